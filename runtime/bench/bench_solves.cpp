#include "runtime/bench/bench_solves.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>
#include <vector>

#include "io/scenario/scenario.h"
#include "runtime/bench/bench_cases.h"

namespace lahar {

namespace {

/// "a, a" or "a, a, a".
std::string repeated(const auto& value, int dim) {
  std::string text = fmt::format("{}", value);
  for (int d = 1; d < dim; ++d) text += fmt::format(", {}", value);
  return text;
}

/// Along the last axis.
std::string upwards(double value, int dim) {
  return repeated(0, dim - 1) + fmt::format(", {}", value);
}

template <int Dim>
Model<Dim> model_of(const std::string& scenario) {
  Model<Dim> model = std::get<Model<Dim>>(read_scenario_text(scenario, ".").model);
  model.analysis.nsteps = endless;
  return model;
}

/// A set of the nodes at one side of a box from the origin to `edges`, and what holds them there.
struct Side {
  int axis;
  bool high;
  std::string name() const { return fmt::format("{}{}", high ? "high" : "low", axis); }
  std::string set(const std::vector<Index>& edges) const {
    std::string point, normal;
    for (int d = 0; d < static_cast<int>(edges.size()); ++d) {
      const char* comma = d > 0 ? ", " : "";
      point +=
          fmt::format("{}{}", comma, d == axis && high ? edges[static_cast<std::size_t>(d)] : 0);
      normal += fmt::format("{}{}", comma, d == axis ? (high ? -1 : 1) : 0);
    }
    return fmt::format(R"("{}": {{"half_space": {{"point": [{}], "normal": [{}]}}}})", name(),
                       point, normal);
  }
  std::string held(int direction) const {
    return fmt::format(R"({{"nset": "{}", "dir": {}, "velocity": 0}})", name(), direction);
  }
};

}  // namespace

template <int Dim>
Model<Dim> implicit_block(const BlockSize& size) {
  const Side floor{Dim - 1, false};
  std::vector<std::string> held;
  for (int d = 0; d < Dim; ++d) held.push_back(floor.held(d));
  return model_of<Dim>(fmt::format(
      R"({{"title": "Block on a floor",
  "mesh": {{"structured": {{"cell_size": 1, "counts": [{0}, {1}]}},
            "boundary_conditions": {{"velocity_constraints": [{2}]}}}},
  "sets": {{"nodes": {{{4}}}}},
  "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e9,
                  "poisson_ratio": 0.3}}],
  "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                "region": {{"box": {{"min": [{3}], "max": [{5}]}}}}}}}}],
  "external_loading_conditions": {{"gravity": [{6}]}},
  "analysis": {{"mpm_scheme": "newmark", "shape_functions": "element", "dt": 0.05, "nsteps": 1,
               "linear_solver": {{"solver_type": "IterativeEigen"}}}}}})",
      repeated(size.cells, Dim - 1), size.cells + 2, fmt::join(held, ", "), repeated(0, Dim),
      floor.set(std::vector<Index>(Dim, size.cells)), repeated(size.cells, Dim),
      upwards(-9.81, Dim)));
}

template <int Dim>
Model<Dim> projected_dam(const BlockSize& size) {
  std::vector<Index> tank(Dim, size.cells);
  tank.front() *= 2;
  std::vector<Side> sides{{Dim - 1, false}};
  for (int d = 0; d + 1 < Dim; ++d) sides.insert(sides.end(), {{d, false}, {d, true}});
  std::vector<std::string> held, sets;
  for (const Side& side : sides) {
    held.push_back(side.held(side.axis));
    sets.push_back(side.set(tank));
  }
  std::vector<Index> counts = tank;
  counts.back() += 8;
  return model_of<Dim>(fmt::format(
      R"({{"title": "Dam of water",
  "mesh": {{"structured": {{"cell_size": 1, "counts": [{0}]}},
            "boundary_conditions": {{"velocity_constraints": [{1}]}}}},
  "sets": {{"nodes": {{{2}}}}},
  "materials": [{{"type": "Newtonian", "density": 1000, "bulk_modulus": 2e9,
                  "dynamic_viscosity": 1e-3}}],
  "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                "region": {{"box": {{"min": [{3}], "max": [{4}]}}}}}}}}],
  "external_loading_conditions": {{"gravity": [{5}]}},
  "analysis": {{"mpm_scheme": "projection", "shape_functions": "element", "dt": 0.01, "nsteps": 1,
               "linear_solver": {{"solver_type": "IterativeEigen"}}}}}})",
      fmt::join(counts, ", "), fmt::join(held, ", "), fmt::join(sets, ", "), repeated(0, Dim),
      repeated(size.cells, Dim), upwards(-9.81, Dim)));
}

template <int Dim>
Model<Dim> pore_block(const BlockSize& size, PoreState state) {
  constexpr Index margin = 4;
  return model_of<Dim>(fmt::format(
      R"({{"title": "Block of soil",
  "mesh": {{"structured": {{"cell_size": 1, "counts": [{0}]}}}},
  "materials": [{{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1,
                  "poisson_ratio": 0.3, "porosity": 0.4, "k_x": 1e-3}},
                {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1,
                  "dynamic_viscosity": 1e-3}}],
  "particles": [{{"generator": {{"type": "region", "per_cell": {1}, "material": {2},
                                "velocity": [{3}],
                                "region": {{"box": {{"min": [{4}], "max": [{5}]}}}}}}}}],
  "analysis": {{"mpm_scheme": "usl", "shape_functions": "element", "velocity_update": "flip",
               "dt": 0.0125, "nsteps": 1}}}})",
      repeated(size.cells + 2 * margin, Dim), Dim == 2 ? 4 : 2,
      state == PoreState::full ? R"(["soil", "water"])" : R"("soil")", repeated(1e-6, Dim),
      repeated(margin, Dim), repeated(margin + size.cells, Dim)));
}

#define LAHAR_INSTANTIATE(Dim)                               \
  template Model<Dim> implicit_block<Dim>(const BlockSize&); \
  template Model<Dim> projected_dam<Dim>(const BlockSize&);  \
  template Model<Dim> pore_block<Dim>(const BlockSize&, PoreState);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
