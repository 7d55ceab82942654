// Triangles and convex polygons in Wavefront OBJ; materials, groups, textures and normals have no
// effect.
#include <fmt/format.h>

#include <array>
#include <charconv>

#include "io/base/text.h"
#include "io/geometry/triangles_builder.h"

namespace lahar {

namespace {

constexpr std::array<std::string_view, 14> without_effect{
    "vn", "vt", "g",      "o",  "s",   "usemtl", "mtllib",
    "l",  "p",  "usemap", "mg", "lod", "bevel",  "shadow_obj"};

class ObjText {
 public:
  ObjText(const SideFile& file, TrianglesBuilder& to, ProblemList& problems)
      : rows_(file, problems), to_(to) {}

  bool read() {
    while (rows_.next() && !rows_.failed()) {
      std::string_view word;
      if (!rows_.word(word, "a keyword")) return false;
      if (word == "v")
        vertex();
      else if (word == "f")
        face();
      else if (std::find(without_effect.begin(), without_effect.end(), word) ==
               without_effect.end())
        rows_.complain(fmt::format("'{}' is not read; surfaces are made of 'v' and 'f' rows", word),
                       "export the surface as triangles");
    }
    return !rows_.failed();
  }

 private:
  void vertex() {
    Vec<3> x;
    for (int d = 0; d < 3; ++d)
      if (!rows_.real(x[d], fmt::format("the {} coordinate", "xyz"[d]))) return;
    vertices_.push_back(to_.point(x));  // a weight or colour may follow
  }

  void face() {
    polygon_.clear();
    while (!rows_.row_ended()) {
      std::string_view word;
      if (!rows_.word(word, "") || !corner(word)) return;
    }
    if (polygon_.size() < 3)
      rows_.complain(fmt::format("a face needs at least 3 corners, found {}", polygon_.size()));
    else if (!to_.polygon(polygon_))
      rows_.complain(fmt::format("this face of {} corners is not convex", polygon_.size()),
                     "export the surface as triangles");
  }

  /// "7", "7/1" or "7/1/2", counted from 1, or from the last vertex on by negative numbers.
  bool corner(std::string_view word) {
    const std::string_view number = word.substr(0, word.find('/'));
    Index i = 0;
    const auto [rest, error] = std::from_chars(number.data(), number.data() + number.size(), i);
    const auto n = static_cast<Index>(vertices_.size());
    if (error != std::errc{} || rest != number.data() + number.size() || i == 0 || i > n ||
        -i > n) {
      rows_.complain(
          fmt::format("a corner must be one of the {} vertices so far, found '{}'", n, word),
          "vertices count from 1");
      return false;
    }
    polygon_.push_back(vertices_[static_cast<std::size_t>(i > 0 ? i - 1 : n + i)]);
    return true;
  }

  RowReader rows_;
  TrianglesBuilder& to_;
  std::vector<Local> vertices_, polygon_;
};

}  // namespace

bool read_obj(const SideFile& file, TrianglesBuilder& to, ProblemList& problems) {
  return ObjText(file, to, problems).read();
}

}  // namespace lahar
