/// \file CPDI2: how the corners of particles' domains move.
#pragma once

#include <bit>
#include <cmath>

#include "physics/basis/basis.h"

namespace lahar {

/// Corners move with the nodes, x_c += dt sum_i N_i(x_c) v_i, so that corners that particles share
/// stay together (Sadeghirad, Brannon & Guilkey 2013). The particle's place becomes the centroid of
/// its domain again, which moves a little otherwise where the domain's volume does not change
/// evenly: functions are then means about x_p. Its volume is not that of the domain, but follows
/// from strain as with other functions: the two differ as sums of 1 + dt tr L do.
template <int Dim>
class CornerMotion {
 public:
  CornerMotion(Patch<Dim>& patch, double dt) : patch_(patch), dt_(dt) {
    Particles<Dim>& particles = patch.particles;
    const auto& layout = particles.layout();
    if (!layout.has(Column::corners)) return;
    from_ = particles.template rows<n_rows>(Column::corners);
    to_ = layout.has(Column::next_corners) ? particles.template rows<n_rows>(Column::next_corners)
                                           : from_;
    x_ = particles.template rows<Dim>(Column::x);
    u_ = particles.template rows<Dim>(Column::u);
  }

  /// The domains of the n particles from p on, before these move by dt v_p. Nothing for bases
  /// without corners.
  template <class Real, class Basis>
  LAHAR_INLINE void move(const Basis& basis, Local p, Local n, const double* v, const Local* nodes,
                         const Real (&v_p)[Dim]) {
    if constexpr (moves_corners<Dim, Basis>) {
      Real relative[corners<Dim>][Dim];
      basis.corner_velocities(p, v, nodes, v_p, relative);
      move(p, n, relative);
    }
  }
  /// The same with the velocities of corners less v_p.
  template <class Real>
  LAHAR_INLINE void move(Local p, Local n, const Real (&relative)[corners<Dim>][Dim]) {
    Hexahedron<Dim, Real> domain;
    Real w[corners<Dim>];
    for (int c = 0; c < corners<Dim>; ++c)
      for (int d = 0; d < Dim; ++d)
        domain.r[c][d] = load<Real>(from_[row(c, d)] + p) + dt_ * relative[c][d];
    unsigned right = greater(domain.weights(w), Real(0.0));
    for (const Real& weight : w) right &= greater(weight, Real(0.0));
    const unsigned used = n >= lanes<Real> ? (1u << lanes<Real>)-1 : (1u << n) - 1;
    if (const unsigned folded = used & ~right; folded != 0) record(folded, p);
    for (int d = 0; d < Dim; ++d) {
      Real shift = w[0] * domain.r[0][d];
      for (int c = 1; c < corners<Dim>; ++c) shift += w[c] * domain.r[c][d];
      for (int c = 0; c < corners<Dim>; ++c)
        store_first(domain.r[c][d] - shift, to_[row(c, d)] + p, n);
      for (double* const at : {x_[static_cast<std::size_t>(d)], u_[static_cast<std::size_t>(d)]})
        store_first(load<Real>(at + p) + shift, at + p, n);
    }
  }

 private:
  static constexpr std::size_t n_rows = static_cast<std::size_t>(corners<Dim>) * Dim;
  static constexpr std::size_t row(int c, int d) { return static_cast<std::size_t>(Dim * c + d); }

  /// Particles p + lane whose domain has no volume any more, or corners of negative weight.
  [[gnu::noinline]] void record(unsigned bits, Local p) {
    for (; bits != 0; bits &= bits - 1) {
      const Local q = p + std::countr_zero(bits);
      ParticleFault& fault = patch_.fault;
      if (fault.kind == ParticleFault::Kind::folded) ++fault.count;
      if (fault.kind != ParticleFault::Kind::none) continue;
      fault.kind = ParticleFault::Kind::folded;
      fault.count = 1;
      fault.particle = patch_.particles.id[static_cast<std::size_t>(q)];
      for (int d = 0; d < Dim; ++d) {
        const auto at = static_cast<std::size_t>(d);
        fault.position[at] = x_[at][q];
        fault.velocity[at] = patch_.particles.row(Column::v, d)[q];
        if (!std::isfinite(fault.position[at] + fault.velocity[at]))
          fault.kind = ParticleFault::Kind::not_finite;
      }
    }
  }

  Patch<Dim>& patch_;
  double dt_;
  std::array<double*, n_rows> from_{}, to_{};
  std::array<double*, Dim> x_{}, u_{};
};

}  // namespace lahar
