/// \file The linear system of a projection: what particles and cells give to it.
#include <algorithm>
#include <array>
#include <numeric>

#include "physics/basis/any_basis.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/particle_sums.h"
#include "physics/kernels/pore_rows.h"
#include "physics/kernels/projection.h"
#include "physics/model/transfer_options.h"

namespace lahar {

namespace {

/// A discharge per pressure gradient, time and volume; divergence of the discharge; storage.
template <int Dim>
struct Flow {
  Pack mobility[Dim];  ///< [m^3/kg] c_d
  Pack rate;           ///< [1/s] div u*
  Pack storage;        ///< [1/Pa] n / K
};

template <int Dim>
LAHAR_INLINE Flow<Dim> flow_of_fluid(const Pack& specific_volume, const Pack& rate) {
  Flow<Dim> flow;
  for (Pack& mobility : flow.mobility) mobility = specific_volume;
  flow.rate = rate;
  flow.storage = Pack(0.0);
  return flow;
}

/// See projection.h. `m` and `V` are the mass of the skeleton and the volume of particles.
template <int Dim>
LAHAR_INLINE Flow<Dim> flow_in_pores(const Pores& pores, double dt, const Pack& m, const Pack& V,
                                     const Pack& rate, const Pack& liquid_rate) {
  const Pack n = pores.porosity(m, V), solid = Pack(1.0) - n;
  const Pack rho_s = m / V, rho_l = pores.liquid_mass(m, V) / V;
  const Pack drag = pores.drag_volume(m, V) / V;
  Flow<Dim> flow;
  for (std::size_t d = 0; d < Dim; ++d) {
    const Pack q = (dt * pores.liquid().resistance[d]) * drag;
    flow.mobility[d] =
        (solid * solid * rho_l + n * n * rho_s + q) / (rho_s * rho_l + q * (rho_s + rho_l));
  }
  flow.rate = solid * rate + n * liquid_rate;
  flow.storage = n * Pack(1.0 / pores.liquid().bulk_modulus);
  return flow;
}

/// What the particles of one bin give to the nodes of their cell.
template <int Dim, int Nodes>
struct CellFlow {
  Pack matrix[Nodes * (Nodes + 1) / 2];  ///< rows i, columns j >= i
  Pack discharge[Nodes], volume[Nodes];

  void clear() {
    std::fill_n(matrix, std::size(matrix), Pack(0.0));
    std::fill_n(discharge, Nodes, Pack(0.0));
    std::fill_n(volume, Nodes, Pack(0.0));
  }

  LAHAR_INLINE void add(const Flow<Dim>& flow, double dt, const Pack& V, const Pack (&N)[Nodes],
                        const Pack (&dN)[Dim][Nodes]) {
    Pack weight[Dim];
    for (int d = 0; d < Dim; ++d) weight[d] = V * (dt * flow.mobility[d]);
    const Pack stored = V * flow.storage * (1.0 / dt);
    int k = 0;
    for (int i = 0; i < Nodes; ++i) {
      const Pack share = N[i] * V;
      discharge[i] -= share * flow.rate;
      volume[i] += share;
      matrix[k] += N[i] * stored;
      for (int j = i; j < Nodes; ++j, ++k)
        for (int d = 0; d < Dim; ++d) matrix[k] += weight[d] * dN[d][i] * dN[d][j];
    }
  }
};

/// Add what a cell gives to the rows of a patch.
template <int Dim, int Nodes>
void add_to_rows(NodalSystem<Dim>& system, const CellFlow<Dim, Nodes>& cell, const Local* nodes) {
  double matrix[Nodes][Nodes];
  for (int i = 0, k = 0; i < Nodes; ++i)
    for (int j = i; j < Nodes; ++j, ++k) matrix[i][j] = matrix[j][i] = reduce(cell.matrix[k]);
  std::array<int, Nodes> order;
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return nodes[a] < nodes[b]; });
  for (int i = 0; i < Nodes; ++i) {
    std::size_t k = system.first[static_cast<std::size_t>(nodes[i])];
    for (const int j : order) {
      while (system.column[k] < nodes[j]) ++k;
      system.blocks[k] += matrix[i][j];
    }
  }
}

}  // namespace

template <int Dim>
void add_to_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  double* sums = patch.own_sums(NodeSum::divergence, step.step);
  const double* V = patch.particles.row(Column::volume);
  const double* m = patch.particles.row(Column::mass);
  for_each_bin_with_basis(
      patch, bins, [](const ParticleBin&) { return true; },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        constexpr int n_nodes = std::decay_t<decltype(basis)>::nodes;
        const auto& liquid = step.model->materials[bin.material].liquid;
        static thread_local CellFlow<Dim, n_nodes> cell;
        cell.clear();
        for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
          const Local n = bin.end - p;
          Pack N[n_nodes], dN[Dim][n_nodes], L[Dim][Dim];
          basis.functions(p, N);
          basis.gradients(p, dN);
          const Pack volume = load<Pack>(V + p), mass = load<Pack>(m + p);
          general::gradient<Dim, Pack>(basis, p, patch.velocity.data(), nodes, L);
          Flow<Dim> flow = flow_of_fluid<Dim>(volume / mass, general::trace(L));
          if (liquid) {
            const Pack rate = flow.rate;
            general::gradient<Dim, Pack>(basis, p, patch.liquid.velocity.data(), nodes, L);
            flow =
                flow_in_pores<Dim>(Pores(*liquid), step.dt, mass, volume, rate, general::trace(L));
          }
          // Beyond the bin there may be anything.
          for (Pack& mobility : flow.mobility) mobility = first_lanes(mobility, n);
          flow.rate = first_lanes(flow.rate, n);
          flow.storage = first_lanes(flow.storage, n);
          cell.add(flow, step.dt, first_lanes(volume, n), N, dN);
        }
        for (int i = 0; i < n_nodes; ++i) {
          double* at = sums + static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride;
          at[0] += reduce(cell.discharge[i]);
          at[1] += reduce(cell.volume[i]);
        }
        add_to_rows(patch.system, cell, nodes);
      });
}

template <int Dim>
void leave_out_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const double left_out = 1.0 - step.model->analysis.projection.kept;
  const auto [row] = pore_rows<1>(patch.particles.capacity());
  const double* V = patch.particles.row(Column::volume);
  const double* pressure = patch.particles.row(Column::state);
  for (const ParticleBin& bin : bins)
    for (Local p = bin.begin; p < bin.end; p += lanes<Pack>)
      store_first(Pack(-left_out * load<Pack>(V + p) * load<Pack>(pressure + p)), row + p,
                  bin.end - p);
  map_gradient_of<Dim, Pack>(patch, bins, row, patch.own_sums(NodeSum::force, step.step));
}

template <int Dim>
void map_outward(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const Analysis& analysis = step.model->analysis;
  double* sums = patch.own_sums(NodeSum::outward, step.step);
  map_gradient_of<Dim, Pack>(patch, bins, patch.particles.row(Column::volume), sums);
  if (!needs_kept_pressure(analysis)) return;
  const auto rows = pore_rows<2>(patch.particles.capacity());
  const double* m = patch.particles.row(Column::mass);
  const double* pressure =
      patch.particles.row(analysis.two_phase ? Column::pore_pressure : Column::state);
  for (const ParticleBin& bin : bins)
    for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
      store_first(Pack(analysis.projection.kept * load<Pack>(m + p) * load<Pack>(pressure + p)),
                  rows[0] + p, bin.end - p);
      store_first(Pack(0.0), rows[1] + p, bin.end - p);
    }
  general::ParticleMomentum<Dim> particle;
  particle.m = rows[0];
  particle.v.fill(rows[1]);
  map_momentum_of<Dim, Pack>(patch, bins, particle, sums);
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template void leave_out_pressure<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template void map_outward<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);        \
  template void add_to_pressure_system<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
