/// Particle to grid: a run of particles of one cell is accumulated in registers, then added once to
/// the cell's nodes in the patch's private arrays. No other patch writes them.
#include "physics/cell_map.h"
#include "physics/kernels.h"
#include "physics/law.h"
#include "physics/loads.h"

namespace lahar {

namespace {

template <int Dim>
double* clear(Patch<Dim>& patch, NodeSum which) {
  auto& values = patch.partial[static_cast<int>(which)];
  std::fill(values.begin(), values.end(), 0.0);
  return values.data();
}

/// Add sum_p N_i q_p over the particles of each run to `Width` components per node, `stride` apart.
/// `values(run, p, n, q)` fills q for the first n particles from p on, zero in other lanes.
template <int Dim, int Width, class Real, class Values>
void scatter(const Patch<Dim>& patch, double* nodes, int stride, Values values) {
  const auto xi = patch.particles.template rows<Dim>(Column::xi);
  for (const Run& run : patch.runs) {
    Real sum[corners<Dim>][Width];
    for (auto& node : sum)
      for (Real& s : node) s = Real(0.0);
    for (Local p = run.begin; p < run.end; p += lanes<Real>) {
      const Weights<Dim, Real> w = weights_at<Dim, Real>(xi, p);
      Real q[Width];
      values(run, p, run.end - p, q);
      for (int i = 0; i < corners<Dim>; ++i) {
        const Real N = w.N(i);
        for (int k = 0; k < Width; ++k) sum[i][k] += N * q[k];
      }
    }
    const auto& corner = patch.topology.corner_nodes[run.cell];
    for (int i = 0; i < corners<Dim>; ++i)
      for (int k = 0; k < Width; ++k)
        nodes[static_cast<std::ptrdiff_t>(corner[i]) * stride + k] += reduce(sum[i][k]);
  }
}

}  // namespace

template <int Dim, class Real>
void map_mass_momentum(Patch<Dim>& patch) {
  double* nodes = clear(patch, NodeSum::mass_momentum);
  const Particles<Dim>& particles = patch.particles;
  const double* m = particles.row(Column::mass);
  const auto v = particles.template rows<Dim>(Column::v);
  scatter<Dim, Dim + 1, Real>(patch, nodes,
                              node_sum_width<Dim>[static_cast<int>(NodeSum::mass_momentum)],
                              [&](const Run&, Local p, Local n, Real(&q)[Dim + 1]) {
                                q[0] = load_first<Real>(m + p, n);
                                for (int d = 0; d < Dim; ++d)
                                  q[1 + d] = q[0] * load<Real>(v[d] + p);
                              });
}

template <int Dim, class Real>
void map_momentum(Patch<Dim>& patch) {
  double* nodes = clear(patch, NodeSum::momentum);
  const Particles<Dim>& particles = patch.particles;
  const double* m = particles.row(Column::mass);
  const auto v = particles.template rows<Dim>(Column::v);
  scatter<Dim, Dim, Real>(patch, nodes, node_sum_width<Dim>[static_cast<int>(NodeSum::momentum)],
                          [&](const Run&, Local p, Local n, Real(&q)[Dim]) {
                            const Real mass = load_first<Real>(m + p, n);
                            for (int d = 0; d < Dim; ++d) q[d] = mass * load<Real>(v[d] + p);
                          });
}

template <int Dim, class Real>
void map_pressure(Patch<Dim>& patch, const StepContext<Dim>& step) {
  double* nodes = clear(patch, NodeSum::pressure);
  if (!patch.particles.layout().has(Column::pressure)) return;
  const double* m = patch.particles.row(Column::mass);
  const double* pressure = patch.particles.row(Column::pressure);
  const auto& materials = step.model->materials;
  scatter<Dim, 1, Real>(patch, nodes, 1, [&](const Run& run, Local p, Local n, Real(&q)[1]) {
    q[0] = has_pressure(materials[run.material].law)
               ? load_first<Real>(m + p, n) * load<Real>(pressure + p)
               : Real(0.0);
  });
}

namespace {

/// Internal force of one run: -sum_p V_p sigma_p grad N_i. With corners paired across each axis the
/// gradient is +- face weight, so that one sum serves both corners of a pair.
template <int Dim, class Real, class Map>
void internal_force(const Patch<Dim>& patch, const Run& run, double* nodes, int stride) {
  const Map map(patch, run.cell);
  const Particles<Dim>& particles = patch.particles;
  const double* V = particles.row(Column::volume);
  const auto xi = particles.template rows<Dim>(Column::xi);
  const auto stress = particles.template rows<stress_components<Dim>>(Column::stress);
  Real sum[Dim][Dim][face_corners<Dim>];
  for (auto& row : sum)
    for (auto& axis : row)
      for (Real& s : axis) s = Real(0.0);

  for (Local p = run.begin; p < run.end; p += lanes<Real>) {
    const Weights<Dim, Real> w = weights_at<Dim, Real>(xi, p);
    const Real volume = load_first<Real>(V + p, run.end - p);
    Real S[Dim][Dim], T[Dim][Dim];
    constexpr int shear[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};  // Voigt component of (a, b)
    for (int a = 0; a < Dim; ++a)
      for (int b = a; b < Dim; ++b) {
        S[a][b] = volume * load<Real>(stress[shear[a][b]] + p);
        S[b][a] = S[a][b];
      }
    map.pull_back(w, S, T);
    for (int k = 0; k < Dim; ++k)
      for (int c = 0; c < face_corners<Dim>; ++c) {
        const Real face = 0.5 * w.face(k, c);
        for (int a = 0; a < Dim; ++a) sum[a][k][c] += T[a][k] * face;
      }
  }
  const auto& corner = patch.topology.corner_nodes[run.cell];
  for (int k = 0; k < Dim; ++k)
    for (int c = 0; c < face_corners<Dim>; ++c) {
      const int low = face_to_corner(k, c);
      double* f_low = nodes + static_cast<std::ptrdiff_t>(corner[low]) * stride;
      double* f_high = nodes + static_cast<std::ptrdiff_t>(corner[low | (1 << k)]) * stride;
      for (int a = 0; a < Dim; ++a) {
        const double f = reduce(sum[a][k][c]) * map.finish(k);
        f_low[a] += f;
        f_high[a] -= f;
      }
    }
}

/// Tractions on the particles of one run: N_i t V / size.
template <int Dim>
void traction_force(const Patch<Dim>& patch, const Run& run, const StepContext<Dim>& step,
                    double* nodes, int stride) {
  const auto& corner = patch.topology.corner_nodes[run.cell];
  const auto xi = patch.particles.template rows<Dim>(Column::xi);
  for (Local p = run.begin; p < run.end; ++p) {
    const Vec<Dim> f = traction_on(patch.particles, p, step);
    if (f.isZero(0.0)) continue;
    const Weights<Dim, Scalar> w = weights_at<Dim, Scalar>(xi, p);
    for (int i = 0; i < corners<Dim>; ++i) {
      const double N = w.N(i)[0];
      for (int d = 0; d < Dim; ++d)
        nodes[static_cast<std::ptrdiff_t>(corner[i]) * stride + d] += N * f[d];
    }
  }
}

}  // namespace

template <int Dim, class Real>
void map_force(Patch<Dim>& patch, const StepContext<Dim>& step) {
  double* nodes = clear(patch, NodeSum::force);
  const int stride = node_sum_width<Dim>[static_cast<int>(NodeSum::force)];
  for (const Run& run : patch.runs) {
    if (patch.cartesian)
      internal_force<Dim, Real, CartesianMap<Dim>>(patch, run, nodes, stride);
    else
      internal_force<Dim, Real, IsoparametricMap<Dim>>(patch, run, nodes, stride);
    if (run.loaded) traction_force(patch, run, step, nodes, stride);
  }
}

#define LAHAR_INSTANTIATE(Dim, Real)                                           \
  template void map_mass_momentum<Dim, Real>(Patch<Dim>&);                     \
  template void map_momentum<Dim, Real>(Patch<Dim>&);                          \
  template void map_pressure<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&); \
  template void map_force<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2, Pack)
LAHAR_INSTANTIATE(3, Pack)
LAHAR_INSTANTIATE(2, Scalar)
LAHAR_INSTANTIATE(3, Scalar)

}  // namespace lahar
