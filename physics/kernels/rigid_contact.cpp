#include "physics/kernels/rigid_contact.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "physics/basis/any_basis.h"
#include "physics/basis/nodal_fields.h"
#include "physics/materials/law.h"

namespace lahar {

namespace {

constexpr double stiffness_share = 4.0;  ///< of k, see rigid_contact.h
constexpr double damping_ratio = 0.3;  ///< zeta

/// Bodies as a step has them.
template <int Dim>
class Bodies {
 public:
  Bodies(const Patch<Dim>& patch, const StepContext<Dim>& step)
      : bodies_(step.model->rigid_bodies), at_(patch.placements) {}
  std::size_t size() const { return bodies_.size(); }
  const RigidBody<Dim>& operator[](std::size_t k) const { return bodies_[k]; }
  const Placement<Dim>& at(std::size_t k) const { return at_[k]; }
  bool moves(std::size_t k) const { return bodies_[k].motion != RigidBody<Dim>::Motion::fixed; }
  typename Solid<Dim>::Nearest nearest(std::size_t k, const Vec<Dim>& x) const {
    const RigidBody<Dim>& body = bodies_[k];
    if (!moves(k)) return body.solid->nearest(x);
    const auto& at = at_[k];
    auto found = body.solid->nearest(body.centre + at.axes.transpose() * (x - at.origin));
    found.normal = at.axes * found.normal;
    return found;
  }

 private:
  const std::vector<RigidBody<Dim>>& bodies_;
  const std::vector<Placement<Dim>>& at_;
};

/// The middle of a local cell, and the radius of a ball around it [m].
template <int Dim>
std::pair<Vec<Dim>, double> ball_around(const Patch<Dim>& patch, Local cell) {
  const auto c = static_cast<std::size_t>(cell);
  Vec<Dim> middle = Vec<Dim>::Zero(), half;
  if (patch.cartesian) {
    for (std::size_t d = 0; d < Dim; ++d) {
      middle[static_cast<int>(d)] = patch.box[c][d];
      half[static_cast<int>(d)] = 1.0 / patch.box[c][Dim + d];
    }
    return {middle, half.norm()};
  }
  const auto& corner = patch.topology.corner_nodes[c];
  const auto place = [&](Local node) {
    return Vec<Dim>(Eigen::Map<const Vec<Dim>>(patch.node_position.data() +
                                               static_cast<std::ptrdiff_t>(node) * node_width));
  };
  for (const Local node : corner) middle += place(node) / corners<Dim>;
  double radius = 0;
  for (const Local node : corner) radius = std::max(radius, (place(node) - middle).norm());
  return {middle, radius};
}

/// Whether any body may touch particles of a cell in this step or the next.
template <int Dim>
bool is_near(const Patch<Dim>& patch, Local cell, const Bodies<Dim>& bodies) {
  const auto [middle, radius] = ball_around(patch, cell);
  for (std::size_t k = 0; k < bodies.size(); ++k)
    if (bodies.nearest(k, middle).distance < 2.5 * radius) return true;
  return false;
}

/// A particle where it will be at the end of the step.
template <int Dim>
struct Touching {
  Vec<Dim> x, v;                  ///< [m], [m/s]
  double dt, stiffness, damping;  ///< [s], k, c
  double area, reach;             ///< [m^2] of its surface, [m]
};

/// What contact does to a particle.
template <int Dim>
struct Touched {
  Vec<Dim> force = Vec<Dim>::Zero(), shear = Vec<Dim>::Zero();
  double lost = 0;  ///< [J] by sliding and damping
  bool any = false;
};

/// Contact of a particle with all bodies. `rest` is the shear of the step before: each body takes
/// the part along its surface, as far as friction allows.
template <int Dim>
Touched<Dim> touch(const Touching<Dim>& p, Vec<Dim> rest, const Bodies<Dim>& bodies,
                   std::vector<Reaction>& reactions) {
  Touched<Dim> all;
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    const auto near = bodies.nearest(k, p.x);
    const double gap = near.distance - p.reach;
    if (!(gap < 0)) continue;
    all.any = true;
    const RigidBody<Dim>& body = bodies[k];
    const Vec<Dim> w = p.v - bodies.at(k).velocity_at(p.x);
    const double closing = -w.dot(near.normal);
    const double spring = -p.stiffness * gap;
    const double push = std::max(0.0, spring + p.damping * closing);
    const Vec<Dim> slip = p.dt * (w + closing * near.normal);
    Vec<Dim> shear = rest - rest.dot(near.normal) * near.normal - p.stiffness * slip;
    const double most = push > 0 ? body.friction * push + body.cohesion * p.area : 0.0;
    const double size = shear.norm();
    if (size > most) {
      all.lost += most * (size - most) / p.stiffness;  // slides by the rest of the spring
      shear *= most / size;
    }
    // What friction leaves is for the dashpot along the surface.
    Vec<Dim> drag = -p.damping * (w + closing * near.normal);
    if (const double sum = (shear + drag).norm(); sum > most)
      drag = (shear + drag) * (most / sum) - shear;
    all.lost += (push - spring) * closing * p.dt - drag.dot(slip);
    rest -= shear;
    all.shear += shear;
    const Vec<Dim> force = push * near.normal + shear + drag;
    all.force += force;
    Reaction& on = reactions[k];
    const Vec<Dim> arm = p.x - bodies.at(k).origin;
    for (int d = 0; d < Dim; ++d) on.force[static_cast<std::size_t>(d)] -= force[d];
    if constexpr (Dim == 2) {
      on.torque[2] -= arm.x() * force.y() - arm.y() * force.x();
    } else {
      const Vec<3> torque = arm.cross(force);
      for (std::size_t d = 0; d < 3; ++d) on.torque[d] -= torque[static_cast<int>(d)];
    }
  }
  return all;
}

template <int Dim>
struct ContactRows {
  std::array<double*, Dim> force, shear, x;
  double *reach, *volume, *mass;
  explicit ContactRows(Particles<Dim>& particles)
      : force(particles.template rows<Dim>(Column::contact_force)),
        shear(particles.template rows<Dim>(Column::contact_shear)),
        x(particles.template rows<Dim>(Column::x)),
        reach(particles.row(Column::contact_reach)),
        volume(particles.row(Column::volume)),
        mass(particles.row(Column::mass)) {}
};

template <int Dim>
Vec<Dim> get(const std::array<double*, Dim>& rows, Local p) {
  Vec<Dim> value;
  for (std::size_t d = 0; d < Dim; ++d) value[static_cast<int>(d)] = rows[d][p];
  return value;
}

template <int Dim>
void set(const std::array<double*, Dim>& rows, Local p, const Vec<Dim>& value) {
  for (std::size_t d = 0; d < Dim; ++d) rows[d][p] = value[static_cast<int>(d)];
}

/// Reach of a particle at x that is seen near a body for the first time. `given`: minus its
/// distance to the surface of the body that it is part of, or 0.
template <int Dim>
double first_reach(double given, const Vec<Dim>& x, double volume, const Bodies<Dim>& bodies) {
  double reach = given < 0 ? -given : 0.5 * std::pow(volume, 1.0 / Dim);
  for (std::size_t k = 0; k < bodies.size(); ++k)
    reach = std::min(reach, bodies.nearest(k, x).distance);
  return std::max(reach, std::numeric_limits<double>::min());
}

}  // namespace

template <int Dim>
Placement<Dim> placement_after(const StepContext<Dim>& step, std::size_t k) {
  const RigidBody<Dim>& body = step.model->rigid_bodies[k];
  if (body.motion == RigidBody<Dim>::Motion::free) return step.placements[k];
  return placement_at(body, step.model->functions, step.time + step.dt);
}

template <int Dim>
void begin_contact(Patch<Dim>& patch, const StepContext<Dim>& step) {
  using Near = typename Patch<Dim>::Near;
  const auto& bodies = step.model->rigid_bodies;
  patch.reactions.assign(bodies.size(), {});
  patch.placements.resize(bodies.size());
  for (std::size_t k = 0; k < bodies.size(); ++k) patch.placements[k] = placement_after(step, k);
  const bool moving = std::any_of(bodies.begin(), bodies.end(), [](const RigidBody<Dim>& body) {
    return body.motion != RigidBody<Dim>::Motion::fixed;
  });
  const std::size_t cells = patch.topology.cells.size();
  if (moving || patch.near_bodies.size() != cells) patch.near_bodies.assign(cells, Near::unknown);
}

template <int Dim>
void touch_bodies(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  using Near = typename Patch<Dim>::Near;
  const Bodies<Dim> bodies(patch, step);
  for (const ParticleBin& bin : bins) {
    Near& near = patch.near_bodies[static_cast<std::size_t>(bin.cell)];
    if (bin.begin < bin.end && near == Near::unknown)
      near = is_near(patch, bin.cell, bodies) ? Near::yes : Near::no;
  }
  const double* const fields[2] = {patch.velocity.data(), patch.acceleration.data()};
  const ContactRows<Dim> rows(patch.particles);
  for_each_bin_with_basis(
      patch, bins,
      [&](const ParticleBin& bin) {
        return patch.near_bodies[static_cast<std::size_t>(bin.cell)] == Near::yes;
      },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        const Material& material = step.model->materials[bin.material];
        const double modulus = material.density * std::pow(wave_speed(material), 2);
        const double h = patch.cell_size[static_cast<std::size_t>(bin.cell)];
        for (Local p = bin.begin; p < bin.end; ++p) {
          Scalar sum[2][Dim];
          general::interpolate<Dim, 2, Scalar>(basis, p, fields, nodes, sum);
          Vec<Dim> v, mean;
          for (int d = 0; d < Dim; ++d) {
            v[d] = sum[0][d][0];
            mean[d] = v[d] - 0.5 * step.dt * sum[1][d][0];
          }
          const Vec<Dim> x = get<Dim>(rows.x, p), old = get<Dim>(rows.force, p);
          const double volume = rows.mass[p] / material.density;
          if (!(rows.reach[p] > 0)) rows.reach[p] = first_reach(rows.reach[p], x, volume, bodies);
          const double stiffness = stiffness_share * modulus * volume / (h * h);
          const Touched<Dim> now =
              touch<Dim>({.x = x + step.dt * v,
                          .v = v,
                          .dt = step.dt,
                          .stiffness = stiffness,
                          .damping = 2 * damping_ratio * std::sqrt(stiffness * rows.mass[p]),
                          .area = std::pow(volume, 1 - 1.0 / Dim),
                          .reach = rows.reach[p]},
                         get<Dim>(rows.shear, p), bodies, patch.reactions);
          patch.work.internal -= old.dot(mean) * step.dt + now.lost;
          patch.work.damping += now.lost;
          patch.work.friction += now.lost;
          set<Dim>(rows.force, p, now.force);
          set<Dim>(rows.shear, p, now.shear);
        }
      });
}

template <int Dim>
void end_contact(Patch<Dim>& patch, const StepContext<Dim>& step) {
  for (std::size_t k = 0; k < patch.reactions.size(); ++k) {
    const Placement<Dim>& at = patch.placements[k];
    double power = 0;  // of the body, on particles
    for (std::size_t d = 0; d < 3; ++d) {
      if (d < Dim) power -= patch.reactions[k].force[d] * at.velocity[static_cast<int>(d)];
      power -= patch.reactions[k].torque[d] * at.spin[static_cast<int>(d)];
    }
    patch.work.external += power * step.dt;
    patch.work.internal += power * step.dt;
  }
}

#define LAHAR_INSTANTIATE(Dim)                                                         \
  template Placement<Dim> placement_after<Dim>(const StepContext<Dim>&, std::size_t);  \
  template void begin_contact<Dim>(Patch<Dim>&, const StepContext<Dim>&);              \
  template void touch_bodies<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template void end_contact<Dim>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
