// Named shapes of generated scenarios, with the files that they come from.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>

#include "tests/properties/scenario_parts.h"

namespace lahar::test {

namespace {

/// A height [m] that waves about `mean` [cells of the last axis].
double height(const Outline& outline, double mean, double amount, double x, double y) {
  const double wave = std::sin(9 * x + 1) * std::cos(7 * y);
  return outline.h.back() * (mean + amount * wave);
}

/// An ESRI ASCII grid over the mesh in plan, of the cells in columns from `begin` to `end`.
std::string grid_file(Choices& choices, const std::string& of, const Outline& outline,
                      const std::array<double, 2>& columns, auto&& value) {
  const double cell = choices.of(of + ".cell", {0.1, 0.04, 0.17});
  const auto count = [&](double length) { return static_cast<int>(std::ceil(length / cell)) + 2; };
  const int nx = count(outline.extent(0)), ny = count(outline.extent(1));
  const int begin = static_cast<int>(nx * columns[0]), end = static_cast<int>(nx * columns[1]);
  const bool holes = of.find("field") == of.npos && choices.chance(of + ".holes", 20);
  std::string text = fmt::format(
      "ncols {}\nnrows {}\nxllcorner {:.9g}\nyllcorner {:.9g}\ncellsize {}\nNODATA_value -99\n",
      end - begin, ny, outline.map_origin[0] + (begin - 1) * cell, outline.map_origin[1] - cell,
      cell);
  for (int row = ny; row-- > 0;)
    for (int k = begin; k < end; ++k) {
      const bool hole = holes && k == nx / 2 && row < ny / 3;
      const double v = hole ? -99 : value((k - 0.5) * cell, (row - 0.5) * cell);
      text += fmt::format("{:.7g}{}", v, k + 1 == end ? "\n" : " ");
    }
  return text;
}

/// A raster of one file or of two that lie beside each other.
Json raster_of(Choices& choices, const std::string& of, const Outline& outline, GeneratedCase& made,
               auto&& value) {
  if (!choices.chance(of + ".tiles", 25)) {
    made.files[of + ".asc"] = grid_file(choices, of, outline, {0, 1}, value);
    return of + ".asc";
  }
  made.files[of + "_west.asc"] = grid_file(choices, of, outline, {0, 0.5}, value);
  made.files[of + "_east.asc"] = grid_file(choices, of, outline, {0.5, 1}, value);
  return Json{of + "_west.asc", of + "_east.asc"};
}

/// A surface of triangles over the mesh, as OBJ in millimetres.
std::string triangles_file(const Outline& outline, auto&& value) {
  constexpr int n = 6;
  std::string text;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const double x = outline.extent(0) * (1.2 * i / n - 0.1),
                   y = outline.extent(1) * (1.2 * j / n - 0.1);
      text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", 1e3 * x, 1e3 * y, 1e3 * value(x, y));
    }
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i + 1, b = a + 1, c = a + n + 1, d = c + 1;
      text += fmt::format("f {} {} {}\nf {} {} {}\n", a, b, d, a, d, c);
    }
  return text;
}

/// A surface in any of the ways that the dimension has.
Json surface_of(Choices& choices, const std::string& of, const Outline& outline,
                GeneratedCase& made, auto&& value) {
  if (outline.dim == 2) {
    Json points = Json::array();
    for (int k = 0; k <= 8; ++k) {
      const double x = outline.extent(0) * (1.2 * k / 8 - 0.1);
      points.push_back({x, value(x, 0.0)});
    }
    return {{"points", points}};
  }
  switch (choices.pick(of + ".kind", 3)) {
    case 1: {
      made.files[of + ".obj"] = triangles_file(outline, value);
      Json surface{{"triangles", of + ".obj"}, {"scale", 1e-3}};
      if (choices.chance(of + ".spacing", 50)) surface["spacing"] = 0.07;
      return surface;
    }
    case 2: {
      Json points = Json::array();
      for (const double x : {-0.1, 0.3, 0.5, 3.0})
        for (const double y : {-0.1, 0.4, 3.0}) points.push_back({x, y, value(x, y)});
      return {{"points", points}};
    }
    default:
      return {{"raster", raster_of(choices, of, outline, made, value)}};
  }
}

using Corner = std::array<double, 3>;

/// The eight faces of an octahedron, counter-clockwise seen from outside.
std::vector<std::array<Corner, 3>> octahedron(const Corner& centre, double radius) {
  std::vector<std::array<Corner, 3>> faces;
  for (int octant = 0; octant < 8; ++octant) {
    std::array<Corner, 3> face;
    bool turned = false;
    for (std::size_t d = 0; d < 3; ++d) {
      const bool low = (octant >> d & 1) != 0;
      turned ^= low;
      face[d] = centre;
      face[d][d] += low ? -radius : radius;
    }
    if (turned) std::swap(face[0], face[1]);
    faces.push_back(face);
  }
  return faces;
}

std::string stl_text(const std::vector<std::array<Corner, 3>>& faces) {
  std::string text = "solid body\n";
  for (const auto& face : faces) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const Corner& x : face)
      text += fmt::format("vertex {:.9g} {:.9g} {:.9g}\n", x[0], x[1], x[2]);
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid body\n";
}

std::string stl_bytes(const std::vector<std::array<Corner, 3>>& faces) {
  std::string bytes(80, ' ');
  const auto put = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(static_cast<std::uint32_t>(faces.size()));
  for (const auto& face : faces) {
    for (int k = 0; k < 3; ++k) put(0.0F);
    for (const Corner& x : face)
      for (const double value : x) put(static_cast<float>(value));
    put(std::uint16_t{0});
  }
  return bytes;
}

Json solid_of(Choices& choices, const std::string& of, GeneratedCase& made, const Corner& centre,
              double radius) {
  const bool moved = choices.chance(of + ".offset", 40);
  const auto faces = octahedron(moved ? Corner{} : centre, radius);
  made.files[of + ".stl"] = choices.chance(of + ".binary", 50) ? stl_bytes(faces) : stl_text(faces);
  Json solid{{"solid", of + ".stl"}};
  if (moved) solid["offset"] = centre;
  return solid;
}

/// A square with a hole, and a triangle.
std::string polygons_file(const Outline& outline) {
  const auto at = [&](double x, double y) {
    return Json{outline.map_origin[0] + x * outline.extent(0),
                outline.map_origin[1] + y * outline.extent(1)};
  };
  const auto ring = [&](double low, double high) {
    return Json{at(low, low), at(high, low), at(high, high), at(low, high), at(low, low)};
  };
  const auto feature = [](int zone, const Json& rings) {
    return Json{{"type", "Feature"},
                {"properties", {{"zone", zone}}},
                {"geometry", {{"type", "Polygon"}, {"coordinates", rings}}}};
  };
  const Json triangle{at(0.75, 0.1), at(0.95, 0.1), at(0.95, 0.8), at(0.75, 0.1)};
  return Json{{"type", "FeatureCollection"},
              {"crs", nullptr},
              {"features",
               {feature(1, Json::array({ring(0.13, 0.72), ring(0.31, 0.44)})),
                feature(2, Json::array({triangle}))}}}
      .dump();
}

}  // namespace

Json geometry_of(Choices& choices, const Outline& outline, GeneratedCase& made) {
  Json all = Json::object();
  if (!outline.shapes) return all;
  const double cells = outline.counts.back();
  const double top = choices.number("ground.height", 0.55, 0.4, 0.75) * cells;
  all["ground"] = surface_of(choices, "ground", outline, made,
                             [&](double x, double y) { return height(outline, top, 0.8, x, y); });
  if (choices.chance("base.thickness", 40)) {
    all["thickness"] = surface_of(choices, "thickness", outline, made, [&](double x, double y) {
      return std::max(0.0, height(outline, top - 2.2, 0.6, y, x));
    });
    all["base"] = {{"surface", "ground"}, {"lower_by", "thickness"}};
  } else {
    all["base"] = {{"surface", "ground"}, {"lower_by", outline.h.back() * (top - 2)}};
  }
  all["middle"] = {{"surface", "base"}, {"raise_by", 0.9 * outline.h.back()}};
  all["bed"] = surface_of(choices, "bed", outline, made,
                          [&](double x, double y) { return height(outline, 0.25, 0.08, x, y); });
  if (outline.dim == 2) return all;
  const Corner middle{0.5 * outline.extent(0), 0.5 * outline.extent(1), outline.h[2] * (top - 0.5)};
  all["lump"] = solid_of(choices, "lump", made, middle, 1.7 * outline.h[2]);
  all["stone"] = solid_of(choices, "stone", made, {middle[0], middle[1], 0.6 * outline.h[2]},
                          0.25 * outline.h[2]);
  made.files["zones.geojson"] = polygons_file(outline);
  all["zones"] = {{"polygons", "zones.geojson"}};
  if (choices.chance("zones.where", 30)) all["zones"]["where"] = "zone = 1";
  return all;
}

Json shape_region_of(Choices& choices, const std::string& of, const Outline& outline,
                     const Json& box) {
  switch (choices.pick(of + "shape", outline.dim == 2 ? 3 : 6)) {
    case 1:
      return {{"intersection", {{{"below", "ground"}}, {{"box", box}}}}};
    case 2:
      return {{"difference", {{{"box", box}}, {{"above", "middle"}}}}};
    case 3:
      return {{"inside", "lump"}};
    case 4:
      return {{"intersection", {{{"between", {"base", "ground"}}}, {{"under", "zones"}}}}};
    case 5:
      return {{"difference", {{{"between", {"base", "ground"}}}, {{"inside", "lump"}}}}};
    default:
      return {{"between", {"base", "ground"}}};
  }
}

Json field_of(Choices& choices, const std::string& of, const Outline& outline, double least,
              GeneratedCase& made) {
  const double most = 1.5 * least;
  Json field;
  switch (choices.pick(of + "kind", outline.dim == 2 ? 2 : 3)) {
    case 1:
      field = {{"at_depth", {{0, least}, {0.15, 1.2 * least}, {0.6, most}}}};
      field["below"] = outline.shapes && choices.chance(of + "below", 50)
                           ? Json("ground")
                           : Json(outline.extent(outline.dim - 1));
      break;
    case 2: {
      const std::string file = of.substr(0, of.find('.')) + "_field";
      field["raster"] = raster_of(choices, file, outline, made, [&](double x, double y) {
        return least * (1.25 + 0.2 * std::sin(11 * x + 5 * y));
      });
      field["min"] = least, field["max"] = most;
      break;
    }
    default:
      field = {{"mean", 1.2 * least}, {"cov", 0.2}, {"min", least}, {"max", most}};
      field["correlation_length"] = choices.number(of + "length", 0.3, 0.05, 1);
      field["seed"] = choices.pick(of + "seed", 3);
      if (choices.chance(of + "normal", 40)) field["distribution"] = "normal";
      if (choices.chance(of + "exponential", 40)) field["correlation"] = "exponential";
  }
  if (choices.chance(of + "few", 50)) field["classes"] = 2 + choices.pick(of + "classes", 8);
  return field;
}

}  // namespace lahar::test
