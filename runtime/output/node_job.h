/// \file A file of nodes, which all ranks write together.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "io/frames/frame.h"
#include "io/frames/frame_layout.h"
#include "runtime/output/output_job.h"

namespace lahar {

/// All nodes of some pieces, each once, ascending ids. Pieces that have the same node have the same
/// values for it.
Frame unite_nodes(const FramePieces& nodes);

/// Ids [begin, end), which follow each other.
struct NodeRun {
  Index begin, end;
};

/// Those that a rank writes, and where in the file they lie.
struct PlacedRun {
  NodeRun ids;
  Index place;
};

/// Places of nodes in the order of their ids. Of each rank: the runs that it has, ascending. A node
/// that several have is written by the first of them. Returns what `rank` writes, and the number of
/// all nodes in `total`.
std::vector<PlacedRun> place_nodes(const std::vector<std::vector<NodeRun>>& runs, int rank,
                                   Index& total);

/// Ranks tell each other which nodes they have, and each writes its own.
class NodeJob : public OutputJob {
 public:
  NodeJob(std::filesystem::path target, FramePieces nodes, std::function<void(AtomicFile&)> name);

  Bytes prepare() override;
  void hear_parts(std::span<const std::byte> parts, int rank) override;
  Bytes create(const AtomicFile& file) override;
  void hear_layout(std::span<const std::byte> layout) override;
  void write(const ByteSink& sink, bool parallel) override;
  void name(AtomicFile& file) override { name_(file); }

 private:
  FramePieces pieces_;
  std::function<void(AtomicFile&)> name_;
  Frame own_;  ///< of all pieces
  std::vector<PlacedRun> runs_;
  Index total_ = 0;
  FrameLayout layout_;
};

}  // namespace lahar
