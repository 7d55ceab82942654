/// \file What random changes of inputs have in common: dice, and numbers and texts at which
/// something may end.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/fuzz/mutation.h"

namespace lahar::fuzz {

// Keys keep their order, so that what is written again is like what was read.
using Json = nlohmann::ordered_json;

inline std::size_t below(std::size_t n, Random& random) {
  return n < 2 ? 0 : static_cast<std::size_t>(random() % n);
}
inline bool one_in(std::size_t n, Random& random) {
  return below(n, random) == 0;
}
template <class List>
auto& any_of(List& list, Random& random) {
  return list[below(list.size(), random)];
}

inline const std::vector<double> doubles{0,    -0.0,  1,    -1,     0.5,    2,     3,    1e-3,
                                         1e3,  1e-30, 1e30, 1e308,  5e-324, 1e17,  9e15, 1e9,
                                         -1e9, 89.99, 90,   0.4999, 0.5,    1e-12, 4096};
inline const std::vector<std::int64_t> integers{
    // clang-format off
    0, 1, -1, 2, 3, 4, 7, 8, 9, 16, 20, 21, 255, 256, 65535, 65536, 1 << 20, 2147483647, 2147483648,
    -2147483649, 9007199254740993, 9223372036854775807
    // clang-format on
};
inline const std::vector<std::string> texts{
    "",         "x",           "0",         "a\x1b[31mb", "<script>alert(1)</script>",
    "../../up", "/etc/passwd", "/dev/zero", "\xc3\xa9",   "\xe2\x80\xae",
    "%s%n",     "a/b",         "."};

}  // namespace lahar::fuzz
