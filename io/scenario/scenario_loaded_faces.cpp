// Tractions in meshes whose cells are no boxes: they act on faces of cells at which material ends.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "io/scenario/scenario_builder.h"
#include "io/scenario/surface_faces.h"

namespace lahar {

namespace {

void drop_copies(std::vector<Index>& ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

}  // namespace

template <int Dim>
typename ScenarioBuilder<Dim>::LoadedFaces ScenarioBuilder<Dim>::cells_with_material() const {
  LoadedFaces found;
  found.filled = model_.particles.cell;
  drop_copies(found.filled);
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

// What faces of cells show to whoever looks along the axis is the area in plan, as in grids. Where
// faces look up and down, as at both sides of a plate, those count that look one way.
template <int Dim>
HiddenLoads ScenarioBuilder<Dim>::load_faces(ParticleTraction& traction, double layers,
                                             LoadedFaces& at) const {
  constexpr double one_sided = 0.5;  // of the area that is seen: the body lies behind it
  constexpr double clearly = 1.01, rounding = 1e-6;
  const auto& p = model_.particles;
  const auto place = [](int axis, bool up) { return static_cast<std::size_t>(2 * axis + up); };
  std::vector<Index> cells;
  for (const Index id : traction.particles)
    cells.push_back(p.cell[static_cast<std::size_t>(rows_.local(id))]);
  drop_copies(cells);
  const std::vector<CellFace<Dim>> faces = faces_of_surface<Dim>(*at.mesh, cells, at.filled, team_);
  std::vector<Index> outer;
  for (const CellFace<Dim>& face : faces) outer.push_back(face.cell);
  drop_copies(outer);
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
  std::array<double, static_cast<std::size_t>(Dim)> seen, net;
  for (int d = 0; d < Dim; ++d) {
    const double down = total[place(d, false)], up = total[place(d, true)];
    seen[static_cast<std::size_t>(d)] = std::max(up, down);
    net[static_cast<std::size_t>(d)] = std::abs(up - down);
  }
  HiddenLoads found;
  found.loaded = team_.sum(static_cast<Index>(traction.particles.size()));
  const double most = *std::max_element(seen.begin(), seen.end());
  if (most == 0) {
    found.inside = true;
    for (const auto& part : team_.gather(std::vector{area_of(traction)})) found.area += part[0];
    return found;
  }
  const bool is_side = *std::max_element(net.begin(), net.end()) >= one_sided * most;
  const auto& by = is_side ? net : seen;
  const auto largest = std::max_element(by.begin(), by.end());
  const double along = by[static_cast<std::size_t>(traction.dir)];
  const bool has_area = along > rounding * most;
  const bool is_body = !is_side && layers >= two_layers && has_area;
  // Faces at the sides of the mesh are faces, too: where most particles are at a surface across
  // the traction, it is meant, however large the others are.
  const bool is_own = has_area && across > 0 && 2 * across_dir >= across;
  const bool is_larger = *largest > clearly * along;
  traction.axis =
      !is_body && !is_own && is_larger ? static_cast<int>(largest - by.begin()) : traction.dir;
  const double below = total[place(traction.axis, false)],
               above = total[place(traction.axis, true)];
  const bool pressed = traction.dir != traction.axis || traction.traction <= 0;
  const bool clear = std::abs(above - below) > (clearly - 1) * most;
  const bool up = clear || above == 0 || below == 0 ? above > below : pressed;
  const std::size_t side = place(traction.axis, up);
  if (traction.dir == traction.axis) traction.side = up ? 1 : -1;
  found.at_faces = true;
  found.axis = traction.axis;
  found.area = total[side];
  if (is_own && is_larger) {
    found.other_axis = static_cast<int>(largest - by.begin());
    found.other_area = *largest;
  }

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
    const bool along_r = model_.analysis.plane == Plane::axisymmetric && traction.axis == 0;
    shares.push_back({all[i].id, area * depth * (along_r ? 1 + offset / all[i].x[0] : 1.0)});
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
