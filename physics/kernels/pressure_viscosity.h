/// \file Viscosity l sqrt(p / rho) of grains (VelocityTransfer): the particles' side.
#pragma once

#include <algorithm>
#include <array>

#include "physics/base/simd.h"
#include "physics/materials/law.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Mass times viscosity of particles. Their mean over a node is the node's viscosity.
template <int Dim>
class PressureViscosity {
 public:
  /// Of the sums of filters that of the first order, 2, has it.
  PressureViscosity(const Patch<Dim>& patch, const StepContext<Dim>& step, int order)
      : model_(*step.model) {
    if (order > 2) return;
    length_ = model_.analysis.transfer.viscosity_length;
    if (length_ == 0.0) return;
    mass_ = patch.particles.row(Column::mass);
    volume_ = patch.particles.row(Column::volume);
    for (int d = 0; d < 3; ++d)
      stress_[static_cast<std::size_t>(d)] = patch.particles.row(Column::stress, d);
  }
  /// Whether the particles of a bin have one: all but fluids, which have their own.
  bool acts_on(const ParticleBin& bin) const {
    return length_ > 0.0 && !has_pressure(model_.materials[bin.material].law);
  }
  /// m l sqrt(p / rho) [kg m^2/s] of the n particles from p on, 0 in other lanes and in tension.
  template <class Real>
  LAHAR_INLINE Real of(Local p, Local n) const {
    const Real sum =
        load<Real>(stress_[0] + p) + load<Real>(stress_[1] + p) + load<Real>(stress_[2] + p);
    const Real pressure = max(Real(0.0), Real((-1.0 / 3.0) * sum));
    const Real m = load_first<Real>(mass_ + p, n);
    return length_ * lahar::sqrt(Real(m * load_first<Real>(volume_ + p, n) * pressure));
  }

 private:
  const Model<Dim>& model_;
  double length_ = 0;
  const double *mass_ = nullptr, *volume_ = nullptr;
  std::array<const double*, 3> stress_{};
};

}  // namespace lahar
