/// \file Springs between particles and rigid bodies (rigid_contact.h).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "physics/kernels/near_bodies.h"
#include "physics/materials/law.h"
#include "physics/model/contact_rows.h"
#include "physics/particles/contact_couple.h"
#include "physics/particles/loads.h"

namespace lahar {

inline constexpr double damping_ratio = 0.3;  ///< zeta
inline constexpr double most_share = 1.5;     ///< of m / dt^2 that k may be

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
  double extent;              ///< [m] to the end of its material
  double stiffness, damping;  ///< k, c
  double swings, longest;     ///< [kg] that the dashpot damps; [s] the longest step, 0 = any
  bool is_new;                ///< bodies have not seen it before
};

template <int Dim>
struct ContactRows {
  std::array<double*, Dim> force, shear, x;
  std::array<double*, contact_components<Dim>> couple;
  double *reach, *extent, *mass;
  explicit ContactRows(Particles<Dim>& particles)
      : force(particles.template rows<Dim>(Column::contact_force)),
        shear(particles.template rows<Dim>(Column::contact_shear)),
        x(particles.template rows<Dim>(Column::x)),
        couple(particles.template rows<contact_components<Dim>>(Column::contact_couple)),
        reach(particles.row(Column::contact_reach)),
        extent(particles.row(Column::contact_extent)),
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

/// Reach of a particle at x that is seen near a body for the first time, in a step of `dt` [s] at
/// whose end bodies are where they are. `given`: minus its distance to the surface of the body that
/// it is part of, or 0. `volume` [m^Dim] of its section.
template <int Dim>
double first_reach(double given, const Vec<Dim>& x, double volume, const Bodies<Dim>& bodies,
                   double dt) {
  double reach = given < 0 ? -given : 0.5 * edge_of_box<Dim>(volume);
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    const auto near = bodies.nearest(k, x);
    const double came_nearer =
        bodies[k].stays() ? 0.0 : dt * bodies.at(k).velocity_at(x).dot(near.normal);
    reach = std::min(reach, near.distance + came_nearer);
  }
  return std::max(reach, std::numeric_limits<double>::min());
}

/// What the particles of a bin have in common.
struct ContactBin {
  double density, modulus;   ///< [kg/m^3], [Pa] of the skeleton where pores hold a liquid
  double fastest, h;         ///< [Pa] modulus of the fastest wave, [m]
  const PoreLiquid* liquid;  ///< null: none
  const Analysis& analysis;
};

template <int Dim>
ContactBin contact_bin(const Patch<Dim>& patch, const StepContext<Dim>& step,
                       const ParticleBin& bin) {
  const Material& material = step.model->materials[bin.material];
  const double fastest = material.density * std::pow(wave_speed(material), 2);
  return {.density = material.density,
          .modulus = material.liquid ? wave_modulus(material.law) : fastest,
          .fastest = fastest,
          .h = patch.cell_size[static_cast<std::size_t>(bin.cell)],
          .liquid = material.liquid ? &*material.liquid : nullptr,
          .analysis = step.model->analysis};
}

/// The surface by which a particle touches [m^(Dim - 1)]. A particle whose volume a surface has cut
/// lies flat on it, twice its reach thick.
template <int Dim>
double contact_area(double volume, double edge, double reach, double h) {
  const double flat = std::min(0.5 * volume / reach, side_of_box<Dim>(0.5 * h));
  return std::max(side_of_box<Dim>(edge), flat);
}

/// A particle at the beginning of a step of `dt` [s].
template <int Dim>
void begin(Touching<Dim>& at, const ContactRows<Dim>& rows, const ContactBin& bin, Local p,
           const Bodies<Dim>& bodies, double dt) {
  at.x = get<Dim>(rows.x, p);
  at.mass = rows.mass[p];
  at.depth = depth_at(bin.analysis, at.x[0]);
  double& reach = rows.reach[p];
  at.is_new = !(reach > 0);
  if (at.is_new) reach = first_reach(reach, at.x, at.mass / (bin.density * at.depth), bodies, dt);
  at.reach = reach;
  double& extent = rows.extent[p];
  if (at.is_new && extent == 0.0) extent = reach;
  at.extent = extent;
  at.damping = at.swings = at.longest = 0;
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
  return std::max(step.dt, steps.safety * bin.h / std::sqrt(bin.fastest / bin.density));
}

/// Spring and dashpot as an explicit step allows them.
template <int Dim>
void limit_spring(Touching<Dim>& p, const ContactBin& bin, double longest) {
  p.stiffness = std::min(p.stiffness, most_share * p.mass / (longest * longest));
  p.longest = longest;
  p.swings = std::min(0.5 * bin.density * p.area * bin.h, p.mass);
  p.damping = 2 * damping_ratio * std::sqrt(p.stiffness * p.swings);
}

/// Distance of a particle to the end of the material in front of it, over half of its edge, from
/// which on this sliver holds what touches the surface: it is 0.35 of a particle thick.
inline constexpr double behind_sliver = 1.7;

/// The area on which cohesion with a surface of this normal acts [m^2]. It counts once, but
/// particles may touch that lie behind others. Where rows of particles lie along the surface the
/// first row has all of it: particles whose material ends no further than half of their size away,
/// or behind a thin sliver, which then hardly touches. Where the surface cuts rows, those touch
/// that lie in a layer as thick as a particle: the area is their volume over this thickness.
template <int Dim>
double sticky_area(const Touching<Dim>& p, const Vec<Dim>& normal) {
  constexpr double whole = 0.95;
  if (is_along_axis<Dim>(normal)) return p.extent <= behind_sliver * 0.5 * p.edge ? p.area : 0.0;
  const double reach = p.reach / (0.5 * p.edge);
  const double thickness = reach < whole ? std::max(p.edge, 0.5 * p.h) : p.edge;
  return p.depth * p.section / thickness;
}

}  // namespace lahar
