/// \file What ranks tell each other about a file that they write together.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "runtime/comm/communicator.h"

namespace lahar {

template <class T>
std::vector<std::byte> bytes_of(std::span<const T> values) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto bytes = std::as_bytes(values);
  return {bytes.begin(), bytes.end()};
}
template <class T>
std::vector<T> values_of(std::span<const std::byte> bytes) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::vector<T> values(bytes.size() / sizeof(T));
  std::ranges::copy(bytes, std::as_writable_bytes(std::span(values)).begin());
  return values;
}

/// Every rank gives some bytes and says whether it failed; all get what all gave. Collective and
/// without waiting: after start() somebody calls progress(), which alone calls MPI, until all is
/// done(). Results are good until the next start. One rank has them at once.
class OutputAgreement {
 public:
  explicit OutputAgreement(const Communicator& ranks);  ///< collective
  /// If lost ranks have left an operation unfinished, its memory is not freed.
  ~OutputAgreement();
  OutputAgreement(const OutputAgreement&) = delete;
  OutputAgreement& operator=(const OutputAgreement&) = delete;
  void release() { ranks_.release(); }  ///< collective: the last call

  const Communicator& ranks() const { return ranks_; }
  void start(std::vector<std::byte> own, bool failed);
  /// Go on; returns at once. True when the results have come.
  bool progress();
  bool done() const { return stage_ == Stage::done; }

  std::span<const std::byte> all() const { return memory_->all; }  ///< one rank after the other
  std::span<const std::byte> of(int rank) const;
  std::optional<int> failed_rank() const;  ///< the first

 private:
  enum class Stage { started, counting, gathering, done };
  struct Part {
    Index bytes, failed;
  };
  /// What MPI works on while an operation is under way.
  struct Memory {
    std::vector<Part> parts;  ///< by rank
    std::vector<std::byte> own, all;
    std::vector<int> sizes, places;  ///< of `all`, by rank
  };
  void lay_out();

  Communicator ranks_;
  std::unique_ptr<Memory> memory_;
  Stage stage_ = Stage::done;
  MPI_Request request_ = MPI_REQUEST_NULL;
};

}  // namespace lahar
