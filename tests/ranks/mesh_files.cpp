// Meshes from files, of which ranks read shares: the bits of one rank that has all of the mesh.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <random>

#include "io/scenario/scenario.h"
#include "physics/mesh/element_grid.h"
#include "runtime/comm/rank_team.h"
#include "runtime/step/simulation.h"
#include "tests/ranks/shared_folder.h"
#include "tests/runtime/step/soil_models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A grid of unit cells with nodes out of their places, and files that name some of its nodes.
template <int Dim>
void write_mesh(const std::filesystem::path& folder, Element element,
                const std::array<Index, Dim>& counts, double by) {
  auto grid = element_grid<Dim>(element, Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> off(-by, by);
  std::ofstream mesh(folder / "mesh.txt"), fixed(folder / "fixed.txt");
  const auto per_cell = static_cast<std::size_t>(info(element).nodes);
  std::string set;
  mesh << grid.nodes.size() << " " << grid.cells.size() / per_cell << "\n";
  for (std::size_t n = 0; n < grid.nodes.size(); ++n) {
    Vec<Dim>& x = grid.nodes[n];
    if (x[Dim - 1] == 0) fixed << n << " " << Dim - 1 << " 0\n";
    if (x[0] == 0) set += fmt::format("{}{}", set.empty() ? "" : ", ", n);
    for (int d = 0; d < Dim; ++d) mesh << fmt::format("{} ", x[d] + off(random));
    mesh << "\n";
  }
  for (std::size_t at = 0; at < grid.cells.size(); at += per_cell) {
    for (std::size_t k = 0; k < per_cell; ++k) mesh << grid.cells[at + k] << " ";
    mesh << "\n";
  }
  std::ofstream(folder / "sets.json") << R"({"node_sets": [{"id": 0, "set": [)" << set << "]}]}";
}

/// A grid of unit cells, in an order of their own, that list the nodes around them: GIMP cells.
/// Those at the border are not listed.
template <int Dim>
void write_ring_mesh(const std::filesystem::path& folder, const std::array<Index, Dim>& counts) {
  const auto grid =
      element_grid<Dim>(multilinear<Dim>, -Vec<Dim>::Ones(), Vec<Dim>::Ones(), counts);
  std::ofstream mesh(folder / "mesh.txt"), fixed(folder / "fixed.txt");
  std::vector<Index> set;
  std::vector<std::string> rows;
  for (std::size_t at = 0; at < grid.cells.size(); at += corners<Dim>) {
    Index rest = static_cast<Index>(at) / corners<Dim>, first = 0, stride = 1, plane = 1;
    std::array<Index, static_cast<std::size_t>(Dim)> step{};
    bool inner = true;
    for (std::size_t d = 0; d < Dim; ++d) {
      const Index i = rest % counts[d];
      inner = inner && 0 < i && i < counts[d] - 1;
      rest /= counts[d];
      step[d] = stride;
      first += (i - 1) * stride;
      stride *= counts[d] + 1;
    }
    if (!inner) continue;
    std::vector<Index> nodes(grid.cells.begin() + static_cast<std::ptrdiff_t>(at),
                             grid.cells.begin() + static_cast<std::ptrdiff_t>(at) + corners<Dim>);
    for (int k = 0; k < Dim; ++k) plane *= 4;
    for (Index k = 0; k < plane; ++k) {
      const Index node = first + k % 4 * step[0] + k / 4 % 4 * step[1] + k / 16 * step[Dim - 1];
      if (std::find(nodes.begin(), nodes.begin() + corners<Dim>, node) ==
          nodes.begin() + corners<Dim>)
        nodes.push_back(node);
    }
    rows.push_back(fmt::format("{}\n", fmt::join(nodes, " ")));
  }
  std::shuffle(rows.begin(), rows.end(), std::mt19937(3));
  mesh << grid.nodes.size() << " " << rows.size() << "\n";
  for (std::size_t n = 0; n < grid.nodes.size(); ++n) {
    const Vec<Dim>& x = grid.nodes[n];
    for (int d = 0; d < Dim; ++d) mesh << x[d] << (d + 1 < Dim ? " " : "\n");
    if (x[Dim - 1] == 0) fixed << n << " " << Dim - 1 << " 0\n";
    if (x[0] == 0) set.push_back(static_cast<Index>(n));
  }
  for (const std::string& row : rows) mesh << row;
  std::ofstream(folder / "sets.json")
      << fmt::format(R"({{"node_sets": [{{"id": 0, "set": [{}]}}]}})", fmt::join(set, ","));
}

std::string scenario(int dim, const char* cell_type, int first, int last) {
  const auto corner = [&](int at) {
    return dim == 2 ? fmt::format("[{0}, {0}]", at) : fmt::format("[{0}, {0}, {0}]", at);
  };
  return fmt::format(R"({{
    "mesh": {{"mesh": "mesh.txt", "entity_sets": "sets.json", "cell_type": "{}",
      "boundary_conditions": {{
        "velocity_constraints": [{{"file": "fixed.txt"}}, {{"nset_id": 0, "dir": "x", "velocity": 0}}],
        "friction_constraints": [{{"nset": "floor", "dir": {}, "sign_n": -1, "friction": 0.3}}]}}}},
    "sets": {{"nodes": {{"floor": {{"half_space": {{"point": {}, "normal": {}}}}}}}}},
    "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.25}}],
    "external_loading_conditions": {{"gravity": {}}},
    "analysis": {{"type": "MPMExplicit{}D", "dt": 0.001, "nsteps": 60, "patch_particles": 60}},
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material_id": 0,
      "region": {{"box": {{"min": {}, "max": {}}}}}}}}}]}})",
                     cell_type, dim - 1, corner(0), dim == 2 ? "[0, 1]" : "[0, 0, 1]",
                     dim == 2 ? "[3, -9.81]" : "[3, 1, -9.81]", dim, corner(first), corner(last));
}

template <int Dim>
void check(const char* cell_type, Element element, const std::array<Index, Dim>& counts, double by,
           int first, int last) {
  CAPTURE(std::string(cell_type));
  const Communicator ranks = Communicator::world();
  const RankTeam team(ranks);
  const SharedFolder folder(ranks);
  if (ranks.rank() == 0) {
    if (std::string_view(cell_type).ends_with("G"))
      write_ring_mesh<Dim>(folder.path, counts);
    else
      write_mesh<Dim>(folder.path, element, counts, by);
    std::ofstream(folder.path / "case.json") << scenario(Dim, cell_type, first, last);
  }
  ranks.wait_for_all();
  const auto file = folder.path / "case.json";
  const auto whole = std::get<Model<Dim>>(read_scenario(file).model);
  REQUIRE(whole.particles.size() >= 100);
  const auto share = std::get<Model<Dim>>(read_scenario(file, {{}, false, &team}).model);
  CHECK(share.mesh->is_share() == ranks.several());
  CHECK(share.mesh->n_cells() == whole.mesh->n_cells());
  for (Index cell = 0; cell < whole.mesh->n_cells(); ++cell)
    if (share.mesh->holds(cell))
      CHECK(std::ranges::equal(share.mesh->element_nodes(cell), whole.mesh->element_nodes(cell)));
  const Outcome reference = run(whole, {.threads = 1});
  CHECK(reference.error == "");
  for (const bool moving : {false, true}) {
    ExecutionOptions way{.threads = moving ? 2 : 1};
    way.ranks = ranks;
    if (moving) way.balance = {BalanceOptions::When::forced, 20, Partitioner::curve};
    const Outcome outcome = run(share, way);
    CHECK(outcome.error == "");
    if (ranks.rank() != 0) continue;
    CHECK(same_bits(outcome.frames.back(), reference.frames.back()));
    CHECK(same_bits(outcome.rows.back(), reference.rows.back()));
  }
}

}  // namespace

TEST_CASE("meshes from files, which ranks read in shares") {
  check<2>("ED2Q4", Element::Q4, {24, 16}, 0.15, 1, 9);
  check<2>("ED2Q9", Element::Q9, {12, 10}, 0.02, 1, 6);
  check<3>("ED3H8", Element::H8, {7, 6, 5}, 0.1, 1, 4);
  check<3>("ED3T4", Element::Tet4, {5, 5, 4}, 0.02, 1, 3);
  check<2>("ED2Q16G", Element::Q4, {20, 14}, 0, 1, 9);
  check<3>("ED3H64G", Element::H8, {8, 7, 7}, 0, 1, 4);
}
