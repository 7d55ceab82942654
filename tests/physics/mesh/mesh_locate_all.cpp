#include <doctest/doctest.h>

#include <limits>
#include <utility>

#include "physics/mesh/inverse_mapping.h"
#include "physics/mesh/locate_all.h"
#include "tests/physics/mesh/mesh_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Points everywhere: inside of cells, on their faces, edges and corners, beyond the mesh, nowhere.
template <int Dim>
std::vector<Vec<Dim>> points_of_all_kinds(const Mesh<Dim>& mesh, std::mt19937& random, int n) {
  const auto [low, high] = mesh.bounds();
  const Vec<Dim> beyond = 0.2 * (high - low);
  std::vector<Vec<Dim>> points;
  for (int i = 0; i < n; ++i) {
    const Index c = static_cast<Index>(random()) % mesh.n_cells();
    Vec<Dim> xi = random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
    for (int d = 0; d < Dim; ++d)
      if (random() % 4 == 0) xi[d] = random() % 2 ? 1.0 : -1.0;
    points.push_back(to_physical<Dim>(mesh.geometry(c), xi));
    points.push_back(random_point<Dim>(random, low - beyond, high + beyond));
  }
  points.push_back(Vec<Dim>::Constant(std::numeric_limits<double>::quiet_NaN()));
  points.push_back(Vec<Dim>::Constant(std::numeric_limits<double>::infinity()));
  points.push_back(Vec<Dim>::Constant(-1e300));
  return points;
}

/// Both find the same for each point, and known cells stay.
template <int Dim>
void check_against_one_by_one(const Mesh<Dim>& mesh, const std::vector<Vec<Dim>>& points) {
  constexpr Index known = 1'000'000;  // no cell: whoever looks finds another
  std::vector<Index> cell(points.size(), -1);
  for (std::size_t p = 0; p < cell.size(); p += 7) cell[p] = known;
  locate_all<Dim>(mesh, points, cell);
  int different = 0, found = 0;
  for (std::size_t p = 0; p < cell.size(); ++p) {
    different += cell[p] != (p % 7 == 0 ? known : mesh.locate(points[p]).cell);
    found += cell[p] >= 0;
  }
  CHECK(different == 0);
  CHECK(found > static_cast<int>(points.size()) / 3);
}

}  // namespace

TEST_CASE("the cells of many points together are those found one by one") {
  std::mt19937 random(11);
  const auto quadrilaterals = distorted<2>(grid_tables<2>({12, 12}), 0.24, random).mesh(true);
  check_against_one_by_one<2>(quadrilaterals, points_of_all_kinds<2>(quadrilaterals, random, 3000));
  const auto hexahedra = distorted<3>(grid_tables<3>({5, 6, 7}), 0.2, random).mesh(true);
  check_against_one_by_one<3>(hexahedra, points_of_all_kinds<3>(hexahedra, random, 3000));
}

TEST_CASE("cells far from each other are searched without bins for all that lies between") {
  std::mt19937 random(12);
  auto tables = distorted<3>(grid_tables<3>({5, 4, 4}), 0.2, random);
  auto& [nodes, cells] = tables;
  const auto all = std::exchange(cells, {});
  for (std::size_t c = 0; c < all.size(); ++c)
    if (c % 5 != 2) cells.push_back(all[c]);  // without the layer in the middle
  for (std::size_t n = 0; n < nodes.size(); ++n)
    if (n % 6 > 2) nodes[n][0] += 1e8;
  const auto mesh = tables.mesh(true);
  check_against_one_by_one<3>(mesh, points_of_all_kinds<3>(mesh, random, 500));
}

TEST_CASE("few points, and meshes of boxes, are located one by one") {
  std::mt19937 random(12);
  const auto hexahedra = distorted<3>(grid_tables<3>({5, 6, 7}), 0.2, random).mesh(true);
  check_against_one_by_one<3>(hexahedra, points_of_all_kinds<3>(hexahedra, random, 5));
  const auto boxes = Mesh<2>::structured({0, 0}, {1, 2}, {4, 3});
  check_against_one_by_one<2>(boxes, points_of_all_kinds<2>(boxes, random, 300));
}
