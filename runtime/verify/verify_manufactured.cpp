// Manufactured solutions: convergence of the displacement with the size of the cells.
#include "runtime/verify/verify_manufactured.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "io/scenario/scenario.h"
#include "physics/base/error.h"
#include "runtime/step/simulation.h"
#include "runtime/terminal/console.h"
#include "runtime/verify/verify_command.h"

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
  /// The particles of the scenario, which fill the square, are its own.
  static void place(const ManufacturedCase&, Model<2>&) {}
  static double duration() { return 2 / solid.c(); }

  Vec<2> displacement(const Vec<2>& X, double t) const {
    Vec<2> u;
    for (int i = 0; i < 2; ++i)
      u[i] = A_ * std::sin(pi * X[i]) * std::sin(pi * (solid.c() * t + i));
    return u;
  }
  Vec<2> velocity(const Vec<2>& X, double t) const {
    const double rate = A_ * pi * solid.c() * std::cos(pi * solid.c() * t);
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
  static double duration() { return 1 / solid.c(); }

  /// Particles in rows along circles, about as far from each other as `what` says. Shear by 7 moves
  /// rows past each other, and they stay as close as they were; particles of a square lattice part
  /// where its shortest vectors are squeezed, and its edges are stairs that turn the ring.
  static void place(const ManufacturedCase& what, Model<2>& model) {
    ParticleTable<2>& particles = model.particles;
    particles = {};
    const double width = outer - inner;
    const long rows = std::lround(width * what.cells * what.per_cell);
    const double across = width / static_cast<double>(rows);
    for (long row = 0; row < rows; ++row) {
      const double R = inner + (static_cast<double>(row) + 0.5) * across;
      const double along = 2 * pi * R / across;
      const long count = 4 * std::lround(along / 4);  // the same in each quarter
      for (long k = 0; k < count; ++k) {
        const double theta = 2 * pi * (static_cast<double>(k) + 0.5) / static_cast<double>(count);
        const Vec<2> X = centre + R * Vec<2>(std::cos(theta), std::sin(theta));
        particles.x.push_back(X);
        particles.cell.push_back(model.mesh->locate(X).cell);
        particles.volume.push_back(2 * pi * R * across / static_cast<double>(count));
        particles.material.push_back(0);
      }
    }
  }

  Vec<2> displacement(const Vec<2>& X, double t) const {
    const Vec<2> r = X - centre;
    const double R = r.norm(), angle = turn(R, t);
    return Vec<2>(std::cos(angle) * r[0] - std::sin(angle) * r[1],
                  std::sin(angle) * r[0] + std::cos(angle) * r[1]) -
           r;
  }
  Vec<2> velocity(const Vec<2>& X, double t) const {
    const Vec<2> r = X + displacement(X, t) - centre;
    const double rate = A_ * solid.c() * pi * std::cos(solid.c() * pi * t) * shape(r.norm());
    return {-rate * r[1], rate * r[0]};
  }
  /// Kamojjala et al. (2015), in the basis that has turned with the material.
  Vec<2> body_force(const Vec<2>& X, double t) const {
    const Vec<2> r = X - centre;
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
  "analysis": {{{6} "mpm_scheme": "{9}", "velocity_update": "{7}", "dt": {8}, "nsteps": 100000000}}}})",
      1.0 / what.cells, side, solid.rho, solid.E, solid.nu, what.per_cell, functions,
      what.update.empty() ? "flip" : what.update, dt, what.scheme);
}

/// Times in a run at which the error is taken.
constexpr int samples = 16;

template <class Solution>
double error_of(const ManufacturedCase& what, const Solution& solution) {
  const Solid& solid = Solution::solid;
  const double wave = std::sqrt((solid.lambda() + 2 * solid.mu()) / solid.rho);
  const double longest = what.courant / (what.cells * wave);
  const Index every = static_cast<Index>(std::ceil(Solution::duration() / samples / longest));
  const double dt = Solution::duration() / static_cast<double>(samples * every);
  Scenario scenario = read_scenario_text(scenario_text(what, solid, Solution::side, dt), ".");
  Model<2> model = std::get<Model<2>>(std::move(scenario.model));
  Solution::place(what, model);
  // Velocities are those of the middle of a step.
  model.particles.velocity.clear();
  for (const Vec<2>& X : model.particles.x)
    model.particles.velocity.push_back(solution.velocity(X, -0.5 * dt));
  model.body_force = [&](const Vec<2>& X, double t) { return solution.body_force(X, t); };
  Simulation simulation(std::move(model), {.threads = what.threads});
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
    largest =
        std::max(largest, std::sqrt(sum / static_cast<double>(frame.id.size())) / what.amplitude);
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
  const char* scheme = "usl";
};

constexpr Method methods[] = {
    // At free edges nodes with hardly any mass get large velocities, which break USL, not MUSL.
    {"linear, FLIP", "element", "flip"},
    {"linear, FLIP, MUSL", "element", "flip", "musl"},
    {"GIMP, FLIP", "gimp", "flip"},
    {"uniform GIMP, FLIP", "uniform_gimp", "flip"},
    {"quadratic B-splines, FLIP", "quadratic_spline", "flip"},
    {"quadratic B-splines, APIC", "quadratic_spline", "apic"},
    {"cubic B-splines, FLIP", "cubic_spline", "flip"},
    {"CPDI, FLIP", "cpdi", "flip"},
    {"CPDI2, FLIP", "cpdi2", "flip"},
};

constexpr int resolutions[] = {8, 16, 32, 64};

/// A row for each method, of what `base` says, up to base.cells.
void table(const char* title, const ManufacturedCase& base) {
  fmt::print("\n{}, {}x{} particles per cell, Courant number {}\n\n  {:<28}", title, base.per_cell,
             base.per_cell, base.courant, "cells per unit length");
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
      column.scheme = method.scheme;
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
      "the amplitude, by cells per unit of length; then the orders from each to the next. USL but\n"
      "for one row; the Courant number is that of the undeformed solid. \"inf\": the run broke "
      "down.\n");
  ManufacturedCase base{.cells = 64, .amplitude = 0.05, .functions = "", .update = ""};
  base.threads = arguments.threads;
  table("Axis-aligned motion, A = 0.05 (Wallstedt and Guilkey 2008)", base);
  base.motion = Motion::vortex;
  base.per_cell = 3;
  base.amplitude = 0.2;
  table("Generalised vortex, A = 0.2 rad (Kamojjala et al. 2015)", base);
  base.cells = 32;
  base.amplitude = 1;
  base.courant = vortex_courant;
  table("Generalised vortex, A = 1 rad", base);
  return true;
}

}  // namespace lahar
