/// \file What particles give to nodes, for kernels that sum it with any basis.
#pragma once

#include <array>

#include "physics/base/simd.h"
#include "physics/particles/patch.h"

namespace lahar::general {

LAHAR_INLINE void add_to_node(double* sums, Local node, const NodeVector& value) {
  double* at = sums + static_cast<std::ptrdiff_t>(node) * sum_stride;
  store(load<NodeVector>(at) + value, at);
}

/// Mass and momentum of the first n particles from p on: m, m v and m C, with C zero unless there
/// is an affine part.
template <int Dim>
struct ParticleMomentum {
  const double* m = nullptr;
  std::array<const double*, Dim> v{};
  std::array<const double*, static_cast<std::size_t>(Dim) * Dim> C{};

  ParticleMomentum() = default;
  explicit ParticleMomentum(const Particles<Dim>& particles)
      : m(particles.row(Column::mass)), v(particles.template rows<Dim>(Column::v)) {
    if (particles.layout().has(Column::affine))
      C = particles.template rows<Dim * Dim>(Column::affine);
  }
  bool is_affine() const { return C[0] != nullptr; }

  template <class Real>
  LAHAR_INLINE void at(Local p, Local n, Real& mass, Real (&momentum)[Dim],
                       Real (&spin)[Dim][Dim]) const {
    mass = load_first<Real>(m + p, n);
    LAHAR_UNROLL
    for (std::size_t a = 0; a < Dim; ++a) {
      momentum[a] = mass * load<Real>(v[a] + p);
      LAHAR_UNROLL
      for (std::size_t d = 0; d < Dim; ++d) spin[a][d] = mass * load<Real>(C[Dim * a + d] + p);
    }
  }
};

/// V sigma of the first n particles from p on.
template <int Dim>
struct ParticleStress {
  const double* V;
  std::array<const double*, stress_components<Dim>> stress;

  explicit ParticleStress(const Particles<Dim>& particles)
      : V(particles.row(Column::volume)),
        stress(particles.template rows<stress_components<Dim>>(Column::stress)) {}

  template <class Real>
  LAHAR_INLINE void at(Local p, Local n, Real (&S)[Dim][Dim]) const {
    constexpr std::size_t voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    const Real volume = load_first<Real>(V + p, n);
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
    for (int b = 0; b < Dim; ++b) S[a][b] = volume * load<Real>(stress[voigt[a][b]] + p);
  }
};

/// The same of a pressure of 1 everywhere, whose internal force is sum_p V_p grad N_i.
template <int Dim>
struct UnitPressure {
  const double* V;

  template <class Real>
  LAHAR_INLINE void at(Local p, Local n, Real (&S)[Dim][Dim]) const {
    const Real volume = load_first<Real>(V + p, n);
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
    for (int b = 0; b < Dim; ++b) S[a][b] = a == b ? -volume : Real(0.0);
  }
};

}  // namespace lahar::general

namespace lahar {

/// {m v, m}_i += sum_p N_i m_p {v_p, 1} for the mass and velocity that `particle` names.
template <int Dim, class Real>
void map_momentum_of(Patch<Dim>& patch, ParticleBins bins,
                     const general::ParticleMomentum<Dim>& particle, double* sums);

/// map_force() with the stress that is given.
template <int Dim, class Real>
void map_force_of(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                  general::ParticleStress<Dim> stress);

/// g_i += sum_p V_p grad N_i with the row V.
template <int Dim, class Real>
void map_gradient_of(Patch<Dim>& patch, ParticleBins bins, const double* V, double* sums);

}  // namespace lahar
