/// \file Particles that a stage removes little by little, so that what they leave is not shaken.
///
/// Mass and volume of such a particle fall linearly to zero, and with them its weight, the forces
/// of its stress, and its stiffness: excavation in infinitely many lifts. Stress, density and state
/// stay, so that its law and the speed of its waves do not notice. At the end it is removed.
/// Bits of Particles::loads behind those of loads and velocities (loads.h) say who goes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "physics/particles/patch.h"

namespace lahar {

/// The bit of the first entry of what is removed.
template <int Dim>
std::size_t first_removal_load(const Model<Dim>& model) {
  return model.tractions.size() + model.particle_velocities.size();
}

/// [s] From the begin of the stage until a particle with these loads is gone; infinite for one that
/// stays.
template <int Dim>
double gone_at(const Model<Dim>& model, std::uint64_t loads) {
  double time = std::numeric_limits<double>::infinity();
  std::uint64_t bits = loads >> first_removal_load(model);
  for (const auto& removal : model.changes.removed) {
    if ((bits & 1) != 0 && removal.takes_time()) time = std::min(time, removal.over);
    bits >>= 1;
  }
  return time;
}
template <int Dim>
double gone_at(const Model<Dim>& model, const Particles<Dim>& particles, Local p) {
  return gone_at(model, particles.loads.empty() ? 0 : particles.loads[static_cast<std::size_t>(p)]);
}

/// The share of its mass and volume that particle p still has at time t [s]. It is 1 if the
/// particle stays, and NaN if t is.
template <int Dim>
double share_left(const Model<Dim>& model, const Particles<Dim>& particles, Local p, double t) {
  if (!model.changes.takes_time()) return 1.0;
  constexpr double rounding = 1e-9;  // of sums of steps
  const double share = 1.0 - t / gone_at(model, particles, p);
  return share < rounding ? 0.0 : share;
}

}  // namespace lahar
