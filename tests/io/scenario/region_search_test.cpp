// Which cells and nodes of a mesh a region is searched in.
#include <doctest/doctest.h>

#include <cmath>

#include "io/scenario/regions.h"

using namespace lahar;

namespace {

template <int Dim>
Region<Dim> region_of(const std::string& text) {
  ProblemList problems;
  const JsonDocument document("region", text, problems);
  Region<Dim> region(document.root, 1e-9, document, problems);
  REQUIRE(problems.empty());
  return region;
}

template <int Dim>
void check(const std::string& text, std::size_t most) {
  CAPTURE(text);
  const Region<Dim> region = region_of<Dim>(text);
  std::array<Index, Dim> counts;
  for (int d = 0; d < Dim; ++d) counts[static_cast<std::size_t>(d)] = 20 + d;
  const auto mesh = Mesh<Dim>::structured(Vec<Dim>::Constant(-1), Vec<Dim>::Constant(0.25), counts);
  std::vector<Index> found, all, visited;
  for_nodes_near(mesh, region, [&](Index n) {
    if (region.contains(mesh.node(n))) found.push_back(n);
  });
  for (Index n = 0; n < mesh.n_nodes(); ++n)
    if (region.contains(mesh.node(n))) all.push_back(n);
  CHECK(!all.empty());
  CHECK(found == all);
  found.clear(), all.clear();
  // Points anywhere in a cell, its corners included.
  const auto meets = [&](Index c) {
    const auto g = mesh.geometry(c);
    bool inside = region.contains(g.centre);
    for (const auto& corner : g.corner)
      inside = inside || region.contains(corner) || region.contains((corner + g.centre) / 2);
    return inside;
  };
  for_cells_near(mesh, region, [&](Index c) {
    visited.push_back(c);
    if (meets(c)) found.push_back(c);
  });
  for (Index c = 0; c < mesh.n_cells(); ++c)
    if (meets(c)) all.push_back(c);
  CHECK(found == all);
  CHECK(visited.size() <= most);
  CHECK(std::is_sorted(visited.begin(), visited.end()));
}

}  // namespace

// Limits: a box on the faces of cells takes in the layer behind them, and one more.
TEST_CASE("a region is found in the part of a grid that its bounding box covers") {
  const std::size_t everything2 = 20 * 21, everything3 = 20 * 21 * 22;
  check<2>(R"({"all": true})", everything2);
  check<2>(R"({"box": {"min": [0, 0.5], "max": [0.25, 1]}})", 5 * 6);
  check<2>(R"({"box": {"min": [3.9, -9], "max": [9, 9]}})", 3 * 21);
  check<2>(R"({"half_space": {"point": [0, -0.9], "normal": [0, 2]}})", 20 * 3);
  check<2>(R"({"half_space": {"point": [3.8, 0], "normal": [-1, 0]}})", 3 * 21);
  check<2>(R"({"half_space": {"point": [0, 0], "normal": [1, 1]}})", everything2);
  check<2>(R"({"sphere": {"centre": [1, 1], "radius": 0.5}})", 8 * 8);
  check<2>(R"({"polygon": {"points": [[0, 0], [1, 0.5], [0.5, 1]]}})", 8 * 8);
  check<2>(R"({"union": [{"box": {"min": [0, 0], "max": [0.5, 0.5]}},
                         {"sphere": {"centre": [1, 1], "radius": 0.25}}]})",
           9 * 9);
  check<2>(R"({"intersection": [{"box": {"min": [0, 0], "max": [2, 0.5]}},
                                {"sphere": {"centre": [0, 0], "radius": 0.5}}]})",
           6 * 6);
  check<2>(R"({"difference": [{"box": {"min": [0, 0], "max": [0.5, 0.5]}},
                              {"sphere": {"centre": [0, 0], "radius": 0.25}}]})",
           6 * 6);
  check<3>(R"({"all": true})", everything3);
  check<3>(R"({"box": {"min": [0, 0.5, 1], "max": [0.25, 1, 1]}})", 5 * 6 * 4);
  check<3>(R"({"cylinder": {"from": [0, 0, 0], "to": [1, 1, 0], "radius": 0.25}})", 10 * 10 * 6);
  check<3>(R"({"polygon": {"points": [[0, 0], [1, 0.5], [0.5, 1]], "axis": "y",
                           "range": [0, 0.5]}})",
           8 * 8 * 6);
  check<3>(R"({"polygon": {"points": [[0, 0], [1, 0.5], [0.5, 1]], "axis": "x"}})", 20 * 8 * 8);
}

TEST_CASE("the box around a cylinder touches it on all sides") {
  const auto check_box = [](const char* text, const Vec<3>& low, const Vec<3>& high) {
    const auto box = region_of<3>(text).bounds();
    CHECK((box.first - low).norm() < 1e-8);
    CHECK((box.second - high).norm() < 1e-8);
  };
  check_box(R"({"cylinder": {"from": [0, 0, 0], "to": [0, 0, 0.2], "radius": 0.3}})",
            {-0.3, -0.3, 0}, {0.3, 0.3, 0.2});
  const double reach = 0.2 * std::sqrt(0.5);  // of an end that stands across the diagonal
  check_box(R"({"cylinder": {"from": [1, 0, 0], "to": [2, 1, 0], "radius": 0.2, "radius_to": 0}})",
            {1 - reach, -reach, -0.2}, {2, 1, 0.2});
}
