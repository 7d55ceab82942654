/// Grid to particle: velocities and positions, nodal pressure.
#include "physics/kernels.h"
#include "physics/law.h"
#include "physics/loads.h"
#include "physics/shape.h"

namespace lahar {

namespace {

/// What of the nodal fields the velocity update takes.
struct VelocityUpdate {
  double keep;          ///< factor of the particle's own velocity (FLIP fraction)
  double acceleration;  ///< factor of the interpolated acceleration [s]
  double velocity;      ///< factor of the interpolated velocity (PIC fraction)
};

template <int Dim, class Real>
void update_run(Patch<Dim>& patch, const Run& run, const VelocityUpdate& update, double dt) {
  const auto& corner = patch.topology.corner_nodes[run.cell];
  double node_v[corners<Dim>][Dim], node_a[corners<Dim>][Dim];
  for (int i = 0; i < corners<Dim>; ++i)
    for (int d = 0; d < Dim; ++d) {
      node_v[i][d] = patch.velocity[corner[i] * Dim + d];
      node_a[i][d] = patch.acceleration[corner[i] * Dim + d];
    }
  Particles<Dim>& particles = patch.particles;
  const auto xi = particles.template rows<Dim>(Column::xi);
  const auto own_v = particles.template rows<Dim>(Column::v);
  const auto x = particles.template rows<Dim>(Column::x);
  const auto u = particles.template rows<Dim>(Column::u);
  for (Local p = run.begin; p < run.end; p += lanes<Real>) {
    const Local n = run.end - p;
    const auto w = weights_at<Dim, Real>(xi, p);
    Real v[Dim], a[Dim];
    for (int d = 0; d < Dim; ++d) v[d] = a[d] = Real(0.0);
    for (int i = 0; i < corners<Dim>; ++i) {
      const Real N = w.N(i);
      for (int d = 0; d < Dim; ++d) {
        v[d] += N * node_v[i][d];
        a[d] += N * node_a[i][d];
      }
    }
    for (int d = 0; d < Dim; ++d) {
      // Factors of exactly 0 and 1 leave pure FLIP and pure PIC unchanged to the last bit.
      const Real blended = update.keep * load<Real>(own_v[d] + p) + update.acceleration * a[d] +
                           update.velocity * v[d];
      store_first(blended, own_v[d] + p, n);
      const Real move = dt * v[d];
      store_first(load<Real>(x[d] + p) + move, x[d] + p, n);
      store_first(load<Real>(u[d] + p) + move, u[d] + p, n);
    }
  }
}

/// Prescribed velocities of the particles of one run, and the work of tractions on them.
template <int Dim>
void finish_loaded_run(Patch<Dim>& patch, const Run& run, const StepContext<Dim>& step) {
  const Model<Dim>& model = *step.model;
  Particles<Dim>& particles = patch.particles;
  const auto& corner = patch.topology.corner_nodes[run.cell];
  for (Local p = run.begin; p < run.end; ++p) {
    const std::uint64_t bits = particles.loads[static_cast<std::size_t>(p)];
    if (bits == 0) continue;
    const Vec<Dim> f = traction_on(particles, p, step);
    const auto w = weights_at<Dim, Scalar>(particles.template rows<Dim>(Column::xi), p);
    for (int i = 0; i < corners<Dim>; ++i)
      for (int d = 0; d < Dim; ++d) {  // with the mean velocity of the step, as at nodes
        const Local at = corner[i] * Dim + d;
        const double v = patch.velocity[at] - 0.5 * step.dt * patch.acceleration[at];
        patch.work.external += f[d] * w.N(i)[0] * v * step.dt;
      }
    for (std::size_t k = 0; k < model.particle_velocities.size(); ++k)
      if (bits >> (model.tractions.size() + k) & 1) {
        double& v = particles.row(Column::v, model.particle_velocities[k].dir)[p];
        const double prescribed = model.particle_velocities[k].velocity;
        patch.work.external +=
            0.5 * particles.row(Column::mass)[p] * (prescribed - v) * (prescribed + v);
        v = prescribed;
      }
  }
}

}  // namespace

template <int Dim, class Real>
void update_particles(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const double flip = step.model->analysis.flip;
  const VelocityUpdate update{flip, flip * step.dt, 1.0 - flip};
  for (const Run& run : patch.runs) {
    update_run<Dim, Real>(patch, run, update, step.dt);
    if (run.loaded) finish_loaded_run(patch, run, step);
  }
}

template <int Dim, class Real>
void smooth_pressure(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const double* mass = patch.total[static_cast<int>(NodeSum::mass_momentum)].data();
  const double* sum = patch.total[static_cast<int>(NodeSum::pressure)].data();
  const int width = node_sum_width<Dim>[static_cast<int>(NodeSum::mass_momentum)];
  Particles<Dim>& particles = patch.particles;
  for (const Run& run : patch.runs) {
    if (!has_pressure(step.model->materials[run.material].law)) continue;
    const auto& corner = patch.topology.corner_nodes[run.cell];
    double nodal[corners<Dim>];
    for (int i = 0; i < corners<Dim>; ++i) {
      const double m = mass[corner[i] * width];
      nodal[i] = m > 0.1 * patch.least_mass ? sum[corner[i]] / m : 0.0;
    }
    const auto xi = particles.template rows<Dim>(Column::xi);
    for (Local p = run.begin; p < run.end; p += lanes<Real>) {
      const auto w = weights_at<Dim, Real>(xi, p);
      Real pressure(0.0);
      for (int i = 0; i < corners<Dim>; ++i) pressure += w.N(i) * nodal[i];
      store_first(pressure, particles.row(Column::pressure) + p, run.end - p);
    }
  }
}

#define LAHAR_INSTANTIATE(Dim, Real)                                               \
  template void update_particles<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&); \
  template void smooth_pressure<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2, Pack)
LAHAR_INSTANTIATE(3, Pack)
LAHAR_INSTANTIATE(2, Scalar)
LAHAR_INSTANTIATE(3, Scalar)

}  // namespace lahar
