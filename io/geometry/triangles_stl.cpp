// Triangles in STL, as text and binary. Normals in the file have no effect: the order of the
// corners says which side is outside.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "io/base/binary_reader.h"
#include "io/geometry/triangles_builder.h"

namespace lahar {

namespace {

constexpr Index head = 80;                     // [bytes] before the count
constexpr Index row = 12 * sizeof(float) + 2;  // [bytes] of a triangle

bool same_word(std::string_view word, std::string_view lower) {
  return word.size() == lower.size() && std::equal(word.begin(), word.end(), lower.begin(),
                                                   [](char a, char b) { return (a | 0x20) == b; });
}

class StlText {
 public:
  StlText(const SideFile& file, TrianglesBuilder& to, ProblemList& problems)
      : rows_(file, problems), to_(to) {}

  bool read() {
    bool any = false, open = false;
    while (rows_.next()) {
      std::string_view word;
      if (!rows_.word(word, "a keyword")) return false;
      if (!open && same_word(word, "solid")) {
        any = open = true;
      } else if (open && same_word(word, "endsolid")) {
        open = false;
      } else if (open && same_word(word, "facet")) {
        if (!facet()) return false;
      } else {
        return unexpected(word, open ? "facet' or 'endsolid" : "solid");
      }
    }
    if (!any || open) rows_.complain_file("the file ends before 'endsolid': it is cut short");
    return !rows_.failed();
  }

 private:
  bool unexpected(std::string_view word, std::string_view wanted) {
    rows_.complain(fmt::format("expected '{}', found '{}'", wanted, word));
    return false;
  }
  bool keyword(std::string_view wanted) {
    std::string_view word;
    if (!rows_.word(word, fmt::format("'{}'", wanted))) return false;
    return same_word(word, wanted) || unexpected(word, wanted);
  }
  bool next_row(std::string_view wanted) {
    if (rows_.next()) return keyword(wanted);
    rows_.complain_file(fmt::format("the file ends before '{}': it is cut short", wanted));
    return false;
  }
  /// After the word `facet`.
  bool facet() {
    std::string_view normal;  // any words: it has no effect
    if (!keyword("normal")) return false;
    while (!rows_.row_ended()) rows_.word(normal, "");
    if (!next_row("outer") || !keyword("loop") || !rows_.end_of_row()) return false;
    Triangles::Corners corners;
    for (Local& corner : corners) {
      Vec<3> x;
      if (!next_row("vertex")) return false;
      for (int d = 0; d < 3; ++d)
        if (!rows_.real(x[d], fmt::format("the {} coordinate", "xyz"[d]))) return false;
      if (!rows_.end_of_row()) return false;
      corner = to_.point(x);
    }
    if (!next_row("endloop") || !next_row("endfacet")) return false;
    to_.triangle(corners);
    return true;
  }

  RowReader rows_;
  TrianglesBuilder& to_;
};

bool read_binary(const SideFile& file, std::uint32_t count, TrianglesBuilder& to,
                 ProblemList& problems) {
  const auto fail = [&](std::string message) {
    problems.error({.file = file.name, .message = std::move(message)});
    return false;
  };
  if (count > most_triangles)
    return fail(
        fmt::format("{} triangles are too many; at most {} are read", count, most_triangles));
  BinaryReader in(file, head + 4);
  for (std::uint32_t i = 0; i < count; ++i) {
    std::array<float, 12> numbers;  // the normal, then corners
    std::uint16_t attribute;
    if (!in.get(numbers) || !in.get(attribute)) return fail("the file has become shorter");
    Triangles::Corners corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec<3> x(numbers[3 + 3 * k], numbers[4 + 3 * k], numbers[5 + 3 * k]);
      if (!x.allFinite())
        return fail(
            fmt::format("coordinates must be finite numbers, but corner {} of triangle {} "
                        "is ({}, {}, {})",
                        k, i, x[0], x[1], x[2]));
      corners[k] = to.point(x);
    }
    to.triangle(corners);
  }
  return true;
}

}  // namespace

bool read_stl(const SideFile& file, TrianglesBuilder& to, ProblemList& problems) {
  // Binary files may begin with `solid`, too: their size is the better sign.
  std::array<char, head + 4> begin{};
  const auto got = file.read(0, begin.data(), begin.size());
  std::uint32_t count = 0;
  std::memcpy(&count, begin.data() + head, sizeof count);
  const Index expected = head + 4 + static_cast<Index>(count) * row;
  if (got == begin.size() && file.size == expected) return read_binary(file, count, to, problems);
  const std::string_view text(begin.data(), got);
  if (text.starts_with("solid") && text.find('\0') == text.npos)
    return StlText(file, to, problems).read();
  problems.error(
      {.file = file.name,
       .message = got < begin.size()
                      ? fmt::format("{} bytes are less than the head of a binary STL file ({})",
                                    file.size, head + 4)
                      : fmt::format("the file counts {} triangles, which take {} bytes, but it "
                                    "has {} bytes",
                                    count, expected, file.size),
       .hint =
           "it is cut short or damaged, or not an STL file (as text, these begin with 'solid')"});
  return false;
}

}  // namespace lahar
