// Grid to particle of a liquid in pores.
#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/basis/basis.h"
#include "physics/basis/cell_map.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/affine_velocity.h"
#include "physics/kernels/general_kernels.h"
#include "physics/kernels/given_pressure.h"
#include "physics/kernels/particle_forces.h"
#include "physics/kernels/particle_update.h"
#include "physics/kernels/pore_rows.h"
#include "physics/kernels/two_phase.h"
#include "physics/model/transfer_options.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

/// Rows of the liquid's velocity and, where energy is counted, its mass.
template <int Dim>
struct LiquidRows {
  std::array<double*, Dim> v;
  const double* mass = nullptr;

  LiquidRows(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins)
      : v(patch.particles.template rows<Dim>(Column::liquid_v)) {
    if (!counts(step.model->analysis)) return;
    const auto [row] = pore_rows<1>(patch.particles.capacity());
    fill_liquid_mass(patch, *step.model, bins, row);
    mass = row;
  }
};

/// Velocities of the n particles from p on, from those and the accelerations of nodes (advance() of
/// the skeleton). Adds to the kinetic energy that the transfer takes [J].
template <int Dim, class Real>
LAHAR_INLINE void advance_liquid(const LiquidRows<Dim>& rows, Local p, Local n,
                                 const Real (&v)[Dim], const Real (&a)[Dim],
                                 const VelocityUpdate& update, Real& all_lost) {
  Real lost(0.0);
  LAHAR_UNROLL
  for (std::size_t d = 0; d < Dim; ++d) {
    const Real old = load<Real>(rows.v[d] + p);
    const Real blended = update.keep * old + update.acceleration * a[d] + update.velocity * v[d];
    if (rows.mass) {
      const Real from = old + update.flip_step * a[d];
      lost += (from - blended) * (from + blended);
    }
    store_first(blended, rows.v[d] + p, n);
  }
  if (rows.mass) all_lost += first_lanes(Real(0.5 * load<Real>(rows.mass + p) * lost), n);
}

/// What is prescribed of the particles of a bin, and the work of it.
template <int Dim>
void prescribe_liquid(Patch<Dim>& patch, const StepContext<Dim>& step, const ParticleBin& bin,
                      const LiquidRows<Dim>& rows) {
  if (!bin.loaded) return;
  const Pores pores(step.model->materials[bin.material].liquid.value());
  for (Local p = bin.begin; p < bin.end; ++p) {
    const auto prescribed = prescribed_velocity(patch.particles, p, step, true);
    if (!prescribed.any()) continue;
    const Scalar m = pores.liquid_mass(Scalar(patch.particles.row(Column::mass)[p]),
                                       Scalar(patch.particles.row(Column::volume)[p]));
    for (std::size_t d = 0; d < Dim; ++d) {
      if (!prescribed.along[d]) continue;
      const double w = prescribed.velocity[d];
      double& v = rows.v[d][p];
      patch.work.external += m[0] * (w - v) * w;
      patch.work.damping += 0.5 * m[0] * (w - v) * (w - v);
      v = w;
    }
  }
}

/// By how much ln(volume of pores) grows in a step with div u dt = r, to a porosity n: r / n, but
/// for terms of the second order. With it liquids that do not flow keep their mass to rounding
/// (compressed_mass_of()).
inline double growth_of_pores(double r, double n) {
  const double share = r / (n * (1.0 + r));  // of the pores after the step
  return share < 0.5 ? -std::log1p(-share) : r / n;
}

/// Pressures of the n particles from p on, which fall by `fall` [Pa]; their work at div u [1/s].
template <int Dim>
LAHAR_INLINE void add_pressure(Patch<Dim>& patch, double dt, Local p, Local n, const Pack& fall,
                               const Pack& rate, Pack& all_work) {
  double* pressure = patch.particles.row(Column::pore_pressure) + p;
  const Pack V = load<Pack>(patch.particles.row(Column::volume) + p);
  const Pack before = load<Pack>(pressure);
  const Pack after = before - fall;
  store_first(after, pressure, n);
  all_work += first_lanes(Pack((-0.5 * dt) * V * (before + after) * rate), n);
}

inline double mean_by_volume(const double* values, const double* V, Local n) {
  double volume = 0, sum = 0;
  for (Local k = 0; k < n; ++k) volume += V[k], sum += V[k] * values[k];
  return sum / volume;
}

template <int Dim, class Map>
double trace_at_centre(const Map& map, const double* v,
                       const std::array<Local, corners<Dim>>& corner) {
  double dN[Dim][corners<Dim>], trace = 0.0;
  centre_gradients(map, dN);
  for (std::size_t i = 0; i < corner.size(); ++i)
    for (int d = 0; d < Dim; ++d)
      trace += dN[d][i] * v[static_cast<std::ptrdiff_t>(corner[i]) * node_width + d];
  return trace;
}

}  // namespace

template <int Dim>
void update_liquid(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const LiquidRows<Dim> rows(patch, step, bins);
  VelocityUpdates<Dim> updates(patch, step);
  if (has_liquid_tractions(*step.model))
    add_work_of_forces(
        patch, step, bins, patch.liquid.velocity, patch.liquid.acceleration,
        [](const ParticleBin& bin) { return bin.loaded; },
        [&](Local p) { return traction_on(patch.particles, p, step, true); });
  const double *v = patch.liquid.velocity.data(), *a = patch.liquid.acceleration.data();
  const double* const fields[2] = {v, a};
  const double* const accelerations[1] = {a};
  const double* spread =
      spreads_before_forces(step.model->analysis) ? patch.liquid.before.data() : v;
  const bool is_affine = patch.particles.layout().has(Column::liquid_affine);
  std::array<double*, static_cast<std::size_t>(Dim) * Dim> affine{};
  if (is_affine) affine = patch.particles.template rows<Dim * Dim>(Column::liquid_affine);
  Pack lost(0.0);
  for_each_bin_with_basis(
      patch, bins, has_liquid(*step.model),
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes)
          __attribute__((always_inline)) {
            const VelocityUpdate update = updates.of(bin);
            for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
              const Local n = bin.end - p;
              Pack sum[2][Dim];
              if (is_affine) {
                Pack change[1][Dim], C[Dim][Dim];
                general::affine_velocity<Dim>(basis, step.model->analysis.affine, p, v, spread,
                                              nodes, sum[0], C);
                general::interpolate<Dim, 1, Pack>(basis, p, accelerations, nodes, change);
                LAHAR_UNROLL
                for (std::size_t k = 0; k < Dim * Dim; ++k)
                  store_first(C[k / Dim][k % Dim], affine[k] + p, n);
                std::copy_n(change[0], Dim, sum[1]);
              } else {
                general::interpolate<Dim, 2, Pack>(basis, p, fields, nodes, sum);
              }
              advance_liquid<Dim>(rows, p, n, sum[0], sum[1], update, lost);
            }
            prescribe_liquid(patch, step, bin, rows);
          });
  patch.work.damping += reduce(lost);
}

template <int Dim>
void update_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                          const VelocityGradients<Dim>& skeleton) {
  const auto& materials = step.model->materials;
  const bool each = step.model->analysis.volume_as_cbgeo, nodal = !patch.liquid.porosity.empty();
  const NodeArray& moves = nodal ? patch.liquid.discharge : patch.liquid.velocity;
  const double* m = patch.particles.row(Column::mass);
  const double* V = patch.particles.row(Column::volume);
  Pack work(0.0);
  // `rates(p)` gives div v and div v_l, or div u, at the particles from p on.
  const auto update_bin = [&](const ParticleBin& bin, const Pores& pores, auto&& rates) {
    const Pack mean(each ? 0.0 : mean_porosity(patch, pores, bin));
    for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
      const Pack porosity = each ? pores.porosity(load<Pack>(m + p), load<Pack>(V + p)) : mean;
      const auto [skeleton, liquid] = rates(p);
      const Pack rate =
          nodal ? liquid : Pack((Pack(1.0) - porosity) * skeleton + porosity * liquid);
      const double K = pores.liquid().bulk_modulus;
      const Pack fall = each ? Pack((step.dt * K) * (rate / porosity))  // else all are alike
                             : Pack(K * growth_of_pores(step.dt * rate[0], porosity[0]));
      add_pressure(patch, step.dt, p, bin.end - p, fall, rate, work);
    }
  };
  if (general::is(patch)) {
    // A buffer that all patches of a thread share stays in its cache.
    static thread_local VelocityGradients<Dim> liquid;
    general::find_gradients<Dim, Pack>(patch, step, bins, moves.data(), liquid);
    for (const ParticleBin& bin : bins) {
      if (!materials[bin.material].liquid || bin.begin == bin.end) continue;
      const Pores pores(*materials[bin.material].liquid);
      const std::size_t first = skeleton.begin(bin, bins);
      const double *of_skeleton = &skeleton.trace[first], *of_liquid = &liquid.trace[first];
      if (each) {
        update_bin(bin, pores, [&](Local p) {
          return std::pair(load<Pack>(of_skeleton + (p - bin.begin)),
                           load<Pack>(of_liquid + (p - bin.begin)));
        });
      } else {
        const auto mean = [&](const double* trace) {
          return Pack(mean_by_volume(trace, V + bin.begin, bin.end - bin.begin));
        };
        const std::pair means(mean(of_skeleton), mean(of_liquid));
        update_bin(bin, pores, [&](Local) { return means; });
      }
    }
  } else {
    for_each_bin(patch, bins, [&](const auto& map, const ParticleBin& bin) {
      if (!materials[bin.material].liquid) return;
      const auto& corner = patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)];
      const Pack skeleton(trace_at_centre<Dim>(map, patch.velocity.data(), corner));
      const Pack liquid(trace_at_centre<Dim>(map, moves.data(), corner));
      update_bin(bin, Pores(*materials[bin.material].liquid),
                 [&](Local) { return std::pair(skeleton, liquid); });
    });
  }
  patch.work.internal += reduce(work);
  if (!given_pressures_press(step.model->analysis)) return;
  for_given_pressures<Dim>(
      patch, step, bins, [&](const ParticleBin& bin, const Local* nodes, const auto& forces) {
        const double n =
            nodal ? 1.0 : mean_porosity(patch, Pores(*materials[bin.material].liquid), bin);
        for (std::size_t i = 0; i < forces.size(); ++i) {
          const double *v = at(nodal ? patch.liquid.discharge : patch.velocity, nodes[i]),
                       *v_l = nodal ? v : at(patch.liquid.velocity, nodes[i]);
          for (int d = 0; d < Dim; ++d)
            patch.work.external -= step.dt * forces[i][d] * (v[d] + n * (v_l[d] - v[d]));
        }
      });
}

template <int Dim>
void take_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const Analysis& analysis = step.model->analysis;
  const bool smooths = analysis.pore_pressure_smoothing;
  const auto [value] = pore_rows<1>(patch.particles.capacity());
  double* pressure = patch.particles.row(Column::pore_pressure);
  const double *V = patch.particles.row(Column::volume), *nodal = patch.liquid.pressure.data();
  double work = 0;
  for_each_bin_with_basis(
      patch, bins, has_liquid(*step.model),
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        constexpr int n_nodes = std::decay_t<decltype(basis)>::nodes;
        const bool given = std::any_of(nodes, nodes + n_nodes, [&](Local node) {
          return find_node(patch.fixed_pressure, node) != nullptr;
        });
        if (!smooths && !given) return;
        if (smooths || analysis.volume_as_cbgeo) {
          for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
            Pack N[n_nodes], sum(0.0);
            basis.functions(p, N);
            LAHAR_UNROLL
            for (int i = 0; i < n_nodes; ++i) sum = multiply_add(sum, N[i], &nodal[nodes[i]]);
            store_first(sum, value + p, bin.end - p);
          }
        } else {
          // The mean of the changes that its corners want, by their functions: these have it then.
          const auto corner = patch.topology.element_nodes(static_cast<std::size_t>(bin.cell));
          double all = 0, share = 0;
          for (int i = 0; i < n_nodes; ++i) {
            const auto* fixed = find_node(patch.fixed_pressure, nodes[i]);
            if (!fixed || !fixed->inside || std::ranges::find(corner, nodes[i]) == corner.end())
              continue;
            for (Local p = bin.begin; p < bin.end; ++p) {
              Scalar N[n_nodes];
              basis.functions(p, N);
              share += V[p] * N[i][0];
              all += V[p] * N[i][0] * nodal[nodes[i]];
            }
          }
          std::fill(value + bin.begin, value + bin.end, share > 0 ? all / share : 0.0);
        }
        const Pores pores(*step.model->materials[bin.material].liquid);
        const double per_stiffness =
            given ? mean_porosity(patch, pores, bin) / pores.liquid().bulk_modulus : 0.0;
        for (Local p = bin.begin; p < bin.end; ++p) {
          const double before = pressure[p], after = smooths ? value[p] : before + value[p];
          pressure[p] = after;
          work += 0.5 * per_stiffness * V[p] * (after + before) * (after - before);
        }
      });
  // Water comes in where pressures are prescribed, and brings its energy.
  patch.work.external += work;
  patch.work.internal += work;
}

#define LAHAR_INSTANTIATE(Dim)                                                                \
  template void update_liquid<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);       \
  template void update_pore_pressure<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins, \
                                          const VelocityGradients<Dim>&);                     \
  template void take_pore_pressure<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
