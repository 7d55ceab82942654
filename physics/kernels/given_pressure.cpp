#include "physics/kernels/given_pressure.h"

#include <array>
#include <cmath>
#include <type_traits>
#include <vector>

#include "physics/basis/any_basis.h"
#include "physics/basis/linear_basis.h"
#include "physics/basis/support.h"
#include "physics/kernels/pore_rows.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

/// Functions of the nodes of a cell at a particle, whatever their basis.
template <int Dim>
struct Functions {
  std::vector<double> N;
  std::array<std::vector<double>, static_cast<std::size_t>(Dim)> dN;

  template <class Basis>
  void find(const Basis& basis, Local p) {
    constexpr int n = Basis::nodes;
    Scalar at[n], gradients[Dim][n];
    basis.functions(p, at);
    basis.gradients(p, gradients);
    N.resize(n);
    for (int i = 0; i < n; ++i) N[static_cast<std::size_t>(i)] = at[i][0];
    for (std::size_t d = 0; d < Dim; ++d) {
      dN[d].resize(n);
      for (int i = 0; i < n; ++i) dN[d][static_cast<std::size_t>(i)] = gradients[d][i][0];
    }
  }
};

template <int Dim>
using FindFunctions = std::function<void(Local p, Functions<Dim>&)>;

/// The sum over the particles of a bin. `centre` is p_g at the centre of the cell, NaN where its
/// mean may be another.
template <int Dim>
std::vector<Vec<Dim>> sum_of_bin(const Patch<Dim>& patch, const ParticleBin& bin,
                                 const std::vector<double>& p_g, double centre,
                                 const FindFunctions<Dim>& of_field,
                                 const FindFunctions<Dim>& of_forces) {
  const double* V = patch.particles.row(Column::volume);
  Functions<Dim> field, at;
  std::vector<Vec<Dim>> force, all;  // all: sum_p V grad N
  double volume = 0, work = 0;
  for (Local p = bin.begin; p < bin.end; ++p) {
    of_field(p, field);
    of_forces(p, at);
    double pressure = 0;
    Vec<Dim> gradient = Vec<Dim>::Zero();
    for (std::size_t i = 0; i < p_g.size(); ++i) {
      pressure += field.N[i] * p_g[i];
      for (std::size_t d = 0; d < Dim; ++d)
        gradient[static_cast<int>(d)] += field.dN[d][i] * p_g[i];
    }
    volume += V[p];
    work += V[p] * pressure;
    force.resize(at.N.size(), Vec<Dim>::Zero());
    all.resize(at.N.size(), Vec<Dim>::Zero());
    for (std::size_t i = 0; i < at.N.size(); ++i) {
      Vec<Dim> slope;
      for (std::size_t d = 0; d < Dim; ++d) slope[static_cast<int>(d)] = at.dN[d][i];
      force[i] += V[p] * (pressure * slope + at.N[i] * gradient);
      all[i] += V[p] * slope;
    }
  }
  if (!std::isnan(centre))
    for (std::size_t i = 0; i < force.size(); ++i) force[i] += (centre - work / volume) * all[i];
  return force;
}

/// The same with the functions at the centre of the cell alone.
template <int Dim, class Basis>
std::vector<Vec<Dim>> sum_at_centre(const Patch<Dim>& patch, const ParticleBin& bin,
                                    const std::vector<double>& p_g, double centre,
                                    const Basis& basis) {
  constexpr int n = Basis::nodes;
  const double* V = patch.particles.row(Column::volume);
  double volume = 0, dN[Dim][n];
  for (Local p = bin.begin; p < bin.end; ++p) volume += V[p];
  basis.centre_gradients(dN);
  std::vector<Vec<Dim>> force(n);
  for (int d = 0; d < Dim; ++d) {
    double gradient = 0;
    for (int i = 0; i < n; ++i) gradient += dN[d][i] * p_g[static_cast<std::size_t>(i)];
    for (int i = 0; i < n; ++i)
      force[static_cast<std::size_t>(i)][d] = volume * (centre * dN[d][i] + gradient / n);
  }
  return force;
}

}  // namespace

template <int Dim>
void for_given_pressures(const Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                         const TakeForces<Dim>& take) {
  if (patch.fixed_pressure.empty()) return;
  const Analysis& analysis = step.model->analysis;
  const bool linear = analysis.functions != ShapeFunctions::element && patch.cartesian;
  const bool at_centre = !general::is(patch) && !analysis.volume_as_cbgeo;
  const LinearCells<Dim, CartesianCells<Dim>> elements(patch);
  std::vector<double> p_g;
  for_each_bin_with_basis(
      patch, bins, has_liquid(*step.model),
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        using Basis = std::decay_t<decltype(basis)>;
        constexpr int n_nodes = Basis::nodes;
        const Local* of_element =
            linear ? patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)].data() : nodes;
        p_g.assign(static_cast<std::size_t>(linear ? corners<Dim> : n_nodes), 0.0);
        double sum = 0;
        bool any = false;
        for (std::size_t i = 0; i < p_g.size(); ++i)
          if (const auto* fixed = find_node(patch.fixed_pressure, of_element[i])) {
            p_g[i] = pressure_given(*step.model, *fixed, step.time);
            sum += p_g[i];
            any = any || p_g[i] != 0.0;
          }
        if (!any) return;
        constexpr bool has_centre = requires(double(&dN)[Dim][n_nodes]) {
          basis.centre_gradients(dN);
        };
        const double mean = sum / static_cast<double>(p_g.size());
        std::vector<Vec<Dim>> force;
        if constexpr (has_centre)
          if (at_centre) force = sum_at_centre<Dim>(patch, bin, p_g, mean, basis);
        if (force.empty()) {
          const FindFunctions<Dim> own = [&](Local p, Functions<Dim>& to) { to.find(basis, p); };
          const FindFunctions<Dim> corner = [&](Local p, Functions<Dim>& to) {
            to.find(elements[bin.cell], p);
          };
          force = sum_of_bin<Dim>(patch, bin, p_g, linear || has_centre ? mean : std::nan(""),
                                  linear ? corner : own, own);
        }
        take(bin, nodes, force);
      });
}

#define LAHAR_INSTANTIATE(Dim)                                                                     \
  template void for_given_pressures<Dim>(const Patch<Dim>&, const StepContext<Dim>&, ParticleBins, \
                                         const TakeForces<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
