// Mandel's problem (Mandel 1953; series of Cheng and Detournay 1988): a saturated slab between
// rigid smooth plates, under a constant load, drains at its sides. These give way first, the middle
// takes their part of the load, and its pore pressure rises before it falls (the Mandel-Cryer
// effect).
//
// The upper plate is given the settlement of the series. What is computed are the pore pressures,
// and the load on the plate, which has to be constant. Damping takes the swings that the sudden
// drainage starts; it is far too weak to hold the slow motion of the slab.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double youngs_modulus = 1e7, nu = 0.2, porosity = 0.4;  // [Pa], [-]
constexpr double conductivity = 3e-5, load = 1e4;  // [m/s], mean stress of the plates [Pa]
constexpr double shear = youngs_modulus / (2 * (1 + nu));
constexpr double bulk = youngs_modulus / (3 * (1 - 2 * nu));

/// The solution for water of a bulk modulus, which may be infinite [Pa]. Lengths are in half widths
/// of 1 m, T is time times `consolidation`.
class Series {
 public:
  explicit Series(double water_modulus) {
    const double compliance = porosity / water_modulus;    // of the pores
    const double stiffness = 1 / (1 + bulk * compliance);  // of the water, over that of both
    const double ratio = shear * compliance * stiffness;   // shear over undrained bulk modulus
    nu_u_ = (3 - 2 * ratio) / (2 * (3 + ratio));
    initial_ = load * stiffness * (1 + nu_u_) / 3;
    consolidation_ = conductivity / 9810 / (compliance + 1 / (bulk + 4.0 / 3.0 * shear));
    find_roots();
  }
  double undrained_poisson() const { return nu_u_; }
  double initial_pressure() const { return initial_; }
  double consolidation() const { return consolidation_; }  ///< [m^2/s]

  /// Over the initial one.
  double pressure(double x, double T) const {
    return 2 * sum(T, [&](double a) { return std::cos(a * x) - std::cos(a); });
  }
  /// Settlement over the height; (1 - nu_u) load / (2 shear) before anything drains.
  double settlement(double T) const {
    return load / shear *
           ((1 - nu) / 2 - (1 - nu_u_) * sum(T, [](double a) { return std::cos(a); }));
  }

 private:
  /// tan a = (1 - nu) / (nu_u - nu) a
  void find_roots() {
    const auto value = [&](double a) {
      return std::sin(a) - (1 - nu) / (nu_u_ - nu) * a * std::cos(a);
    };
    for (int i = 0; i < 400; ++i) {
      double low = i * std::numbers::pi + 1e-9, high = (i + 0.5) * std::numbers::pi;
      const double sign = value(high);
      for (int k = 0; k < 100; ++k) {
        const double middle = 0.5 * (low + high);
        (value(middle) * sign > 0 ? high : low) = middle;
      }
      roots_.push_back(low);
    }
  }
  /// sum_i f(a_i) sin a_i / (a_i - sin a_i cos a_i) exp(-a_i^2 T)
  double sum(double T, auto&& f) const {
    double all = 0;
    for (const double a : roots_)
      all += f(a) * std::sin(a) / (a - std::sin(a) * std::cos(a)) * std::exp(-a * a * T);
    return all;
  }

  double nu_u_, initial_, consolidation_;
  std::vector<double> roots_;
};

struct Slab {
  int cells = 10;  ///< in half of the width, 1 m
  double safety = 0.4;
  std::string scheme = "musl", functions = "element";
  double dt = 0;  ///< [s] of a projection, whose water keeps its volume; 0 = explicit steps

  Series series() const {
    return Series(dt > 0 ? std::numeric_limits<double>::infinity() : explicit_modulus);
  }
  std::string name() const {
    return dt > 0 ? fmt::format("projection, {} s", dt)
                  : fmt::format("{}, {}, {}", scheme, functions, safety);
  }
  static constexpr double explicit_modulus = 1e8;  ///< [Pa]
};

constexpr int layers = 2;  // the solution does not depend on the height

Model<2> model_of(const Slab& slab) {
  const double h = 1.0 / slab.cells;
  const Series series = slab.series();
  const std::string steps = slab.dt > 0
                                ? fmt::format(R"("mpm_scheme": "projection", "dt": {})", slab.dt)
                                : fmt::format(R"("mpm_scheme": "{}", "shape_functions": "{}",
                                   "time_step": {{"safety": {}}})",
                                              slab.scheme, slab.functions, slab.safety);
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {0}, "counts": [{1}, {2}]}},
      "particles_pore_pressures": {{"type": "isotropic", "values": {3}}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "middle", "dir": "x", "velocity": 0}},
        {{"nset": "base", "dir": "y", "velocity": 0}},
        {{"nset": "plate", "dir": "y", "velocity": -1}}]}}}},
    "sets": {{"nodes": {{
      "middle": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
      "base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "plate": {{"half_space": {{"point": [0, {4}], "normal": [0, -1]}}}}}}}},
    "materials": [
      {{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": {5},
       "poisson_ratio": {6}, "porosity": {7}, "k_x": {8}}},
      {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": {9},
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, 0], "max": [1, {4}]}}}}}}}}],
    "analysis": {{"preset": "lahar", {10}, "end_time": 100,
                 "damping": {{"type": "Viscous", "damping_factor": 40}}}}}})",
      h, slab.cells + 2, layers, series.initial_pressure(), layers * h, youngs_modulus, nu,
      porosity, conductivity, Slab::explicit_modulus, steps));
  // Before anything drains: total stresses are 0 along x, -load along y, and nu_u of it across.
  const double p = series.initial_pressure();
  model.particles.stress.assign(model.particles.x.size(),
                                Voigt{p, p - load, p - series.undrained_poisson() * load, 0, 0, 0});
  return model;
}

/// The plate moves with the series, by pieces that are short at first.
class Plate {
 public:
  explicit Plate(const Slab& slab)
      : series_(slab.series()), model_(model_of(slab)), height_(layers * 1.0 / slab.cells) {}

  /// Go on to time T over width^2 / c.
  State run_to(double T) {
    while (piece_ < pieces && time_of(piece_) < T - 1e-12) {
      const double to = time_of(++piece_) / series_.consolidation();
      const double velocity = (settled_ - series_.settlement(time_of(piece_))) / (to - time());
      move(velocity * height_);
      model_.analysis.end_time = to;
      const double from = time();
      auto next = simulation_ ? std::make_unique<Simulation>(model_, ExecutionOptions{}, Observer{},
                                                             simulation_->state())
                              : std::make_unique<Simulation>(model_);
      simulation_ = std::move(next);
      simulation_->run();
      settled_ -= velocity * (time() - from);  // fixed steps may end a little later
    }
    return State(simulation_->frame());
  }

 private:
  static constexpr int pieces = 100;
  static constexpr double last = 0.25;
  double time() const { return simulation_ ? simulation_->time() : 0; }  ///< [s]
  static double time_of(int piece) { return last * piece * piece / (pieces * pieces); }

  void move(double velocity) {
    for (auto* list : {&entries_of<NodeVelocity>(model_), &model_.liquid_velocities})
      for (NodeVelocity& entry : *list)
        if (entry.velocity != 0) entry.velocity = velocity;
  }

  Series series_;
  Model<2> model_;
  double height_;  ///< of the slab [m]
  int piece_ = 0;
  double settled_ = series_.settlement(0);  ///< over the height
  std::unique_ptr<Simulation> simulation_;
};

void check_slab(const Slab& slab) {
  CAPTURE(slab.cells);
  CAPTURE(slab.name());
  const Series series = slab.series();
  Plate plate(slab);
  const double h = 1.0 / slab.cells;
  double highest = 0;
  for (const double T : {0.01, 0.0225, 0.04, 0.0625, 0.09, 0.16, 0.25}) {
    CAPTURE(T);
    const State state = plate.run_to(T);
    const double now = state.time() * series.consolidation();
    const auto total = [&](Index p) {
      return state.get("stress", p, 1) - state.get("pore_pressure", p);
    };
    const auto all = [](Index) { return true; };
    const double on_plate = -mean(state, all, total) / load;
    double centre = 0, largest = 0;
    for (Index p = 0; p < state.size(); ++p) {
      const double x = state.x(p, 0) - state.get("displacement", p, 0);
      const double ratio = state.get("pore_pressure", p) / series.initial_pressure();
      const double error = ratio - series.pressure(x, now);
      if (x < 1 - h) largest = std::max(largest, std::abs(error));
      if (x < h) centre = std::abs(error) > std::abs(centre) ? error : centre;
      if (x < h) highest = std::max(highest, ratio);
    }
    MESSAGE(fmt::format(
        "{} cells, {}: T = {:.3f}: centre {:.4f} {:+.4f}, largest error {:.4f}, "
        "load {:.4f}",
        slab.cells, slab.name(), now, series.pressure(0, now), centre, largest, on_plate));
    CHECK(std::abs(centre) < (slab.dt > 0 ? 0.025 : 0.02));
    CHECK(std::abs(on_plate - 1) < 0.02);
  }
  CHECK(highest > 1.08);  // the series: 1.097 at T = 0.064
}

}  // namespace

TEST_CASE("Mandel's slab: the pressure in its middle rises by a tenth before it falls") {
  check_slab({});
  check_slab({.safety = 0.2});
  check_slab({.cells = 20});
  check_slab({.scheme = "usl"});
  check_slab({.functions = "quadratic_spline"});
}

TEST_CASE("Mandel's slab, by projections, whose water keeps its volume") {
  check_slab({.dt = 4e-4});
  check_slab({.dt = 2e-4});
  check_slab({.cells = 20, .dt = 4e-4});
}
