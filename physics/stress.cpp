/// Strain increment and constitutive update.
#include "physics/cell_map.h"
#include "physics/kernels.h"
#include "physics/law.h"

namespace lahar {

namespace {

template <int Dim>
inline constexpr std::array<int, strain_components<Dim>> strain_voigt = [] {
  if constexpr (Dim == 2)
    return std::array<int, 3>{0, 1, 3};
  else
    return std::array<int, 6>{0, 1, 2, 3, 4, 5};
}();

/// Strain rate with engineering shear from the velocity gradient; Voigt rows of a stress.
template <int Dim, class Real>
void strain_rate(const Real (&L)[Dim][Dim], Real (&rate)[stress_components<Dim>]) {
  rate[0] = L[0][0];
  rate[1] = L[1][1];
  if constexpr (Dim == 2) {
    rate[2] = Real(0.0);
    rate[3] = L[0][1] + L[1][0];
  } else {
    rate[2] = L[2][2];
    rate[3] = L[0][1] + L[1][0];
    rate[4] = L[1][2] + L[2][1];
    rate[5] = L[0][2] + L[2][0];
  }
}

/// One run with its law and cell map; `work` collects V sigma : d(eps) with the mean stress.
template <int Dim, class Real, class Map, class LawType>
void update_run(Patch<Dim>& patch, const Run& run, double dt, StressPart part, const LawType& law,
                Real& work) {
  const Map map(patch, run.cell);
  const CornerDifferences<Dim> difference(patch.velocity.data(), Dim,
                                          patch.topology.corner_nodes[run.cell]);
  double Gc[Dim][Dim], Lc[Dim][Dim];
  difference.centre_gradient(Gc);
  map.to_physical_centre(Gc, Lc);
  double volumetric = 0.0;
  for (int d = 0; d < Dim; ++d) volumetric += Lc[d][d];
  volumetric *= dt;

  Particles<Dim>& particles = patch.particles;
  if (!(1.0 + volumetric > 0.0) && patch.mark.kind == Mark::Kind::none) {
    patch.mark.kind = std::isfinite(volumetric) ? Mark::Kind::volume : Mark::Kind::not_finite;
    patch.mark.particle = particles.id[static_cast<std::size_t>(run.begin)];
    patch.mark.count = run.end - run.begin;
    for (int d = 0; d < Dim; ++d) patch.mark.position[d] = particles.row(Column::x, d)[run.begin];
  }
  double* V = particles.row(Column::volume);
  const auto xi = particles.template rows<Dim>(Column::xi);
  const auto strain = particles.template rows<strain_components<Dim>>(Column::strain);
  const auto sigma = particles.template rows<stress_components<Dim>>(Column::stress);
  double* pressure =
      particles.layout().has(Column::pressure) ? particles.row(Column::pressure) : nullptr;

  for (Local p = run.begin; p < run.end; p += lanes<Real>) {
    const Local n = run.end - p;
    Real G[Dim][Dim], L[Dim][Dim];
    const auto w = weights_at<Dim, Real>(xi, p);
    difference.gradient(w, G);
    map.to_physical(w, G, L);
    LawInput<Dim, Real> in;
    strain_rate<Dim, Real>(L, in.rate);
    in.dt = dt;
    in.volumetric = volumetric;

    if (part != StressPart::law) {
      for (int k = 0; k < strain_components<Dim>; ++k)
        store_first(load<Real>(strain[k] + p) + dt * in.rate[strain_voigt<Dim>[k]], strain[k] + p,
                    n);
      store_first(load<Real>(V + p) * (1.0 + volumetric), V + p, n);
    }
    if (part != StressPart::strain) {
      Real stress[stress_components<Dim>], p_value(0.0), power(0.0);
      for (int k = 0; k < stress_components<Dim>; ++k) stress[k] = load<Real>(sigma[k] + p);
      for (int k = 0; k < stress_components<Dim>; ++k) power += stress[k] * in.rate[k];
      if (pressure) p_value = load<Real>(pressure + p);
      update(law, in, stress, &p_value);
      if (pressure) store_first(p_value, pressure + p, n);
      for (int k = 0; k < stress_components<Dim>; ++k) {
        power += stress[k] * in.rate[k];
        store_first(stress[k], sigma[k] + p, n);
      }
      work += (0.5 * dt) * load_first<Real>(V + p, n) * power;
    }
  }
}

}  // namespace

template <int Dim, class Real>
void update_stress(Patch<Dim>& patch, const StepContext<Dim>& step, StressPart part) {
  Real work(0.0);
  for (const Run& run : patch.runs)
    std::visit(
        [&](const auto& law) {
          if (patch.cartesian)
            update_run<Dim, Real, CartesianMap<Dim>>(patch, run, step.dt, part, law, work);
          else
            update_run<Dim, Real, IsoparametricMap<Dim>>(patch, run, step.dt, part, law, work);
        },
        step.model->materials[run.material].law);
  patch.work.internal += reduce(work);
}

#define LAHAR_INSTANTIATE(Dim, Real) \
  template void update_stress<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, StressPart);
LAHAR_INSTANTIATE(2, Pack)
LAHAR_INSTANTIATE(3, Pack)
LAHAR_INSTANTIATE(2, Scalar)
LAHAR_INSTANTIATE(3, Scalar)

}  // namespace lahar
