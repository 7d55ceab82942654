#include "physics/kernels/rigid_contact.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "physics/base/pack_bits.h"
#include "physics/basis/any_basis.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/contact_push.h"
#include "physics/kernels/contact_springs.h"
#include "physics/kernels/liquid_contact.h"
#include "physics/kernels/particle_forces.h"
#include "physics/particles/contact_couple.h"
#include "physics/particles/loads.h"

namespace lahar {

namespace {

constexpr double most_of_body = 0.5;  ///< the same of a free body, all its springs together
constexpr double memory = 1.5;        ///< of couples, in cells that waves pass

/// What contact does to a particle.
template <int Dim>
struct Touched {
  Vec<Dim> force = Vec<Dim>::Zero(), shear = Vec<Dim>::Zero();
  ContactCouple<Dim> couple = ContactCouple<Dim>::Zero();  ///< [N m]
  double lost = 0;                                         ///< [J] by sliding and damping
  Eigen::Matrix<double, Dim, Dim> stiffness = Eigen::Matrix<double, Dim, Dim>::Zero();
  bool any = false, slides = false;
  std::vector<typename ImplicitContact<Dim>::Push>* pushes = nullptr;  ///< get them, or null
};

/// -d force / d move of contact without dashpots. `shear` is what the springs gave along the
/// surface, `most` what friction allows of it.
template <int Dim>
void add_stiffness(Touched<Dim>& to, const RigidBody<Dim>& body, double k, const Vec<Dim>& normal,
                   const Vec<Dim>& shear, double most) {
  using Matrix = Eigen::Matrix<double, Dim, Dim>;
  const Matrix along = normal * normal.transpose(), across = Matrix::Identity() - along;
  to.stiffness += k * along;
  const double size = shear.norm();
  if (body.friction == 0 && body.cohesion == 0) return;
  if (size <= most) {
    to.stiffness += k * across;
    return;
  }
  to.slides = true;
  const Vec<Dim> t = shear / size;
  to.stiffness += k * most / size * (across - t * t.transpose());
  if (most > 0) to.stiffness += body.friction * k * t * normal.transpose();
}

/// Particles of one pack, with which a step deals together.
template <int Dim>
using TouchingPack = std::array<Touching<Dim>, lanes<Pack>>;
template <int Dim>
using NearestPack = std::array<typename Solid<Dim>::Nearest, lanes<Pack>>;

/// Where body k is nearest to the particles whose bits are set. (One question takes long, but the
/// processor answers several at a time if nothing else is between them.)
template <int Dim>
NearestPack<Dim> find_nearest(const TouchingPack<Dim>& at, unsigned bits, const Bodies<Dim>& bodies,
                              std::size_t k) {
  NearestPack<Dim> near;
  for_each_bit(bits, [&](std::size_t lane) { near[lane] = bodies.nearest(k, at[lane].x); });
  return near;
}

/// Which of the particles whose bits are set are certainly further from all bodies than they get in
/// a step.
template <int Dim>
unsigned which_are_away(const TouchingPack<Dim>& at, unsigned bits, const Bodies<Dim>& bodies,
                        double step) {
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    unsigned beyond = 0;
    for_each_bit(bits, [&](std::size_t lane) {
      const bool is = bodies.is_beyond(k, at[lane].x, at[lane].reach + step);
      beyond |= static_cast<unsigned>(is) << lane;
    });
    bits &= beyond;
  }
  return bits;
}

struct Spring {
  double stiffness, damping;  ///< k, c
};

/// What a free body allows: the part of its mass that is above the surface of the particle swings
/// on this spring, too.
template <int Dim>
Spring spring_to(const Touching<Dim>& p, const Bodies<Dim>& bodies, std::size_t k) {
  const Spring spring{p.stiffness, p.damping};
  if (bodies[k].motion != RigidBody<Dim>::Motion::free || p.longest == 0) return spring;
  const double mass = p.area * bodies.mass_over_area(k);
  const double most = most_of_body * mass / (p.longest * p.longest);
  if (spring.stiffness <= most) return spring;
  return {most, 2 * damping_ratio * std::sqrt(most * std::min(p.swings, mass))};
}

/// Contact of a particle with body k, which is nearest to it as `near` says. `rest` is what is left
/// of the shear of the step before: each body takes the part along its surface, as far as friction
/// allows. A body that is nearer than `closed` [m] is closed. Without `reactions` the stiffness is
/// found instead.
template <int Dim>
void touch(const Touching<Dim>& p, const Bodies<Dim>& bodies, std::size_t k,
           const typename Solid<Dim>::Nearest& near, double closed,
           std::vector<Reaction>* reactions, Vec<Dim>& rest, Touched<Dim>& all) {
  const double gap = near.distance - p.reach;
  if (!(gap < closed)) return;
  all.any = true;
  const RigidBody<Dim>& body = bodies[k];
  const auto [stiffness, damping] = spring_to(p, bodies, k);
  const Vec<Dim> move = p.move - p.dt * bodies.at(k).velocity_at(p.x);
  const double closing = -move.dot(near.normal);
  const Vec<Dim> slip = move + closing * near.normal;
  const double spring = -stiffness * gap;
  const double push = std::max(0.0, spring + damping / p.dt * closing);
  Vec<Dim> shear = rest - rest.dot(near.normal) * near.normal - stiffness * slip;
  const double held = body.cohesion > 0 ? body.cohesion * sticky_area(p, near.normal) : 0.0;
  const double most = push > 0 ? body.friction * push + held : 0.0;
  const double arm = std::max(0.0, p.extent + gap);
  if (!reactions) add_stiffness<Dim>(all, body, stiffness, near.normal, shear, most);
  if (all.pushes) all.pushes->push_back({near.normal, arm, p.extent, push, stiffness});
  const double size = shear.norm();
  if (size > most) {
    all.lost += most * (size - most) / stiffness;  // slides by the rest of the spring
    shear *= most / size;
  }
  // What friction leaves is for the dashpot along the surface.
  Vec<Dim> drag = -damping / p.dt * slip;
  if (const double sum = (shear + drag).norm(); sum > most)
    drag = (shear + drag) * (most / sum) - shear;
  all.lost += (push - std::max(0.0, spring)) * closing - drag.dot(slip);
  rest -= shear;
  all.shear += shear;
  const Vec<Dim> force = push * near.normal + shear + drag;
  all.force += force;
  all.couple += push * arm * near.normal * near.normal.transpose();
  if (reactions) (*reactions)[k].template add<Dim>(-force, p.x - bodies.at(k).origin);
}

/// Over how long pushes are smoothed for couples [s].
double memory_time(const ContactBin& bin) {
  if (is_implicit(bin.analysis) && bin.analysis.implicit.quasi_static) return 0.0;
  return memory * bin.h / std::sqrt(bin.fastest / bin.density);
}

/// The couple after a step, from that before it and that of the present push.
template <int Dim>
ContactCouple<Dim> mean_couple(const ContactCouple<Dim>& before, const ContactCouple<Dim>& now,
                               double T, double dt) {
  return (T * before + dt * now) / (T + dt);
}

/// Contact of the particles whose bits are set, of the pack from `first` on, with all bodies.
template <int Dim>
std::array<Touched<Dim>, lanes<Pack>> touch(const TouchingPack<Dim>& at, unsigned bits,
                                            const ContactRows<Dim>& rows, Local first,
                                            const Bodies<Dim>& bodies,
                                            std::vector<Reaction>& reactions) {
  std::array<Touched<Dim>, lanes<Pack>> now;
  std::array<Vec<Dim>, lanes<Pack>> rest;
  for_each_bit(bits, [&](std::size_t lane) {
    rest[lane] = get<Dim>(rows.shear, first + static_cast<Local>(lane));
  });
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    const auto near = find_nearest(at, bits, bodies, k);
    for_each_bit(bits, [&](std::size_t lane) {
      touch<Dim>(at[lane], bodies, k, near[lane], 0.0, &reactions, rest[lane], now[lane]);
    });
  }
  return now;
}

/// The area on which what begins at a body presses it [m^2]: that of cohesion, but a sliver, which
/// yields, leaves all to the row behind it.
template <int Dim>
double pressed_area(const Touching<Dim>& p, const Vec<Dim>& normal) {
  const double across = p.area / p.depth, side = Dim == 2 ? across : std::sqrt(across);
  const bool is_sliver = p.section / across < (0.5 * behind_sliver - 0.5) * side;
  return is_along_axis<Dim>(normal) && is_sliver ? 0.0 : sticky_area(p, normal);
}

/// n . stress n
template <int Dim>
double stress_across(const Particles<Dim>& particles, Local p, const Vec<Dim>& n) {
  constexpr int shear[2][3] = {{3, 0, 0}, {3, 5, 4}};  // rows of xy, xz, yz
  const auto stress = [&](int row) { return particles.row(Column::stress, row)[p]; };
  double sum = 0;
  for (int a = 0; a < Dim; ++a) {
    sum += n[a] * n[a] * stress(a);
    for (int b = a + 1; b < Dim; ++b) sum += 2 * n[a] * n[b] * stress(shear[Dim - 2][a + b - 1]);
  }
  return sum;
}

/// A particle that bodies see for the first time and that touches one: it presses them with its
/// stresses, and with the pressure in its pores. Explicit steps.
template <int Dim>
void press_at_start(Patch<Dim>& patch, const Bodies<Dim>& bodies, Local p, Touching<Dim>& at) {
  constexpr double closed = 0.1;  // of its edge: where slivers were left out
  const ContactRows<Dim> rows(patch.particles);
  const bool has_liquid = patch.particles.layout().has(Column::contact_liquid);
  const Vec<Dim> x = get<Dim>(rows.x, p);
  Vec<Dim> all = Vec<Dim>::Zero();
  double reach = at.reach;
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    const auto near = bodies.nearest(k, x);
    if (near.distance > at.reach + closed * at.edge) continue;
    const double area = pressed_area(at, near.normal);
    const double grains = std::max(0.0, -area * stress_across(patch.particles, p, near.normal));
    const double liquid = has_liquid ? area * patch.particles.row(Column::pore_pressure)[p] : 0.0;
    if (grains == 0.0 && liquid == 0.0) continue;
    reach = std::max(reach, near.distance + grains / at.stiffness);
    all += liquid * near.normal;
  }
  at.extent = rows.extent[p] += reach - at.reach;
  at.reach = rows.reach[p] = reach;
  if (has_liquid) set<Dim>(patch.particles.template rows<Dim>(Column::contact_liquid), p, all);
}

/// The velocity [m/s] at a place of the body that is nearest to it.
template <int Dim>
Vec<Dim> velocity_of_nearest(const Bodies<Dim>& bodies, const Vec<Dim>& x) {
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < bodies.size(); ++k)
    if (const double distance = bodies.nearest(k, x).distance; distance < least) {
      least = distance;
      nearest = k;
    }
  return bodies.at(nearest).velocity_at(x);
}

}  // namespace

template <int Dim>
Placement<Dim> placement_after(const StepContext<Dim>& step, std::size_t k) {
  const RigidBody<Dim>& body = step.model->rigid_bodies[k];
  if (body.motion == RigidBody<Dim>::Motion::free) return step.placements[k];
  auto at = placement_at(body, step.model->functions, step.time + step.dt, step.dt);
  if (is_implicit(step.model->analysis) && body.function >= 0 && step.dt > 0) {
    // Steps are long: its velocity is that by which it comes to this place.
    const MathFunction& f = step.model->functions[static_cast<std::size_t>(body.function)];
    const double mean = (f.integral(step.time + step.dt) - f.integral(step.time)) / step.dt;
    at.velocity = mean * body.velocity;
    at.spin = mean * body.spin;
  }
  return at;
}

template <int Dim>
void begin_contact(Patch<Dim>& patch, const StepContext<Dim>& step) {
  using Near = typename Patch<Dim>::Near;
  const auto& bodies = step.model->rigid_bodies;
  patch.reactions.assign(bodies.size(), {});
  patch.placements.resize(bodies.size());
  for (std::size_t k = 0; k < bodies.size(); ++k) patch.placements[k] = placement_after(step, k);
  const bool moving = Bodies<Dim>(patch, step).any_moves();
  const std::size_t cells = patch.topology.cells.size();
  if (moving || patch.near_bodies.size() != cells) patch.near_bodies.assign(cells, Near::unknown);
}

template <int Dim>
void touch_bodies(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const Bodies<Dim> bodies(patch, step);
  const bool implicit = is_implicit(step.model->analysis), moving = bodies.any_moves();
  const double* const fields[2] = {patch.velocity.data(), patch.acceleration.data()};
  const ContactRows<Dim> rows(patch.particles);
  for_each_bin_with_basis(
      patch, bins, [&](const ParticleBin& bin) { return is_near(patch, bin, bodies); },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        const ContactBin common = contact_bin(patch, step, bin);
        const double longest = longest_step(step, common), T = memory_time(common);
        TouchingPack<Dim> at;
        for (Local first = bin.begin; first < bin.end; first += lanes<Pack>) {
          const unsigned all = first_bits<Pack>(bin.end - first);
          for_each_bit(all, [&](std::size_t lane) {
            begin(at[lane], rows, common, first + static_cast<Local>(lane), bodies, step.dt);
          });
          const unsigned touched =
              not_zero(rows.force, first, bin.end) | not_zero(rows.couple, first, bin.end);
          const unsigned near = all & ~which_are_away(at, all & ~touched, bodies, 0.5 * common.h);
          if (near == 0) continue;
          Pack sum[2][Dim];
          general::interpolate<Dim, 2, Pack>(basis, first, fields, nodes, sum);
          std::array<Vec<Dim>, lanes<Pack>> mean;  // move with the mean velocity
          for_each_bit(near, [&](std::size_t lane) {
            Vec<Dim> move;
            for (int d = 0; d < Dim; ++d) {
              move[d] = step.dt * sum[0][d][static_cast<int>(lane)];
              mean[lane][d] =
                  implicit ? move[d]
                           : move[d] - 0.5 * step.dt * step.dt * sum[1][d][static_cast<int>(lane)];
            }
            move_with_step(at[lane], common, move, step.dt);
            if (!implicit) limit_spring(at[lane], common, longest);
            if (at[lane].is_new && !implicit)
              press_at_start(patch, bodies, first + static_cast<Local>(lane), at[lane]);
          });
          const auto now = touch(at, near, rows, first, bodies, patch.reactions);
          for_each_bit(near, [&](std::size_t lane) {
            const Local p = first + static_cast<Local>(lane);
            const Vec<Dim> old = get<Dim>(rows.force, p);
            const Vec<Dim> worked = implicit ? Vec<Dim>(0.5 * (old + now[lane].force)) : old;
            patch.work.internal -= worked.dot(mean[lane]) + now[lane].lost;
            patch.work.damping += now[lane].lost;
            patch.work.friction += now[lane].lost;
            set<Dim>(rows.force, p, now[lane].force);
            set<Dim>(rows.shear, p, now[lane].shear);
            ContactCouple<Dim> couple = ContactCouple<Dim>::Zero();
            const ContactCouple<Dim> couple_before = contact_couple<Dim>(rows.couple, p);
            if (now[lane].any)
              couple = mean_couple<Dim>(couple_before, now[lane].couple, T, step.dt);
            set_contact_couple<Dim>(rows.couple, p, couple);
            if (!implicit) return;  // count_couples() does
            if (moving) {  // end_contact() takes the force after the step, and not the mean of both
              const Vec<Dim> v = velocity_of_nearest(bodies, at[lane].x);
              const double more = 0.5 * step.dt * (old - now[lane].force).dot(v);
              patch.work.external += more;
              patch.work.internal += more;
            }
            const auto add_half = [&](const Vec<Dim>& force, const ContactCouple<Dim>& c) {
              give_couple<Dim>(basis, p, force, c, rows.extent[p], [&](int i, const Vec<Dim>& f) {
                const double* v = fields[0] + static_cast<std::ptrdiff_t>(nodes[i]) * node_width;
                patch.work.internal -= 0.5 * step.dt * f.dot(Eigen::Map<const Vec<Dim>>(v));
              });
            };
            add_half(old, couple_before);
            add_half(now[lane].force, couple);
          });
        }
      });
}

template <int Dim>
void count_couples(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                   const VelocityGradients<Dim>* gradients) {
  const ContactRows<Dim> rows(patch.particles);
  const bool by_axes = row_of(step.model->analysis.functions).products;
  const auto side_of = [&](Local p) {
    return SidePush<Dim>(contact_force<Dim>(patch.particles, p),
                         contact_couple<Dim>(rows.couple, p), rows.extent[p]);
  };
  const auto count = [&](Local p, auto gradient) {
    ContactCouple<Dim> couple = contact_couple<Dim>(rows.couple, p);
    if (by_axes) side_of(p).take_from(couple);
    for (int a = 0; a < Dim; ++a)
      for (int b = 0; b < Dim; ++b) patch.work.internal += step.dt * couple(a, b) * gradient(a, b);
  };
  const auto act = [&](const ParticleBin& bin) {
    return has_particle_forces(patch, bin, *step.model);
  };
  if (by_axes)
    for_each_bin_with_basis(
        patch, bins, act, [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
          if constexpr (TensorBasis<std::decay_t<decltype(basis)>>)
            for (Local p = bin.begin; p < bin.end; p += lanes<Pack>)
              for_each_bit(not_zero(rows.couple, p, bin.end), [&](int lane) {
                const SidePush<Dim> side = side_of(p + lane);
                if (side.share == 0.0) return;
                give_shift_to_side<Dim>(basis, p + lane, side, [&](int i, double shift) {
                  const auto at = static_cast<std::ptrdiff_t>(nodes[i]) * node_width;
                  for (int d = 0; d < Dim; ++d)
                    patch.work.internal -= step.dt * shift * side.push[d] * patch.velocity[at + d];
                });
              });
        });
  if (gradients) {
    for (const ParticleBin& bin : bins) {
      if (!act(bin)) continue;
      const std::size_t begin = gradients->begin(bin, bins);
      for (Local p = bin.begin; p < bin.end; p += lanes<Pack>)
        for_each_bit(not_zero(rows.couple, p, bin.end), [&](int lane) {
          const std::size_t at = begin + static_cast<std::size_t>(p + lane - bin.begin);
          count(p + lane, [&](int a, int b) {
            return gradients->L[static_cast<std::size_t>(Dim * a + b)][at];
          });
        });
    }
    return;
  }
  for_each_bin_with_basis(
      patch, bins, act, [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
          const unsigned acting = not_zero(rows.couple, p, bin.end);
          if (acting == 0) continue;
          Pack L[Dim][Dim];
          general::gradient<Dim, Pack>(basis, p, patch.velocity.data(), nodes, L);
          for_each_bit(acting, [&](int lane) {
            count(p + lane, [&](int a, int b) { return L[a][b][lane]; });
          });
        }
      });
}

template <int Dim>
bool meets_bodies(Patch<Dim>& patch, const StepContext<Dim>& step, const ParticleBin& bin) {
  return !patch.near_bodies.empty() && is_near(patch, bin, Bodies<Dim>(patch, step));
}

template <int Dim>
ImplicitContact<Dim> contact_after(Patch<Dim>& patch, const StepContext<Dim>& step,
                                   const ParticleBin& bin, Local p, const Vec<Dim>& move) {
  constexpr double closed = 1e-9;  // of a cell: what begins at a body is held by it
  const Bodies<Dim> bodies(patch, step);
  const ContactRows<Dim> rows(patch.particles);
  const ContactBin common = contact_bin(patch, step, bin);
  Touching<Dim> at;
  begin(at, rows, common, p, bodies, step.dt);
  move_with_step(at, common, move, step.dt);
  ImplicitContact<Dim> found;
  Touched<Dim> now;
  now.pushes = &found.pushes;
  Vec<Dim> rest = get<Dim>(rows.shear, p);
  for (std::size_t k = 0; k < bodies.size(); ++k)
    touch<Dim>(at, bodies, k, bodies.nearest(k, at.x), closed * common.h, nullptr, rest, now);
  found.force = now.force;
  found.stiffness = now.stiffness;
  found.touches = now.any;
  found.slides = now.slides;
  found.share_of_now = step.dt / (memory_time(common) + step.dt);
  return found;
}

template <int Dim>
void keep_outside(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  Particles<Dim>& particles = patch.particles;
  if (particles.layout().has(Column::corners)) return;  // places follow from corners
  const Bodies<Dim> bodies(patch, step);
  const ContactRows<Dim> rows(particles);
  const auto u = particles.template rows<Dim>(Column::u);
  for (const ParticleBin& bin : bins) {
    if (bin.begin == bin.end || !is_near(patch, bin, bodies)) continue;
    for (Local first = bin.begin; first < bin.end; first += lanes<Pack>)
      for_each_bit(not_zero(rows.force, first, bin.end), [&](int lane) {
        const Local p = first + lane;
        for (std::size_t k = 0; k < bodies.size(); ++k) {
          const Vec<Dim> x = get<Dim>(rows.x, p);
          if (bodies.is_beyond(k, x, 0.0)) continue;
          const auto near = bodies.nearest(k, x);
          if (!(near.distance < 0)) continue;
          const Vec<Dim> out = -near.distance * near.normal;
          set<Dim>(rows.x, p, x + out);
          set<Dim>(u, p, get<Dim>(u, p) + out);
          rows.reach[p] -= near.distance;
          rows.extent[p] -= near.distance;
        }
      });
  }
}

template <int Dim>
void end_contact(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const bool rings = step.model->analysis.plane == Plane::axisymmetric;
  for (std::size_t k = 0; k < patch.reactions.size(); ++k) {
    const Placement<Dim>& at = patch.placements[k];
    if (rings) patch.reactions[k].torque = {};  // couples of a ring cancel
    double power = 0;                           // of the body, on particles
    for (std::size_t d = 0; d < 3; ++d) {
      if (d < Dim) power -= patch.reactions[k].force[d] * at.velocity[static_cast<int>(d)];
      power -= patch.reactions[k].torque[d] * at.spin[static_cast<int>(d)];
    }
    patch.work.external += power * step.dt;
    patch.work.internal += power * step.dt;
  }
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template Placement<Dim> placement_after<Dim>(const StepContext<Dim>&, std::size_t);        \
  template void begin_contact<Dim>(Patch<Dim>&, const StepContext<Dim>&);                    \
  template void touch_bodies<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);       \
  template void keep_outside<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);       \
  template void count_couples<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins,       \
                                   const VelocityGradients<Dim>*);                           \
  template void end_contact<Dim>(Patch<Dim>&, const StepContext<Dim>&);                      \
  template bool meets_bodies<Dim>(Patch<Dim>&, const StepContext<Dim>&, const ParticleBin&); \
  template ImplicitContact<Dim> contact_after<Dim>(Patch<Dim>&, const StepContext<Dim>&,     \
                                                   const ParticleBin&, Local, const Vec<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
