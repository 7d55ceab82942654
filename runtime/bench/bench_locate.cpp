#include "runtime/bench/bench_locate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "physics/mesh/element_grid.h"
#include "physics/mesh/locate_all.h"
#include "runtime/base/exit_codes.h"
#include "runtime/step/simulation.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

/// Time that this thread has been computing [s]: what else the machine does hardly matters.
double computed_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

constexpr Index n_particles = 150'000;
/// Looking into all cells takes milliseconds per particle.
constexpr Index brute_force_particles = 50;

/// About 23,000 cells around the unit square or cube, inner nodes moved by up to a tenth of an
/// edge.
template <int Dim>
Mesh<Dim> distorted_mesh(Element element) {
  const double boxes = 23'000.0 / (!info(element).simplex ? 1 : Dim == 2 ? 2 : 6);
  const auto n = static_cast<Index>(std::lround(std::pow(boxes, 1.0 / Dim)));
  std::array<Index, Dim> counts;
  counts.fill(n);
  const double edge = 1.0 / static_cast<double>(n);
  auto tables = element_grid<Dim>(element, Vec<Dim>::Zero(), Vec<Dim>::Constant(edge), counts);
  std::mt19937_64 random(1);
  const double most = 0.1 * edge / (info(element).order * info(element).order);
  std::uniform_real_distribution<> shift(-most, most);
  for (auto& x : tables.nodes)
    for (int d = 0; d < Dim; ++d)
      if (x[d] > 0.5 * edge && x[d] < 1 - 0.5 * edge) x[d] += shift(random);
  return Mesh<Dim>::from_tables(tables.nodes, element, tables.cells, true);
}

/// The best of some samples of what body() does, per particle [ns].
template <class Body>
double best(int repeats, Index particles, Body body) {
  double least = std::numeric_limits<double>::infinity();
  for (int sample = 0; sample < repeats; ++sample) {
    const double begin = computed_seconds();
    body();
    least = std::min(least, computed_seconds() - begin);
  }
  return least * 1e9 / static_cast<double>(particles);
}

/// Particles cell by cell, as patches hold them, at random places of their cells.
template <int Dim>
struct Cloud {
  std::vector<Vec<Dim>> x;
  std::vector<Index> cell;

  explicit Cloud(const Mesh<Dim>& mesh) {
    std::mt19937_64 random(2);
    std::uniform_real_distribution<> place(0.02, 0.98);
    for (Index p = 0; p < n_particles; ++p) {
      const Index c = p * mesh.n_cells() / n_particles;
      const auto geometry = mesh.element_geometry(c);
      Vec<Dim> xi;
      for (int d = 0; d < Dim; ++d) xi[d] = place(random);
      if (!info(mesh.element()).simplex)
        xi = (2.0 * xi.array() - 1.0).matrix();
      else if (xi.sum() > 1.0)
        xi /= 1.02 * xi.sum();
      x.push_back(geometry.point(xi));
      cell.push_back(c);
    }
  }
};

/// The stage of a step in which particles that rest are located [ns per particle-step].
template <int Dim>
double stage_time(std::shared_ptr<const Mesh<Dim>> mesh, const Cloud<Dim>& cloud, int samples) {
  Model<Dim> model;
  model.mesh = std::move(mesh);
  model.materials = {{.id = 0,
                      .name = "solid",
                      .density = 1000,
                      .law = LinearElastic{.youngs_modulus = 1e6, .poisson_ratio = 0.3}}};
  model.particles.x = cloud.x;
  model.particles.cell = cloud.cell;
  model.particles.volume.assign(cloud.x.size(), std::pow(n_particles, -1.0));
  model.particles.material.assign(cloud.x.size(), 0);
  model.analysis.scheme = Scheme::usl;
  model.analysis.step.dt = 1e-9;  // at rest, whatever the masses of nodes
  model.analysis.nsteps = std::numeric_limits<Index>::max();
  Simulation simulation(std::move(model), {.threads = 1});
  constexpr Index steps = 10;
  const auto spent = [&] {
    double total = 0;
    for (const StageTiming& stage : simulation.timings())
      if (stage.name == "locate") total += stage.total;
    return total;
  };
  simulation.advance(5);
  double least = std::numeric_limits<double>::infinity();
  for (int sample = 0; sample < samples; ++sample) {
    const double before = spent();
    simulation.advance(steps);
    least = std::min(least, spent() - before);
  }
  return least * 1e9 / static_cast<double>(steps * n_particles);
}

template <int Dim>
void measure(Element element, const LocateBenchArguments& arguments) {
  const auto mesh = std::make_shared<const Mesh<Dim>>(distorted_mesh<Dim>(element));
  const Cloud<Dim> cloud(*mesh);
  const int repeats = arguments.quick ? 1 : arguments.repeats;
  Index wrong = 0;
  const auto each = [&](Index n, auto locate) {
    return best(repeats, n, [&] {
      for (Index p = 0; p < n; ++p) wrong += locate(static_cast<std::size_t>(p)) < 0;
    });
  };
  const double brute = each(brute_force_particles, [&](std::size_t p) {
    // Spread over the mesh.
    const std::size_t q = p * (cloud.x.size() / brute_force_particles);
    for (Index c = 0; c < mesh->n_cells(); ++c)
      if (mesh->natural_coordinates(c, cloud.x[q])) return c;
    return Index{-1};
  });
  const double cold =
      each(n_particles, [&](std::size_t p) { return mesh->locate(cloud.x[p]).cell; });
  const double together = best(repeats, n_particles, [&] {
    std::vector<Index> cell(cloud.x.size(), -1);
    locate_all<Dim>(*mesh, cloud.x, cell);
    wrong += std::ranges::count_if(cell, [](Index c) { return c < 0; });
  });
  const double stay = each(n_particles, [&](std::size_t p) {
    return mesh->locate_from(cloud.x[p], cloud.cell[p]).cell;
  });
  // Particles that come from one of the cells around theirs.
  std::vector<Index> from;
  for (const Index c : cloud.cell) {
    const auto around = mesh->neighbours(c);
    from.push_back(around[static_cast<std::size_t>(c) % around.size()]);
  }
  const double walk =
      each(n_particles, [&](std::size_t p) { return mesh->locate_from(cloud.x[p], from[p]).cell; });
  const double stage = stage_time<Dim>(mesh, cloud, repeats);
  if (wrong > 0) throw SimulationError(fmt::format("{} particles were not found", wrong));
  fmt::print("| {} | {} | {:.0f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n",
             info(element).name, format_count(mesh->n_cells()), brute / 1000, cold, together,
             together * 1e-6 * n_particles, walk, stay, stage);
  std::fflush(stdout);
}

}  // namespace

int bench_locate(const LocateBenchArguments& arguments) {
  fmt::print(
      "## Finding the cells of {} particles, one thread\n\n"
      "Distorted cells. Cold: the cell is not known, of one particle or of all together. Moved: "
      "from "
      "a cell beside. Stay: in the cell as before, one by one, and as a stage of a step does it, "
      "in "
      "packs.\n\n"
      "| element | cells | all cells, cold [us] | grid, cold [ns] | together, cold [ns] | all of "
      "them [ms] | walk, moved [ns] | stay [ns] | stay, in a step [ns] |\n"
      "|---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
      format_count(n_particles));
  using enum Element;
  for (const Element element : {Q4, T3, T6, Q8, Q9}) measure<2>(element, arguments);
  for (const Element element : {H8, Tet4, H20, H27}) measure<3>(element, arguments);
  return exit_ok;
}

}  // namespace lahar
