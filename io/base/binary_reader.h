/// \file A side file of numbers as they are in memory (little endian), read in pieces.
#pragma once

#include <bit>
#include <cstring>
#include <type_traits>
#include <vector>

#include "io/base/side_files.h"

namespace lahar {

static_assert(std::endian::native == std::endian::little);

class BinaryReader {
 public:
  explicit BinaryReader(const SideFile& file, Index offset = 0)
      : file_(file), piece_(piece_size), filled_(offset) {}

  /// Where the next value begins [bytes].
  Index offset() const { return filled_ - static_cast<Index>(held_ - at_); }

  /// The next value; false where the file ends before its end.
  template <class T>
  bool get(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    return bytes(&value, sizeof(T));
  }
  bool bytes(void* to, std::size_t n) {
    auto* out = static_cast<char*>(to);
    while (n > 0) {
      if (at_ == held_ && !refill()) return false;
      const std::size_t some = std::min(n, held_ - at_);
      std::memcpy(out, piece_.data() + at_, some);
      at_ += some;
      out += some;
      n -= some;
    }
    return true;
  }
  bool skip(Index n) {
    if (n < 0 || offset() + n > file_.size) return false;
    filled_ = offset() + n;
    at_ = held_ = 0;
    return true;
  }

 private:
  static constexpr std::size_t piece_size = std::size_t{1} << 18;

  bool refill() {
    held_ = file_.read(filled_, piece_.data(), piece_.size());
    filled_ += static_cast<Index>(held_);
    at_ = 0;
    return held_ > 0;
  }

  const SideFile& file_;
  std::vector<char> piece_;
  Index filled_;  ///< the piece ends here in the file
  std::size_t at_ = 0, held_ = 0;
};

}  // namespace lahar
