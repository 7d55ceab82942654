/// \file Loads and prescribed velocities of particles. Bit k of Particles::loads says that entry k
/// of the model's lists (tractions first, then prescribed velocities, then what a stage removes:
/// removal_in_time.h) acts on the particle.
#pragma once

#include <algorithm>
#include <array>

#include "physics/particles/patch.h"
#include "physics/particles/removal_in_time.h"

namespace lahar {

/// Entries that fit in the bit mask of a particle.
inline constexpr std::size_t max_particle_loads = 64;

/// Value of load function `function` (-1 = constant 1) at time t.
template <int Dim>
double load_factor(const Model<Dim>& model, int function, double t) {
  return function < 0 ? 1.0 : model.functions[static_cast<std::size_t>(function)](t);
}

/// The factor of a velocity in a step (MathFunction::mean()).
template <int Dim>
double mean_factor(const StepContext<Dim>& step, int function) {
  if (function < 0) return 1.0;
  return step.model->functions[static_cast<std::size_t>(function)].mean(step.time, step.dt);
}

/// The pressure [Pa] that is prescribed at a node (Patch::fixed_pressure) at time t [s].
template <int Dim, class FixedPressure>
double pressure_given(const Model<Dim>& model, const FixedPressure& fixed, double t) {
  return fixed.pressure * load_factor(model, fixed.function, t);
}

/// Gravity at the time of a step [m/s^2]; its mass lane is zero.
template <int Dim>
NodeVector gravity_in(const StepContext<Dim>& step) {
  double g[node_width] = {};
  const double factor = load_factor(*step.model, step.model->gravity_function, step.time);
  for (int d = 0; d < Dim; ++d) g[d] = factor * step.model->gravity[d];
  return load<NodeVector>(g);
}

/// The loads and prescribed velocities of a particle that comes during the run: those of all
/// particles.
template <int Dim>
std::uint64_t loads_of_all(const Model<Dim>& model) {
  std::uint64_t bits = 0;
  std::size_t k = 0;
  for (const auto& traction : model.tractions) bits |= std::uint64_t{traction.all} << k++;
  for (const auto& velocity : model.particle_velocities) bits |= std::uint64_t{velocity.all} << k++;
  return bits;
}

/// What is prescribed of a particle's velocity; of several for a direction the last wins.
template <int Dim>
struct PrescribedVelocity {
  std::array<bool, Dim> along{};
  std::array<double, Dim> velocity{};  ///< [m/s]
  bool any() const { return std::find(along.begin(), along.end(), true) != along.end(); }
};
template <int Dim>
PrescribedVelocity<Dim> prescribed_velocity(const Particles<Dim>& particles, Local p,
                                            const StepContext<Dim>& step, bool of_liquid = false) {
  const Model<Dim>& model = *step.model;
  PrescribedVelocity<Dim> found;
  const std::uint64_t bits =
      particles.loads.empty() ? 0 : particles.loads[static_cast<std::size_t>(p)];
  if (bits == 0) return found;
  for (std::size_t k = 0; k < model.particle_velocities.size(); ++k)
    if (bits >> (model.tractions.size() + k) & 1 &&
        model.particle_velocities[k].of_liquid == of_liquid) {
      const auto d = static_cast<std::size_t>(model.particle_velocities[k].dir);
      found.along[d] = true;
      found.velocity[d] = model.particle_velocities[k].velocity;
      if (const int function = model.particle_velocities[k].function; function >= 0)
        found.velocity[d] *= mean_factor(step, function);
    }
  return found;
}

/// Forces that act on a particle, each component at its place along its own axis.
template <int Dim>
struct SurfaceForce {
  Vec<Dim> force = Vec<Dim>::Zero();   ///< [N]
  Vec<Dim> offset = Vec<Dim>::Zero();  ///< [m] from the particle's centre, of each component

  bool is_zero() const { return force.isZero(0.0); }
  Vec<Dim> couple() const { return force.cwiseProduct(offset); }  ///< [N m]
  friend SurfaceForce mean(const SurfaceForce& a, const SurfaceForce& b) {
    return {0.5 * (a.force + b.force), 0.5 * (a.offset + b.offset)};
  }
};

/// The area across an axis of a particle with these edges [m].
template <int Dim>
double area_across(int axis, double depth,
                   const std::array<double, static_cast<std::size_t>(Dim)>& edges) {
  double area = depth;
  for (int d = 0; d < Dim; ++d)
    if (d != axis) area *= edges[static_cast<std::size_t>(d)];
  return area;
}

/// The area at a distance `offset` [m] along an axis from the centre of a particle at r, over that
/// at the centre: rings are larger outside.
inline double share_at_side(const Analysis& analysis, int axis, double r, double offset) {
  return analysis.plane == Plane::axisymmetric && axis == 0 ? 1 + offset / r : 1.0;
}

/// The area on which a traction acts on particle p [m^2; m per m of depth, of rings the whole one],
/// where its centre is.
/// It does not follow how the particle deforms, but for the radius of rings: a load stays the load
/// that it was. That of CB-Geo MPM does, by the present volume over the initial size.
template <int Dim>
double loaded_area(const Particles<Dim>& particles, Local p, const ParticleTraction& one,
                   const Analysis& analysis) {
  if (one.axis < 0) return particles.row(Column::volume)[p] / particles.row(Column::size)[p];
  std::array<double, static_cast<std::size_t>(Dim)> edges;
  for (int d = 0; d < Dim; ++d)
    edges[static_cast<std::size_t>(d)] = particles.row(Column::size, d)[p];
  return area_across<Dim>(one.axis, depth_at(analysis, particles.row(Column::x)[p]), edges);
}

/// Edge [m] of particle p across the area of a traction. Of one of which a stage has left a share
/// it is that at the beginning, as its volume does not say how large it is.
template <int Dim>
double edge_across(const Particles<Dim>& particles, Local p, const ParticleTraction& one,
                   double area, double share) {
  return share < 1 ? particles.row(Column::size, std::max(one.axis, 0))[p]
                   : particles.row(Column::volume)[p] / area;
}

/// All tractions on particle p. Of several for a direction the last wins. They act at the side of
/// the particle: forces at centres would be an error of stress in the rows beside a surface. Of a
/// particle that a stage lets go they fall with its mass.
template <int Dim>
SurfaceForce<Dim> traction_on(const Particles<Dim>& particles, Local p,
                              const StepContext<Dim>& step, bool on_liquid = false) {
  SurfaceForce<Dim> all;
  const std::uint64_t bits =
      particles.loads.empty() ? 0 : particles.loads[static_cast<std::size_t>(p)];
  if (bits == 0) return all;
  const double share = share_left(*step.model, particles, p, step.time);
  if (share == 0) return all;
  const auto& tractions = step.model->tractions;
  for (std::size_t k = 0; k < tractions.size(); ++k) {
    const ParticleTraction& one = tractions[k];
    if (!(bits >> k & 1) || one.on_liquid != on_liquid) continue;
    const Analysis& analysis = step.model->analysis;
    const double area = loaded_area(particles, p, one, analysis);
    const double offset = 0.5 * one.side * edge_across(particles, p, one, area, share);
    all.force[one.dir] = one.traction * load_factor(*step.model, one.function, step.time) * area *
                         share_at_side(analysis, one.axis, particles.row(Column::x)[p], offset);
    if (one.axis >= 0) all.force[one.dir] *= share;  // else the area has it
    all.offset[one.dir] = offset;
  }
  return all;
}

/// Whether any traction acts on the liquid in pores alone.
template <int Dim>
bool has_liquid_tractions(const Model<Dim>& model) {
  return std::any_of(model.tractions.begin(), model.tractions.end(),
                     [](const ParticleTraction& traction) { return traction.on_liquid; });
}

/// True if particles of a bin may have forces of their own.
template <int Dim>
bool has_particle_forces(const Patch<Dim>& patch, const ParticleBin& bin, const Model<Dim>& model) {
  if (bin.loaded || model.body_force) return true;
  if (!model.analysis.rigid_bodies) return false;
  return patch.near_bodies.empty() ||  // not looked for yet, after a restart
         patch.near_bodies[static_cast<std::size_t>(bin.cell)] != Patch<Dim>::Near::no;
}

/// Tractions and Model::body_force on particle p.
template <int Dim>
SurfaceForce<Dim> applied_force_on(const Particles<Dim>& particles, Local p,
                                   const StepContext<Dim>& step) {
  SurfaceForce<Dim> all = traction_on(particles, p, step);
  if (step.model->body_force) {
    Vec<Dim> X;
    for (int d = 0; d < Dim; ++d)
      X[d] = particles.row(Column::x, d)[p] - particles.row(Column::u, d)[p];
    all.force += particles.row(Column::mass)[p] * step.model->body_force(X, step.time);
  }
  return all;
}

/// The same with the force of rigid bodies.
template <int Dim>
SurfaceForce<Dim> force_on(const Particles<Dim>& particles, Local p, const StepContext<Dim>& step) {
  SurfaceForce<Dim> all = applied_force_on(particles, p, step);
  if (step.model->analysis.rigid_bodies)
    for (int d = 0; d < Dim; ++d) all.force[d] += particles.row(Column::contact_force, d)[p];
  return all;
}

}  // namespace lahar
