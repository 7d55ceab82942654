// Tractions on particles, and the side of each particle on which they act.
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "io/scenario/scenario_builder.h"
#include "physics/base/sort_unique.h"
#include "physics/particles/loads.h"

namespace lahar {

// A particle that fills a region is a part of a cell, and has the edges of the whole part also
// where the region's surface cuts it. Other particles have the shape of their cells, and their own
// volume.
template <int Dim>
Vec<Dim> ScenarioBuilder<Dim>::edges_of(Index id) const {
  const auto i = static_cast<std::size_t>(rows_.local(id));
  const auto& p = model_.particles;
  const double area = p.volume[i] / depth_at(model_.analysis, p.x[i][0]);
  if (!of_boxes_) return Vec<Dim>::Constant(std::pow(area, 1.0 / Dim));
  const Vec<Dim> cell = outer_cell();
  const auto made = std::upper_bound(generators_.begin(), generators_.end(), id,
                                     [](Index row, const GeneratorRows& g) { return row < g.end; });
  if (mesh_->is_structured() && made != generators_.end() && made->parts > 0 &&
      !section("mesh").find("particles_volumes"))
    return cell / made->parts;
  return cell * std::pow(area / cell.prod(), 1.0 / Dim);
}

template <int Dim>
void ScenarioBuilder<Dim>::build_tractions() {
  for (const JsonValue* t :
       get_list(section("external_loading_conditions"), "particle_surface_traction")) {
    const auto dir = phase_direction_of(*t);
    const auto value = get_number(*t, "traction");
    const int function = find_function(*t);
    auto ids = members(*t, "pset_id", "pset", sets_.particles);
    if (dir && value && ids)
      model_.tractions.push_back({std::move(*ids), *dir % Dim, *value, function,
                                  means_all(*t, "pset_id", "pset"), *dir >= Dim});
  }
}

namespace {

/// A particle with a traction.
template <int Dim>
struct Loaded {
  std::array<double, static_cast<std::size_t>(Dim)> x, edges;  ///< [m]
};

/// Which of the loaded particles have others at their lower and at their upper side along an axis.
template <int Dim>
class Neighbours {
 public:
  Neighbours(std::vector<Loaded<Dim>> loaded, int axis)
      : loaded_(std::move(loaded)), axis_(axis), sides_(2 * loaded_.size(), 0.0) {
    for (const Loaded<Dim>& one : loaded_)
      for (std::size_t d = 0; d < Dim; ++d) widest_[d] = std::max(widest_[d], one.edges[d]);
    for (std::size_t i = 0; i < loaded_.size(); ++i) {
      const Place place = place_of(loaded_[i].x.data());
      in_[key_of(place)].push_back(i);
      for (std::size_t d = 0; d < Dim; ++d) {
        low_[d] = i == 0 ? place[d] : std::min(low_[d], place[d]);
        high_[d] = i == 0 ? place[d] : std::max(high_[d], place[d]);
      }
    }
  }

  void look(const Vec<Dim>& x) {
    const Place place = place_of(x.data());
    for (std::size_t d = 0; d < Dim; ++d)
      if (place[d] < low_[d] - reach(d) || place[d] > high_[d] + reach(d)) return;
    Place at;
    for (Index k = -reach(2); Dim == 2 ? k == -reach(2) : k <= reach(2); ++k)
      for (Index j = -reach(1); j <= reach(1); ++j)
        for (Index i = -reach(0); i <= reach(0); ++i) {
          at[0] = place[0] + i;
          at[1] = place[1] + j;
          if constexpr (Dim == 3) at[2] = place[2] + k;
          if (const auto found = in_.find(key_of(at)); found != in_.end())
            for (const std::size_t one : found->second) compare(one, x);
        }
  }
  /// 1.0 where there is one: below and above each of the loaded particles.
  const std::vector<double>& sides() const { return sides_; }

 private:
  using Place = std::array<Index, static_cast<std::size_t>(Dim)>;

  /// How many boxes away a neighbour may be. A box has the longest edges of all loaded particles.
  Index reach(std::size_t d) const { return static_cast<int>(d) == axis_ ? 2 : 1; }
  Place place_of(const double* x) const {
    Place place;
    for (std::size_t d = 0; d < Dim; ++d)
      place[d] = static_cast<Index>(std::floor(x[d] / widest_[d]));
    return place;
  }
  static std::size_t key_of(const Place& place) {
    std::size_t key = 0;  // two places of one key only cost time
    for (const Index i : place) key = key * 1000003 + static_cast<std::size_t>(i);
    return key;
  }
  void compare(std::size_t one, const Vec<Dim>& x) {
    constexpr double beside = 0.75, nearest = 0.5, furthest = 1.5;  // edges
    double along = 0;
    for (std::size_t d = 0; d < Dim; ++d) {
      const double distance = (x[static_cast<int>(d)] - loaded_[one].x[d]) / loaded_[one].edges[d];
      if (static_cast<int>(d) == axis_)
        along = distance;
      else if (std::abs(distance) > beside)
        return;
    }
    if (std::abs(along) <= nearest || std::abs(along) > furthest) return;
    sides_[2 * one + (along > 0 ? 1 : 0)] = 1.0;
  }

  std::vector<Loaded<Dim>> loaded_;
  int axis_;
  std::vector<double> sides_;
  std::array<double, static_cast<std::size_t>(Dim)> widest_{};
  std::unordered_map<std::size_t, std::vector<std::size_t>> in_;
  Place low_{}, high_{};
};

template <int Dim>
Loaded<Dim> loaded_at(const Vec<Dim>& x, const Vec<Dim>& edges) {
  Loaded<Dim> one;
  std::copy_n(x.data(), Dim, one.x.begin());
  std::copy_n(edges.data(), Dim, one.edges.begin());
  return one;
}

/// Those of all members of a team.
template <int Dim>
struct AllLoaded {
  std::vector<Loaded<Dim>> all;
  std::size_t first = 0;  ///< of this member's
};
template <int Dim>
AllLoaded<Dim> gather_loaded(const Team& team, const std::vector<Loaded<Dim>>& own) {
  const auto shares = team.gather(own);
  AllLoaded<Dim> found{.all = joined(shares)};
  for (int member = 0; member < team.index(); ++member)
    found.first += shares[static_cast<std::size_t>(member)].size();
  return found;
}

template <int Dim>
bool have_equal_edges(const std::vector<Loaded<Dim>>& loaded) {
  constexpr double rounding = 1e-9;  // of an edge
  return std::all_of(loaded.begin(), loaded.end(), [&](const Loaded<Dim>& one) {
    for (std::size_t d = 0; d < Dim; ++d)
      if (std::abs(one.edges[d] - loaded.front().edges[d]) > rounding * one.edges[d]) return false;
    return true;
  });
}

/// Loaded particles that lie behind each other without a gap are a stack. Its end at the surface,
/// where nothing is beside it (`sides`), has the load; of two such ends, or none, the upper one if
/// `upper`.
template <int Dim>
HiddenLoads hidden_in_stacks(const std::vector<Loaded<Dim>>& loaded,
                             const std::vector<double>& sides, const Vec<Dim>& low, int axis,
                             bool upper) {
  using Place = std::array<Index, static_cast<std::size_t>(Dim)>;  // across the axis, then along it
  std::vector<std::pair<Place, std::size_t>> places;
  for (std::size_t i = 0; i < loaded.size(); ++i) {
    Place place;
    for (std::size_t d = 0, n = 0; d < Dim; ++d) {
      const double at = (loaded[i].x[d] - low[static_cast<int>(d)]) / loaded[i].edges[d];
      place[static_cast<int>(d) == axis ? Dim - 1 : n++] =
          static_cast<Index>(std::floor(at + 1e-6));
    }
    places.emplace_back(place, i);
  }
  std::sort(places.begin(), places.end());
  HiddenLoads found{.is_hidden = std::vector<bool>(loaded.size(), false)};
  for (std::size_t first = 0, end; first < places.size(); first = end) {
    const auto goes_on = [&](std::size_t k) {
      const Place &below = places[k - 1].first, &above = places[k].first;
      return std::equal(below.begin(), below.end() - 1, above.begin()) &&
             above.back() - below.back() <= 1;
    };
    for (end = first + 1; end < places.size() && goes_on(end);) ++end;
    const std::size_t lowest = places[first].second, highest = places[end - 1].second;
    const bool free_below = sides[2 * lowest] == 0.0, free_above = sides[2 * highest + 1] == 0.0;
    const std::size_t kept = (free_below == free_above ? upper : free_above) ? highest : lowest;
    for (std::size_t k = first; k < end; ++k)
      found.is_hidden[places[k].second] = places[k].second != kept;
    found.count += static_cast<Index>(end - first) - 1;
    found.deepest = std::max(found.deepest, static_cast<Index>(end - first));
  }
  return found;
}

}  // namespace

// Looking along the axis of the surface, the particles of a traction lie in the fewest layers.
template <int Dim>
void ScenarioBuilder<Dim>::find_loaded_surfaces() {
  using Column = std::array<Index, static_cast<std::size_t>(Dim)>;  // its axis, places across it
  auto& p = model_.particles;
  if (model_.tractions.empty() || !mesh_) return;
  of_boxes_ = !in_.cbgeo_defaults && !team_.any(!mesh_->is_cartesian());
  layers_of_loads_.assign(model_.tractions.size(), 0.0);
  hidden_loads_.assign(model_.tractions.size(), {});
  const Vec<Dim> low = mesh_->bounds().first;
  LoadedFaces faces;
  if (!in_.cbgeo_defaults && team_.any(!mesh_->is_structured() || !of_boxes_)) {
    faces = cells_with_material();
    of_boxes_ = of_boxes_ && has_equal_cells(faces);
  }
  for (std::size_t k = 0; k < model_.tractions.size(); ++k) {
    ParticleTraction& traction = model_.tractions[k];
    const auto members = static_cast<std::size_t>(team_.size());
    std::vector<std::vector<Column>> to(members);
    std::vector<std::size_t> room(members, 1 << 12);  // until equal ones are taken out
    for (const Index id : traction.particles) {
      const Vec<Dim> edges = edges_of(id), &x = p.x[static_cast<std::size_t>(rows_.local(id))];
      for (int axis = 0; axis < Dim; ++axis) {
        Column column{axis};
        Index owner = axis;
        for (int d = 0, n = 1; d < Dim; ++d)
          if (d != axis) {
            column[static_cast<std::size_t>(n)] =
                static_cast<Index>(std::floor((x[d] - low[d]) / edges[d] + 1e-6));
            owner = 31 * owner + std::abs(column[static_cast<std::size_t>(n++)]);
          }
        const auto member = static_cast<std::size_t>(owner % team_.size());
        to[member].push_back(column);
        if (to[member].size() < room[member]) continue;
        sort_unique(to[member]);
        room[member] = std::max(room[member], 2 * to[member].size());
      }
    }
    for (auto& columns : to) sort_unique(columns);
    std::vector<Column> columns = joined(team_.exchange(std::move(to)));
    sort_unique(columns);
    const Index loaded = team_.sum(static_cast<Index>(traction.particles.size()));
    if (loaded == 0) continue;
    std::array<double, static_cast<std::size_t>(Dim)> layers{};
    for (Index axis = 0; axis < Dim; ++axis) {
      const auto here = std::count_if(columns.begin(), columns.end(),
                                      [&](const Column& c) { return c[0] == axis; });
      layers[static_cast<std::size_t>(axis)] =
          static_cast<double>(loaded) / static_cast<double>(team_.sum(static_cast<Index>(here)));
    }
    const auto least = std::min_element(layers.begin(), layers.end());
    layers_of_loads_[k] = *least;
    if (in_.cbgeo_defaults) continue;
    const bool is_along = layers[static_cast<std::size_t>(traction.dir)] > one_layer;
    traction.axis =
        is_along && *least < two_layers ? static_cast<int>(least - layers.begin()) : traction.dir;
    if (traction.all) continue;
    if (!of_boxes_) {
      hidden_loads_[k] = load_faces(traction, *least, faces);
      continue;
    }
    std::vector<int> thin;  // axes along which they are one layer
    for (int axis = 0; axis < Dim; ++axis)
      if (layers[static_cast<std::size_t>(axis)] <= one_layer) thin.push_back(axis);
    if (thin.size() > 1 && std::find(thin.begin(), thin.end(), traction.axis) != thin.end())
      hidden_loads_[k] = find_strip(traction, thin);
    const double behind = layers[static_cast<std::size_t>(traction.axis)];
    if (!(behind > 1 && behind < two_layers)) continue;
    if (HiddenLoads hidden = leave_hidden(traction); hidden.count > 0) {
      hidden.other_axis = hidden_loads_[k].other_axis;
      hidden.other_area = hidden_loads_[k].other_area;
      hidden_loads_[k] = std::move(hidden);
    }
  }
  keep_areas(faces);
}

// Particles at a free side have neighbours at the other: at both the body goes on, and at none it
// is as thin as the set. Where that leaves several axes, or none, the traction's own counts.
template <int Dim>
HiddenLoads ScenarioBuilder<Dim>::find_strip(ParticleTraction& traction,
                                             const std::vector<int>& axes) {
  constexpr double most = 0.5;    // of the particles have a free side
  constexpr double equal = 1e-3;  // areas
  const auto& p = model_.particles;
  std::vector<Loaded<Dim>> own;
  for (const Index id : traction.particles)
    own.push_back(loaded_at(p.x[static_cast<std::size_t>(rows_.local(id))], edges_of(id)));
  const std::vector<Loaded<Dim>> loaded = gather_loaded(team_, own).all;
  std::vector<int> ending;
  for (const int axis : axes) {
    Neighbours<Dim> neighbours(loaded, axis);
    for (const Vec<Dim>& x : p.x) neighbours.look(x);
    const std::vector<double> sides = team_.most(neighbours.sides());
    std::size_t with_end = 0;
    for (std::size_t i = 0; i < loaded.size(); ++i)
      with_end += sides[2 * i] != sides[2 * i + 1] ? 1 : 0;
    if (static_cast<double>(with_end) >= most * static_cast<double>(loaded.size()))
      ending.push_back(axis);
  }
  const auto has = [](const std::vector<int>& list, int axis) {
    return std::find(list.begin(), list.end(), axis) != list.end();
  };
  if (!ending.empty() && !has(ending, traction.axis))
    traction.axis = has(ending, traction.dir) ? traction.dir : ending.front();
  const auto all_across = [&](int axis) {
    double sum = 0;
    for (const Loaded<Dim>& one : loaded)
      sum += area_across<Dim>(axis, depth_at(model_.analysis, one.x[0]), one.edges);
    return sum;
  };
  HiddenLoads found;
  found.axis = traction.axis;
  found.area = all_across(traction.axis);
  for (const int axis : ending.empty() ? axes : ending) {
    const double other = all_across(axis);
    if (axis == traction.axis || std::abs(other / found.area - 1) <= equal) continue;
    found.other_axis = axis;
    found.other_area = other;
  }
  return found;
}

// On slopes and curved surfaces, some particles of a set lie behind others. What is loaded is the
// surface as seen along its axis.
template <int Dim>
HiddenLoads ScenarioBuilder<Dim>::leave_hidden(ParticleTraction& traction) {
  if (traction.all || !of_boxes_ || team_.any(!mesh_->is_structured())) return {};
  const auto& p = model_.particles;
  std::vector<Loaded<Dim>> own;
  for (const Index id : traction.particles)
    own.push_back(loaded_at(p.x[static_cast<std::size_t>(rows_.local(id))], edges_of(id)));
  const auto [loaded, first] = gather_loaded(team_, own);
  if (!have_equal_edges(loaded)) return {};  // they are in no common rows
  Neighbours<Dim> neighbours(loaded, traction.axis);
  for (const Vec<Dim>& x : p.x) neighbours.look(x);
  const bool upper = traction.dir != traction.axis || traction.traction <= 0;
  HiddenLoads found = hidden_in_stacks<Dim>(loaded, team_.most(neighbours.sides()),
                                            mesh_->bounds().first, traction.axis, upper);
  if (found.count == 0) return {};
  for (std::size_t i = 0; i < loaded.size(); ++i) {
    double area = depth_at(model_.analysis, loaded[i].x[0]);
    for (std::size_t d = 0; d < Dim; ++d)
      area *= static_cast<int>(d) == traction.axis ? 1.0 : loaded[i].edges[d];
    found.area += found.is_hidden[i] ? 0.0 : area;
  }
  std::vector<Index> kept;
  for (std::size_t i = 0; i < own.size(); ++i)
    if (!found.is_hidden[first + i]) kept.push_back(traction.particles[i]);
  traction.particles = std::move(kept);
  found.loaded = static_cast<Index>(loaded.size());
  found.axis = traction.axis;
  return found;
}

// A traction acts at the side of a particle that has no neighbour, if the opposite side has one. A
// traction along the surface, such as shear, acts at the centre.
template <int Dim>
void ScenarioBuilder<Dim>::place_tractions() {
  if (of_boxes_) {
    auto& edges = model_.particles.edges;
    edges.resize(model_.particles.x.size());
    for (const ParticleTraction& traction : model_.tractions)
      for (const Index id : traction.particles)
        std::copy_n(edges_of(id).data(), Dim,
                    edges[static_cast<std::size_t>(rows_.local(id))].begin());
  }
  std::vector<std::vector<ParticleTraction>> parts(model_.tractions.size());
  if (!in_.cbgeo_defaults) parts = parts_by_side();
  std::vector<double> areas(parts.size(), 0.0);
  std::vector<ParticleTraction> placed;
  for (std::size_t t = 0; t < parts.size(); ++t) {
    if (parts[t].empty()) parts[t].push_back(std::move(model_.tractions[t]));
    for (ParticleTraction& part : parts[t]) {
      if (!hidden_loads_.empty()) part.traction *= hidden_loads_[t].factor;
      areas[t] += area_of(part);
      placed.push_back(std::move(part));
    }
  }
  model_.tractions = std::move(placed);
  describe_tractions(areas);
  describe_nodal_forces();
}

template <int Dim>
std::vector<std::vector<ParticleTraction>> ScenarioBuilder<Dim>::parts_by_side() const {
  constexpr double least = 0.5;  // of the particles of a traction that have a side
  const auto& p = model_.particles;
  std::vector<std::vector<ParticleTraction>> parts(model_.tractions.size());
  std::size_t entries = parts.size() + model_.particle_velocities.size();
  for (std::size_t t = 0; t < parts.size(); ++t) {
    const ParticleTraction& traction = model_.tractions[t];
    if (!hidden_loads_.empty() && hidden_loads_[t].at_faces) continue;  // it has its side
    std::vector<Loaded<Dim>> own;
    if (!traction.all)
      for (const Index id : traction.particles)
        own.push_back(loaded_at(p.x[static_cast<std::size_t>(rows_.local(id))], edges_of(id)));
    const auto [loaded, first] = gather_loaded(team_, own);
    if (loaded.empty()) continue;
    Neighbours<Dim> neighbours(loaded, traction.dir);
    for (const Vec<Dim>& x : p.x) neighbours.look(x);
    const std::vector<double> sides = team_.most(neighbours.sides());
    const auto side_of = [&](std::size_t i) {
      return static_cast<int>(sides[2 * i] - sides[2 * i + 1]);
    };
    std::size_t with_side = 0;
    for (std::size_t i = 0; i < sides.size() / 2; ++i) with_side += side_of(i) != 0 ? 1 : 0;
    if (with_side == 0 ||
        static_cast<double>(with_side) < least * static_cast<double>(sides.size() / 2))
      continue;
    for (const int side : {-1, 0, 1}) {
      ParticleTraction part = traction;
      part.particles.clear();
      part.side = side;
      for (std::size_t k = 0; k < own.size(); ++k)
        if (side_of(first + k) == side) part.particles.push_back(traction.particles[k]);
      if (team_.any(!part.particles.empty())) parts[t].push_back(std::move(part));
    }
    entries += parts[t].size() - 1;
  }
  if (entries > max_particle_loads) parts.assign(parts.size(), {});
  return parts;
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
