/// \file Ranks that give their part of a file to another rank, which writes it.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "io/base/shared_file.h"
#include "runtime/comm/communicator.h"

namespace lahar {

/// Each writer writes for consecutive ranks, and is the first of them. The others send it blocks of
/// bytes with their places in the file, a few at a time, so that memory is bounded on both sides.
/// One thread of a rank has the bytes or writes them. Another, or the same, calls progress() all
/// the while: no other function calls MPI.
class OutputRelay {
 public:
  /// The size of a block; longer ones are divided.
  static constexpr std::size_t most_bytes = std::size_t{1} << 20;
  /// Blocks that wait to be sent, or to be written, at a time.
  static constexpr std::size_t slots = 4;

  /// Waits for the other side, and may call progress(). Throws if waiting is of no use.
  using Wait = std::function<void()>;

  /// `ranks`: whose messages nobody else receives. `writers` < 1 or more than ranks: every rank
  /// writes for itself.
  OutputRelay(const Communicator& ranks, int writers);
  /// If lost ranks have not taken a block, its memory is not freed.
  ~OutputRelay();
  OutputRelay(const OutputRelay&) = delete;
  OutputRelay& operator=(const OutputRelay&) = delete;

  bool writes() const { return writer_ == ranks_.rank(); }
  /// The writer of `rank` among `ranks`.
  static int writer_of(int rank, int ranks, int writers);

  /// Go on with sending or receiving; returns at once.
  void progress();

  /// By a rank that does not write.
  void give(Index place, std::span<const std::byte> bytes, const Wait& wait);
  /// By every rank, for each file: returns when all that ranks gave is sent. A rank that writes
  /// gets the blocks of the others, in any order; `write` must not throw, as they would wait.
  void end(const ByteSink& write, const Wait& wait);

 private:
  /// Bytes behind their place in the file; a negative place = no more.
  using Block = std::vector<std::byte>;
  void push(Index place, std::span<const std::byte> bytes, const Wait& wait);
  void take_all(const ByteSink& write, const Wait& wait);
  Block next();
  bool request_is_done();
  void send();
  void receive();

  Communicator ranks_;
  int writer_;  ///< of this rank
  int others_;  ///< for whom this rank writes
  std::mutex mutex_;
  std::deque<Block> blocks_;       ///< to be sent, or to be written
  std::unique_ptr<Block> memory_;  ///< what MPI works on
  MPI_Request request_ = MPI_REQUEST_NULL;
};

}  // namespace lahar
