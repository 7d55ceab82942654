/// \file What the ranks tell each other about a frame that they write together.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "io/frames/frame_layout.h"
#include "runtime/comm/communicator.h"

namespace lahar {

/// One operation at a time, all of them collective and without waiting: start one, then ask done()
/// until it is. Results are good until the next start. With one rank nothing of MPI is touched, and
/// all is done at once. Starts and done() are calls of MPI: by one thread at a time.
class FrameAgreement {
 public:
  explicit FrameAgreement(const Communicator& ranks);  ///< collective
  /// An operation that others did not take part in, because they were lost, is left behind.
  ~FrameAgreement();
  FrameAgreement(const FrameAgreement&) = delete;
  FrameAgreement& operator=(const FrameAgreement&) = delete;
  void release();  ///< collective: the last call

  bool several() const { return ranks_.several(); }
  int rank() const { return ranks_.rank(); }
  bool done();

  /// Every rank says how many particles it has, and whether it could write everything so far.
  void start_counting(Index particles, bool failed);
  Index before() const;  ///< particles of the ranks before this one
  Index total() const;

  /// Rank 0 tells the others where to write.
  void start_telling(const FrameLayout& layout);
  const FrameLayout& layout() const { return memory_->layout; }

  /// Every rank says whether it wrote its part.
  void start_reporting(bool failed);
  /// After counting and after reporting: the first rank that failed.
  std::optional<int> failed_rank() const;

 private:
  struct Count {
    Index particles, failed;
  };
  /// What MPI works on while an operation is under way.
  struct Memory {
    Count own{};
    std::vector<Count> all;
    FrameLayout layout;
    int failed = 0, first_failed = 0;
  };

  Communicator ranks_;
  std::unique_ptr<Memory> memory_;
  MPI_Request request_ = MPI_REQUEST_NULL;
};

}  // namespace lahar
