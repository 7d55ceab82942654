/// \file Bodies that vibrate freely in one mode.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/verification/case.h"

namespace lahar::verification {

struct Vibration {
  double period;     ///< [s]
  double imbalance;  ///< of energy, over that at the beginning
  double kept;       ///< least sum of kinetic and strain energy, over the same
};

/// From the first time at which `momentum`, begun at its largest, is zero: a quarter.
inline Vibration vibrate(Model<2> model, int axis) {
  Vibration found{.period = 0, .imbalance = 0, .kept = 1};
  double energy = 0, before = 0, time = 0;  // kinetic, at first
  for (std::size_t p = 0; p < model.particles.x.size(); ++p)
    energy += 0.5 * model.materials[0].density * model.particles.volume[p] *
              model.particles.velocity[p].squaredNorm();
  Observer observer;
  observer.history = [&](const HistoryRow& row) {
    found.imbalance = std::max(found.imbalance, std::abs(row.balance) / energy);
    found.kept = std::min(found.kept, (row.kinetic + row.internal) / energy);
    const double now = row.momentum[static_cast<std::size_t>(axis)];
    if (found.period == 0 && row.step > 0 && now * before < 0)
      found.period = 4 * (time + (row.time - time) * before / (before - now));
    before = now;
    time = row.time;
  };
  Simulation simulation(std::move(model), {}, observer);
  simulation.run();
  return found;
}

}  // namespace lahar::verification
