// Sets, constraints, loads and injection from files, of which each rank keeps a part.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <fstream>
#include <random>
#include <vector>

#include "io/scenario/scenario.h"
#include "physics/mesh/element_grid.h"
#include "runtime/comm/rank_team.h"
#include "runtime/patches/patch_set.h"
#include "runtime/step/simulation.h"
#include "runtime/step/timestep.h"
#include "tests/ranks/shared_folder.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

using Counts = std::array<Index, 2>;

/// A mesh of distorted unit squares, and files that say something of nodes, cells and particles.
void write_files(const std::filesystem::path& folder, const Counts& counts) {
  const auto grid = element_grid<2>(Element::Q4, Vec<2>::Zero(), Vec<2>::Ones(), counts);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> off(-0.15, 0.15);
  std::ofstream mesh(folder / "mesh.txt"), fixed(folder / "fixed.txt"), rough(folder / "rough.txt"),
      angles(folder / "angles.txt"), forces(folder / "forces.txt"),
      accelerated(folder / "accelerated.txt"), displaced(folder / "displaced.txt");
  std::vector<Index> left, turned, waves, cells, fed;
  const std::size_t n_cells = grid.cells.size() / 4;
  mesh << grid.nodes.size() << " " << n_cells << "\n";
  for (std::size_t n = 0; n < grid.nodes.size(); ++n) {
    const double x = grid.nodes[n].x(), y = grid.nodes[n].y();
    const auto node = static_cast<Index>(n);
    mesh << fmt::format("{} {}\n", x + off(random), y + off(random));
    if (y == 0) fixed << node << " 1 0\n" << node << " 1 5\n";  // the first counts
    if (y == 0 && x > 4) rough << node << " 1 -1 0.3\n";
    if (x == 0) left.push_back(node);
    if (x == 10 && y > 0) {
      angles << node << " 0.2 0.1\n";
      turned.push_back(node);
    }
    if (y == 6) forces << node << " 0 20\n" << node << " 1 " << x << "\n";
    if (x == 1 && y > 0) waves.push_back(node);
    if (y == 0) displaced << node << " 1 " << x << "\n" << node << " 0 0\n";
    if (y == 2 && x > 3 && x < 6) accelerated << node << " 0 3\n";
  }
  for (std::size_t c = 0; c < n_cells; ++c) {
    const Index* node = &grid.cells[4 * c];
    mesh << fmt::format("{} {} {} {}\n", node[0], node[1], node[2], node[3]);
    const auto cell = static_cast<Index>(c);
    const Index i = cell % counts[0], j = cell / counts[0];
    if (i < 9 && j < 7) cells.push_back(cell);
    if (i == 14 && j > 3) fed.push_back(cell);
  }
  std::shuffle(cells.begin(), cells.end(), random);
  std::shuffle(fed.begin(), fed.end(), random);
  std::vector<Index> third(cells.size() * 4 / 3);  // of the particles, four of a cell
  for (std::size_t i = 0; i < third.size(); ++i) third[i] = static_cast<Index>(3 * i);
  std::ofstream(folder / "sets.json") << fmt::format(
      R"({{"node_sets": [{{"id": 0, "set": [{}]}}, {{"id": 3, "set": [{}]}}, {{"id": 5, "set": [{}]}}],
          "cell_sets": [{{"id": 1, "set": [{}]}}, {{"id": 2, "set": [{}]}}],
          "particle_sets": [{{"id": 0, "set": [{}]}}]}})",
      fmt::join(left, ","), fmt::join(turned, ","), fmt::join(waves, ","), fmt::join(cells, ","),
      fmt::join(fed, ","), fmt::join(third, ","));
}

std::string scenario(const std::string& mesh) {
  return R"({"mesh": {)" + mesh + R"(, "entity_sets": "sets.json",
      "boundary_conditions": {
        "nodal_euler_angles": "angles.txt",
        "velocity_constraints": [{"file": "fixed.txt"}, {"nset_id": 0, "dir": "x", "velocity": 0},
                                 {"nset_id": 3, "dir": "x", "velocity": 0}],
        "friction_constraints": [{"file": "rough.txt"},
                                 {"nset": "ledge", "dir": "y", "sign_n": -1, "friction": 0.5}],
        "acceleration_constraints": [{"file": "accelerated.txt"}],
        "absorbing_constraints": [{"nset_id": 5, "dir": "x", "delta": 10, "h_min": 1, "a": 1,
                                   "b": 1, "position": "edge"}],
        "spring_constraints": [{"nset_id": 5, "dir": "y", "stiffness": 30, "damping": 2}]}},
    "sets": {"nodes": {"ledge": {"box": {"min": [12, 3], "max": [16, 4]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.25}],
    "math_functions": [{"id": 0, "type": "Sin", "x0": 0, "a": 30}],
    "external_loading_conditions": {"gravity": [3, -9.81],
      "particle_surface_traction": [{"pset_id": 0, "dir": "x", "traction": 200}],
      "concentrated_nodal_forces": [{"file": "forces.txt", "math_function_id": 0},
                                    {"nset_id": -1, "dir": "y", "force": 1}]},
    "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": 60, "patch_particles": 60},
    "particles": [
      {"generator": {"type": "gauss", "cset_id": 1, "nparticles_per_dir": 2, "material_id": 0}},
      {"generator": {"type": "inject", "cset_id": 2, "nparticles_per_dir": 1, "material_id": 0,
                     "velocity": [8, -4]}}]})";
}

/// Implicit steps, whose displacements the same files prescribe.
std::string implicit_scenario() {
  return R"({"mesh": {"mesh": "mesh.txt", "cell_type": "ED2Q4", "entity_sets": "sets.json",
      "boundary_conditions": {"displacement_constraints": [
        {"file": "displaced.txt"}, {"nset_id": -1, "dir": "x", "displacement": 2,
                                    "math_function_id": 0}]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.25}],
    "math_functions": [{"id": 0, "type": "Sin", "x0": 0, "a": 30}],
    "analysis": {"type": "MPMImplicit2D", "dt": 0.001, "nsteps": 1, "patch_particles": 60},
    "particles": [{"generator": {"type": "gauss", "cset_id": 1, "nparticles_per_dir": 2,
                                 "material_id": 0}}]})";
}

/// The lists of a model, with names.
void for_each_list(const Model<2>& model, auto&& visit) {
  visit("velocities", entries_of<NodeVelocity>(model));
  visit("frictions", entries_of<NodeFriction>(model));
  visit("frames", model.node_frames);
  visit("forces", entries_of<NodeForce>(model));
  visit("absorptions", entries_of<NodeAbsorption>(model));
  visit("springs", entries_of<NodeSpring>(model));
  visit("accelerations", entries_of<NodeAcceleration>(model));
  visit("injections", model.injections.at(0).cells);
}

/// All ranks together have the lists of one that is alone, and none has more than its part.
void check_parts(const Model<2>& part, const Model<2>& whole, const Communicator& ranks) {
  std::vector<Index> own;
  for_each_list(
      part, [&](const char*, const auto& list) { own.push_back(static_cast<Index>(list.size())); });
  std::vector<Index> all = own;
  ranks.sum(all);
  std::size_t k = 0;
  for_each_list(whole, [&](const char* name, const auto& list) {
    CAPTURE(name);
    CHECK(!list.empty());
    CHECK(all[k++] == static_cast<Index>(list.size()));
  });
}

template <class A>
bool same_entries(const std::vector<A>& a, const std::vector<A>& b, auto&& as_text) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](const A& x, const A& y) { return as_text(x) == as_text(y); });
}

/// What patches got is what they get where one process has everything.
void check_patches(const PatchSet<2>& patches, const PatchSet<2>& alone) {
  for (int p = 0; p < patches.size(); ++p) {
    const Patch<2>& a = patches[p];
    int q = 0;
    while (alone[q].topology.patch != a.topology.patch) REQUIRE(++q < alone.size());
    const Patch<2>& b = alone[q];
    CHECK(same_entries(a.fixed, b.fixed, [](const auto& at) {
      return fmt::format("{} {} {}", at.node, at.dir, at.velocity);
    }));
    CHECK(same_entries(a.fixed_displacement, b.fixed_displacement, [](const auto& at) {
      return fmt::format("{} {} {} {}", at.node, at.dir, at.displacement, at.function);
    }));
    CHECK(same_entries(a.walls, b.walls, [](const auto& at) {
      return fmt::format("{} {} {} {} {} {}", at.node, at.friction, at.velocity[0],
                         at.acceleration[0], at.axes(0, 0), at.axes(1, 0));
    }));
    CHECK(same_entries(a.forces, b.forces, [](const auto& at) {
      return fmt::format("{} {} {} {}", at.node, at.dir, at.force, at.function);
    }));
    using Absorbing = std::vector<ActingNode<2, NodeAbsorption>>;
    using Springs = std::vector<ActingNode<2, NodeSpring>>;
    CHECK(same_entries(
        std::get<Absorbing>(a.acting), std::get<Absorbing>(b.acting), [](const auto& at) {
          return fmt::format("{} {} {}", at.node, at.condition.normal, at.condition.area);
        }));
    CHECK(
        same_entries(std::get<Springs>(a.acting), std::get<Springs>(b.acting), [](const auto& at) {
          return fmt::format("{} {} {}", at.node, at.condition.dir, at.condition.stiffness);
        }));
    CHECK(same_entries(a.injection_cells, b.injection_cells, [](const auto& at) {
      return fmt::format("{} {} {}", at.event, at.cell, at.volume);
    }));
    CHECK(a.injection_points == b.injection_points);
  }
}

void check(const std::string& mesh) {
  CAPTURE(mesh);
  const Communicator ranks = Communicator::world();
  const RankTeam team(ranks);
  const SharedFolder folder(ranks);
  if (ranks.rank() == 0) {
    write_files(folder.path, {24, 16});
    std::ofstream(folder.path / "case.json") << scenario(mesh);
  }
  ranks.wait_for_all();
  const auto file = folder.path / "case.json";
  const auto whole = std::get<Model<2>>(read_scenario(file).model);
  const auto part = std::get<Model<2>>(read_scenario(file, {{}, false, &team}).model);
  check_parts(part, whole, ranks);
  {
    Model<2> alone = whole, own = part, all = whole;
    const NodeSumCopies copies = node_sum_copies(whole.analysis);
    const PatchSet<2> reference(alone, 0, copies);
    check_patches(PatchSet<2>(own, 0, copies, 1, ranks), reference);
    check_patches(PatchSet<2>(all, 0, copies, 1, ranks), reference);
    check_parts(own, whole, ranks);
    check_parts(all, whole, ranks);  // what every rank had has become a part
  }
  const Outcome reference = run(whole, {.threads = 1});
  CHECK(reference.error == "");
  CHECK(reference.frames.back().size() > static_cast<std::size_t>(whole.particles.size()));
  for (const bool moving : {false, true}) {
    ExecutionOptions way{.threads = moving ? 2 : 1};
    way.ranks = ranks;
    if (moving) way.balance = {BalanceOptions::When::forced, 20, Partitioner::curve};
    const Outcome outcome = run(part, way);
    CHECK(outcome.error == "");
    if (ranks.rank() != 0) continue;
    CHECK(same_bits(outcome.frames.back(), reference.frames.back()));
    CHECK(same_bits(outcome.rows.back(), reference.rows.back()));
  }
}

}  // namespace

TEST_CASE(
    "what files say of nodes, cells and particles gives the bits of one rank that knows all") {
  check(R"("mesh": "mesh.txt", "cell_type": "ED2Q4")");
  check(R"("structured": {"cell_size": 1, "counts": [24, 16]})");
}

TEST_CASE("prescribed displacements reach the patches of any rank") {
  const Communicator ranks = Communicator::world();
  const RankTeam team(ranks);
  const SharedFolder folder(ranks);
  const auto file = folder.path / "case.json";
  if (ranks.rank() == 0) {
    write_files(folder.path, {24, 16});
    std::ofstream(file) << implicit_scenario();
  }
  ranks.wait_for_all();
  auto alone = std::get<Model<2>>(read_scenario(file).model);
  auto part = std::get<Model<2>>(read_scenario(file, {{}, false, &team}).model);
  const std::size_t count = 25 * 17 + 25;  // x everywhere, y at the bottom
  REQUIRE(entries_of<NodeDisplacement>(alone).size() == count);
  CHECK(ranks.sum(static_cast<Index>(entries_of<NodeDisplacement>(part).size())) ==
        static_cast<Index>(count));
  const NodeSumCopies copies = node_sum_copies(alone.analysis);
  const PatchSet<2> reference(alone, 0, copies), patches(part, 0, copies, 1, ranks);
  check_patches(patches, reference);
  std::size_t reached = 0;
  for (int p = 0; p < patches.size(); ++p) reached += patches[p].fixed_displacement.size();
  CHECK(reached > 0);
}

TEST_CASE("each rank keeps its part of what is said of nodes and cells") {
  const Communicator ranks = Communicator::world();
  const RankTeam team(ranks);
  const SharedFolder folder(ranks);
  if (ranks.rank() == 0) {
    write_files(folder.path, {300, 200});
    std::string text = scenario(R"("mesh": "mesh.txt", "cell_type": "ED2Q4")");
    for (const char* set : {"\"cset_id\": 1", "\"cset_id\": 2"})  // all cells
      text.replace(text.find(set), 12, "\"cset_id\": -1");
    text.replace(text.find("\"patch_particles\": 60"), 21, "\"patch_particles\": 2000");
    std::ofstream(folder.path / "case.json") << text;
  }
  ranks.wait_for_all();
  auto model =
      std::get<Model<2>>(read_scenario(folder.path / "case.json", {{}, false, &team}).model);
  const auto even = [&](std::size_t own, double all) {
    return static_cast<double>(own) < 1.1 * all / ranks.size();
  };
  CHECK(even(entries_of<NodeForce>(model).size(), 301 * 201 + 301));
  CHECK(even(model.injections[0].x.size(), 300 * 200));
  // The border of the mesh is spread as well, whose ids have a regular distance.
  const auto left =
      std::count_if(entries_of<NodeVelocity>(model).begin(), entries_of<NodeVelocity>(model).end(),
                    [](const NodeVelocity& v) { return v.node % 301 == 0; });
  CHECK(static_cast<double>(left) < 2.0 * 201 / ranks.size() + 10);
  const PatchSet<2> patches(model, 0, node_sum_copies(model.analysis), 1, ranks);
  CHECK(even(entries_of<NodeForce>(model).size(), 301 * 201 + 301));
  std::size_t forces = 0;
  for (int p = 0; p < patches.size(); ++p) forces += patches[p].forces.size();
  CHECK(static_cast<double>(forces) < 1.5 * (301 * 201 + 301) / ranks.size());
}
