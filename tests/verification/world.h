/// \file Cases against experiments: scenarios of the folder `world`, run with native defaults, and
/// how their numbers are compared with what was measured and with half the step and the cell.
#pragma once

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/verification/case.h"
#include "tests/verification/measures.h"

namespace lahar::verification {

/// How large the changes may be that follow from half the step and from half the cell.
constexpr double change_by_step = 0.02, change_by_cell = 0.05;

inline std::string world_file(const std::string& name) {
  return LAHAR_SOURCE_DIR "/tests/verification/world/" + name;
}

/// A case at one cell size [m; in 3D a list of three is possible] and share of the stable step.
struct Resolution {
  std::string cell;
  double safety;
};

/// The scenario `name` of the folder `world` with native defaults and `changes` as for --set.
template <int Dim>
Model<Dim> world_case(const std::string& name, const Resolution& at,
                      const std::vector<std::string>& changes = {}) {
  ScenarioOptions options;
  options.overrides.push_back("mesh.structured.cell_size=" + at.cell);
  options.overrides.push_back(fmt::format("analysis.time_step.safety={}", at.safety));
  options.overrides.insert(options.overrides.end(), changes.begin(), changes.end());
  Scenario scenario = read_scenario(world_file(name), options);
  return std::get<Model<Dim>>(std::move(scenario.model));
}

/// Ends a run whose step collapses: it would take hours, and what flies there is no result.
class StepGuard {
 public:
  explicit StepGuard(const Simulation& simulation) : least_(simulation.info().dt / 20) {}
  void check(const Simulation& simulation) const {
    if (const double dt = simulation.info().dt; dt < least_)
      throw std::runtime_error(fmt::format(
          "the step fell to {:.1e} s, a twentieth of the first one, at t = {:.3g} s after {} steps",
          dt, simulation.time(), simulation.step()));
  }

 private:
  double least_;  ///< [s]
};

/// Mean step so far [s].
inline double mean_step(const Simulation& simulation) {
  return simulation.time() / static_cast<double>(simulation.step());
}

/// Share of the particles that left the mesh.
inline double lost_share(const Simulation& simulation) {
  const SimulationInfo info = simulation.info();
  return static_cast<double>(info.removed) / static_cast<double>(info.particles + info.removed);
}

/// Collects the first number of the first gauge over time: means between its rows, in the middle.
inline Observer observe_gauge(Curve& curve) {
  Observer observer;
  observer.gauges = [&curve, before = 0.0](const GaugeRows& row) mutable {
    if (row.time > before) curve.add((before + row.time) / 2, row.values[0][0]);
    before = row.time;
  };
  return observer;
}

/// Take all steps, as long as the step does not collapse.
inline void run_to_end(Simulation& simulation) {
  const StepGuard guard(simulation);
  while (!simulation.finished()) {
    simulation.advance(200);
    guard.check(simulation);
  }
}

/// Numbers of a run, by name; empty where it failed.
using Numbers = std::map<std::string, double>;

/// A case at a step and a cell, at half the step, and at half the cell (with the same share of the
/// stable step, which is half then, too).
class Study {
 public:
  /// `run` takes a Resolution and returns Numbers. Without a `half_cell` it is not run with one.
  template <class Run>
  Study(std::string name, const Resolution& base, const std::string& half_cell, Run run)
      : name_(std::move(name)), at_{base, {base.cell, base.safety / 2}} {
    if (!half_cell.empty()) at_.push_back({half_cell, base.safety});
    found_.resize(at_.size());
    for (std::size_t i = 0; i < at_.size(); ++i) {
      const Resolution& at = at_[i];
      try {
        found_[i] = run(at);
      } catch (const std::exception& failure) {
        FAIL_CHECK(fmt::format("{}: cell {}, {} of the stable step: {}", name_, at.cell, at.safety,
                               failure.what()));
      }
    }
  }

  /// From the first run; not a number where it failed.
  double value(const std::string& number) const { return value(0, number); }
  /// From the run with that cell (and the larger step).
  double value(const std::string& number, const std::string& cell) const {
    return value(cell == at_.back().cell ? at_.size() - 1 : 0, number);
  }

  /// The number is within `low` and `high`, give or take a share `band` of them, in all runs.
  void agrees(const std::string& number, double low, double high, double band) const {
    for (std::size_t i = 0; i < found_.size(); ++i) {
      if (found_[i].empty()) continue;  // the failure was reported
      const double v = found_[i].at(number);
      const double error = v < low ? v / low - 1 : v > high ? v / high - 1 : 0;
      MESSAGE(fmt::format(
          "{}, {}: {}: {:.4g}, reference {}, error {:+.1f} %", name_, number, where(i), v,
          low == high ? fmt::format("{:.4g}", low) : fmt::format("{:.4g} to {:.4g}", low, high),
          100 * error));
      CHECK_MESSAGE(std::abs(error) <= band, fmt::format("{}, {}: {:+.1f} % off, allowed {:.0f} %",
                                                         name_, number, 100 * error, 100 * band));
    }
  }
  void agrees(const std::string& number, double reference, double band) const {
    agrees(number, reference, reference, band);
  }
  /// The number is at most `limit` in all runs.
  void stays_below(const std::string& number, double limit) const {
    for (std::size_t i = 0; i < found_.size(); ++i) {
      if (found_[i].empty()) continue;
      const double v = found_[i].at(number);
      MESSAGE(fmt::format("{}, {}: {}: {:.4g}, allowed {:.4g}", name_, number, where(i), v, limit));
      CHECK(v <= limit);
    }
  }

  /// Half the step and half the cell change the number by no more than is allowed; `scale` is what
  /// the change is a share of (0: the number itself).
  void converges(const std::string& number, double scale = 0, double step = change_by_step,
                 double cell = change_by_cell) const {
    check_change(1, "half the step", number, scale, step);
    if (at_.size() > 2) check_change(2, "half the cell", number, scale, cell);
  }

 private:
  double value(std::size_t run, const std::string& number) const {
    return found_[run].empty() ? std::nan("") : found_[run].at(number);
  }

  std::string where(std::size_t run) const {
    return fmt::format("cell {}, {} of the stable step", at_[run].cell, at_[run].safety);
  }

  void check_change(std::size_t run, const char* by, const std::string& number, double scale,
                    double allowed) const {
    const double base = value(0, number), changed = value(run, number);
    const double change = (changed - base) / (scale > 0 ? scale : std::abs(base));
    MESSAGE(fmt::format("{}, {}: {:.5g}, {:.5g} with {}, {:+.2f} %", name_, number, base, changed,
                        by, 100 * change));
    CHECK_MESSAGE(std::abs(change) <= allowed, fmt::format("{}, {}: {} changes it by {:+.2f} %",
                                                           name_, number, by, 100 * change));
  }

  std::string name_;
  std::vector<Resolution> at_;
  std::vector<Numbers> found_;
};

/// Share of sqrt(g height) that a grain still moves with, in the mean: a deposit is at rest where
/// this is small.
inline double unrest(const HistoryRow& row, double height) {
  return std::sqrt(2 * row.kinetic / row.mass) / std::sqrt(9.81 * height);
}

/// Write a curve for world_figures.py into the folder that LAHAR_WORLD_OUTPUT names, if it is set.
inline void keep_curve(const std::string& name, const Resolution& at, const Curve& curve) {
  const char* folder = std::getenv("LAHAR_WORLD_OUTPUT");
  if (!folder) return;
  std::filesystem::create_directories(folder);
  std::string cell = at.cell.substr(0, at.cell.find(','));
  cell.erase(std::remove(cell.begin(), cell.end(), '['), cell.end());
  std::ofstream out(std::filesystem::path(folder) /
                    fmt::format("{}-cell{}-safety{}.csv", name, cell, at.safety));
  for (std::size_t i = 0; i < curve.x.size(); ++i)
    out << fmt::format("{:.6g},{:.6g}\n", curve.x[i], curve.y[i]);
}

}  // namespace lahar::verification
