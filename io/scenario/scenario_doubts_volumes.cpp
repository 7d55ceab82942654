// Warnings of volumes that particles from files cannot have, or do not have, of liquids that are
// thinner than a cell, and of gauges that are smaller than the distance of particles.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "io/scenario/scenario_builder.h"

namespace lahar {

namespace {

/// Particles of a cell.
struct CellParticles {
  Index cell;
  Index all;
  Index open;  ///< of a file, and without a volume
};

void merge_cells(std::vector<CellParticles>& list) {
  std::sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.cell < b.cell; });
  std::vector<CellParticles> merged;
  for (const CellParticles& one : list) {
    if (merged.empty() || merged.back().cell != one.cell) merged.push_back({one.cell, 0, 0});
    merged.back().all += one.all;
    merged.back().open += one.open;
  }
  list = std::move(merged);
}

/// Volume in a column of cells.
struct ColumnVolume {
  Index column;
  double volume;  ///< [m^3]
};

}  // namespace

// What has no volume after the file of volumes gets its share of a cell. For particles that other
// generators make that is so by design.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_missing_volumes() {
  if (team_.any(!mesh_ || !particles_complete_ || !in_.problems.empty())) return;
  const ParticleTable<Dim>& p = model_.particles;
  const JsonValue* given = section("mesh").find("particles_volumes");
  std::vector<bool> is_file;
  for (const GeneratorRows& rows : generators_)
    is_file.push_back(get_text(*rows.generator, "type") == "file");
  Index missing = 0, all = 0;
  for_own_particles([&](std::size_t g, std::size_t i) {
    if (!is_file[g]) return;
    ++all;
    if (p.volume[i] == 0) ++missing;
  });
  missing = team_.sum(missing);
  all = team_.sum(all);
  if (missing == 0) return;
  if (!given) return warn_of_partly_filled_cells(is_file);
  in_.warning(*given,
              fmt::format("the file has no volume for {} of the {} particles from files: they get "
                          "the volume of their cell over the number of particles in it",
                          missing, all),
              "give a row \"id volume\" for each particle");
}

// Half as many particles in a cell get twice the volume each: also where the cell is half empty.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_partly_filled_cells(const std::vector<bool>& is_file) {
  if (in_.cbgeo_defaults) return;  // so it is there
  const ParticleTable<Dim>& p = model_.particles;
  std::vector<CellParticles> own;
  for_own_particles([&](std::size_t g, std::size_t i) {
    if (p.cell[i] < 0) return;
    if (own.empty() || own.back().cell != p.cell[i]) own.push_back({p.cell[i], 0, 0});
    ++own.back().all;
    if (is_file[g] && p.volume[i] == 0) ++own.back().open;
  });
  merge_cells(own);
  if (!team_.alone()) {
    std::vector<std::vector<CellParticles>> to(static_cast<std::size_t>(team_.size()));
    for (const CellParticles& one : own)
      to[static_cast<std::size_t>(team_.member(one.cell, mesh_->n_cells()))].push_back(one);
    own = joined(team_.exchange(std::move(to)));
    merge_cells(own);
  }
  std::map<Index, Index> cells_with;  // so many particles
  for (const CellParticles& one : own)
    if (one.open > 0) ++cells_with[one.all];
  std::vector<std::array<Index, 2>> told;
  for (const auto& [particles, cells] : cells_with) told.push_back({particles, cells});
  cells_with.clear();
  for (const auto& [particles, cells] : joined(team_.gather(told))) cells_with[particles] += cells;
  Index usual = 0, most = 0, fewer = 0, all = 0;
  for (const auto& [particles, cells] : cells_with)
    if (cells >= most) usual = particles, most = cells;
  for (const auto& [particles, cells] : cells_with) {
    all += cells;
    if (particles < usual) fewer += cells;
  }
  if (fewer == 0) return;
  const auto first = std::find(is_file.begin(), is_file.end(), true) - is_file.begin();
  in_.warning(*generators_[static_cast<std::size_t>(first)].generator,
              fmt::format("{} of the {} cells with particles from files hold fewer than {}, the "
                          "most common number: without volumes particles share the volume of "
                          "their cell, so these cells are as heavy as full ones",
                          fewer, all, usual),
              "give the particles their volumes with mesh.particles_volumes, or take \"type\": "
              "\"region\", whose particles have volumes of their own");
}

// Of one particle, not of its cell, and in m^3.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_large_volumes() {
  constexpr double most = 1.5;  // of the volume of a cell
  const JsonValue* given = section("mesh").find("particles_volumes");
  if (!given) return;
  const ParticleTable<Dim>& p = model_.particles;
  std::vector<double> of_cells;
  const auto volume_of = [&](Index cell) { return mesh_->cell_volume(cell); };
  if (mesh_->is_share())
    of_cells = ask<double>(
        team_, p.cell, [&](Index cell) { return team_.member(cell, mesh_->n_cells()); }, volume_of);
  else
    for (const Index cell : p.cell) of_cells.push_back(volume_of(cell));
  Index count = 0;
  double largest = 0;
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const double ratio = p.volume[i] / depth_at(model_.analysis, p.x[i][0]) / of_cells[i];
    if (ratio > most) ++count;
    largest = std::max(largest, ratio);
  }
  count = team_.sum(count);
  largest = team_.most(std::vector<double>{largest}).front();
  if (count == 0) return;
  in_.warning(*given,
              fmt::format("the volumes of {} of the {} particles are above {} times that of their "
                          "cell, the largest is {:.3g} times it",
                          count, rows_.total(), most, largest),
              "a volume is that of one particle, in m^3: about that of its cell over the number of "
              "particles in it");
}

// The rows of a layer in one cell move as one. Its pressure is not that of its depth, and bores in
// it are smeared over many cells (wet_bed.cpp).
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_shallow_liquids() {
  constexpr double least_depth = 0.9;  // of a cell
  constexpr double least_share = 0.3;  // of its area; less is the shore of a pool
  if (in_.cbgeo_defaults || !mesh_->is_structured() || model_.gravity.norm() == 0 ||
      model_.analysis.plane == Plane::axisymmetric)
    return;
  Eigen::Index up = 0;
  model_.gravity.cwiseAbs().maxCoeff(&up);
  const auto counts = mesh_->counts();
  Index below = 1;  // cells of a row before the next along the way up
  for (Eigen::Index d = 0; d < up; ++d) below *= counts[static_cast<std::size_t>(d)];
  const Index layer = below * counts[static_cast<std::size_t>(up)];
  const ParticleTable<Dim>& p = model_.particles;
  std::map<Index, double> own, whole;  // volumes by column; of those that this member sums up
  std::pair<Index, double*> last(-1, nullptr);  // particles of a cell come one after the other
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    if (p.cell[i] < 0 || !has_pressure(model_.materials[p.material[i]].law)) continue;
    const Index column = p.cell[i] / layer * below + p.cell[i] % below;
    if (column != last.first) last = {column, &own[column]};
    *last.second += p.volume[i];
  }
  std::vector<std::vector<ColumnVolume>> to(static_cast<std::size_t>(team_.size()));
  for (const auto& [column, volume] : own)
    to[static_cast<std::size_t>(team_.member(column, mesh_->n_cells()))].push_back(
        {column, volume});
  for (const ColumnVolume& one : joined(team_.exchange(std::move(to))))
    whole[one.column] += one.volume;
  const double height = outer_cell()[up], area = outer_cell().prod() / height;
  Index shallow = 0;
  double depth = 0;  // of them together
  for (const auto& [column, volume] : whole) {
    if (!(volume < least_depth * height * area)) continue;
    ++shallow;
    depth += volume / area;
  }
  const auto columns = static_cast<double>(team_.sum(static_cast<Index>(whole.size()))),
             all_shallow = static_cast<double>(team_.sum(shallow)),
             share = all_shallow / std::max(columns, 1.0);
  depth = team_.sum(depth) / std::max(all_shallow, 1.0);
  if (!(share >= least_share)) return;
  in_.warning(
      section("mesh"),
      fmt::format("over {:.0f} % of its area the liquid is less than a cell deep, {:.3g} m "
                  "in the mean: there its pressure is wrong, and fronts are smeared over "
                  "many cells",
                  100 * share, depth),
      fmt::format("cells of at most {:.2g} m along {}, half of its depth", depth / 2, "xyz"[up]));
}

// Particles count by 1 - distance / radius along each axis.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_small_gauges() {
  constexpr double rounding = 1e-6;  // of the distance
  const auto entries = get_list(section("post_processing"), "gauges");
  const auto& gauges = model_.output.measured.gauges;
  if (rows_.total() == 0 || gauges.empty()) return;
  const ParticleTable<Dim>& p = model_.particles;
  double volume = 0;
  for (std::size_t i = 0; i < p.x.size(); ++i)
    volume += p.volume[i] / depth_at(model_.analysis, p.x[i][0]);
  volume = team_.sum(volume);
  const double distance = std::pow(volume / static_cast<double>(rows_.total()), 1.0 / Dim);
  for (std::size_t k = 0; k < std::min(entries.size(), gauges.size()); ++k) {
    const JsonValue* radius = entries[k]->find("radius");
    if (gauges[k].kind != Gauge::Kind::points || !radius || radius->defaulted) continue;
    if (!(gauges[k].radius.front() < (1 - rounding) * distance)) continue;
    in_.warning(*radius,
                fmt::format("the radius of the gauge '{}', {:.3g} m, is below the distance of "
                            "particles, {:.3g} m: where no particle is that near it gives nan",
                            gauges[k].name, gauges[k].radius.front(), distance),
                fmt::format("a radius of {:.2g} m or more; without 'radius' it is the size of a "
                            "cell",
                            2 * distance));
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
