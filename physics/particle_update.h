/// \file What G2P does to a pack of particles once nodal values are interpolated.
#pragma once

#include <vector>

#include "physics/patch.h"
#include "physics/simd.h"

namespace lahar {

/// What of the nodal fields the velocity update takes.
struct VelocityUpdate {
  double keep;          ///< factor of the particle's own velocity (FLIP fraction)
  double acceleration;  ///< factor of the interpolated acceleration [s]
  double velocity;      ///< factor of the interpolated velocity (PIC fraction)

  VelocityUpdate(double flip, double dt)
      : keep(flip), acceleration(flip * dt), velocity(1.0 - flip) {}
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

/// Velocities and places of the n particles from p on, from interpolated v and a. Returns the speed
/// squared at each lane, zero beyond the n.
template <int Dim, class Real>
LAHAR_INLINE Real advance(const MovedRows<Dim>& rows, Local p, Local n, const Real (&v)[Dim],
                          const Real (&a)[Dim], const VelocityUpdate& update, double dt) {
  Real speed2(0.0);
  LAHAR_UNROLL
  for (std::size_t d = 0; d < Dim; ++d) {
    // Factors of exactly 0 and 1 leave pure FLIP and pure PIC unchanged to the last bit.
    const Real blended = update.keep * load<Real>(rows.v[d] + p) + update.acceleration * a[d] +
                         update.velocity * v[d];
    store_first(blended, rows.v[d] + p, n);
    speed2 += blended * blended;
    const Real move = dt * v[d];
    store_first(load<Real>(rows.x[d] + p) + move, rows.x[d] + p, n);
    store_first(load<Real>(rows.u[d] + p) + move, rows.u[d] + p, n);
  }
  return first_lanes(speed2, n);
}

/// Raise Patch::max_speed to the speeds whose squares the lanes hold [m/s].
template <int Dim, class Real>
LAHAR_INLINE void note_speeds(Patch<Dim>& patch, const Real& speed2) {
  for (int lane = 0; lane < lanes<Real>; ++lane)
    patch.max_speed = std::max(patch.max_speed, std::sqrt(speed2[lane]));
}

/// Particles whose velocities are prescribed: begin() comes before G2P moves a run, end() after it.
template <int Dim>
class PrescribedMotion {
 public:
  PrescribedMotion(Patch<Dim>& patch, const StepContext<Dim>& step) : patch_(patch), step_(step) {}
  void begin(const Run& run) {
    if (run.loaded && step_.model->analysis.drives_nodes) keep_places(run);
  }
  void end(const Run& run) {
    if (run.loaded) prescribe(run);
  }

 private:
  void keep_places(const Run& run);
  void prescribe(const Run& run);

  Patch<Dim>& patch_;
  const StepContext<Dim>& step_;
  std::vector<double> kept_;  ///< [m] x, u along prescribed directions, as G2P found them
};

}  // namespace lahar
