// Meshes from files read by a team: each member has a share, and all together what one process has.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <numeric>
#include <random>

#include "io/mesh/mesh_search.h"
#include "io/scenario/scenario.h"
#include "physics/mesh/element_grid.h"
#include "tests/io/base/team_folder.h"
#include "tests/io/base/thread_team.h"

namespace fs = std::filesystem;
using namespace lahar;

namespace {

constexpr int teams[] = {2, 3, 7};

template <int Dim>
struct Tables {
  Element element;
  std::vector<Vec<Dim>> nodes;
  std::vector<std::vector<Index>> cells;
};

// A grid with nodes out of their places, cells in an order of their own, and a node without a cell.
template <int Dim>
Tables<Dim> distorted(Element element, const std::array<Index, Dim>& counts, double by) {
  const auto grid = element_grid<Dim>(element, Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts);
  Tables<Dim> tables{element, grid.nodes, {}};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> off(-by, by);
  for (auto& x : tables.nodes)
    for (int d = 0; d < Dim; ++d) x[d] += off(random);
  tables.nodes.push_back(Vec<Dim>::Constant(0.25));
  const auto per_cell = static_cast<std::size_t>(info(element).nodes);
  for (std::size_t at = 0; at < grid.cells.size(); at += per_cell)
    tables.cells.emplace_back(grid.cells.begin() + static_cast<std::ptrdiff_t>(at),
                              grid.cells.begin() + static_cast<std::ptrdiff_t>(at + per_cell));
  std::shuffle(tables.cells.begin(), tables.cells.end(), random);
  return tables;
}

template <int Dim>
std::string text_of(const Tables<Dim>& tables) {
  std::string text = fmt::format("# made up\n{} {}\n", tables.nodes.size(), tables.cells.size());
  for (const auto& x : tables.nodes)
    text += fmt::format("{}\n", fmt::join(x.data(), x.data() + Dim, " "));
  text += "! cells\n";
  for (const auto& cell : tables.cells) text += fmt::format("{}\n", fmt::join(cell, " "));
  return text;
}

template <int Dim>
std::string random_particles(int n, double extent) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(0.5, extent - 0.5);
  std::string text = fmt::format("{}\n", n);
  for (int i = 0; i < n; ++i) {
    for (int d = 0; d < Dim; ++d) text += fmt::format("{} ", x(random));
    text += "\n";
  }
  return text;
}

std::string scenario(int dim, const std::string& cell_type, const std::string& mesh) {
  const std::string zero = dim == 2 ? "[0, 0.3]" : "[0, 0, 0.3]";
  const std::string up = dim == 2 ? "[0, 1]" : "[0, 0, 1]";
  const std::string middle = dim == 2 ? "[4, 4]" : "[4, 4, 4]";
  return fmt::format(R"({{
    "mesh": {{{}, "cell_type": "{}", "boundary_conditions": {{
      "velocity_constraints": [{{"nset": "floor", "dir": "y", "velocity": 0}}],
      "friction_constraints": [{{"nset": "floor", "dir": "x", "sign_n": -1, "friction": 0.5}}]}}}},
    "sets": {{"nodes": {{"floor": {{"half_space": {{"point": {}, "normal": {}}}}}}},
             "cells": {{"middle": {{"sphere": {{"centre": {}, "radius": 2}}}}}}}},
    "materials": [{{"type": "LinearElastic", "name": "soft", "density": 1000,
                   "youngs_modulus": 1e5, "poisson_ratio": 0.25}}],
    "analysis": {{"type": "MPMExplicit{}D", "dt": 0.0001, "nsteps": 1}},
    "particles": [
      {{"generator": {{"type": "file", "location": "particles.txt", "material": "soft"}}}},
      {{"generator": {{"type": "gauss", "cset": "middle", "nparticles_per_dir": 2,
                     "material": "soft", "check_duplicates": false}}}},
      {{"generator": {{"type": "region", "region": {{"half_space": {{"point": {}, "normal": {}}}}},
                     "per_cell": 2, "material": "soft", "check_duplicates": false}}}},
      {{"generator": {{"type": "inject", "cset": "middle", "nparticles_per_dir": 1,
                     "material": "soft", "duration": [0, 1]}}}}]}})",
                     mesh, cell_type, zero, up, middle, dim, middle, up);
}

// What each member reads.
std::vector<Scenario> read_by_team(const fs::path& file, int size) {
  std::vector<Scenario> parts(static_cast<std::size_t>(size));
  run_team(size, [&](const Team& team) {
    parts[static_cast<std::size_t>(team.index())] = read_scenario(file, {{}, false, &team});
  });
  return parts;
}

template <int Dim>
void check_share(const Mesh<Dim>& share, const Mesh<Dim>& whole, int member, int size) {
  REQUIRE(share.is_share());
  CHECK(share.n_nodes() == whole.n_nodes());
  CHECK(share.n_cells() == whole.n_cells());
  CHECK(share.element() == whole.element());
  CHECK(share.is_cartesian() == whole.is_cartesian());
  CHECK(share.bounds() == whole.bounds());
  CHECK(share.mean_cell() == whole.mean_cell());
  CHECK(share.n_bins() == whole.n_bins());
  const auto begin = [&](int m) { return whole.n_cells() * m / size; };
  for (Index cell = 0; cell < whole.n_cells(); ++cell) {
    const bool own = begin(member) <= cell && cell < begin(member + 1);
    CHECK(share.holds(cell) == own);
    if (own) CHECK(share.cell_volume(cell) == whole.cell_volume(cell));
  }
}

template <int Dim>
void check_model(const Model<Dim>& whole, const std::vector<Scenario>& parts) {
  std::map<Index, Vec<Dim>> x;
  std::map<Index, Index> cell;
  std::map<Index, double> volume;
  std::map<std::pair<Index, int>, double> velocity;
  std::size_t frictions = 0, injected = 0;
  Index held = 0;
  const int size = static_cast<int>(parts.size());
  for (int m = 0; m < size; ++m) {
    const auto& model = std::get<Model<Dim>>(parts[static_cast<std::size_t>(m)].model);
    check_share(*model.mesh, *whole.mesh, m, size);
    for (Index c = 0; c < whole.mesh->n_cells(); ++c) held += model.mesh->holds(c);
    const auto& p = model.particles;
    for (std::size_t i = 0; i < p.x.size(); ++i) {
      x[p.id[i]] = p.x[i];
      cell[p.id[i]] = p.cell[i];
      volume[p.id[i]] = p.volume[i];
    }
    for (const NodeVelocity& v : entries_of<NodeVelocity>(model))
      velocity[{v.node, v.dir}] = v.velocity;
    frictions += entries_of<NodeFriction>(model).size();
    REQUIRE(model.injections.size() == 1);
    const Injection<Dim>& injection = model.injections[0];
    CHECK(injection.n_cells() == whole.injections[0].n_cells());
    for (std::size_t i = 0; i < injection.cells.size(); ++i) {
      const auto at = static_cast<std::size_t>(injection.position_of(i));
      CHECK(injection.cells[i] == whole.injections[0].cells.at(at));
      CHECK(injection.x[i] == whole.injections[0].x[at]);  // one in each
      CHECK(injection.volume[i] == whole.injections[0].volume[at]);
    }
    injected += injection.cells.size();
  }
  CHECK(velocity.size() == entries_of<NodeVelocity>(whole).size());
  for (const NodeVelocity& v : entries_of<NodeVelocity>(whole))
    CHECK(velocity.at({v.node, v.dir}) == v.velocity);
  CHECK(frictions == entries_of<NodeFriction>(whole).size());
  CHECK(injected == whole.injections[0].cells.size());
  CHECK(held == whole.mesh->n_cells());
  const auto& p = whole.particles;
  REQUIRE(x.size() == p.x.size());
  Index different = 0;
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const auto id = static_cast<Index>(i);
    different += x[id] != p.x[i] || cell[id] != p.cell[i] || volume[id] != p.volume[i];
  }
  CHECK(different == 0);
}

template <int Dim>
void check_case(const fs::path& file) {
  const Scenario whole = read_scenario(file, {});
  const auto& model = std::get<Model<Dim>>(whole.model);
  REQUIRE(!entries_of<NodeVelocity>(model).empty());
  REQUIRE(!model.injections.empty());
  for (const int size : teams) {
    CAPTURE(size);
    const std::vector<Scenario> parts = read_by_team(file, size);
    for (const Scenario& part : parts)
      CHECK(format_problems(part.warnings) == format_problems(whole.warnings));
    check_model<Dim>(model, parts);
  }
}

template <int Dim>
void check_element(const std::string& cell_type, Element element, double by) {
  CAPTURE(cell_type);
  const Folder folder;
  std::array<Index, Dim> counts;
  counts.fill(8);
  folder.write("mesh.txt", text_of(distorted<Dim>(element, counts, by)));
  folder.write("particles.txt", random_particles<Dim>(500, 8));
  folder.write("case.json", scenario(Dim, cell_type, R"("mesh": "mesh.txt")"));
  check_case<Dim>(folder.path / "case.json");
  folder.write("grid.json",
               scenario(Dim, cell_type,
                        Dim == 2 ? R"("structured": {"cell_size": 1, "counts": [8, 8]})"
                                 : R"("structured": {"cell_size": 1, "counts": [8, 8, 8]})"));
  if (element != multilinear<Dim>) check_case<Dim>(folder.path / "grid.json");
}

std::string problems_of(const fs::path& file, const Team* team) {
  try {
    read_scenario(file, {{}, false, team});
  } catch (const InputError& error) {
    return format_problems(error.problems());
  }
  return "";
}

}  // namespace

TEST_CASE(
    "shares of meshes from files, and of grids of other elements, are the mesh of one process") {
  check_element<2>("ED2Q4", Element::Q4, 0.2);
  check_element<2>("ED2T3", Element::T3, 0.1);
  check_element<2>("ED2Q9", Element::Q9, 0.02);
  check_element<3>("ED3H8", Element::H8, 0.1);
  check_element<3>("ED3T4", Element::Tet4, 0.02);
  check_element<3>("ED3H20", Element::H20, 0.01);
  check_element<2>("ED2Q4", Element::Q4, 0);  // boxes
}

TEST_CASE("a share of a mesh has a share of its memory") {
  const auto tables = distorted<3>(Element::H8, {20, 20, 20}, 0.1);
  std::vector<Index> cells;
  for (const auto& cell : tables.cells) cells.insert(cells.end(), cell.begin(), cell.end());
  const auto whole = Mesh<3>::from_tables(tables.nodes, Element::H8, cells, true);
  std::vector<std::vector<Index>> in_order = tables.cells;
  std::sort(in_order.begin(), in_order.end());
  cells.clear();
  for (const auto& cell : in_order) cells.insert(cells.end(), cell.begin(), cell.end());
  const auto ordered = Mesh<3>::from_tables(tables.nodes, Element::H8, cells, true);
  std::vector<std::size_t> bytes(4);
  run_team(4, [&](const Team& team) {
    const auto share = share_of(ordered, team);
    bytes[static_cast<std::size_t>(team.index())] = share.bytes();
  });
  for (const std::size_t n : bytes) CHECK(n < whole.bytes() / 8);
}

TEST_CASE("points are found in shares as in the whole mesh, on borders of cells and outside, too") {
  const auto tables = distorted<2>(Element::Q4, {30, 20}, 0.2);
  std::vector<Index> cells;
  for (const auto& cell : tables.cells) cells.insert(cells.end(), cell.begin(), cell.end());
  const auto whole = Mesh<2>::from_tables(tables.nodes, Element::Q4, cells, true);
  std::vector<Vec<2>> points = tables.nodes;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> x(-2, 33);
  for (int i = 0; i < 2000; ++i) points.emplace_back(x(random), x(random));
  std::vector<Index> suggested, expected;
  for (std::size_t p = 0; p < points.size(); ++p) {
    suggested.push_back(static_cast<Index>(p % 7 == 0 ? p % tables.cells.size() : 0) - 1);
    const bool inside =
        suggested[p] >= 0 && whole.natural_coordinates(suggested[p], points[p]).has_value();
    expected.push_back(inside ? suggested[p] : whole.locate(points[p]).cell);
  }
  for (const int size : teams)
    run_team(size, [&](const Team& team) {
      const MeshSearch<2> search(share_of(whole, team), team);
      const auto part = [&](const auto& all) {
        const auto n = static_cast<Index>(all.size());
        return std::vector(all.begin() + team.part(n, team.index()),
                           all.begin() + team.part(n, team.index() + 1));
      };
      CHECK(search.locate(part(points), part(suggested)) == part(expected));
    });
}

TEST_CASE("what is wrong with a mesh is said in the same words, once, by any number of processes") {
  const Folder folder;
  folder.write("particles.txt", random_particles<2>(10, 8));
  const auto good = distorted<2>(Element::Q4, {8, 8}, 0.1);
  const auto check = [&](const std::string& mesh, const std::string& expected) {
    folder.write("mesh.txt", mesh);
    folder.write("case.json", scenario(2, "ED2Q4", R"("mesh": "mesh.txt")"));
    const std::string alone = problems_of(folder.path / "case.json", nullptr);
    CHECK(alone.find(expected) != std::string::npos);
    for (const int size : teams)
      run_team(size, [&](const Team& team) {
        CHECK(problems_of(folder.path / "case.json", &team) == alone);
      });
  };
  auto bad = good;
  std::swap(bad.cells[50][1], bad.cells[50][3]);
  check(text_of(bad), "cell 50 is inverted");
  bad = good;
  bad.cells[7][2] = 1000;
  check(text_of(bad), "a node id must be an integer from 0 to 81, found '1000'");
  bad = good;
  bad.cells.push_back(bad.cells[3]);
  bad.cells.push_back(bad.cells[3]);
  check(text_of(bad), "share one face; two at most can");
  check(text_of(good) + "1 2 3 4\n", "unexpected row after 64 cells");
  check("82 64\n0 0\n", "the file ends after 1 of 82 nodes");
  check("82\n0 0\n", "the number of cells is missing");
}
