/// \file Arrays as bytes and back, for what ranks of one run send to each other.
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

class ByteWriter {
 public:
  /// Preceded by their number.
  template <class T>
  void array(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    const Index n = static_cast<Index>(values.size());
    append(&n, sizeof n);
    append(values.data(), values.size_bytes());
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  void append(const void* from, std::size_t n) {
    if (n == 0) return;
    bytes_.resize(bytes_.size() + n);
    std::memcpy(bytes_.data() + bytes_.size() - n, from, n);
  }
  std::vector<std::byte> bytes_;
};

/// Reads what a ByteWriter wrote, in the same order. Throws std::invalid_argument where the bytes
/// cannot be that.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : rest_(bytes) {}

  template <class T>
  std::vector<T> array() {
    static_assert(std::is_trivially_copyable_v<T>);
    Index n = 0;
    copy(&n, sizeof n);
    if (n < 0 || static_cast<std::size_t>(n) > rest_.size() / sizeof(T)) fail();
    std::vector<T> values(n);
    copy(values.data(), n * sizeof(T));
    return values;
  }
  void expect_end() const {
    if (!rest_.empty()) fail();
  }

 private:
  [[noreturn]] static void fail() {
    throw std::invalid_argument("bytes from another rank are cut off or not what was expected");
  }
  void copy(void* to, std::size_t n) {
    if (n > rest_.size()) fail();
    if (n > 0) std::memcpy(to, rest_.data(), n);
    rest_ = rest_.subspan(n);
  }
  std::span<const std::byte> rest_;
};

}  // namespace lahar
