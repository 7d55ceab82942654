#include "physics/kernels/rigid_contact.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "physics/base/pack_bits.h"
#include "physics/basis/any_basis.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/near_bodies.h"
#include "physics/kernels/particle_forces.h"
#include "physics/materials/law.h"
#include "physics/particles/contact_couple.h"
#include "physics/particles/loads.h"

namespace lahar {

namespace {

constexpr double damping_ratio = 0.3;  ///< zeta
constexpr double most_share = 1.5;     ///< of m / dt^2 that k may be
constexpr double most_of_body = 0.5;   ///< the same of a free body, all its springs together
constexpr double memory = 1.5;         ///< of couples, in cells that waves pass

/// The edge of a square or a cube.
template <int Dim>
double edge_of_box(double volume) {
  return Dim == 2 ? std::sqrt(volume) : std::cbrt(volume);
}

/// And one of its sides.
template <int Dim>
double side_of_box(double edge) {
  return Dim == 2 ? edge : edge * edge;
}

/// A particle where it will be at the end of the step.
template <int Dim>
struct Touching {
  Vec<Dim> x, move;           ///< [m]; the second since the beginning
  double dt;                  ///< [s]
  double mass;                ///< [kg]
  double depth;               ///< [m] of the model there: depth_at()
  double section, edge, h;    ///< [m^Dim] volume over depth; [m] of a box of it; [m] of the cell
  double area, reach;         ///< [m^2] of its surface, [m]
  double stiffness, damping;  ///< k, c
  double swings, longest;     ///< [kg] that the dashpot damps; [s] the longest step, 0 = any
};

/// What contact does to a particle.
template <int Dim>
struct Touched {
  Vec<Dim> force = Vec<Dim>::Zero(), shear = Vec<Dim>::Zero();
  ContactCouple<Dim> couple = ContactCouple<Dim>::Zero();  ///< [N m]
  double lost = 0;                                         ///< [J] by sliding and damping
  Eigen::Matrix<double, Dim, Dim> stiffness = Eigen::Matrix<double, Dim, Dim>::Zero();
  bool any = false, slides = false;
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

/// The area on which cohesion with a surface of this normal acts [m^2]. It counts once, but
/// particles may touch that lie behind others. Where rows of particles lie along the surface the
/// first row has all of it: particles that reach no further than half of their size, or behind a
/// thin sliver, which then hardly touches. Where the surface cuts rows, those touch that lie in a
/// layer as thick as a particle: the area is their volume over this thickness.
template <int Dim>
double sticky_area(const Touching<Dim>& p, const Vec<Dim>& normal) {
  constexpr double along_axis = 0.99, behind_sliver = 1.7, whole = 0.95;
  const double reach = p.reach / (0.5 * p.edge);
  if (normal.cwiseAbs().maxCoeff() > along_axis) return reach <= behind_sliver ? p.area : 0.0;
  const double thickness = reach < whole ? std::max(p.edge, 0.5 * p.h) : p.edge;
  return p.depth * p.section / thickness;
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
  if (!reactions) add_stiffness<Dim>(all, body, stiffness, near.normal, shear, most);
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
  all.couple += push * std::max(0.0, near.distance) * near.normal * near.normal.transpose();
  if (reactions) (*reactions)[k].template add<Dim>(-force, p.x - bodies.at(k).origin);
}

template <int Dim>
struct ContactRows {
  std::array<double*, Dim> force, shear, x;
  std::array<double*, contact_components<Dim>> couple;
  double *reach, *mass;
  explicit ContactRows(Particles<Dim>& particles)
      : force(particles.template rows<Dim>(Column::contact_force)),
        shear(particles.template rows<Dim>(Column::contact_shear)),
        x(particles.template rows<Dim>(Column::x)),
        couple(particles.template rows<contact_components<Dim>>(Column::contact_couple)),
        reach(particles.row(Column::contact_reach)),
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
/// distance to the surface of the body that it is part of, or 0. `volume` [m^Dim] of its section.
template <int Dim>
double first_reach(double given, const Vec<Dim>& x, double volume, const Bodies<Dim>& bodies) {
  double reach = given < 0 ? -given : 0.5 * edge_of_box<Dim>(volume);
  for (std::size_t k = 0; k < bodies.size(); ++k)
    reach = std::min(reach, bodies.nearest(k, x).distance);
  return std::max(reach, std::numeric_limits<double>::min());
}

/// What the particles of a bin have in common.
struct ContactBin {
  double density, modulus, h;  ///< [kg/m^3], [Pa], [m]
  const Analysis& analysis;
};

template <int Dim>
ContactBin contact_bin(const Patch<Dim>& patch, const StepContext<Dim>& step,
                       const ParticleBin& bin) {
  const Material& material = step.model->materials[bin.material];
  return {.density = material.density,
          .modulus = material.density * std::pow(wave_speed(material), 2),
          .h = patch.cell_size[static_cast<std::size_t>(bin.cell)],
          .analysis = step.model->analysis};
}

/// The surface by which a particle touches [m^(Dim - 1)]. A particle whose volume a surface has cut
/// lies flat on it, twice its reach thick.
template <int Dim>
double contact_area(double volume, double edge, double reach, double h) {
  const double flat = std::min(0.5 * volume / reach, side_of_box<Dim>(0.5 * h));
  return std::max(side_of_box<Dim>(edge), flat);
}

/// A particle at the beginning of a step.
template <int Dim>
void begin(Touching<Dim>& at, const ContactRows<Dim>& rows, const ContactBin& bin, Local p,
           const Bodies<Dim>& bodies) {
  at.x = get<Dim>(rows.x, p);
  at.mass = rows.mass[p];
  at.depth = depth_at(bin.analysis, at.x[0]);
  double& reach = rows.reach[p];
  if (!(reach > 0)) reach = first_reach(reach, at.x, at.mass / (bin.density * at.depth), bodies);
  at.reach = reach;
  at.damping = at.swings = at.longest = 0;
}

/// Over how long pushes are smoothed for couples [s].
double memory_time(const ContactBin& bin) {
  return memory * bin.h / std::sqrt(bin.modulus / bin.density);
}

/// The couple after a step, from that before it and that of the present push.
template <int Dim>
ContactCouple<Dim> mean_couple(const ContactCouple<Dim>& before, const ContactCouple<Dim>& now,
                               double T, double dt) {
  return (T * before + dt * now) / (T + dt);
}

/// The step moves it, and its material gives it a spring.
template <int Dim>
void move_with_step(Touching<Dim>& p, const ContactBin& bin, const Vec<Dim>& move, double dt) {
  p.x += move;
  p.move = move;
  p.dt = dt;
  p.section = p.mass / (bin.density * p.depth);
  p.edge = edge_of_box<Dim>(p.section);
  p.h = bin.h;
  p.area = p.depth * contact_area<Dim>(p.section, p.edge, p.reach, bin.h);
  p.stiffness = bin.modulus * p.area / (0.5 * bin.h);
}

/// The longest step that a particle allows, as far as a run takes it [s]. A step that is cut short
/// for output does not change springs.
template <int Dim>
double longest_step(const StepContext<Dim>& step, const ContactBin& bin) {
  const TimeStep& steps = step.model->analysis.step;
  if (!steps.adaptive) return step.dt;
  return std::max(step.dt, steps.safety * bin.h / std::sqrt(bin.modulus / bin.density));
}

/// Spring and dashpot as an explicit step allows them.
template <int Dim>
void limit_spring(Touching<Dim>& p, const ContactBin& bin, double longest) {
  p.stiffness = std::min(p.stiffness, most_share * p.mass / (longest * longest));
  p.longest = longest;
  p.swings = std::min(0.5 * bin.density * p.area * bin.h, p.mass);
  p.damping = 2 * damping_ratio * std::sqrt(p.stiffness * p.swings);
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
  const Bodies<Dim> bodies(patch, step);
  const bool implicit = is_implicit(step.model->analysis);
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
            begin(at[lane], rows, common, first + static_cast<Local>(lane), bodies);
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
            if (!implicit && now[lane].any)
              couple = mean_couple<Dim>(contact_couple<Dim>(rows.couple, p), now[lane].couple, T,
                                        step.dt);
            set_contact_couple<Dim>(rows.couple, p, couple);
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
                         contact_couple<Dim>(rows.couple, p), rows.reach[p]);
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
  begin(at, rows, common, p, bodies);
  move_with_step(at, common, move, step.dt);
  Touched<Dim> now;
  Vec<Dim> rest = get<Dim>(rows.shear, p);
  for (std::size_t k = 0; k < bodies.size(); ++k)
    touch<Dim>(at, bodies, k, bodies.nearest(k, at.x), closed * common.h, nullptr, rest, now);
  return {now.force, now.stiffness, now.any, now.slides};
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
