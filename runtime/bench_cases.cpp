#include "runtime/bench_cases.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <random>

#include "io/problems.h"
#include "io/scenario.h"
#include "runtime/console.h"
#include "runtime/verify_plate.h"

namespace lahar {

namespace {

constexpr int per_cell(int dim) {
  return dim == 2 ? 4 : 2;
}

/// A run that ends when the measurement does; a history row every 1 % of it is none.
constexpr Index endless = 1'000'000'000'000;

/// The farthest that deformed() takes a particle, from the middle over the block's edge.
double reach(int dim) {
  return 0.5 * std::sqrt(static_cast<double>(dim));
}

/// [m/s] divided by the step's cells per second; the components add to one.
template <int Dim>
Vec<Dim> direction() {
  if constexpr (Dim == 2)
    return {0.55, 0.45};
  else
    return {0.4, 0.27, 0.33};
}

/// Cells below and above the block: for its deformation, and above for its flight.
struct Margins {
  Index below, above;
};

Margins margins(int dim, const BlockSize& size) {
  if (size.mesh_cells > 0) {
    const Index below = (size.mesh_cells - size.cells) / 2;
    return {below, size.mesh_cells - size.cells - below};
  }
  constexpr double flight = crossings_per_step * flight_steps;  // cells, at most
  const double swell = static_cast<double>(size.cells) * (reach(dim) - 0.5);
  const Index below = 2 + static_cast<Index>(std::ceil(swell));
  return {below, below + static_cast<Index>(flight)};
}

std::string repeated(double value, int dim) {
  std::string text = fmt::format("{}", value);
  for (int d = 1; d < dim; ++d) text += fmt::format(", {}", value);
  return text;
}

std::string repeated(Index value, int dim) {
  std::string text = fmt::format("{}", value);
  for (int d = 1; d < dim; ++d) text += fmt::format(", {}", value);
  return text;
}

constexpr double block_step = 0.0125;  // [s]

std::string block_scenario(int dim, const BlockSize& size) {
  const auto [below, above] = margins(dim, size);
  const Index end = below + size.cells;
  return fmt::format(
      R"({{"title": "Block of linear elastic material",
  "mesh": {{"structured": {{"cell_size": 1, "counts": [{}]}}}},
  "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1,
                  "poisson_ratio": 0.3}}],
  "particles": [{{"generator": {{"type": "region", "per_cell": {}, "material": 0,
                                "velocity": [{}],
                                "region": {{"box": {{"min": [{}], "max": [{}]}}}}}}}}],
  "analysis": {{"mpm_scheme": "usl", "dt": {}, "nsteps": 1}}}})",
      repeated(end + above, dim), per_cell(dim), repeated(1e-6, dim), repeated(below, dim),
      repeated(end, dim), block_step);
}

/// Angle [rad] at a distance from the axis, over the distance at which nothing moves.
double swirl_angle(double distance) {
  constexpr double turns = 1.25;
  const double fall = std::max(0.0, 1.0 - distance * distance);
  return 2 * std::numbers::pi * turns * fall * fall;
}

void turn(double& a, double& b, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), old = a;
  a = c * old - s * b;
  b = s * old + c * b;
}

}  // namespace

Index BlockSize::particles(int dim) const {
  Index n = 1;
  for (int d = 0; d < dim; ++d) n *= cells * per_cell(dim);
  return n;
}

template <int Dim>
Vec<Dim> deformed(const Vec<Dim>& x, double edge) {
  Vec<Dim> y = x;
  const double rim = edge * std::numbers::sqrt2 / 2;
  if constexpr (Dim == 2) {
    turn(y[0], y[1], swirl_angle(std::hypot(x[0], x[1]) / rim));
  } else {
    // The angle also depends on the place along the axis: layers shear against each other.
    turn(y[0], y[1], swirl_angle(std::hypot(x[0], x[1]) / rim) * (1 + x[2] / edge));
    const double rim_now = edge * reach(3);
    turn(y[1], y[2], swirl_angle(std::hypot(y[1], y[2]) / rim_now) * (1 + y[0] / edge));
  }
  return y;
}

template <int Dim>
Model<Dim> lattice_block(const BlockSize& size) {
  Scenario scenario = read_scenario_text(block_scenario(Dim, size), ".");
  Model<Dim> model = std::get<Model<Dim>>(std::move(scenario.model));
  model.analysis.nsteps = endless;
  return model;
}

template <int Dim>
Model<Dim> deformed_block(const BlockSize& size) {
  Model<Dim> model = lattice_block<Dim>(size);
  const auto edge = static_cast<double>(size.cells);
  const Vec<Dim> middle =
      Vec<Dim>::Constant(static_cast<double>(margins(Dim, size).below) + 0.5 * edge);
  // A particle that moves by a share of a cell along an axis has that chance to change its cell.
  const Vec<Dim> velocity = direction<Dim>() * crossings_per_step / block_step;
  ParticleTable<Dim>& particles = model.particles;
  for (std::size_t p = 0; p < particles.x.size(); ++p) {
    particles.x[p] = middle + deformed<Dim>(particles.x[p] - middle, edge);
    particles.cell[p] = model.mesh->locate(particles.x[p]).cell;
    particles.velocity[p] = velocity;
  }
  return model;
}

Model<2> bench_plate(const std::vector<std::string>& overrides) {
  constexpr Index steps = 1000;  // of a sample
  Model<2> model = published_plate(overrides);
  model.analysis.nsteps = endless;
  model.output.history_steps = steps / 100;  // as a run of so many steps does
  return model;
}

Model<2> bench_plate_isoparametric() {
  constexpr double amount = 0.15 * plate_cell;
  Model<2> model = bench_plate({});
  const Mesh<2>& boxes = *model.mesh;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<> shift(-amount, amount);
  const auto [low, high] = boxes.bounds();
  std::vector<Vec<2>> nodes;
  for (Index n = 0; n < boxes.n_nodes(); ++n) {
    Vec<2> x = boxes.node(n);
    const bool inner =
        (x.array() > low.array() + amount).all() && (x.array() < high.array() - amount).all();
    if (inner) x += Vec<2>(shift(random), shift(random));
    nodes.push_back(x);
  }
  std::vector<Mesh<2>::Corners> cells;
  for (Index c = 0; c < boxes.n_cells(); ++c) cells.push_back(boxes.cell_nodes(c));
  model.mesh = std::make_shared<const Mesh<2>>(
      Mesh<2>::from_tables(std::move(nodes), std::move(cells), true));
  for (std::size_t p = 0; p < model.particles.x.size(); ++p)
    model.particles.cell[p] = model.mesh->locate(model.particles.x[p]).cell;
  return model;
}

#define LAHAR_INSTANTIATE(Dim)                              \
  template Vec<Dim> deformed<Dim>(const Vec<Dim>&, double); \
  template Model<Dim> lattice_block<Dim>(const BlockSize&); \
  template Model<Dim> deformed_block<Dim>(const BlockSize&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)

}  // namespace lahar
