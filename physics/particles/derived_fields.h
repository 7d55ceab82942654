/// \file Fields of frames that follow from columns of the particle. Frames have those that a
/// scenario names in `post_processing.vtk`; a new one is one row here.
#pragma once

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <string_view>

#include "physics/base/types.h"

namespace lahar {

/// A particle as frames show it: what a derived field may follow from. In 2D components that do not
/// exist are zero (the strain zz exists in sheets and bodies of revolution), and mass [kg] and
/// volume [m^3] are those of the whole body: of a metre of thickness, or of rings.
struct ParticleValues {
  double mass = 0, volume = 0;
  std::array<double, 3> x{}, v{}, u{};  ///< [m], [m/s], [m]
  Voigt stress{}, strain{};             ///< [Pa] positive in tension; [-] with engineering shears
  // The liquid in the pores; zero without one.
  double porosity = 0, liquid_mass = 0, pore_pressure = 0;  ///< [-], [kg], [Pa]

  /// p [Pa], positive in compression.
  double pressure() const { return -(stress[0] + stress[1] + stress[2]) / 3.0; }
};

inline double square(const std::array<double, 3>& a) {
  return a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
}

/// s:s of the deviator s of a tensor. Squares of shear components count `shear` times: 2, or 1/2 of
/// engineering shears.
inline double deviator_square(const Voigt& a, double shear) {
  const double mean = (a[0] + a[1] + a[2]) / 3.0;
  return square({a[0] - mean, a[1] - mean, a[2] - mean}) + shear * square({a[3], a[4], a[5]});
}

/// Principal value of a tensor, of 0, 1, 2 in ascending order (Eigen's symmetric solver).
inline double principal_value(const Voigt& a, int which) {
  Eigen::Matrix3d tensor;
  tensor << a[0], a[3], a[5], a[3], a[1], a[4], a[5], a[4], a[2];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(tensor, Eigen::EigenvaluesOnly);
  return solver.eigenvalues()[which];
}

struct DerivedField {
  std::string_view name;  ///< in frames and in `post_processing.vtk`
  std::string_view unit;
  int components;            ///< 1, or 6 as stress has
  std::string_view columns;  ///< of a frame, from which it follows; "" = from none
  std::string_view help;
  void (*value)(const ParticleValues& p, double* to);
};

// clang-format off
inline constexpr auto derived_fields = std::to_array<DerivedField>({
    {"speed", "m/s", 1, "velocity", "magnitude of the velocity",
     [](const ParticleValues& p, double* to) { *to = std::sqrt(square(p.v)); }},
    {"kinetic_energy", "J", 1, "mass velocity", "m v^2 / 2; in 2D per metre of thickness",
     [](const ParticleValues& p, double* to) { *to = 0.5 * p.mass * square(p.v); }},
    {"mass_density", "kg/m^3", 1, "mass volume", "mass over volume",
     [](const ParticleValues& p, double* to) { *to = p.mass / p.volume; }},
    {"mean_stress", "Pa", 1, "stress", "pressure p = -(xx + yy + zz) / 3 of the stress, positive in compression",
     [](const ParticleValues& p, double* to) { *to = p.pressure(); }},
    {"von_mises_stress", "Pa", 1, "stress", "q = sqrt(3/2 s:s), with the deviator s of the stress",
     [](const ParticleValues& p, double* to) { *to = std::sqrt(1.5 * deviator_square(p.stress, 2.0)); }},
    {"deviatoric_stress", "Pa", 6, "stress", "s: the stress without its mean",
     [](const ParticleValues& p, double* to) {
       for (std::size_t k = 0; k < 6; ++k) to[k] = p.stress[k] + (k < 3 ? p.pressure() : 0.0);
     }},
    {"volumetric_strain", "-", 1, "strain", "xx + yy + zz of the strain, positive in expansion",
     [](const ParticleValues& p, double* to) { *to = p.strain[0] + p.strain[1] + p.strain[2]; }},
    {"equivalent_strain", "-", 1, "strain", "sqrt(2/3 e:e), with the deviator e of the strain",
     [](const ParticleValues& p, double* to) { *to = std::sqrt(2.0 / 3.0 * deviator_square(p.strain, 0.5)); }},
    {"porosity", "-", 1, "", "volume of pores by whole volume, where a liquid fills them",
     [](const ParticleValues& p, double* to) { *to = p.porosity; }},
    {"liquid_mass", "kg", 1, "", "mass of the liquid in pores, as it is compressed; `mass` is that of the grains",
     [](const ParticleValues& p, double* to) { *to = p.liquid_mass; }},
    {"total_mean_stress", "Pa", 1, "stress pore_pressure", "mean_stress of skeleton and liquid together: with the pore pressure",
     [](const ParticleValues& p, double* to) { *to = p.pressure() + p.pore_pressure; }},
    {"principal_stress_1", "Pa", 1, "stress", "largest principal stress, positive in tension",
     [](const ParticleValues& p, double* to) { *to = principal_value(p.stress, 2); }},
    {"principal_stress_2", "Pa", 1, "stress", "principal stress between the largest and the least",
     [](const ParticleValues& p, double* to) { *to = principal_value(p.stress, 1); }},
    {"principal_stress_3", "Pa", 1, "stress", "least principal stress: minus the largest compression",
     [](const ParticleValues& p, double* to) { *to = principal_value(p.stress, 0); }},
    {"deviatoric_strain", "-", 6, "strain", "e: the strain without its mean, with engineering shears",
     [](const ParticleValues& p, double* to) {
       const double mean = (p.strain[0] + p.strain[1] + p.strain[2]) / 3.0;
       for (std::size_t k = 0; k < 6; ++k) to[k] = p.strain[k] - (k < 3 ? mean : 0.0);
     }},
});
// clang-format on

}  // namespace lahar
