/// \file The linear system of a projection: what particles and cells give to it.
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <utility>

#include "physics/basis/any_basis.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/cell_quadrature.h"
#include "physics/kernels/matrix_pattern.h"
#include "physics/kernels/particle_sums.h"
#include "physics/kernels/pore_rows.h"
#include "physics/kernels/projection.h"
#include "physics/model/transfer_options.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_place.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

/// Sums over the particles of a bin.
template <int Dim>
struct BinFlow {
  double volume = 0;                     ///< [m^3]
  double mobility[Dim]{};                ///< [m^6/kg] sum_p V_p c_d
  double storage = 0;                    ///< [m^3/Pa] sum_p V_p n / K
  double released = 0;                   ///< [m^3] of it, where a part of the pressure is not kept
  Vec<Dim> centre = Vec<Dim>::Zero();    ///< [m] mean place of `released`
  Vec<Dim> gradient = Vec<Dim>::Zero();  ///< [m^2] of `released`, in the cell

  void scale(double factor) {
    volume *= factor;
    storage *= factor;
    released *= factor;
    gradient *= factor;
    for (double& of_axis : mobility) of_axis *= factor;
  }
};

template <int Dim>
BinFlow<Dim> flow_of_fluid(const Patch<Dim>& patch, const ParticleBin& bin) {
  const double* V = patch.particles.row(Column::volume);
  const double* m = patch.particles.row(Column::mass);
  BinFlow<Dim> flow;
  for (Local p = bin.begin; p < bin.end; ++p) {
    flow.volume += V[p];
    flow.mobility[0] += V[p] * V[p] / m[p];
  }
  std::fill_n(flow.mobility, Dim, flow.mobility[0]);
  return flow;
}

/// The mean place [m] of the particles of a bin, and how their pressure, `row`, changes from there
/// on [Pa/m]: by least squares, not at all along directions in which they do not lie apart.
template <int Dim>
std::pair<Vec<Dim>, Vec<Dim>> gradient_in_bin(const Patch<Dim>& patch, const ParticleBin& bin,
                                              const double* row) {
  using Matrix = Eigen::Matrix<double, Dim, Dim>;
  constexpr double least = 1e-9;  // of the cell's size squared: a spread that counts as none
  const auto x = patch.particles.template rows<Dim>(Column::x);
  Matrix spread = Matrix::Zero();
  Vec<Dim> moment = Vec<Dim>::Zero();
  const auto n = static_cast<double>(bin.end - bin.begin);
  const auto place = [&](Local p) {
    Vec<Dim> at;
    for (std::size_t d = 0; d < Dim; ++d) at[static_cast<int>(d)] = x[d][p];
    return at;
  };
  Vec<Dim> centre = Vec<Dim>::Zero();
  double mean = 0;
  for (Local p = bin.begin; p < bin.end; ++p) {
    centre += place(p) / n;
    mean += row[p] / n;
  }
  for (Local p = bin.begin; p < bin.end; ++p) {
    const Vec<Dim> away = place(p) - centre;
    spread += away * away.transpose();
    moment += away * (row[p] - mean);
  }
  const double h = patch.cell_size[static_cast<std::size_t>(bin.cell)];
  spread += least * h * h * n * Matrix::Identity();
  return {centre, spread.inverse() * moment};
}

/// See projection.h.
template <int Dim>
BinFlow<Dim> flow_in_pores(const Patch<Dim>& patch, const ParticleBin& bin, const Pores& pores,
                           double dt, double kept) {
  const double* pressure = patch.particles.row(Column::pore_pressure);
  const double* V = patch.particles.row(Column::volume);
  const double* mass = patch.particles.row(Column::mass);
  BinFlow<Dim> flow;
  for (Local p = bin.begin; p < bin.end; ++p) {
    const Scalar volume(V[p]), m(mass[p]);
    const double n = pores.porosity(m, volume)[0], solid = 1.0 - n;
    const double rho_s = mass[p] / V[p], rho_l = pores.liquid_mass(m, volume)[0] / V[p];
    const double drag = pores.drag_volume(m, volume)[0] / V[p];
    flow.volume += V[p];
    for (std::size_t d = 0; d < Dim; ++d) {
      const double q = dt * pores.liquid().resistance[d] * drag;
      flow.mobility[d] += V[p] * (solid * solid * rho_l + n * n * rho_s + q) /
                          (rho_s * rho_l + q * (rho_s + rho_l));
    }
    const double storage = V[p] * n / pores.liquid().bulk_modulus;
    flow.storage += storage;
    flow.released += storage * (1.0 - kept) * pressure[p];
  }
  if (kept < 1.0) {
    const auto [centre, gradient] = gradient_in_bin(patch, bin, pressure);
    flow.centre = centre;
    flow.gradient = flow.storage * (1.0 - kept) * gradient;
  }
  return flow;
}

/// Material in cells that count as filled fills them: their volume over that of their particles.
template <int Dim>
double filling(const Patch<Dim>& patch, const StepContext<Dim>& step, const ParticleBin& bin) {
  const auto c = static_cast<std::size_t>(bin.cell);
  const double volume = step.model->mesh->cell_volume(patch.topology.cells[c]);
  const double filled = volume_in(patch, c);
  return is_filled(*step.model, filled, volume) ? volume / filled : 1.0;
}

template <int Dim, int Nodes>
double divergence_at(const QuadraturePoint<Dim, Nodes>& point, const NodeArray& v,
                     const Local* nodes) {
  double sum = 0;
  for (int i = 0; i < Nodes; ++i)
    for (int d = 0; d < Dim; ++d)
      sum += point.dN[d][i] *
             v[static_cast<std::size_t>(nodes[i]) * node_width + static_cast<std::size_t>(d)];
  return sum;
}

/// The mean acceleration of the discharge of a cell's nodes, by mass [m/s^2].
template <int Dim, int Nodes>
Vec<Dim> mean_acceleration(const Patch<Dim>& patch, const Local* nodes) {
  Vec<Dim> sum = Vec<Dim>::Zero();
  double mass = 0;
  for (int i = 0; i < Nodes; ++i) {
    const double m = at(patch.velocity, nodes[i])[mass_lane];
    const double n = patch.liquid.porosity[static_cast<std::size_t>(nodes[i])];
    const double *a = at(patch.acceleration, nodes[i]),
                 *a_l = at(patch.liquid.acceleration, nodes[i]);
    for (int d = 0; d < Dim; ++d) sum[d] += m * (a[d] + n * (a_l[d] - a[d]));
    mass += m;
  }
  return mass > 0 ? Vec<Dim>(sum / mass) : sum;
}

/// What material gives to the nodes of its cell.
template <int Nodes>
struct CellFlow {
  double discharge[Nodes]{};
  double matrix[Nodes][Nodes]{};

  template <int Dim>
  void add(const BinFlow<Dim>& flow, const QuadraturePoint<Dim, Nodes>& point, double rate,
           double dt, const Vec<Dim>& weight, const Vec<Dim>& gradient,
           const std::array<Vec<Dim>, Nodes>& place) {
    for (int i = 0; i < Nodes; ++i) {
      const double released =
          flow.released + flow.gradient.dot(place[static_cast<std::size_t>(i)] - flow.centre);
      double b = point.N[i] * (released / dt - flow.volume * rate);
      for (int d = 0; d < Dim; ++d)
        b += (flow.volume * weight[d] + dt * flow.mobility[d] * gradient[d]) * point.dN[d][i];
      discharge[i] += point.weight * b;
      for (int j = 0; j < Nodes; ++j) {
        double value = i == j ? flow.storage * point.N[i] / dt : 0.0;
        for (int d = 0; d < Dim; ++d)
          value += dt * flow.mobility[d] * point.dN[d][i] * point.dN[d][j];
        matrix[i][j] += point.weight * value;
      }
    }
  }
};

/// What weight gives to b (projection.h).
template <int Dim>
struct WeightOfStep {
  Vec<Dim> velocity, gradient;  ///< [m/s] of a fluid, [Pa/m] in pores
  explicit WeightOfStep(const StepContext<Dim>& step)
      : velocity(weight_out_of_velocities(step)), gradient(pore_gradient_at_rest(step)) {}
};

/// Material that fills a cell with these points evenly.
template <int Dim, int Nodes, std::size_t Points>
void add_cell(Patch<Dim>& patch, const StepContext<Dim>& step, const BinFlow<Dim>& flow,
              const WeightOfStep<Dim>& weight,
              const std::array<QuadraturePoint<Dim, Nodes>, Points>& points, const Local* nodes) {
  std::array<Vec<Dim>, Nodes> place;
  place.fill(flow.centre);
  if (!flow.gradient.isZero(0.0))
    for (std::size_t i = 0; i < Nodes; ++i) place[i] = place_of(patch, *step.model->mesh, nodes[i]);
  CellFlow<Nodes> cell;
  const bool nodal = !patch.liquid.porosity.empty();
  Vec<Dim> forced = Vec<Dim>::Zero();
  if (nodal) forced = step.dt * mean_acceleration<Dim, Nodes>(patch, nodes);
  for (const auto& point : points) {
    double rate = divergence_at(point, nodal ? patch.liquid.discharge : patch.velocity, nodes);
    for (int i = 0; nodal && i < Nodes; ++i)
      for (int d = 0; d < Dim; ++d)
        rate += point.dN[d][i] * forced[d] *
                patch.projection.unforced[static_cast<std::size_t>(nodes[i] * Dim + d)];
    cell.add(flow, point, rate, step.dt, weight.velocity, weight.gradient, place);
  }
  double* sums = patch.own_sums(NodeSum::divergence, step.step);
  for (int i = 0; i < Nodes; ++i)
    sums[static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride] += cell.discharge[i];
  for_each_block<Nodes>(patch.system, nodes, [&](int i, int j, std::size_t k) {
    patch.system.blocks[k] += cell.matrix[i][j];
  });
}

/// |D| = sqrt(2 D : D) of the velocity gradient L.
template <int Dim>
LAHAR_INLINE Pack shear_rate(const Pack (&L)[Dim][Dim]) {
  Pack sum(0.0);
  for (int a = 0; a < Dim; ++a)
    for (int b = 0; b < Dim; ++b) sum += 0.5 * ((L[a][b] + L[b][a]) * (L[a][b] + L[b][a]));
  return sqrt(sum);
}

/// {., V, ., V |D|} of the particles of a bin; the last one of tanks without a free surface.
template <int Dim, class Basis>
void add_volumes(const Patch<Dim>& patch, const Basis& basis, const ParticleBin& bin,
                 const Local* nodes, bool is_closed, double* sums) {
  constexpr int n_nodes = Basis::nodes;
  const double* V = patch.particles.row(Column::volume);
  Pack volume[n_nodes], sheared[n_nodes];
  for (int i = 0; i < n_nodes; ++i) volume[i] = sheared[i] = Pack(0.0);
  for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
    const Local n = bin.end - p;
    Pack N[n_nodes], L[Dim][Dim];
    basis.functions(p, N);
    general::gradient<Dim, Pack>(basis, p, patch.velocity.data(), nodes, L);
    const Pack of_particles = load_first<Pack>(V + p, n);
    const Pack shear = first_lanes(shear_rate<Dim>(L), n);  // beyond the bin there may be anything
    for (int i = 0; i < n_nodes; ++i) {
      const Pack share = N[i] * of_particles;
      volume[i] += share;
      sheared[i] += share * shear;
    }
  }
  for (int i = 0; i < n_nodes; ++i) {
    double* at = sums + static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride;
    at[1] += reduce(volume[i]);
    if (is_closed) at[3] += reduce(sheared[i]);
  }
}

}  // namespace

template <int Dim>
void add_to_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const WeightOfStep<Dim> weight(step);
  const bool is_closed = !step.model->analysis.projection.free_surface;
  for_each_bin_with_basis(
      patch, bins, [](const ParticleBin&) { return true; },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        const auto& liquid = step.model->materials[bin.material].liquid;
        BinFlow<Dim> flow = liquid ? flow_in_pores(patch, bin, Pores(*liquid), step.dt,
                                                   step.model->analysis.projection.kept)
                                   : flow_of_fluid(patch, bin);
        flow.scale(filling(patch, step, bin));
        with_quadrature(patch, basis, bin, nodes, [&](const auto& points, const Local* of_cell) {
          add_cell(patch, step, flow, weight, points, of_cell);
        });
        add_volumes(patch, basis, bin, nodes, is_closed,
                    patch.own_sums(NodeSum::divergence, step.step));
      });
}

template <int Dim>
void add_voids(Patch<Dim>& patch, const StepContext<Dim>& step, const std::vector<char>& voids) {
  BinFlow<Dim> all;
  for (const ParticleBin& bin : patch.bins) {
    const BinFlow<Dim> flow = flow_of_fluid(patch, bin);
    all.volume += flow.volume;
    for (int d = 0; d < Dim; ++d) all.mobility[d] += flow.mobility[d];
  }
  if (all.volume == 0) return;
  const WeightOfStep<Dim> weight(step);
  for (std::size_t c = 0; c < voids.size(); ++c) {
    if (!voids[c]) continue;
    BinFlow<Dim> flow = all;
    flow.scale(step.model->mesh->cell_volume(patch.topology.cells[c]) / all.volume);
    add_cell(patch, step, flow, weight, corner_points_of(patch, static_cast<Local>(c)),
             patch.topology.corner_nodes[c].data());
  }
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

namespace {

/// The part of a gradient along axes on which a node holds the liquid.
template <int Dim>
Vec<Dim> along_held_axes(const Patch<Dim>& patch, Local node, const Vec<Dim>& gradient) {
  Vec<Dim> along = Vec<Dim>::Zero();
  for_entries(patch.fixed_liquid, node,
              [&](const auto& held) { along[held.dir] = gradient[held.dir]; });
  return along;
}

}  // namespace

template <int Dim>
void map_kept_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const Analysis& analysis = step.model->analysis;
  const auto x = patch.particles.template rows<Dim>(Column::x);
  const double* m = patch.particles.row(Column::mass);
  const double* pressure =
      patch.particles.row(analysis.two_phase ? Column::pore_pressure : Column::state);
  double* sums = patch.own_sums(NodeSum::kept_pressure, step.step);
  for_each_bin_with_basis(
      patch, bins, [](const ParticleBin&) { return true; },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        constexpr int n_nodes = std::decay_t<decltype(basis)>::nodes;
        const auto gradient = gradient_in_bin(patch, bin, pressure).second;
        Vec<Dim> place[n_nodes], along_held[n_nodes];
        Pack at_node[n_nodes], at_wall[n_nodes];
        for (int i = 0; i < n_nodes; ++i) {
          place[i] = place_of(patch, *step.model->mesh, nodes[i]);
          along_held[i] = along_held_axes<Dim>(patch, nodes[i], gradient);
          at_node[i] = at_wall[i] = Pack(0.0);
        }
        for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
          const Local n = bin.end - p;
          Pack N[n_nodes], at_particle[Dim];
          basis.functions(p, N);
          const Pack mass = load_first<Pack>(m + p, n);
          const Pack own = first_lanes(load<Pack>(pressure + p), n);
          for (std::size_t d = 0; d < Dim; ++d)
            at_particle[d] = first_lanes(load<Pack>(x[d] + p), n);
          for (int i = 0; i < n_nodes; ++i) {
            Pack extrapolated = own, to_wall = own;
            for (int d = 0; d < Dim; ++d) {
              const Pack away = place[i][d] - at_particle[d];
              extrapolated += gradient[d] * away;
              to_wall += along_held[i][d] * away;
            }
            const Pack share = N[i] * mass;
            at_node[i] += share * extrapolated;
            at_wall[i] += share * to_wall;
          }
        }
        for (int i = 0; i < n_nodes; ++i) {
          double* at = sums + static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride;
          at[0] += analysis.projection.kept * reduce(at_node[i]);
          at[1] += analysis.projection.kept * reduce(at_wall[i]);
        }
      });
}

#define LAHAR_INSTANTIATE(Dim)                                                                  \
  template void add_voids<Dim>(Patch<Dim>&, const StepContext<Dim>&, const std::vector<char>&); \
  template void leave_out_pressure<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);    \
  template void map_kept_pressure<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);     \
  template void add_to_pressure_system<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
