/// \file A file that all ranks write together, as OutputWriter sees it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/base/atomic_file.h"
#include "io/base/shared_file.h"
#include "runtime/trace/record/recorder.h"

namespace lahar {

/// What is special about one file: its contents, where they lie, and what goes with its name. Each
/// rank has an object of its own for its part of the file.
class OutputJob {
 public:
  using Bytes = std::vector<std::byte>;

  struct About {
    std::filesystem::path target;  ///< name of the complete file
    Index step = 0;
    TraceKind kind = TraceKind::frame;
    /// By the caller of OutputWriter::write() before it returns, not by the thread: for data that
    /// are not a copy.
    bool prepare_now = false, write_now = false;
  };

  explicit OutputJob(About about) : about_(std::move(about)) {}
  virtual ~OutputJob() = default;
  OutputJob(const OutputJob&) = delete;
  OutputJob& operator=(const OutputJob&) = delete;
  const About& about() const { return about_; }

  // The tasks, one after the other. What they return is told to all ranks; they may throw.
  /// Every rank: what all have to know about its part.
  virtual Bytes prepare() = 0;
  /// Rank 0: makes file.temporary(), with room for all parts. Returns where they lie.
  virtual Bytes create(const AtomicFile& file) = 0;
  /// Every rank: its part. `parallel`: several threads may call `sink` at a time.
  virtual void write(const ByteSink& sink, bool parallel) = 0;
  /// Rank 0: commits the file, which is complete.
  virtual void name(AtomicFile& file) = 0;

  /// What prepare() returned on all ranks, one after the other; this one is `rank`.
  virtual void hear_parts(std::span<const std::byte> parts, int rank) = 0;
  /// What create() returned on rank 0.
  virtual void hear_layout(std::span<const std::byte> layout) = 0;

 private:
  About about_;
};

}  // namespace lahar
