#include "runtime/patches/patch_filling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <string>

#include "physics/base/error.h"
#include "physics/kernels/kernels.h"
#include "physics/materials/law.h"
#include "physics/mesh/inverse_mapping.h"
#include "physics/particles/particle_domain.h"
#include "runtime/base/parallel.h"
#include "runtime/patches/initial_particles.h"

namespace lahar {

template <int Dim>
RowsByPatch::RowsByPatch(const std::vector<Index>& cell_of_row, const Partition<Dim>& partition)
    : first_(static_cast<std::size_t>(partition.n_patches()) + 1, 0) {
  std::vector<Span> spans;
  Index row = 0, last_cell = -1;
  for (const Index cell : cell_of_row) {
    if (cell != last_cell) {
      const Index patch = partition.patch_of(cell);
      if (spans.empty() || spans.back().patch != patch) {
        spans.push_back({row, row, patch});
        ++first_[static_cast<std::size_t>(patch) + 1];
      }
      last_cell = cell;
    }
    spans.back().end = ++row;
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<Index> next(first_.begin(), first_.end() - 1);
  spans_.resize(spans.size());
  for (const Span& span : spans)
    spans_[static_cast<std::size_t>(next[static_cast<std::size_t>(span.patch)]++)] = span;
}

std::vector<Index> RowsByPatch::occupied() const {
  std::vector<Index> patches;
  for (std::size_t i = 0; i + 1 < first_.size(); ++i)
    if (first_[i] < first_[i + 1]) patches.push_back(static_cast<Index>(i));
  return patches;
}

namespace {

using Rows = std::span<const RowsByPatch::Span>;

/// Call `body(row, i)` for each row, where i counts from 0.
void for_each_row(Rows rows, auto&& body) {
  std::size_t i = 0;
  for (const auto& span : rows)
    for (auto row = static_cast<std::size_t>(span.begin); row < static_cast<std::size_t>(span.end);)
      body(row++, i++);
}

/// Natural coordinates of x in a cell of a patch; nothing if it lies outside.
template <int Dim>
std::optional<Vec<Dim>> natural_coordinates(const Patch<Dim>& patch, const Mesh<Dim>& mesh,
                                            Local cell, const Vec<Dim>& x) {
  const auto c = static_cast<std::size_t>(cell);
  if (!patch.cartesian) return mesh.natural_coordinates(patch.topology.cells[c], x);
  Vec<Dim> xi;
  for (std::size_t d = 0; d < Dim; ++d) xi[d] = (x[d] - patch.box[c][d]) * patch.box[c][Dim + d];
  if (!in_closed_cell<Dim>(xi)) return std::nullopt;
  return clamp_to_cell<Dim>(xi);
}

/// The same of a particle that may touch its cell by rounding only.
template <int Dim>
std::optional<Vec<Dim>> touching(const Mesh<Dim>& mesh, Index cell, const Vec<Dim>& x) {
  const auto found = mesh.locate(x);
  return found.cell == cell ? std::optional<Vec<Dim>>(found.xi) : std::nullopt;
}

/// Ids, materials, loads and places. Returns the first row that is not in its cell; -1 = none.
template <int Dim>
Index fill_places(Patch<Dim>& patch, Rows rows, const Model<Dim>& model) {
  const ParticleTable<Dim>& table = model.particles;
  Particles<Dim>& to = patch.particles;
  Local n = 0;
  for (const auto& span : rows) n += static_cast<Local>(span.end - span.begin);
  to.reserve(n);
  to.resize(n);
  if (!table.loads.empty()) to.loads.resize(static_cast<std::size_t>(n));
  const auto x = to.template rows<Dim>(Column::x);
  std::array<double*, Dim> xi{};
  if (to.layout().has(Column::xi)) xi = to.template rows<Dim>(Column::xi);
  Index last_cell = -1, stray = -1;
  Local local = -1;
  for_each_row(rows, [&](std::size_t row, std::size_t i) {
    if (table.cell[row] != last_cell) local = patch.local_cell.at(last_cell = table.cell[row]);
    to.id[i] = table.id_of(row);
    to.cell[i] = patch.cell_of(local, table.material[row]);
    to.material[i] = table.material[row];
    if (!table.loads.empty()) to.loads[i] = table.loads[row];
    auto natural = natural_coordinates(patch, *model.mesh, local, table.x[row]);
    if (!natural) natural = touching(*model.mesh, last_cell, table.x[row]);
    if (!natural && stray < 0) stray = static_cast<Index>(row);
    for (std::size_t d = 0; d < Dim; ++d) {
      x[d][i] = table.x[row][d];
      if (xi[d] && natural) xi[d][i] = (*natural)[d];
    }
  });
  return stray;
}

template <int Dim>
void fill_domains(Patch<Dim>& patch, const Analysis& analysis) {
  Particles<Dim>& particles = patch.particles;
  std::vector<Index> in_cell(patch.topology.cells.size(), 0);
  for (const Local cell : particles.cell) ++in_cell[static_cast<std::size_t>(cell)];
  for (Local p = 0; p < particles.size(); ++p) {
    const auto cell = static_cast<std::size_t>(particles.cell[static_cast<std::size_t>(p)]);
    set_domain(particles, p, patch.box[cell], depth_at(analysis, particles.row(Column::x)[p]),
               analysis.cbgeo_domains ? in_cell[cell] : 0);
  }
}

/// State variables of the materials.
template <int Dim>
void fill_law_state(Particles<Dim>& to, Rows rows, const Model<Dim>& model) {
  if (!to.layout().has(Column::state)) return;
  const ParticleTable<Dim>& table = model.particles;
  std::vector<double> state(most_state_variables(model.materials));
  for_each_row(rows, [&](std::size_t row, std::size_t i) {
    const Law& law = model.materials[table.material[row]].law;
    if (table.state.empty())
      initial_state(law, table.stress.empty() ? Voigt{} : table.stress[row], state.data());
    else
      std::copy_n(table.state[row].begin(), state.size(), state.begin());
    for (std::size_t k = 0; k < state_variables(law).size(); ++k)
      to.row(Column::state, static_cast<int>(k))[i] = state[k];
  });
}

/// Everything that is known of a particle besides its place. Returns the smallest mass [kg].
template <int Dim>
double fill_state(Patch<Dim>& patch, Rows rows, const Model<Dim>& model) {
  const ParticleTable<Dim>& table = model.particles;
  Particles<Dim>& to = patch.particles;
  const auto set = [&](Column column, const std::vector<Vec<Dim>>& values) {
    if (values.empty()) return;
    const auto to_rows = to.template rows<Dim>(column);
    for_each_row(rows, [&](std::size_t row, std::size_t i) {
      for (std::size_t d = 0; d < Dim; ++d) to_rows[d][i] = values[row][d];
    });
  };
  set(Column::v, table.velocity);
  set(Column::u, table.displacement);
  if (to.layout().has(Column::liquid_v))
    set(Column::liquid_v, table.liquid_velocity.empty() ? table.velocity : table.liquid_velocity);
  // As the fork of CB-Geo MPM begins; else the first step finds accelerations (implicit.h).
  if (to.layout().has(Column::acceleration) && model.analysis.as_cbgeo) {
    const auto a = to.template rows<Dim>(Column::acceleration);
    for (std::size_t d = 0; d < Dim; ++d) std::fill_n(a[d], to.size(), model.gravity[d]);
  }
  if (!table.stress.empty()) {
    const auto stress = to.template rows<stress_components<Dim>>(Column::stress);
    for_each_row(rows, [&](std::size_t row, std::size_t i) {
      for (std::size_t k = 0; k < stress.size(); ++k) stress[k][i] = table.stress[row][k];
    });
  }
  const auto set_scalar = [&](Column column, const std::vector<double>& values) {
    if (values.empty() || !to.layout().has(column)) return;
    double* to_row = to.row(column);
    for_each_row(rows, [&](std::size_t row, std::size_t i) { to_row[i] = values[row]; });
  };
  set_scalar(Column::pore_pressure, table.pore_pressure);
  set_scalar(Column::opening, table.opening);
  if (!table.strain.empty()) {  // 2D: xx yy xy
    const auto strain = to.template rows<strain_components<Dim>>(Column::strain);
    for_each_row(rows, [&](std::size_t row, std::size_t i) {
      for (std::size_t k = 0; k < strain.size(); ++k)
        strain[k][i] = table.strain[row][Dim == 2 && k == 2 ? 3 : k];
    });
    if (to.layout().has(Column::strain_across)) {
      double* across = to.row(Column::strain_across);
      for_each_row(rows, [&](std::size_t row, std::size_t i) { across[i] = table.strain[row][2]; });
    }
  }
  if (to.layout().has(Column::contact_reach) && !table.reach.empty()) {
    double* reach = to.row(Column::contact_reach);  // negative: bodies have not seen it yet
    for_each_row(rows, [&](std::size_t row, std::size_t i) { reach[i] = -table.reach[row]; });
    set_scalar(Column::contact_extent, table.extent);
  }
  const double* x = to.row(Column::x);
  double* volume = to.row(Column::volume);
  double* mass = to.row(Column::mass);
  const bool has_size = to.layout().has(Column::size);
  std::array<double*, Dim> size{};
  if (has_size) size = to.template rows<Dim>(Column::size);
  double lightest = std::numeric_limits<double>::infinity();
  for_each_row(rows, [&](std::size_t row, std::size_t i) {
    volume[i] = table.volume[row];
    mass[i] = table.mass.empty() ? table.volume[row] * model.materials[table.material[row]].density
                                 : table.mass[row];
    if (has_size) {
      std::array<double, Dim> edges{};
      if (!table.edges.empty()) edges = table.edges[row];
      if (edges[0] == 0.0)
        edges.fill(std::pow(table.volume[row] / depth_at(model.analysis, x[i]), 1.0 / Dim));
      for (std::size_t d = 0; d < Dim; ++d) size[d][i] = edges[d];
    }
    lightest = std::min(lightest, mass[i]);
  });
  fill_law_state(to, rows, model);
  if (has_domain(to.layout())) fill_domains(patch, model.analysis);
  return lightest;
}

}  // namespace

template <int Dim>
double fill_patches(std::span<const std::unique_ptr<Patch<Dim>>> patches, const RowsByPatch& rows,
                    Model<Dim>& model, int threads) {
  const auto for_patches = [&](auto&& body) {
    parallel_for(threads, static_cast<int>(patches.size()), [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      body(*patches[at], rows[patches[at]->topology.patch], at);
    });
  };
  std::vector<Index> strays(patches.size());
  set_loads(model);
  for_patches([&](Patch<Dim>& patch, Rows from, std::size_t i) {
    strays[i] = fill_places(patch, from, model);
  });
  std::erase(strays, -1);
  if (!strays.empty()) {
    const auto row = static_cast<std::size_t>(*std::min_element(strays.begin(), strays.end()));
    throw InputError("particle " + std::to_string(model.particles.id_of(row)) +
                     " is not in its cell " + std::to_string(model.particles.cell[row]) + ".");
  }
  model.particles.x = {};
  model.particles.cell = {};
  model.particles.loads = {};
  std::vector<double> lightest(patches.size());
  for_patches([&](Patch<Dim>& patch, Rows from, std::size_t i) {
    lightest[i] = fill_state(patch, from, model);
  });
  model.particles = {};
  for_patches([&](Patch<Dim>& patch, Rows, std::size_t) { receive(patch); });
  return lightest.empty() ? std::numeric_limits<double>::infinity()
                          : *std::min_element(lightest.begin(), lightest.end());
}

#define LAHAR_INSTANTIATE(Dim)                                                                   \
  template RowsByPatch::RowsByPatch(const std::vector<Index>&, const Partition<Dim>&);           \
  template double fill_patches(std::span<const std::unique_ptr<Patch<Dim>>>, const RowsByPatch&, \
                               Model<Dim>&, int);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
