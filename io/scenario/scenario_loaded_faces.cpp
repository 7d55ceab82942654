// Tractions in meshes whose cells are no boxes: they act on faces of cells at which material ends.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "io/scenario/scenario_builder.h"
#include "io/scenario/surface_faces.h"
#include "physics/base/sort_unique.h"
#include "physics/particles/loads.h"

namespace lahar {

namespace {

/// In SeenAreas: faces that look up or down an axis.
std::size_t seen_index(int axis, bool up) {
  return static_cast<std::size_t>(2 * axis + up);
}

/// The faces on which a traction acts, and others on which it might.
struct LoadedSide {
  int axis;
  bool up;
  int other_axis = -1;
  double other_area = 0;  ///< [m^2]
};

/// Chooses the side from the areas of a traction's particles. `is_own`: most of the particles are
/// at a surface across the traction. Then this surface is chosen, though another one is larger:
/// sides of the mesh count as surfaces, too.
template <int Dim>
LoadedSide side_of(const ParticleTraction& traction, const SeenAreas<Dim>& total, double layers,
                   bool is_own) {
  constexpr double one_sided = 0.5;  // of the area that is seen: the body lies behind it
  constexpr double clearly = 1.01, rounding = 1e-6;
  std::array<double, static_cast<std::size_t>(Dim)> seen, net;
  for (int d = 0; d < Dim; ++d) {
    const double down = total[seen_index(d, false)], up = total[seen_index(d, true)];
    seen[static_cast<std::size_t>(d)] = std::max(up, down);
    net[static_cast<std::size_t>(d)] = std::abs(up - down);
  }
  const double most = *std::max_element(seen.begin(), seen.end());
  const bool is_side = *std::max_element(net.begin(), net.end()) >= one_sided * most;
  const auto& by = is_side ? net : seen;
  const auto largest = std::max_element(by.begin(), by.end());
  const auto largest_axis = static_cast<int>(largest - by.begin());
  const double along = by[static_cast<std::size_t>(traction.dir)];
  const bool is_larger = *largest > clearly * along, has_area = along > rounding * most;
  const bool is_body = !is_side && layers >= two_layers;
  LoadedSide side{.axis = traction.dir, .up = false};
  if (is_larger && !(has_area && (is_body || is_own))) side.axis = largest_axis;
  if (is_larger && has_area && is_own) side.other_axis = largest_axis, side.other_area = *largest;
  const double below = total[seen_index(side.axis, false)],
               above = total[seen_index(side.axis, true)];
  const bool pressed = traction.dir != side.axis || traction.traction <= 0;
  const bool clear = std::abs(above - below) > (clearly - 1) * most || above == 0 || below == 0;
  side.up = clear ? above > below : pressed;
  return side;
}

}  // namespace

template <int Dim>
typename ScenarioBuilder<Dim>::LoadedFaces ScenarioBuilder<Dim>::cells_with_material() const {
  LoadedFaces found;
  found.filled = model_.particles.cell;
  sort_unique(found.filled);
  found.mesh = mesh_with(found.filled);
  return found;
}

// In boxes of several sizes the mean cell says nothing of the faces of particles.
template <int Dim>
bool ScenarioBuilder<Dim>::has_equal_cells(const LoadedFaces& at) const {
  constexpr double equal = 1e-3;  // of an edge
  const Vec<Dim> mean = outer_cell();
  bool other = false;
  for (const ParticleTraction& traction : model_.tractions)
    for (const Index id : traction.particles) {
      const Index cell = model_.particles.cell[static_cast<std::size_t>(rows_.local(id))];
      const auto [low, high] = at.mesh->cell_bounds(cell);
      other = other || ((high - low - mean).array().abs() > equal * mean.array()).any();
    }
  return !team_.any(other);
}

// A face counts with its area as seen along the axis, which is the area in plan, as in grids. A
// plate has faces on both sides: those of one side count.
template <int Dim>
HiddenLoads ScenarioBuilder<Dim>::load_faces(ParticleTraction& traction, double layers,
                                             LoadedFaces& at) const {
  const auto& p = model_.particles;
  std::vector<Index> cells;
  for (const Index id : traction.particles)
    cells.push_back(p.cell[static_cast<std::size_t>(rows_.local(id))]);
  sort_unique(cells);
  const std::vector<CellFace<Dim>> faces = faces_of_surface<Dim>(*at.mesh, cells, at.filled, team_);
  std::vector<Index> outer;
  for (const CellFace<Dim>& face : faces) outer.push_back(face.cell);
  sort_unique(outer);
  std::vector<FaceParticle<Dim>> own;
  for (const RowShares::Range& range : rows_.own_ranges())
    for (Index row = range.first; row < range.end; ++row) {
      const auto i = static_cast<std::size_t>(range.local + row - range.first);
      if (!std::binary_search(outer.begin(), outer.end(), p.cell[i])) continue;
      const auto& set = traction.particles;
      FaceParticle<Dim>& one = own.emplace_back(FaceParticle<Dim>{
          p.cell[i], row, {}, p.volume[i], std::binary_search(set.begin(), set.end(), row)});
      std::copy_n(p.x[i].data(), Dim, one.x.begin());
    }
  std::vector<FaceParticle<Dim>> all = joined(team_.gather(own));
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return std::pair(a.cell, a.id) < std::pair(b.cell, b.id);
  });
  const std::vector<SurfaceShare<Dim>> areas = areas_of<Dim>(faces, all, model_.analysis);

  SeenAreas<Dim> total{};
  Index across = 0, across_dir = 0;  // particles with faces that look along an axis; along dir
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].loaded) continue;
    for (std::size_t k = 0; k < total.size(); ++k) total[k] += areas[i].seen[k];
    const auto& looks = areas[i].across;
    across += std::find(looks.begin(), looks.end(), true) != looks.end() ? 1 : 0;
    across_dir += looks[static_cast<std::size_t>(traction.dir)] ? 1 : 0;
  }
  HiddenLoads found;
  found.loaded = team_.sum(static_cast<Index>(traction.particles.size()));
  if (*std::max_element(total.begin(), total.end()) == 0) {
    found.inside = true;
    found.area = team_.sum(area_of(traction));
    return found;
  }
  const LoadedSide chosen =
      side_of<Dim>(traction, total, layers, across > 0 && 2 * across_dir >= across);
  const std::size_t side = seen_index(chosen.axis, chosen.up);
  traction.axis = chosen.axis;
  if (traction.dir == traction.axis) traction.side = chosen.up ? 1 : -1;
  found.at_faces = true;
  found.axis = chosen.axis;
  found.area = total[side];
  found.other_axis = chosen.other_axis;
  found.other_area = chosen.other_area;

  // The force is the sum over particles, of rings at their outer sides, in the order of their rows.
  struct Share {
    Index row;
    double area;
  };
  std::vector<Share> shares;
  std::vector<Index> kept;
  const auto axis = static_cast<std::size_t>(traction.axis);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].loaded || areas[i].seen[side] == 0) continue;
    ++found.count;
    if (!rows_.holds(all[i].id)) continue;
    const double depth = depth_at(model_.analysis, all[i].x[0]);
    double& area = at.areas[all[i].id][axis];
    if (area == 0) area = areas[i].seen[side] / depth;
    kept.push_back(all[i].id);
    const double offset = 0.5 * traction.side * all[i].volume / (area * depth);
    shares.push_back(
        {all[i].id,
         area * depth * share_at_side(model_.analysis, traction.axis, all[i].x[0], offset)});
  }
  shares = joined(team_.gather(shares));
  std::sort(shares.begin(), shares.end(),
            [](const Share& a, const Share& b) { return a.row < b.row; });
  double sum = 0;
  for (const Share& share : shares) sum += share.area;
  if (sum > 0) found.factor = found.area / sum;
  found.count = found.loaded - found.count;
  std::sort(kept.begin(), kept.end());
  traction.particles = std::move(kept);
  return found;
}

template <int Dim>
void ScenarioBuilder<Dim>::keep_areas(const LoadedFaces& at) {
  if (at.areas.empty()) return;
  auto& p = model_.particles;
  p.edges.resize(p.x.size());
  for (const auto& [row, areas] : at.areas) {
    const auto i = static_cast<std::size_t>(rows_.local(row));
    const double volume = p.volume[i] / depth_at(model_.analysis, p.x[i][0]);
    auto all = areas;
    for (double& area : all)
      if (area == 0) area = std::pow(volume, (Dim - 1.0) / Dim);
    p.edges[i] = edges_with<Dim>(all);
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
