#include "runtime/bench/bench_cases.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "io/base/problems.h"
#include "io/scenario/scenario.h"
#include "physics/mesh/element_grid.h"
#include "runtime/terminal/console.h"
#include "runtime/verify/verify_plate.h"

namespace lahar {

namespace {

constexpr int per_cell(int dim) {
  return dim == 2 ? 4 : 2;
}

/// [m/s] divided by the step's cells per second; the components add to one.
template <int Dim>
Vec<Dim> direction() {
  if constexpr (Dim == 2)
    return {0.55, 0.45};
  else
    return {0.4, 0.27, 0.33};
}

/// Cells below and above the block: free space, and above room for its flight. Multiples of the
/// edge of a patch, so that the smallest block is one patch.
struct Margins {
  Index below, above;
};

Margins margins(const BlockSize& size) {
  if (size.mesh_cells > 0) {
    const Index below = (size.mesh_cells - size.cells) / 2;
    return {below, size.mesh_cells - size.cells - below};
  }
  constexpr Index patch = 16;  // in 3D 8
  const auto end = size.cells + static_cast<Index>(crossings_per_step * flight_steps);
  return {patch, patch - end % patch + end - size.cells};
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
constexpr double sliding_speed = 1.0;  // [m/s], a cell in 80 steps

std::string block_scenario(int dim, const BlockSize& size) {
  const auto [below, above] = margins(size);
  const Index end = below + size.cells;
  return fmt::format(
      R"({{"title": "Block of linear elastic material",
  "mesh": {{"structured": {{"cell_size": 1, "counts": [{}]}}}},
  "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1,
                  "poisson_ratio": 0.3}}],
  "particles": [{{"generator": {{"type": "region", "per_cell": {}, "material": 0,
                                "velocity": [{}],
                                "region": {{"box": {{"min": [{}], "max": [{}, {}]}}}}}}}}],
  "analysis": {{"mpm_scheme": "usl", "shape_functions": "element", "velocity_update": "flip",
               "dt": {}, "nsteps": 1}}}})",
      repeated(end + above, dim), per_cell(dim), repeated(1e-6, dim), repeated(below, dim),
      static_cast<double>(below) + size.filled * static_cast<double>(size.cells),
      repeated(end, dim - 1), block_step);
}

/// Turn (a, b) about the origin: at the radius `rim` and beyond not at all, inside by `turns`.
void swirl(double& a, double& b, double rim, double turns) {
  const double distance = std::hypot(a, b) / rim;
  const double fall = std::max(0.0, 1.0 - distance * distance);
  const double angle = 2 * std::numbers::pi * turns * fall * fall;
  const double c = std::cos(angle), s = std::sin(angle), old = a;
  a = c * old - s * b;
  b = s * old + c * b;
}

}  // namespace

Index BlockSize::particles(int dim) const {
  double n = filled;
  for (int d = 0; d < dim; ++d) n *= static_cast<double>(cells * per_cell(dim));
  return std::llround(n);
}

template <int Dim>
Vec<Dim> deformed(const Vec<Dim>& x, double edge) {
  constexpr double turns = 1.25;
  Vec<Dim> y = x;
  if constexpr (Dim == 2) {
    swirl(y[0], y[1], edge / 2, turns);
    const Vec<2> quarter(std::copysign(edge / 4, y[0]), std::copysign(edge / 4, y[1]));
    y -= quarter;
    swirl(y[0], y[1], edge / 4, turns);
    y += quarter;
  } else {  // turns also depend on the place along the axis: layers shear against each other
    swirl(y[0], y[1], edge / 2, turns * (1 + y[2] / edge));
    swirl(y[1], y[2], edge / 2, turns * (1 + y[0] / edge));
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
Model<Dim> stacked_block(const BlockSize& size, int bodies) {
  Model<Dim> model = lattice_block<Dim>(size);
  model.analysis.scheme = Scheme::musl;
  model.analysis.functions = ShapeFunctions::quadratic_spline;
  model.analysis.contact = {.bodies = bodies, .friction = 0.3};
  model.materials.push_back(model.materials[0]);
  model.materials[1].body = bodies - 1;
  const double middle =
      static_cast<double>(margins(size).below) + 0.5 * static_cast<double>(size.cells);
  ParticleTable<Dim>& particles = model.particles;
  for (std::size_t p = 0; p < particles.x.size(); ++p)
    particles.material[p] = particles.x[p][1] > middle ? 1 : 0;
  return model;
}

template <int Dim>
Model<Dim> element_block(const BlockSize& size, Element element) {
  constexpr double beside = 0.07;  // [m]
  Model<Dim> model = lattice_block<Dim>(size);
  auto tables = element_grid<Dim>(element, model.mesh->bounds().first, Vec<Dim>::Ones(),
                                  model.mesh->counts());
  model.mesh = std::make_shared<const Mesh<Dim>>(
      Mesh<Dim>::from_tables(std::move(tables.nodes), element, tables.cells, true));
  ParticleTable<Dim>& particles = model.particles;
  for (std::size_t p = 0; p < particles.x.size(); ++p) {
    particles.x[p][0] += beside;
    particles.cell[p] = model.mesh->locate(particles.x[p]).cell;
  }
  return model;
}

template <int Dim>
Model<Dim> deformed_block(const BlockSize& size) {
  Model<Dim> model = lattice_block<Dim>(size);
  const auto edge = static_cast<double>(size.cells);
  const Vec<Dim> middle = Vec<Dim>::Constant(static_cast<double>(margins(size).below) + 0.5 * edge);
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

Model<3> soil_block(const BlockSize& size, SoilState state) {
  Model<3> model = lattice_block<3>(size);
  const double pressure = 1e-3, rate = 1e-3;  // [Pa], [1/s]: an elastic strain of 1e-3, 1e-5 a step
  model.materials[0].law = MohrCoulomb{.youngs_modulus = 1,
                                       .poisson_ratio = 0.3,
                                       .friction = 30,
                                       .dilation = 5,
                                       .cohesion = state == SoilState::yielding ? 1e-4 : 1.0,
                                       .tension_cutoff = 0};
  // Mohr's circle touches the line: shear c cos(phi) + p sin(phi) on a pressure that is the same in
  // all directions.
  const double shear = 1e-4 * std::cos(std::numbers::pi / 6) + 0.5 * pressure;
  ParticleTable<3>& particles = model.particles;
  particles.stress.assign(particles.x.size(), {-pressure, -pressure, -pressure, shear, 0, 0});
  for (std::size_t p = 0; p < particles.x.size(); ++p)
    particles.velocity[p] = {rate * particles.x[p][1], 0, 0};
  return model;
}

template <int Dim>
Model<Dim> collapse() {
  const char* column = R"({"title": "Column of sand",
  "mesh": {"structured": {"cell_size": 0.005, "counts": [80, 32]},
           "boundary_conditions": {"velocity_constraints": [
             {"nset": "middle", "dir": "x", "velocity": 0},
             {"nset": "floor", "dir": "x", "velocity": 0},
             {"nset": "floor", "dir": "y", "velocity": 0}]}},
  "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
                     "middle": {"half_space": {"point": [0, 0], "normal": [1, 0]}}}},
  "materials": [{"type": "MohrCoulomb", "density": 1600, "youngs_modulus": 1e6,
                 "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 0,
                 "tension_cutoff": 0}],
  "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                               "region": {"box": {"min": [0, 0], "max": [0.1, 0.1]}}}}],
  "external_loading_conditions": {"gravity": [0, -9.81]},
  "analysis": {"nsteps": 6000}})";
  const char* cliff = R"({"title": "Cliff of soil",
  "mesh": {"structured": {"cell_size": 4, "counts": [30, 10, 16]},
           "boundary_conditions": {"velocity_constraints": [
             {"nset": "back", "dir": "x", "velocity": 0},
             {"nset": "sides", "dir": "y", "velocity": 0},
             {"nset": "floor", "dir": "x", "velocity": 0},
             {"nset": "floor", "dir": "y", "velocity": 0},
             {"nset": "floor", "dir": "z", "velocity": 0}]}},
  "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}},
                     "back": {"half_space": {"point": [0, 0, 0], "normal": [1, 0, 0]}},
                     "sides": {"union": [
                       {"half_space": {"point": [0, 0, 0], "normal": [0, 1, 0]}},
                       {"half_space": {"point": [0, 40, 0], "normal": [0, -1, 0]}}]}}},
  "materials": [{"type": "MohrCoulomb", "density": 1900, "youngs_modulus": 3e7,
                 "poisson_ratio": 0.3, "friction": 24, "dilation": 0, "cohesion": 2000,
                 "tension_cutoff": 0}],
  "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                               "region": {"box": {"min": [0, 0, 0], "max": [40, 40, 40]}}}}],
  "external_loading_conditions": {"gravity": [0, 0, -9.81]},
  "analysis": {"nsteps": 300}})";
  Model<Dim> model = std::get<Model<Dim>>(read_scenario_text(Dim == 2 ? column : cliff, ".").model);
  model.analysis.nsteps = endless;
  return model;
}

Model<3> sliding_block(Index length, bool moves) {
  const std::string text = fmt::format(
      R"({{"title": "Sliding block",
  "mesh": {{"structured": {{"cell_size": 1, "counts": [{0}, {1}, {1}]}}}},
  "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1,
                  "poisson_ratio": 0.3}}],
  "particles": [{{"generator": {{"type": "region", "per_cell": {2}, "material": 0,
                                "velocity": [{3}, 0, 0],
                                "region": {{"box": {{"min": [0, 0, 0], "max": [{4}, {1}, {1}]}}}}}}}}],
  "analysis": {{"mpm_scheme": "usl", "shape_functions": "element", "velocity_update": "flip",
               "dt": {5}, "nsteps": {6}}}}})",
      2 * length, length / 2, per_cell(3), moves ? sliding_speed : 0.0, length, block_step,
      sliding_steps(length));
  return std::get<Model<3>>(read_scenario_text(text, ".").model);
}

Index sliding_steps(Index length) {
  // It stops short of the wall by a cell.
  return static_cast<Index>(static_cast<double>(length - 1) / (sliding_speed * block_step));
}

Index sliding_particles(Index length) {
  return length * (length / 2) * (length / 2) * 8;
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

#define LAHAR_INSTANTIATE(Dim)                                       \
  template Vec<Dim> deformed<Dim>(const Vec<Dim>&, double);          \
  template Model<Dim> lattice_block<Dim>(const BlockSize&);          \
  template Model<Dim> stacked_block<Dim>(const BlockSize&, int);     \
  template Model<Dim> collapse<Dim>();                               \
  template Model<Dim> element_block<Dim>(const BlockSize&, Element); \
  template Model<Dim> deformed_block<Dim>(const BlockSize&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)

}  // namespace lahar
