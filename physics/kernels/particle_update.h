/// \file What G2P does to a pack of particles once nodal values are interpolated.
#pragma once

#include <vector>

#include "physics/base/simd.h"
#include "physics/kernels/velocity_transfer.h"
#include "physics/particles/patch.h"

namespace lahar {

/// What of the nodal fields the velocity update takes.
struct VelocityUpdate {
  double keep;          ///< factor of the particle's own velocity (FLIP fraction)
  double acceleration;  ///< factor of the interpolated acceleration [s]
  double velocity;      ///< factor of the interpolated velocity (PIC fraction)
  double flip_step;     ///< [s] the step, or 0 where a filter has the accelerations

  VelocityUpdate(double flip, double dt)
      : keep(flip), acceleration(flip * dt), velocity(1.0 - flip), flip_step(dt) {}
};

/// The velocity updates of a patch in a step, and what they take the acceleration from.
template <int Dim>
class VelocityUpdates {
 public:
  VelocityUpdates(const Patch<Dim>& patch, const StepContext<Dim>& step)
      : model_(*step.model), dt_(step.dt), filtered_(has_filter(model_.analysis.transfer)) {
    set(0);
    if (counts(model_.analysis)) mass_ = patch.particles.row(Column::mass);
  }
  LAHAR_INLINE const VelocityUpdate& of(const ParticleBin& bin) {
    if (model_.analysis.contact.bodies > 1)
      if (const int body = model_.materials[bin.material].body; body != body_) set(body);
    return update_;
  }
  /// Whether any needs the interpolated acceleration.
  bool need_acceleration() const {
    return filtered_ || !model_.analysis.transfer.rates.empty() ||
           model_.analysis.transfer.flip != 0.0;
  }
  /// Nodal field whose factor is VelocityUpdate::acceleration.
  const double* field(const Patch<Dim>& patch) const {
    return (filtered_ ? patch.transfer : patch.acceleration).data();
  }
  /// Nodal field whose mass lane has shares that the viscosity of pressures takes, else null.
  const double* shares_of_nodes(const Patch<Dim>& patch) const {
    return filtered_ && model_.analysis.transfer.viscosity_length > 0.0
               ? patch.transfer.data() + mass_lane
               : nullptr;
  }
  /// Masses of the particles where the kinetic energy that is taken is counted, else null.
  const double* mass() const { return mass_; }

 private:
  void set(int body) {
    body_ = body;
    update_ = VelocityUpdate(model_.analysis.transfer.kept(body, dt_), dt_);
    if (filtered_) update_.acceleration = 1.0, update_.velocity = 0.0;
    if (!blends(model_.analysis)) update_.flip_step = 0.0;
  }

  const Model<Dim>& model_;
  double dt_;
  bool filtered_;
  int body_ = 0;
  VelocityUpdate update_{1.0, 0.0};
  const double* mass_ = nullptr;
};

/// Rows of the columns that G2P changes.
template <int Dim>
struct MovedRows {
  std::array<double*, Dim> v, x, u;

  explicit MovedRows(Particles<Dim>& particles)
      : v(particles.template rows<Dim>(Column::v)),
        x(particles.template rows<Dim>(Column::x)),
        u(particles.template rows<Dim>(Column::u)) {}
};

/// What G2P finds of all particles, at each lane.
template <class Real>
struct Advanced {
  Real fastest = Real(0.0);  ///< largest speed squared
  Real lost = Real(0.0);     ///< kinetic energy that the transfer takes [J], see advance()
};

/// Places move with the velocity v of the nodes, whatever the particle's new one.
struct MovesWithNodes {
  template <class Real>
  LAHAR_INLINE Real operator()(std::size_t, const Real& v, const Real&) const {
    return v;
  }
};

/// Velocities and places of the n particles from p on, from interpolated v and a. `taken`: what
/// nodes take of the particles' own velocities besides. `moves(d, v_d,
/// new velocity)` says with which velocity places move. `mass`: of all
/// particles where energy is counted, else null. What a blend takes is the kinetic energy of FLIP's
/// velocities less that of the new ones; where a filter has the accelerations, the energy before
/// less that after, from which integrate() subtracts what nodes got.
template <int Dim, class Real, class Moves = MovesWithNodes>
LAHAR_INLINE void advance(const MovedRows<Dim>& rows, Local p, Local n, const Real (&v)[Dim],
                          const Real (&a)[Dim], const Real& taken, const VelocityUpdate& update,
                          double dt, const double* mass, Advanced<Real>& all,
                          const Moves& moves = {}) {
  Real speed2(0.0), lost(0.0);
  const Real keep = update.keep - taken;
  LAHAR_UNROLL
  for (std::size_t d = 0; d < Dim; ++d) {
    // Factors of exactly 0 and 1 leave pure FLIP and pure PIC unchanged to the last bit.
    const Real old = load<Real>(rows.v[d] + p);
    const Real blended = keep * old + update.acceleration * a[d] + update.velocity * v[d];
    if (mass) {
      const Real from = old + update.flip_step * a[d];
      lost += (from - blended) * (from + blended);
    }
    store_first(blended, rows.v[d] + p, n);
    speed2 += blended * blended;
    const Real move = dt * moves(d, v[d], blended);
    store_first(load<Real>(rows.x[d] + p) + move, rows.x[d] + p, n);
    store_first(load<Real>(rows.u[d] + p) + move, rows.u[d] + p, n);
  }
  all.fastest = max(all.fastest, first_lanes(speed2, n));
  if (mass) all.lost += first_lanes(Real(0.5 * load<Real>(mass + p) * lost), n);
}

/// Raise Patch::max_speed, and add what particles lost to what the transfer takes: what nodes got
/// is subtracted from it in integrate().
template <int Dim, class Real>
LAHAR_INLINE void note(Patch<Dim>& patch, const Advanced<Real>& all) {
  for (int lane = 0; lane < lanes<Real>; ++lane)
    patch.max_speed = std::max(patch.max_speed, std::sqrt(all.fastest[lane]));
  patch.work.damping += reduce(all.lost);
}

/// Particles whose velocities are prescribed: begin() comes before G2P moves a bin, end() after it.
template <int Dim>
class PrescribedMotion {
 public:
  PrescribedMotion(Patch<Dim>& patch, const StepContext<Dim>& step) : patch_(patch), step_(step) {}
  void begin(const ParticleBin& bin) {
    if (bin.loaded && step_.model->analysis.drives_nodes) keep_places(bin);
  }
  void end(const ParticleBin& bin) {
    if (bin.loaded) prescribe(bin);
  }

 private:
  void keep_places(const ParticleBin& bin);
  void prescribe(const ParticleBin& bin);

  Patch<Dim>& patch_;
  const StepContext<Dim>& step_;
  std::vector<double> kept_;  ///< [m] x, u along prescribed directions, as G2P found them
};

}  // namespace lahar
