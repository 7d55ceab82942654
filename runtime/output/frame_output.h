/// \file The frames of a run.
#pragma once

#include <filesystem>
#include <functional>
#include <utility>
#include <vector>

#include "io/base/series.h"
#include "io/frames/frame.h"
#include "io/run/run_continuation.h"
#include "runtime/output/output_writer.h"

namespace lahar {

/// Writes frames to FOLDER/particles_STEP.hdf and lists them, with their times, in
/// FOLDER/particles.hdf.series, which ParaView opens; likewise nodes, nodes_STEP.hdf. All ranks
/// give the same frames in the same order, each with its own particles; in a file, ranks follow
/// each other. OutputWriter says how, and what its functions mean; frames after one that failed are
/// not written.
class FrameOutput {
 public:
  /// Frames that may wait or be written at a time.
  static constexpr std::size_t slots = 2;

  /// Collective. The folder exists.
  /// `earlier`: files that are in the folder and belong in the indices. `writers`: so many ranks
  /// write; 0 = all.
  explicit FrameOutput(std::filesystem::path folder, const Communicator& ranks = {},
                       KeptFrames earlier = {}, int writers = 0);

  /// Hand a frame over and return. Blocks while all slots are taken.
  void add(FramePieces frame);
  /// The same with nodes, which may be in several pieces, of several ranks, with the same values:
  /// in the file each is once, ascending ids.
  void add_nodes(FramePieces nodes);
  /// Write a frame from where its particles are, on all threads that it allows, when those before
  /// are written; only bringing it to the disk is left for later. Collective, for times at which no
  /// step is taken.
  void write(const FrameSource& frame);
  void progress() { writer_.progress(); }
  void wait_for_named() { writer_.wait_for_named(); }
  void give_up() { writer_.give_up(); }
  void finish() { writer_.finish(); }
  void while_waiting(std::function<void()> poll) { writer_.while_waiting(std::move(poll)); }
  /// Called by a thread of rank 0 before a frame gets its name, which it does not where this
  /// throws.
  void before_naming(std::function<void()> check) { check_ = std::move(check); }

 private:
  class Job;
  void name(AtomicFile& file, double time, std::vector<TimedFile>& index, const char* series);

  std::filesystem::path folder_;
  std::function<void()> check_;
  KeptFrames index_;     // of the thread
  OutputWriter writer_;  // the last member: its thread uses the others
};

}  // namespace lahar
