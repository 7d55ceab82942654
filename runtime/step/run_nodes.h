/// \file Nodes of a run, as files have them: copied by tasks while steps are taken, or taken from
/// patches at rest.
#pragma once

#include <optional>
#include <vector>

#include "io/frames/frame.h"
#include "runtime/patches/patch_set.h"
#include "runtime/step/time_control.h"

namespace lahar {

/// Pieces are those of patches. Patches that share a node all have it, with the same values.
template <int Dim>
class RunNodes {
 public:
  /// All must outlive it.
  RunNodes(const Model<Dim>& model, const PatchSet<Dim>& patches, const TimeControl& time)
      : model_(model), patches_(patches), time_(time) {}

  bool any() const { return !model_.output.node_fields.empty(); }
  std::size_t bytes() const;  ///< of a copy of this rank's nodes, those shared in each piece

  void make_room();
  /// By the task of a patch that has done `step`.
  void copy(int patch, Step step);
  /// What all patches have copied; steps in order.
  FramePieces take(Step step);

  /// At rest, when `at` steps are done.
  FramePieces present(Step at) const;
  /// Remember these, before patches change.
  void keep(Step at) { kept_ = present(at); }
  /// Those of keep(), if it was for so many steps.
  std::optional<FramePieces> kept(Step at) const;

 private:
  FrameHeader header(Step at) const;
  Frame piece(const Patch<Dim>& patch, Step step) const;

  const Model<Dim>& model_;
  const PatchSet<Dim>& patches_;
  const TimeControl& time_;
  PerStep<std::vector<Frame>> pieces_;  ///< by patch
  std::optional<FramePieces> kept_;
};

}  // namespace lahar
