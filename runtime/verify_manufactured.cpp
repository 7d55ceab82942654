// Manufactured solutions: convergence of the displacement with the size of the cells.
#include "runtime/verify_manufactured.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "io/scenario.h"
#include "physics/error.h"
#include "runtime/console.h"
#include "runtime/simulation.h"
#include "runtime/verify_command.h"

namespace lahar {

namespace {

using std::numbers::pi;

/// Young's modulus [Pa], Poisson's ratio, density [kg/m^3] and what follows.
struct Solid {
  double E, nu, rho;
  double mu() const { return E / (2 * (1 + nu)); }
  double lambda() const { return E * nu / ((1 + nu) * (1 - 2 * nu)); }
  double c() const { return std::sqrt(E / rho); }
};

/// A motion: displacement u(X, t), velocity at t = 0 and the body force that it needs.
class AxisAligned {
 public:
  static constexpr Solid solid{1e4, 0.3, 1};
  static constexpr double side = 1;  // [m]
  explicit AxisAligned(double amplitude) : A_(amplitude) {}
  static bool at_rest(const Vec<2>&) { return false; }
  static double duration() { return 2 / solid.c(); }

  Vec<2> displacement(const Vec<2>& X, double t) const {
    Vec<2> u;
    for (int i = 0; i < 2; ++i)
      u[i] = A_ * std::sin(pi * X[i]) * std::sin(pi * (solid.c() * t + i));
    return u;
  }
  Vec<2> velocity(const Vec<2>& X) const {
    const double rate = A_ * pi * solid.c();
    return {rate * std::sin(pi * X[0]), -rate * std::sin(pi * X[1])};
  }
  /// b_i = pi^2 u_i (mu / rho - c^2 - (lambda (ln J - 1) - mu) / (rho F_ii^2)).
  Vec<2> body_force(const Vec<2>& X, double t) const {
    const Vec<2> u = displacement(X, t);
    Vec<2> F;
    for (int i = 0; i < 2; ++i)
      F[i] = 1 + A_ * pi * std::cos(pi * X[i]) * std::sin(pi * (solid.c() * t + i));
    const double mu = solid.mu(), rho = solid.rho;
    const double stretched = solid.lambda() * (std::log(F[0] * F[1]) - 1) - mu;
    Vec<2> b;
    for (int i = 0; i < 2; ++i)
      b[i] = pi * pi * u[i] * (mu / rho - solid.c() * solid.c() - stretched / (rho * F[i] * F[i]));
    return b;
  }

 private:
  double A_;
};

class Vortex {
 public:
  static constexpr Solid solid{1e3, 0.3, 1e3};
  static constexpr double inner = 0.75, outer = 1.25, side = 2.75;  // [m]
  static inline const Vec<2> centre{side / 2, side / 2};
  explicit Vortex(double amplitude) : A_(amplitude) {}
  static bool at_rest(const Vec<2>& X) {
    const double R = (X - centre).norm();
    return R < inner || R > outer;
  }
  static double duration() { return 1 / solid.c(); }

  Vec<2> displacement(const Vec<2>& X, double t) const {
    const Vec<2> r = X - centre;
    const double R = r.norm(), angle = turn(R, t);
    return Vec<2>(std::cos(angle) * r[0] - std::sin(angle) * r[1],
                  std::sin(angle) * r[0] + std::cos(angle) * r[1]) -
           r;
  }
  Vec<2> velocity(const Vec<2>& X) const {
    const Vec<2> r = X - centre;
    const double rate = A_ * solid.c() * pi * shape(r.norm());
    return {-rate * r[1], rate * r[0]};
  }
  /// Kamojjala et al. (2015), in the basis that has turned with the material.
  Vec<2> body_force(const Vec<2>& X, double t) const {
    const Vec<2> r = X - centre;
    if (at_rest(X)) return {0, 0};
    const double R = r.norm(), c = solid.c(), mu = solid.mu(), rho = solid.rho;
    const double p = 4 * R - 3, q = 4 * R - 5, s = std::sin(c * pi * t), k = std::cos(c * pi * t);
    const double radial = -A_ * A_ * R * c * c * pi * pi * k * k * std::pow(p * q, 4) +
                          4096 / rho * A_ * A_ * R * mu * s * s * (R - 1) * (R - 1) * p * p * q * q;
    const double tangential = -A_ * s *
                              (R * c * c * pi * pi * p * p * q * q +
                               64 * mu / rho * (96 * R * R * R - 240 * R * R + 188 * R - 45));
    const double theta = std::atan2(r[1], r[0]) + turn(R, t);
    return {radial * std::cos(theta) - tangential * std::sin(theta),
            radial * std::sin(theta) + tangential * std::cos(theta)};
  }

 private:
  static double shape(double R) {
    if (R < inner || R > outer) return 0;
    const double x = 16 * (R - 1) * (R - 1);
    return (1 - x) * (1 - x);
  }
  double turn(double R, double t) const { return A_ * std::sin(solid.c() * pi * t) * shape(R); }
  double A_;
};

/// The scenario but for motion and body force: a square of the solid between smooth walls.
std::string scenario_text(const ManufacturedCase& what, const Solid& solid, double side,
                          double dt) {
  const std::string functions =
      what.functions.empty() ? "" : fmt::format(R"("shape_functions": "{}",)", what.functions);
  return fmt::format(
      R"({{"mesh": {{"structured": {{"cell_size": {0}, "extent": [{1}, {1}]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": "left and right", "dir": "x", "velocity": 0}},
               {{"nset": "below and above", "dir": "y", "velocity": 0}}]}}}},
  "sets": {{"nodes": {{
    "left and right": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                                {{"half_space": {{"point": [{1}, 0], "normal": [-1, 0]}}}}]}},
    "below and above": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                                 {{"half_space": {{"point": [0, {1}], "normal": [0, -1]}}}}]}}}}}},
  "materials": [{{"type": "NeoHookean", "density": {2}, "youngs_modulus": {3},
                  "poisson_ratio": {4}}}],
  "particles": [{{"generator": {{"type": "region", "per_cell": {5}, "material": 0,
                                "region": {{"all": true}}}}}}],
  "analysis": {{{6} "mpm_scheme": "usl", "velocity_update": "{7}", "dt": {8}, "nsteps": 100000000}}}})",
      1.0 / what.cells, side, solid.rho, solid.E, solid.nu, what.per_cell, functions,
      what.update.empty() ? "flip" : what.update, dt);
}

/// Share of the time in which a longitudinal wave crosses a cell.
constexpr double courant = 0.2;
/// Times in a run at which the error is taken.
constexpr int samples = 16;

template <class Solution>
double error_of(const ManufacturedCase& what, const Solution& solution) {
  const Solid& solid = Solution::solid;
  const double wave = std::sqrt((solid.lambda() + 2 * solid.mu()) / solid.rho);
  const double longest = courant / (what.cells * wave);
  const Index every = static_cast<Index>(std::ceil(Solution::duration() / samples / longest));
  const double dt = Solution::duration() / static_cast<double>(samples * every);
  Scenario scenario = read_scenario_text(scenario_text(what, solid, Solution::side, dt), ".");
  Model<2> model = std::get<Model<2>>(std::move(scenario.model));
  model.particles.velocity.clear();
  Index moving = 0;
  for (const Vec<2>& X : model.particles.x) {
    model.particles.velocity.push_back(solution.velocity(X));
    moving += !Solution::at_rest(X);
  }
  model.body_force = [&](const Vec<2>& X, double t) { return solution.body_force(X, t); };
  Simulation<2> simulation(std::move(model), {.threads = what.threads});
  double largest = 0;
  for (int sample = 0; sample < samples; ++sample) {
    simulation.advance(every);
    const Frame frame = simulation.frame();
    const auto& u = frame.find("displacement")->values;
    double sum = 0;
    for (std::size_t p = 0; p < frame.id.size(); ++p) {
      const Vec<2> x(frame.coordinates[2 * p], frame.coordinates[2 * p + 1]);
      const auto stride = u.size() / frame.id.size();
      const Vec<2> moved(u[stride * p], u[stride * p + 1]);
      sum += (moved - solution.displacement(x - moved, simulation.time())).squaredNorm();
    }
    largest = std::max(largest, std::sqrt(sum / static_cast<double>(moving)) / what.amplitude);
  }
  return largest;
}

}  // namespace

double displacement_error(const ManufacturedCase& what) try {
  return what.motion == Motion::vortex ? error_of(what, Vortex(what.amplitude))
                                       : error_of(what, AxisAligned(what.amplitude));
} catch (const SimulationError&) {
  return std::numeric_limits<double>::infinity();
}

namespace {

struct Method {
  const char* name;
  const char* functions;
  const char* update;
};

constexpr Method methods[] = {
    {"linear, FLIP", "element", "flip"},
    {"GIMP, FLIP", "gimp", "flip"},
    {"quadratic B-splines, FLIP", "quadratic_spline", "flip"},
    {"quadratic B-splines, APIC", "quadratic_spline", "apic"},
    {"cubic B-splines, FLIP", "cubic_spline", "flip"},
    {"CPDI, FLIP", "cpdi", "flip"},
    {"CPDI2, FLIP", "cpdi2", "flip"},
};

constexpr int resolutions[] = {8, 16, 32, 64};

/// A row for each method, of what `base` says, up to base.cells.
void table(const char* title, const ManufacturedCase& base) {
  fmt::print("\n{}, {}x{} particles per cell\n\n  {:<28}", title, base.per_cell, base.per_cell,
             "cells per unit length");
  std::vector<ManufacturedCase> columns;
  for (const int cells : resolutions) {
    if (cells > base.cells) break;
    columns.push_back(base);
    columns.back().cells = cells;
    fmt::print("{:>10}", cells);
  }
  fmt::print("   orders\n");
  for (const Method& method : methods) {
    fmt::print("  {:<28}", method.name);
    std::vector<double> errors;
    for (ManufacturedCase& column : columns) {
      column.functions = method.functions;
      column.update = method.update;
      errors.push_back(displacement_error(column));
      fmt::print("{:>10.2e}", errors.back());
      std::fflush(stdout);
    }
    fmt::print("  ");
    for (std::size_t k = 1; k < errors.size(); ++k)
      if (std::isfinite(errors[k - 1]) && std::isfinite(errors[k]))
        fmt::print(" {:5.2f}", std::log2(errors[k - 1] / errors[k]));
      else
        fmt::print(" {:>5}", "-");
    fmt::print("\n");
  }
}

}  // namespace

bool verify_manufactured(const VerifyArguments& arguments) {
  fmt::print(
      "Manufactured solutions: largest root mean square error of the displacement over a run, "
      "over\n"
      "the amplitude, by cells per unit of length; then the orders from each to the next. USL,\n"
      "Courant number {}. \"inf\": the run broke down.\n",
      courant);
  const auto of = [&](Motion motion, int finest, double amplitude, int per_cell) {
    return ManufacturedCase{.motion = motion,
                            .cells = finest,
                            .amplitude = amplitude,
                            .functions = "",
                            .update = "",
                            .per_cell = per_cell,
                            .threads = arguments.threads};
  };
  table("Axis-aligned motion, A = 0.05 (Wallstedt and Guilkey 2008)",
        of(Motion::axis_aligned, 64, 0.05, 2));
  table("Generalised vortex, A = 0.2 rad (Kamojjala et al. 2015)", of(Motion::vortex, 64, 0.2, 3));
  // Shear strains up to 3: particles part, and most methods break down as cells get finer.
  table("Generalised vortex, A = 0.5 rad", of(Motion::vortex, 32, 0.5, 3));
  return true;
}

}  // namespace lahar
