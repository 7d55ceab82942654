#include <doctest/doctest.h>

#include <numeric>

#include "physics/base/error.h"
#include "tests/physics/mesh/element_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A grid of any element whose nodes are moved, those of the sides along them.
template <int Dim>
ElementTables<Dim> bent_grid(Element element, Index n, double amount, std::mt19937& random) {
  std::array<Index, Dim> counts;
  counts.fill(n);
  auto t = element_grid<Dim>(element, Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts);
  amount /= info(element).order * info(element).order;
  for (auto& x : t.nodes)
    for (int d = 0; d < Dim; ++d)
      if (x[d] != 0 && x[d] != static_cast<double>(n)) x[d] += uniform(random, -amount, amount);
  return t;
}

template <int Dim>
Mesh<Dim> mesh_of(const ElementTables<Dim>& t, bool isoparametric = true) {
  return Mesh<Dim>::from_tables(t.nodes, t.element, t.cells, isoparametric);
}

/// The lowest cell that contains x, by looking into all; and into how many it touches.
template <int Dim>
std::pair<Index, int> brute_force(const Mesh<Dim>& mesh, const Vec<Dim>& x) {
  Index lowest = -1;
  int touching = 0;
  for (Index c = mesh.n_cells() - 1; c >= 0; --c) {
    if (mesh.natural_coordinates(c, x)) lowest = c;
    Vec<Dim> xi;
    if (inverse_map<Dim>(mesh.element_geometry(c), x, xi) == Mapped::yes)
      touching += outside_by<Dim>(mesh.element(), xi) < 1e-9;
  }
  return {lowest, touching};
}

template <int Dim>
void check_location() {
  for_elements<Dim>([](Element element, std::mt19937& random) {
    const Index n = Dim == 2 ? 6 : 3;
    const auto mesh = mesh_of(bent_grid<Dim>(element, n, 0.2, random));
    double volume = 0;
    for (Index c = 0; c < mesh.n_cells(); ++c) volume += mesh.cell_volume(c);
    CHECK(volume == doctest::Approx(std::pow(n, Dim)).epsilon(1e-12));
    for (int k = 0; k < 300; ++k) {
      const Index cell = static_cast<Index>(random() % static_cast<unsigned>(mesh.n_cells()));
      const Vec<Dim> xi = random_xi<Dim>(element, random);
      const Vec<Dim> x = mesh.element_geometry(cell).point(xi);
      const auto found = mesh.locate(x);
      REQUIRE(found.cell >= 0);
      CHECK((mesh.element_geometry(found.cell).point(found.xi) - x).norm() < 1e-9);
      CHECK(in_closed_cell<Dim>(element, found.xi));
      const auto [lowest, touching] = brute_force(mesh, x);
      if (lowest >= 0) CHECK(found.cell == lowest);
      // From every cell around: the cell itself, or the only one there is.
      for (const Index from : mesh.neighbours(cell)) {
        const auto walked = mesh.locate_from(x, from);
        REQUIRE(walked.cell >= 0);
        CHECK((mesh.element_geometry(walked.cell).point(walked.xi) - x).norm() < 1e-9);
        if (touching == 1) CHECK(walked.cell == found.cell);
      }
    }
    CHECK(mesh.locate(Vec<Dim>::Constant(-0.01)).cell == -1);
    CHECK(mesh.locate(Vec<Dim>::Constant(std::nan(""))).cell == -1);
  });
}

template <int Dim>
void check_connectivity() {
  for_elements<Dim>([](Element element, std::mt19937& random) {
    const auto mesh = mesh_of(bent_grid<Dim>(element, 3, 0.1, random));
    for (Index c = 0; c < mesh.n_cells(); ++c) {
      const auto nodes = mesh.element_nodes(c);
      CHECK(nodes.count == info(element).nodes);
      std::set<Index> around;
      for (const Index node : nodes)
        for (const Index other : mesh.node_cells(node))
          if (other != c) around.insert(other);
      const auto neighbours = mesh.neighbours(c);
      CHECK(std::ranges::equal(neighbours, around));
      const auto [low, high] = mesh.cell_bounds(c);
      CHECK((mesh.cell_centre(c) - low).minCoeff() > 0);
      CHECK((high - mesh.cell_centre(c)).minCoeff() > 0);
      CHECK(mesh.cell_size(c) > 0);
      CHECK(mesh.cell_size(c) < 1.3 / info(element).order);
    }
  });
}

/// A part of a mesh answers like the whole.
template <int Dim>
void check_parts() {
  for_elements<Dim>([](Element element, std::mt19937& random) {
    const auto whole = mesh_of(bent_grid<Dim>(element, 4, 0.1, random));
    const std::vector<Index> first = {0, 1, 2, 5}, second = whole.neighbours(5);
    const auto a = whole.part(first);
    const std::vector<std::vector<std::byte>> pieces = {whole.pack(second)};
    const auto part = a.part(first, pieces);
    CHECK(part.element() == element);
    for (const auto* cells : {&first, &second})
      for (const Index c : *cells) {
        REQUIRE(part.holds(c));
        CHECK(std::ranges::equal(part.element_nodes(c), whole.element_nodes(c)));
        CHECK(part.cell_volume(c) == whole.cell_volume(c));
        CHECK(part.cell_size(c) == whole.cell_size(c));
        CHECK(part.cell_bounds(c) == whole.cell_bounds(c));
        const Vec<Dim> x = whole.element_geometry(c).point(centre_xi<Dim>(element));
        CHECK(part.locate_from(x, 5).cell == c);
        CHECK(part.locate_from(x, 5).xi == whole.locate_from(x, 5).xi);
      }
    const auto other = mesh_of(bent_grid<Dim>(element, 3, 0.1, random));
    CHECK_THROWS_AS(other.part(first, pieces), std::invalid_argument);
  });
}

std::string message_of(auto make) {
  try {
    make();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("means of the functions of every element") {
  const auto check = [](const std::vector<double>& means) {
    CHECK(std::accumulate(means.begin(), means.end(), 0.0) == doctest::Approx(1).epsilon(1e-14));
  };
  for_elements<2>([&](Element e, std::mt19937&) { check(means_of_functions<2>(e)); });
  for_elements<3>([&](Element e, std::mt19937&) { check(means_of_functions<3>(e)); });
  // Of a corner and of the last node: integrals of the polynomials by hand.
  const auto ends = [](const std::vector<double>& means, double corner, double last) {
    CHECK(means.front() == doctest::Approx(corner).epsilon(1e-13).scale(1));
    CHECK(means.back() == doctest::Approx(last).epsilon(1e-13).scale(1));
  };
  ends(means_of_functions<2>(Element::Q4), 1.0 / 4, 1.0 / 4);
  ends(means_of_functions<2>(Element::Q8), -1.0 / 12, 1.0 / 3);
  ends(means_of_functions<2>(Element::Q9), 1.0 / 36, 4.0 / 9);
  ends(means_of_functions<2>(Element::T6), 0, 1.0 / 3);
  ends(means_of_functions<3>(Element::Tet4), 1.0 / 4, 1.0 / 4);
  ends(means_of_functions<3>(Element::H20), -1.0 / 8, 1.0 / 6);
  ends(means_of_functions<3>(Element::H27), 1.0 / 216, 8.0 / 27);
}

TEST_CASE("meshes of every element find the cell of a point, by search and by walking") {
  check_location<2>();
  check_location<3>();
}

TEST_CASE("cells of every element know their nodes, neighbours and sizes") {
  check_connectivity<2>();
  check_connectivity<3>();
}

TEST_CASE("a part of a mesh of any element answers like the whole") {
  check_parts<2>();
  check_parts<3>();
}

TEST_CASE("the size of a regular cell is the distance between its faces, or nodes") {
  const auto size = [](Element element) {
    if (info(element).dim == 2)
      return mesh_of(element_grid<2>(element, Vec<2>::Zero(), Vec<2>::Ones(), {1, 1})).cell_size(0);
    return mesh_of(element_grid<3>(element, Vec<3>::Zero(), Vec<3>::Ones(), {1, 1, 1}))
        .cell_size(0);
  };
  using enum Element;
  CHECK(size(Q4) == doctest::Approx(1));
  CHECK(size(Q8) == doctest::Approx(0.5));
  CHECK(size(Q9) == doctest::Approx(0.5));
  CHECK(size(T3) == doctest::Approx(std::sqrt(0.5)));  // the height over the diagonal
  CHECK(size(T6) == doctest::Approx(std::sqrt(0.5) / 2));
  CHECK(size(H8) == doctest::Approx(1));
  CHECK(size(H20) == doctest::Approx(0.5));
  CHECK(size(H27) == doctest::Approx(0.5));
  // Volume 1/6; the largest faces, over an edge and a face diagonal, have an area of sqrt(2) / 2.
  CHECK(size(Tet4) == doctest::Approx(std::sqrt(0.5)));
}

TEST_CASE("inverted, flat and wrongly listed cells of other elements are refused") {
  using enum Element;
  const std::vector<Vec<2>> corners = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  const auto triangle = [&](std::vector<Index> cells) {
    return message_of([&] { Mesh<2>::from_tables(corners, T3, cells, true); });
  };
  CHECK(triangle({0, 1, 2, 1, 3, 2}).empty());
  CHECK(triangle({0, 2, 1}).find("cell 0 is inverted at its corner at node 0") !=
        std::string::npos);
  CHECK(triangle({0, 1, 1}).find("cell 0 has node 1 twice; a triangle has 3 different nodes") !=
        std::string::npos);
  CHECK(triangle({0, 1, 2, 0, 1, 3, 0, 1, 3}).find("share one face") != std::string::npos);
  CHECK(message_of([&] {  // no box is asked of triangles
          const Index cell[] = {0, 1, 2};
          Mesh<2>::from_tables(corners, T3, cell, false);
        })
            .empty());

  // The middle of a side moved to the quarter of it: the Jacobian vanishes at the corner.
  auto t = element_grid<2>(Q8, Vec<2>::Zero(), Vec<2>::Ones(), {1, 1});
  const auto move = [&](double x) {
    t.nodes[static_cast<std::size_t>(t.cells[4])][0] = x;
    return message_of([&] { mesh_of(t); });
  };
  CHECK(move(0.26).empty());
  CHECK(move(0.25).find("cell 0 is flat at its corner at node 0") != std::string::npos);
  CHECK(move(0.2).find("cell 0 is inverted at its corner at node 0") != std::string::npos);
  t.nodes[static_cast<std::size_t>(t.cells[4])][0] = 0.5;
  CHECK(message_of([&] { mesh_of(t, false); }).empty());
  t.nodes[static_cast<std::size_t>(t.cells[4])][1] = 0.01;
  CHECK(message_of([&] { mesh_of(t, false); }).find("cell 0 is not a box along the axes") !=
        std::string::npos);
}
