/// Grid to particle: velocities and positions, nodal pressure.
#include "physics/cell_map.h"
#include "physics/kernels.h"
#include "physics/law.h"
#include "physics/loads.h"

namespace lahar {

namespace {

/// What of the nodal fields the velocity update takes.
struct VelocityUpdate {
  double keep;          ///< factor of the particle's own velocity (FLIP fraction)
  double acceleration;  ///< factor of the interpolated acceleration [s]
  double velocity;      ///< factor of the interpolated velocity (PIC fraction)
};

/// Rows of the columns that the stage changes.
template <int Dim>
struct Rows {
  std::array<double*, Dim> v, x, u;

  explicit Rows(Particles<Dim>& particles)
      : v(particles.template rows<Dim>(Column::v)),
        x(particles.template rows<Dim>(Column::x)),
        u(particles.template rows<Dim>(Column::u)) {}
};

/// Returns the largest speed squared at each lane.
template <int Dim, class Real, class Map>
LAHAR_INLINE Real update_run(const Patch<Dim>& patch, const Map& map, const Run& run,
                             const Rows<Dim>& rows, const VelocityUpdate& update, double dt) {
  const auto& corner = patch.topology.corner_nodes[static_cast<std::size_t>(run.cell)];
  const double *node_v[corners<Dim>], *node_a[corners<Dim>];
  LAHAR_UNROLL
  for (std::size_t i = 0; i < corners<Dim>; ++i) {
    node_v[i] = patch.velocity.data() + static_cast<std::ptrdiff_t>(corner[i]) * node_width;
    node_a[i] = patch.acceleration.data() + static_cast<std::ptrdiff_t>(corner[i]) * node_width;
  }
  Real fastest(0.0);
  for (Local p = run.begin; p < run.end; p += lanes<Real>) {
    const Local n = run.end - p;
    prefetch(rows.v, p);
    prefetch(rows.u, p);
    const auto w = weights_at<Dim, Real>(map, p);
    Real v[Dim], a[Dim];
    LAHAR_UNROLL
    for (int i = 0; i < corners<Dim>; ++i) {
      const Real N = w.N(i);
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d)
        v[d] = i == 0 ? multiply(N, node_v[i] + d) : multiply_add(v[d], N, node_v[i] + d);
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d)
        a[d] = i == 0 ? multiply(N, node_a[i] + d) : multiply_add(a[d], N, node_a[i] + d);
    }
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
    fastest = max(fastest, first_lanes(speed2, n));
  }
  return fastest;
}

/// Prescribed velocities of the particles of one run.
template <int Dim>
void prescribe_velocities(Patch<Dim>& patch, const Run& run, const StepContext<Dim>& step) {
  const Model<Dim>& model = *step.model;
  Particles<Dim>& particles = patch.particles;
  for (Local p = run.begin; p < run.end; ++p) {
    const std::uint64_t bits = particles.loads[static_cast<std::size_t>(p)];
    for (std::size_t k = 0; k < model.particle_velocities.size(); ++k)
      if (bits >> (model.tractions.size() + k) & 1) {
        double& v = particles.row(Column::v, model.particle_velocities[k].dir)[p];
        const double prescribed = model.particle_velocities[k].velocity;
        patch.work.external +=
            0.5 * particles.row(Column::mass)[p] * (prescribed - v) * (prescribed + v);
        v = prescribed;
        patch.max_speed = std::max(patch.max_speed, std::sqrt(Dim) * std::abs(prescribed));
      }
  }
}

}  // namespace

template <int Dim, class Real>
void update_particles(Patch<Dim>& patch, const StepContext<Dim>& step, Runs runs) {
  const double flip = step.model->analysis.flip;
  const VelocityUpdate update{flip, flip * step.dt, 1.0 - flip};
  const Rows<Dim> rows(patch.particles);
  Real fastest(0.0);
  for_each_run(
      patch, runs, [&](const auto& map, const Run& run) __attribute__((always_inline)) {
        fastest = max(fastest, update_run<Dim, Real>(patch, map, run, rows, update, step.dt));
        if (run.loaded) prescribe_velocities(patch, run, step);
      });
  for (int lane = 0; lane < lanes<Real>; ++lane)
    patch.max_speed = std::max(patch.max_speed, std::sqrt(fastest[lane]));
}

template <int Dim>
void add_work_of_tractions(Patch<Dim>& patch, const StepContext<Dim>& step, Runs runs) {
  if (step.model->tractions.empty()) return;
  for_each_run(patch, runs, [&](const auto& map, const Run& run) {
    if (!run.loaded) return;
    const auto& corner = patch.topology.corner_nodes[static_cast<std::size_t>(run.cell)];
    for (Local p = run.begin; p < run.end; ++p) {
      const Vec<Dim> f = traction_on(patch.particles, p, step);
      if (f.isZero(0.0)) continue;
      const auto w = weights_at<Dim, Scalar>(map, p);
      for (int i = 0; i < corners<Dim>; ++i)
        for (int d = 0; d < Dim; ++d) {  // with the mean velocity of the step, as at nodes
          const auto at =
              static_cast<std::size_t>(corner[static_cast<std::size_t>(i)]) * node_width +
              static_cast<std::size_t>(d);
          const double v = patch.velocity[at] - 0.5 * step.dt * patch.acceleration[at];
          patch.work.external += f[d] * w.N(i)[0] * v * step.dt;
        }
    }
  });
}

template <int Dim, class Real>
void smooth_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, Runs runs) {
  Particles<Dim>& particles = patch.particles;
  for_each_run(patch, runs, [&](const auto& map, const Run& run) {
    if (!has_pressure(step.model->materials[run.material].law)) return;
    const auto& corner = patch.topology.corner_nodes[static_cast<std::size_t>(run.cell)];
    for (Local p = run.begin; p < run.end; p += lanes<Real>) {
      const auto w = weights_at<Dim, Real>(map, p);
      Real pressure(0.0);
      LAHAR_UNROLL
      for (std::size_t i = 0; i < corners<Dim>; ++i)
        pressure = multiply_add(pressure, w.N(static_cast<int>(i)),
                                &patch.pressure[static_cast<std::size_t>(corner[i])]);
      store_first(pressure, particles.row(Column::state) + p, run.end - p);
    }
  });
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                     \
  template void update_particles<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, Runs); \
  template void smooth_pressure<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, Runs);
LAHAR_INSTANTIATE(2, Pack)
LAHAR_INSTANTIATE(3, Pack)
LAHAR_INSTANTIATE(2, Scalar)
LAHAR_INSTANTIATE(3, Scalar)
template void add_work_of_tractions<2>(Patch<2>&, const StepContext<2>&, Runs);
template void add_work_of_tractions<3>(Patch<3>&, const StepContext<3>&, Runs);

}  // namespace lahar
