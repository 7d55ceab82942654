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
LAHAR_INLINE void strain_rate(const Real (&L)[Dim][Dim], Real (&rate)[stress_components<Dim>]) {
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

/// Rows of the columns that the stage changes; null where there is no such column.
template <int Dim>
struct Rows {
  std::array<double*, stress_components<Dim>> stress;
  std::array<double*, strain_components<Dim>> strain{};
  double *volume, *pressure = nullptr;

  explicit Rows(Particles<Dim>& particles)
      : stress(particles.template rows<stress_components<Dim>>(Column::stress)),
        volume(particles.row(Column::volume)) {
    if (particles.layout().has(Column::strain))
      strain = particles.template rows<strain_components<Dim>>(Column::strain);
    if (particles.layout().has(Column::pressure)) pressure = particles.row(Column::pressure);
  }
};

template <int Dim>
void mark_collapse(Patch<Dim>& patch, const Run& run, double volumetric) {
  if (patch.mark.kind != Mark::Kind::none) return;
  patch.mark.kind = std::isfinite(volumetric) ? Mark::Kind::volume : Mark::Kind::not_finite;
  patch.mark.particle = patch.particles.id[static_cast<std::size_t>(run.begin)];
  patch.mark.count = run.end - run.begin;
  for (int d = 0; d < Dim; ++d)
    patch.mark.position[static_cast<std::size_t>(d)] = patch.particles.row(Column::x, d)[run.begin];
}

/// One run with its law and cell map; returns the sum of V sigma : d(eps) with the mean stress.
template <int Dim, class Real, class Map, class LawType>
LAHAR_INLINE Real update_run(Patch<Dim>& patch, const Map& map, const Run& run,
                             const Rows<Dim>& rows, double dt, StressPart part, LawType law) {
  const CornerDifferences<Dim> difference(
      patch.velocity.data(), patch.topology.corner_nodes[static_cast<std::size_t>(run.cell)]);
  double Gc[Dim][Dim], Lc[Dim][Dim];
  difference.centre_gradient(Gc);
  map.to_physical_centre(Gc, Lc);
  double volumetric = 0.0;
  LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) volumetric += Lc[d][d];
  volumetric *= dt;
  if (!(1.0 + volumetric > 0.0)) mark_collapse(patch, run, volumetric);

  Real work(0.0);
  for (Local p = run.begin; p < run.end; p += lanes<Real>) {
    const Local n = run.end - p;
    prefetch(rows.stress, p);
    Real G[Dim][Dim], L[Dim][Dim];
    difference.gradient(weights_at<Dim, Real>(map, p), G);
    map.to_physical(p, G, L);
    LawInput<Dim, Real> in;
    strain_rate<Dim, Real>(L, in.rate);
    in.dt = dt;
    in.volumetric = volumetric;

    if (part != StressPart::law) {
      if (rows.strain[0]) {
        LAHAR_UNROLL
        for (std::size_t k = 0; k < strain_components<Dim>; ++k)
          store_first(load<Real>(rows.strain[k] + p) + dt * in.rate[strain_voigt<Dim>[k]],
                      rows.strain[k] + p, n);
      }
      store_first(load<Real>(rows.volume + p) * (1.0 + volumetric), rows.volume + p, n);
    }
    if (part != StressPart::strain) {
      Real stress[stress_components<Dim>], pressure(0.0), power(0.0);
      LAHAR_UNROLL
      for (std::size_t k = 0; k < stress_components<Dim>; ++k) {
        stress[k] = load<Real>(rows.stress[k] + p);
        power += stress[k] * in.rate[k];
      }
      if (rows.pressure) pressure = load<Real>(rows.pressure + p);
      update(law, in, stress, &pressure);
      if (rows.pressure) store_first(pressure, rows.pressure + p, n);
      LAHAR_UNROLL
      for (std::size_t k = 0; k < stress_components<Dim>; ++k) {
        power += stress[k] * in.rate[k];
        store_first(stress[k], rows.stress[k] + p, n);
      }
      work += (0.5 * dt) * load_first<Real>(rows.volume + p, n) * power;
    }
  }
  return work;
}

}  // namespace

template <int Dim, class Real>
void update_stress(Patch<Dim>& patch, const StepContext<Dim>& step, Runs runs, StressPart part) {
  const Rows<Dim> rows(patch.particles);
  Real work(0.0);
  // Runs of one material together: its law is found once.
  for (std::size_t from = 0, to = 0; from < runs.size(); from = to) {
    while (to < runs.size() && runs[to].material == runs[from].material) ++to;
    std::visit(
        [&](const auto& law) {
          for_each_run(
              patch, runs.subspan(from, to - from),
              [&](const auto& map, const Run& run) __attribute__((always_inline)) {
                work += update_run<Dim, Real>(patch, map, run, rows, step.dt, part, law);
              });
        },
        step.model->materials[runs[from].material].law);
  }
  patch.work.internal += reduce(work);
}

#define LAHAR_INSTANTIATE(Dim, Real) \
  template void update_stress<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, Runs, StressPart);
LAHAR_INSTANTIATE(2, Pack)
LAHAR_INSTANTIATE(3, Pack)
LAHAR_INSTANTIATE(2, Scalar)
LAHAR_INSTANTIATE(3, Scalar)

}  // namespace lahar
