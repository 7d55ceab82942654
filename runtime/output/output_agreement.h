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
/// without waiting: start(), then ask done() until it is. Results are good until the next start.
/// With one rank nothing of MPI is touched, and all is done at once. start() and done() are calls
/// of MPI: by one thread at a time.
class OutputAgreement {
 public:
  explicit OutputAgreement(const Communicator& ranks);  ///< collective
  /// What others did not take part in, because they were lost, is left behind.
  ~OutputAgreement();
  OutputAgreement(const OutputAgreement&) = delete;
  OutputAgreement& operator=(const OutputAgreement&) = delete;
  void release() { ranks_.release(); }  ///< collective: the last call

  const Communicator& ranks() const { return ranks_; }
  void start(std::vector<std::byte> own, bool failed);
  bool done();

  std::span<const std::byte> all() const { return memory_->all; }  ///< one rank after the other
  std::span<const std::byte> of(int rank) const;
  std::optional<int> failed_rank() const;  ///< the first

 private:
  struct Part {
    Index bytes, failed;
  };
  /// What MPI works on while an operation is under way.
  struct Memory {
    std::vector<Part> parts;  ///< by rank
    std::vector<std::byte> own, all;
    std::vector<int> sizes, places;  ///< of `all`, by rank
  };
  bool request_is_done();
  void start_gathering();

  Communicator ranks_;
  std::unique_ptr<Memory> memory_;
  bool counting_ = false;  ///< under way are the sizes
  MPI_Request request_ = MPI_REQUEST_NULL;
};

}  // namespace lahar
