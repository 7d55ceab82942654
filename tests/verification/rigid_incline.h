/// \file An elastic block on a rigid plane that cuts the mesh at any angle.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/verification/case.h"

namespace lahar::verification {

inline constexpr double pi = std::numbers::pi;
inline constexpr double g = 9.81;  ///< [m/s^2]

/// A block of 0.6 x 0.15 m on a plane that falls by `angle` along x, in cells of a grid that does
/// not know of it.
struct Incline {
  double angle, friction;
  double h = 0.05, end_time = 0.3;
  std::string analysis = R"("velocity_update": "pic")";
  double ramp = 0;      ///< [s] in which gravity grows; 0: it acts at once
  double cohesion = 0;  ///< [Pa]
  double level = 1.7;   ///< [m] of the block's upper end on the plane
  std::string cut_cells = "centres";
  bool by_default = false;  ///< other keys are as users have them

  /// A block as users have it.
  static Incline of_users(double angle, double friction) {
    return {.angle = angle,
            .friction = friction,
            .analysis = R"("preset": "lahar")",
            .cut_cells = "exact",
            .by_default = true};
  }

  double sine() const { return std::sin(angle); }
  double cosine() const { return std::cos(angle); }
  std::string place(double along, double above) const {
    return fmt::format("[{}, {}]", 0.4 + along * cosine() + above * sine(),
                       level - along * sine() + above * cosine());
  }
  std::string gravity() const {
    if (ramp == 0) return fmt::format("[0, {}]", -g);
    return fmt::format(R"({{"gravity": [0, {}], "ramping_time": {}}})", -g, ramp);
  }
  Model<2> model() const {
    const std::string text = fmt::format(
        R"({{
      "mesh": {{"structured": {{"cell_size": {}, "extent": [2.5, 2.5]}}}},
      "materials": [{{"type": "LinearElastic", "density": 2000, "youngs_modulus": 1e8,
                     "poisson_ratio": 0.2}}],
      "rigid_bodies": [{{"region": {{"half_space": {{"point": {}, "normal": [{}, {}]}}}},
                        "friction": {}, "cohesion": {}}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
        "cut_cells": "{}", "region": {{"polygon": {{"points": [{}, {}, {}, {}]}}}}}}}}],
      "external_loading_conditions": {{"gravity": {}}},
      "analysis": {{"mpm_scheme": "musl", "end_time": {}, {}}},
      "post_processing": {{"history_steps": 20}}}})",
        h, place(0, 0), sine(), cosine(), friction, cohesion, cut_cells, place(0, 0), place(0.6, 0),
        place(0.6, 0.15), place(0, 0.15), gravity(), end_time, analysis);
    return by_default ? model_by_default<2>(text) : model_of_text<2>(text);
  }
  /// Along the plane [m/s], and the time: all rows.
  struct Motion {
    std::vector<double> time, velocity;
    double friction = 0;  ///< impulse along the plane over that along its normal
  };
  Motion run() const {
    Motion motion;
    Observer observer;
    double mass = 0, along = 0, above = 0;
    observer.history = [&](const HistoryRow& row) {
      mass = row.mass;
      along = row.momentum[0] * cosine() - row.momentum[1] * sine();
      above = row.momentum[0] * sine() + row.momentum[1] * cosine();
      motion.time.push_back(row.time);
      motion.velocity.push_back(along / mass);
    };
    Simulation simulation(model(), {.threads = 1}, observer);
    simulation.run();
    const double t = motion.time.back();
    motion.friction = (mass * g * sine() * t - along) / (mass * g * cosine() * t + above);
    return motion;
  }
};

}  // namespace lahar::verification
