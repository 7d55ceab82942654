/// \file Frames of a run: copied by tasks while steps are taken, or taken from patches at rest.
#pragma once

#include <memory>
#include <vector>

#include "io/frames/frame.h"
#include "runtime/patches/patch_set.h"
#include "runtime/step/injection_log.h"
#include "runtime/step/time_control.h"

namespace lahar {

/// Ids in frames are dense, as the log of injections says.
template <int Dim>
class RunFrames {
 public:
  /// All must outlive it.
  RunFrames(const Model<Dim>& model, const PatchSet<Dim>& patches, const InjectionLog& log,
            const TimeControl& time)
      : model_(model), patches_(patches), log_(log), time_(time) {}

  /// Find the size of a frame anew, with `more` bytes of this rank that come with it. Collective.
  void measure(const Communicator& ranks, std::size_t more);
  Index particles() const;                      ///< of this rank, in a frame
  std::size_t bytes() const { return bytes_; }  ///< of the rank with most of it
  std::size_t bytes_of(Index particles) const;  ///< of a frame with so many

  void make_room();
  /// By the task of a patch that has done `step`.
  void copy(int patch, Step step);
  /// What all patches have copied; steps in order.
  FramePieces take(Step step);

  /// At rest, without a copy: good until steps are taken.
  FrameSource present(Step at, int threads) const;
  /// The same of all ranks, ascending ids. Collective.
  Frame present_of(const Communicator& ranks, Step at) const;

 private:
  FrameHeader header(Step at) const;

  const Model<Dim>& model_;
  const PatchSet<Dim>& patches_;
  const InjectionLog& log_;
  const TimeControl& time_;
  std::size_t bytes_ = 0;
  PerStep<std::vector<Frame>> pieces_;  ///< by patch
  std::shared_ptr<SparePieces> spare_ = std::make_shared<SparePieces>();
};

}  // namespace lahar
