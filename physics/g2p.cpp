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
  for (Local p = run.begin; p < run.end; p += lanes<Real>) {
    const auto mask = first_lanes<Real>(run.end - p);
    Real xi[Dim], v[Dim], a[Dim];
    for (int d = 0; d < Dim; ++d) xi[d] = load<Real>(particles.row(Column::xi, d) + p);
    const Weights<Dim, Real> w(xi);
    for (int d = 0; d < Dim; ++d) v[d] = a[d] = Real(0.0);
    for (int i = 0; i < corners<Dim>; ++i) {
      const Real N = w.N(i);
      for (int d = 0; d < Dim; ++d) {
        v[d] += N * node_v[i][d];
        a[d] += N * node_a[i][d];
      }
    }
    for (int d = 0; d < Dim; ++d) {
      double* own = particles.row(Column::v, d) + p;
      double* x = particles.row(Column::x, d) + p;
      double* u = particles.row(Column::u, d) + p;
      // Factors of exactly 0 and 1 leave pure FLIP and pure PIC unchanged to the last bit.
      const Real blended =
          update.keep * load<Real>(own) + update.acceleration * a[d] + update.velocity * v[d];
      store(blended, own, mask);
      const Real move = dt * v[d];
      store(load<Real>(x) + move, x, mask);
      store(load<Real>(u) + move, u, mask);
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
    Scalar xi[Dim];
    for (int d = 0; d < Dim; ++d) xi[d] = particles.row(Column::xi, d)[p];
    const Weights<Dim, Scalar> w(xi);
    for (int i = 0; i < corners<Dim>; ++i)
      for (int d = 0; d < Dim; ++d)
        patch.work.external += f[d] * w.N(i)[0] * patch.velocity[corner[i] * Dim + d] * step.dt;
    for (std::size_t k = 0; k < model.particle_velocities.size(); ++k)
      if (bits >> (model.tractions.size() + k) & 1)
        particles.row(Column::v, model.particle_velocities[k].dir)[p] =
            model.particle_velocities[k].velocity;
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
      nodal[i] = m > least_mass_velocity ? sum[corner[i]] / m : 0.0;
    }
    for (Local p = run.begin; p < run.end; p += lanes<Real>) {
      Real xi[Dim];
      for (int d = 0; d < Dim; ++d) xi[d] = load<Real>(particles.row(Column::xi, d) + p);
      const Weights<Dim, Real> w(xi);
      Real pressure(0.0);
      for (int i = 0; i < corners<Dim>; ++i) pressure += w.N(i) * nodal[i];
      store(pressure, particles.row(Column::pressure) + p, first_lanes<Real>(run.end - p));
    }
  }
}

#define LAHAR_INSTANTIATE(Dim, Real)                                              \
  template void update_particles<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&); \
  template void smooth_pressure<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2, Pack)
LAHAR_INSTANTIATE(3, Pack)
LAHAR_INSTANTIATE(2, Scalar)
LAHAR_INSTANTIATE(3, Scalar)

}  // namespace lahar
