// Warnings of what is probably at the wrong place: walls, regions, generators.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <unordered_set>

#include "io/scenario/scenario_builder.h"
#include "io/scenario/surface_order.h"

namespace lahar {

namespace {

/// Nodes of one friction entry whose walls have the same normal.
template <int Dim>
struct Wall {
  Index nodes = 0, framed = 0;     ///< framed: with axes of their own
  Index two_sided = 0, loose = 0;  ///< loose: two-sided, and not held along the normal
  std::array<double, Dim> low, high;
  Wall() {
    low.fill(infinity);
    high.fill(-infinity);
  }
  void add(const Wall& other) {
    nodes += other.nodes;
    framed += other.framed;
    two_sided += other.two_sided;
    loose += other.loose;
    for (std::size_t d = 0; d < Dim; ++d) {
      low[d] = std::min(low[d], other.low[d]);
      high[d] = std::max(high[d], other.high[d]);
    }
  }
};

struct AbsorbingNode {
  std::array<double, 3> x{};  ///< [m]
  double area = 0;            ///< [m^2; m] that the scenario gives it
  int normal = 0;
  Index entry = 0;
};

/// Absorbing nodes that lie in one plane.
struct AbsorbingPlane {
  std::vector<AbsorbingNode> nodes;
  std::array<double, 3> low, high;  ///< [m]
  double given = 0;                 ///< [m^2; m] area

  AbsorbingPlane() {
    low.fill(infinity);
    high.fill(-infinity);
  }
  void add(const AbsorbingNode& node) {
    nodes.push_back(node);
    given += node.area;
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], node.x[d]);
      high[d] = std::max(high[d], node.x[d]);
    }
  }
  /// Of cells with these edges [m]; 0 where the nodes are too few to tell.
  template <int Dim>
  double area(const Vec<Dim>& edge) const {
    constexpr double few = 1.5;  // cells
    double sum = 0;
    for (const AbsorbingNode& node : nodes) {
      double of_node = 1;
      for (int d = 0; d < Dim; ++d) {
        const auto k = static_cast<std::size_t>(d);
        if (d == node.normal) continue;
        if (high[k] - low[k] < few * edge[d]) return 0;
        const double inside = std::min(node.x[k] - low[k], high[k] - node.x[k]);
        of_node *= edge[d] * (inside < 0.5 * edge[d] ? 0.5 : 1.0);
      }
      sum += of_node;
    }
    return sum;
  }
};

}  // namespace

// The nodes of an absorbing boundary get their areas from what the scenario says of the mesh.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_absorbing_nodes(
    const std::vector<std::pair<const JsonValue*, std::size_t>>& entries) {
  constexpr double much = 0.15;
  if (!mesh_ || !mesh_->is_cartesian()) return;
  const auto& list = entries_of<NodeAbsorption>(model_);
  if (!team_.any(!list.empty())) return;
  std::vector<Index> ids;
  for (const NodeAbsorption& one : list) ids.push_back(one.node);
  const auto places = places_of(ids);
  std::vector<AbsorbingNode> own(list.size());
  std::size_t entry = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    while (i >= entries[entry].second) ++entry;
    NodeAbsorption one = list[i];
    one.derive(Dim);
    own[i] = {.area = one.area, .normal = one.normal, .entry = static_cast<Index>(entry)};
    std::copy_n(places[i].data(), Dim, own[i].x.begin());
  }
  const Vec<Dim> edge = outer_cell();
  std::array<std::map<long, AbsorbingPlane>, static_cast<std::size_t>(Dim)> planes;  // by normal
  for (const AbsorbingNode& node : joined(team_.gather(own))) {
    const auto normal = static_cast<std::size_t>(node.normal);
    planes[normal][std::lround(node.x[normal] / edge[node.normal])].add(node);
  }
  for (std::size_t normal = 0; normal < planes.size(); ++normal) {
    const char axis = "xyz"[normal];
    // A set may have both sides of a model.
    if (planes[normal].size() > 2) {
      const AbsorbingNode& first = planes[normal].begin()->second.nodes.front();
      in_.warning(
          *entries[static_cast<std::size_t>(first.entry)].first,
          fmt::format("the nodes of this absorbing boundary lie one behind the other along "
                      "its normal, {}, in {} places: all of them absorb as if each "
                      "were at the boundary",
                      axis, planes[normal].size()),
          "'dir' is the axis across the boundary, and all its nodes have one place along it");
      continue;
    }
    for (const auto& [at, plane] : planes[normal]) {
      const double area = plane.template area<Dim>(edge);
      if (area == 0 || std::abs(plane.given - area) <= much * area) continue;
      in_.warning(
          *entries[static_cast<std::size_t>(plane.nodes.front().entry)].first,
          fmt::format("the nodes of the absorbing boundary at {} = {:.6g} have areas of {:.4g} {} "
                      "together by 'h_min' and 'position', and {:.4g} by the mesh: waves come back "
                      "from it",
                      axis, plane.low[normal], plane.given, Dim == 2 ? "m" : "m^2", area),
          Dim == 2 ? "h_min is the edge of the cells along the boundary; its two ends are a "
                     "\"corner\", all other nodes an \"edge\""
                   : "h_min is the edge of the cells along the boundary; nodes inside are a "
                     "\"face\", those of its border an \"edge\", its corners a \"corner\"");
    }
  }
}

template <int Dim>
std::vector<Vec<Dim>> ScenarioBuilder<Dim>::places_of(const std::vector<Index>& nodes) const {
  std::vector<Vec<Dim>> places;
  if (!mesh_->is_share()) {
    for (const Index node : nodes) places.push_back(mesh_->node(node));
    return places;
  }
  using Place = std::array<double, static_cast<std::size_t>(Dim)>;
  const Index first = team_.part(n_nodes(), team_.index());
  const auto answers = ask<Place>(
      team_, nodes, [&](Index node) { return team_.member(node, n_nodes()); },
      [&](Index node) {
        Place place;
        std::copy_n(own_nodes_[static_cast<std::size_t>(node - first)].data(), Dim, place.begin());
        return place;
      });
  for (const Place& place : answers) places.emplace_back(place.data());
  return places;
}

template <int Dim>
void ScenarioBuilder<Dim>::warn_of_walls() {
  std::unordered_set<Index> framed;
  for (const auto& frame : model_.node_frames) framed.insert(frame.node);
  std::set<std::pair<Index, int>> shaken;
  for (const auto& c : entries_of<NodeAcceleration>(model_)) shaken.insert({c.node, c.dir});
  for (const FrictionEntry& e : friction_entries_) {
    std::array<Wall<Dim>, 2 * static_cast<std::size_t>(Dim)> walls;  // by normal and sign
    std::vector<Index> nodes;
    for (std::size_t i = e.first; i < e.end; ++i)
      nodes.push_back(entries_of<NodeFriction>(model_)[i].node);
    const auto places = places_of(nodes);
    for (std::size_t i = e.first; i < e.end; ++i) {
      const NodeFriction& f = entries_of<NodeFriction>(model_)[i];
      Wall<Dim>& wall = walls[2 * static_cast<std::size_t>(f.normal) + (f.outward > 0 ? 1 : 0)];
      ++wall.nodes;
      wall.framed += framed.count(f.node) ? 1 : 0;
      wall.two_sided += f.two_sided ? 1 : 0;
      const bool held = is_held(f.node, f.normal) || shaken.count({f.node, f.normal});
      wall.loose += !f.two_sided || held ? 0 : 1;
      for (std::size_t d = 0; d < Dim; ++d) {
        const double x = places[i - e.first][static_cast<int>(d)];
        wall.low[d] = std::min(wall.low[d], x);
        wall.high[d] = std::max(wall.high[d], x);
      }
    }
    const auto parts = team_.gather(std::vector<Wall<Dim>>(walls.begin(), walls.end()));
    for (std::size_t k = 0; k < walls.size(); ++k) {
      Wall<Dim> wall;
      for (const auto& part : parts) wall.add(part[k]);
      const int axis = static_cast<int>(k / 2), outward = k % 2 == 1 ? 1 : -1;
      if (wall.nodes == 0) continue;
      if (wall.loose > 0)
        in_.warning(*e.entry,
                    fmt::format("{} of the {} nodes of this two-sided friction wall are not held "
                                "along its normal, {}",
                                wall.loose, wall.two_sided, "xyz"[axis]),
                    fmt::format("friction alone does not stop material: add a velocity constraint "
                                "with \"dir\": {}, or set \"two_sided\": false",
                                axis));
      if (wall.framed == 0)
        warn_of_side(*e.entry, wall.low.data(), wall.high.data(), axis, outward);
    }
  }
  own_nodes_ = {};
  const auto& friction = entries_of<NodeFriction>(model_);
  const bool pulls = std::any_of(friction.begin(), friction.end(), [](const NodeFriction& f) {
    return f.two_sided && f.friction > 0;
  });
  // Where constraints move a node along a wall, material moves with it.
  std::vector<std::pair<Index, int>> moved;
  for (const NodeVelocity& v : entries_of<NodeVelocity>(model_))
    if (v.velocity != 0) moved.emplace_back(v.node, v.dir);
  for (const NodeAcceleration& a : entries_of<NodeAcceleration>(model_))
    if (a.acceleration != 0) moved.emplace_back(a.node, a.dir);
  std::sort(moved.begin(), moved.end());
  const bool glued = std::any_of(friction.begin(), friction.end(), [&](const NodeFriction& f) {
    if (!std::isfinite(f.friction)) return false;
    for (int d = 0; d < Dim; ++d)
      if (d != f.normal && std::binary_search(moved.begin(), moved.end(), std::pair(f.node, d)))
        return true;
    return false;
  });
  if (team_.any(glued))
    in_.warning(*friction_entries_.front().entry,
                "constraints move nodes of a wall along it: material sticks to these nodes, "
                "whatever the friction of the wall",
                "a rigid body with that velocity is a floor on which material may slide");
  if (team_.any(pulls) && in_.cbgeo_defaults && !model_.analysis.as_cbgeo)
    in_.warning(*friction_entries_.front().entry,
                "two-sided friction, as in CB-Geo MPM, slows what slides by more than the "
                "coefficient says, and stiff material by much more",
                "set \"two_sided\": false for Coulomb's friction");
}

// A wall at the border of the mesh bounds what is in the mesh; for others particles near them tell.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_side(const JsonValue& entry, const double* low,
                                        const double* high, int axis, int outward) {
  const auto [mesh_low, mesh_high] = mesh_->bounds();
  const char name = "xyz"[axis];
  const auto warn = [&](const std::string& what) {
    in_.warning(
        entry,
        fmt::format("the wall at {} = {}{} has its material on the wrong side: {}", name, low[axis],
                    low[axis] < high[axis] ? fmt::format(" to {}", high[axis]) : "", what),
        entry.find("normal")
            ? "'normal' points from the wall into the material: reverse its sign"
            : "'sign_n' is the sign of the direction that points out of the body, -1 for a "
              "floor below it: reverse it");
  };
  const double tolerance = region_tolerance_;
  const double inner = outward > 0 ? mesh_low[axis] : mesh_high[axis];
  if (std::abs(low[axis] - inner) <= tolerance && std::abs(high[axis] - inner) <= tolerance)
    return warn(fmt::format("it bounds what is {} it along {}, where the mesh ends",
                            outward > 0 ? "below" : "above", name));
  const double near = outer_cell()[axis];  // particles within a cell
  Index before = 0, behind = 0;            // inside of the body, and beyond the wall
  for (const Vec<Dim>& x : model_.particles.x) {
    bool beside = false;
    for (int d = 0; d < Dim; ++d)
      beside |= d != axis && (x[d] < low[d] - tolerance || x[d] > high[d] + tolerance);
    const bool above = x[axis] >= high[axis] && x[axis] < high[axis] + near;
    const bool below = x[axis] <= low[axis] && x[axis] > low[axis] - near;
    const bool between = x[axis] > low[axis] && x[axis] < high[axis];
    if (beside || (!above && !below && !between)) continue;
    ++(!between && (outward > 0 ? above : below) ? behind : before);
  }
  before = team_.sum(before);
  behind = team_.sum(behind);
  if (behind > 0 && before == 0)
    warn(fmt::format("all {} particles within a cell of it are {} it", behind,
                     outward > 0 ? "above" : "below"));
}

template <int Dim>
Vec<Dim> ScenarioBuilder<Dim>::outer_cell() const {
  return mesh_->is_structured() ? mesh_->spacing() : mesh_->mean_cell();
}

template <int Dim>
bool ScenarioBuilder<Dim>::is_held(Index node, int dir) const {
  const auto& v = entries_of<NodeVelocity>(model_);  // sorted by node and direction
  const auto it = std::lower_bound(v.begin(), v.end(), std::pair(node, dir),
                                   [](const NodeVelocity& a, const std::pair<Index, int>& key) {
                                     return std::pair(a.node, a.dir) < key;
                                   });
  return it != v.end() && it->node == node && it->dir == dir;
}

namespace {

/// The volume of a region in a box [m^Dim], and what of it lies beyond a mesh, by points of a
/// lattice.
template <int Dim>
struct VolumeInBox {
  double all = 0, beyond = 0;
};
template <int Dim>
VolumeInBox<Dim> volume_in(const Region<Dim>& region, const Vec<Dim>& low, const Vec<Dim>& high,
                           const std::pair<Vec<Dim>, Vec<Dim>>& mesh) {
  constexpr int points = Dim == 2 ? 64 : 24;  // along each axis
  VolumeInBox<Dim> volume;
  const double part = (high - low).prod() / std::pow(points, Dim);
  std::array<int, static_cast<std::size_t>(Dim)> at{};
  for (bool more = true; more;) {
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d)
      x[d] = low[d] + (high[d] - low[d]) * (at[static_cast<std::size_t>(d)] + 0.5) / points;
    if (region.contains(x)) {
      const bool in =
          (x.array() >= mesh.first.array()).all() && (x.array() <= mesh.second.array()).all();
      volume.all += part;
      volume.beyond += in ? 0.0 : part;
    }
    more = false;
    for (std::size_t d = 0; d < Dim && !more; ++d) {
      more = ++at[d] < points;
      if (!more) at[d] = 0;
    }
  }
  return volume;
}

}  // namespace

// What of a region lies beyond the mesh. A side without an end ends with the mesh: soil below a
// surface may lack its top, but not what lies deeper.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_clipping(const JsonValue& shape, const Region<Dim>& region,
                                            Index particles) {
  constexpr double most = 0.05;  // of the region
  auto [low, high] = region.bounds();
  const auto mesh = mesh_->bounds();
  auto shown = region.bounds();
  // What lies beyond the axis is the same body once more.
  if (get_text(section("analysis"), "plane") == "axisymmetric" && low[0] < 0 && high[0] > 0)
    low[0] = shown.first[0] = 0;
  const bool of_surface = names_surface(shape);
  bool beyond = false;
  for (int d = 0; d < Dim; ++d) {
    const bool open = std::isinf(low[d]) || std::isinf(high[d]);
    if (std::isinf(low[d])) low[d] = shown.first[d] = mesh.first[d];
    if (std::isinf(high[d])) high[d] = shown.second[d] = mesh.second[d];
    // Whoever reaches beyond the mesh at both ends means all of it.
    const bool all = open ? !of_surface
                          : low[d] < mesh.first[d] - 2 * region_tolerance_ &&
                                high[d] > mesh.second[d] + 2 * region_tolerance_;
    if (all) {
      low[d] = std::max(low[d], mesh.first[d]);
      high[d] = std::min(high[d], mesh.second[d]);
    }
    beyond |= low[d] < mesh.first[d] - 2 * region_tolerance_ ||
              high[d] > mesh.second[d] + 2 * region_tolerance_;
  }
  if (!beyond) return;
  const auto all = volume_in<Dim>(region, low, high, mesh);
  double inside = all.all - all.beyond;
  if (!(inside > 0))  // the mesh is small beside it
    inside = volume_in<Dim>(region, low.cwiseMax(mesh.first), high.cwiseMin(mesh.second), mesh).all;
  const double share = all.beyond / (all.beyond + inside);
  if (!(inside > 0) || share < most) return;
  in_.warning(shape,
              fmt::format("{:.{}f} % of the region lies outside of the mesh and gets no particles: "
                          "about {:.0f}, beside the {} inside",
                          100 * share, share > 0.99 ? 2 : 0,
                          static_cast<double>(particles) * share / (1 - share), particles),
              fmt::format("the mesh extends {}, the region {}: move one of them, or make the mesh "
                          "larger",
                          extent<Dim>(mesh), extent<Dim>(shown)));
}

namespace {

/// What particles of one generator take of a cell.
struct CellShare {
  Index cell;
  int generator;
  double volume;  ///< [m^3]
};

/// Cells in which a generator adds to those before it.
struct CommonPlace {
  int generator, earlier;
  Index cells;
  double most;  ///< of particle volume over the cell's [-]
};

bool before(const CellShare& a, const CellShare& b) {
  return std::pair(a.cell, a.generator) < std::pair(b.cell, b.generator);
}

/// Sorted, with one entry per cell and generator.
void merge_shares(std::vector<CellShare>& shares) {
  std::stable_sort(shares.begin(), shares.end(), before);
  std::size_t n = 0;
  for (const CellShare& s : shares)
    if (n > 0 && !before(shares[n - 1], s))
      shares[n - 1].volume += s.volume;
    else
      shares[n++] = s;
  shares.resize(n);
}

}  // namespace

template <int Dim>
auto ScenarioBuilder<Dim>::generator_boxes() const -> std::vector<Box> {
  const std::size_t n = generators_.size(), sides = 2 * static_cast<std::size_t>(Dim);
  if (n < 2) return {};
  std::vector<double> box(n * sides, -infinity);  // -low, then high
  for_own_particles([&](std::size_t g, std::size_t i) {
    for (int d = 0; d < Dim; ++d) {
      const double at = model_.particles.x[i][d];
      double* side = &box[g * sides + 2 * static_cast<std::size_t>(d)];
      side[0] = std::max(side[0], -at);
      side[1] = std::max(side[1], at);
    }
  });
  box = team_.most(std::move(box));
  std::vector<Box> boxes(n);
  for (std::size_t g = 0; g < n; ++g)
    for (int d = 0; d < Dim; ++d) {
      const double* side = &box[g * sides + 2 * static_cast<std::size_t>(d)];
      boxes[g][0][d] = -side[0];
      boxes[g][1][d] = side[1];
    }
  return boxes;
}

template <int Dim>
bool ScenarioBuilder<Dim>::apart(const Box& a, const Box& b, const Vec<Dim>& gap) {
  return ((a[1] + gap).array() < b[0].array()).any() || ((b[1] + gap).array() < a[0].array()).any();
}

template <int Dim>
void ScenarioBuilder<Dim>::warn_of_overlap(const std::vector<Box>& boxes) {
  if (in_.placed > 0) return;    // others may be there no more
  constexpr double most = 1.05;  // of particle volume over the cell's [-]
  bool meet = false;
  for (std::size_t a = 0; a < boxes.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) meet |= !apart(boxes[a], boxes[b], Vec<Dim>::Zero());
  if (!meet) return;
  const auto& p = model_.particles;
  std::vector<CellShare> own;
  for_own_particles([&](std::size_t g, std::size_t i) {
    const int generator = static_cast<int>(g);
    if (own.empty() || own.back().cell != p.cell[i] || own.back().generator != generator)
      own.push_back({p.cell[i], generator, 0.0});
    own.back().volume += p.volume[i] / depth_at(model_.analysis, p.x[i][0]);
  });
  merge_shares(own);
  if (!team_.alone()) {
    std::vector<std::vector<CellShare>> to(static_cast<std::size_t>(team_.size()));
    for (const CellShare& s : own)
      to[static_cast<std::size_t>(team_.member(s.cell, mesh_->n_cells()))].push_back(s);
    own = joined(team_.exchange(std::move(to)));
    merge_shares(own);
  }
  std::map<std::pair<int, int>, CommonPlace> found;
  for (std::size_t begin = 0, end; begin < own.size(); begin = end) {
    double volume = 0;
    for (end = begin; end < own.size() && own[end].cell == own[begin].cell; ++end)
      volume += own[end].volume;
    const double ratio = end - begin < 2 ? 0 : volume / mesh_->cell_volume(own[begin].cell);
    if (ratio <= most) continue;
    const std::pair key(own[end - 1].generator, own[begin].generator);
    CommonPlace& o =
        found.try_emplace(key, CommonPlace{key.first, key.second, 0, 0.0}).first->second;
    ++o.cells;
    o.most = std::max(o.most, ratio);
  }
  std::vector<CommonPlace> list;
  for (const auto& [key, o] : found) list.push_back(o);
  found.clear();
  for (const auto& part : team_.gather(list))
    for (const CommonPlace& other : part) {
      const std::pair key(other.generator, other.earlier);
      CommonPlace& o =
          found.try_emplace(key, CommonPlace{key.first, key.second, 0, 0.0}).first->second;
      o.cells += other.cells;
      o.most = std::max(o.most, other.most);
    }
  for (const auto& [key, o] : found) {
    const auto& earlier = generators_[static_cast<std::size_t>(o.earlier)];
    in_.warning(*generators_[static_cast<std::size_t>(o.generator)].generator,
                fmt::format("this generator fills the same place as the one {}: {} cells "
                            "hold particles of both, of up to {:.3g} times the cell's volume",
                            in_.document.line(*earlier.generator), o.cells, o.most),
                "material is there twice: take the smaller region out of the larger one with "
                "\"difference\"");
  }
}

// Particles that get a traction and lie behind each other whichever way one looks: each gets it
// times its area. Where only some do, those at the surface get it: of a set whose surface is steep,
// or faces two ways, that may be less than was meant.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_thick_loads() {
  constexpr Index most_in_slopes = 3;  // in a row, of up to 45 degrees along both axes
  const char* const newton = is_per_metre() ? "N/m" : "N";
  const char* const m2 = is_per_metre() ? "m" : "m^2";
  const auto entries =
      get_list(section("external_loading_conditions"), "particle_surface_traction");
  for (std::size_t k = 0; k < std::min(entries.size(), layers_of_loads_.size()); ++k) {
    const HiddenLoads& hidden = hidden_loads_[k];
    const double traction = model_.tractions[k].traction;
    if (hidden.inside)
      in_.warning(*entries[k],
                  fmt::format("the cells of these particles have material all around: the traction "
                              "is {:.4g} {} on {:.4g} {}, the sum of areas that each particle has "
                              "by its volume",
                              traction * hidden.area, newton, hidden.area, m2),
                  "give the set the particles at a surface");
    else if (hidden.at_faces && hidden.count > 0 && layers_of_loads_[k] >= one_layer)
      in_.warning(*entries[k],
                  fmt::format("{} of the {} particles of this traction lie behind others, and get "
                              "none: it is {:.4g} {} on {:.4g} {}, the surface as seen along {}",
                              hidden.count, hidden.loaded, traction * hidden.area, newton,
                              hidden.area, m2, "xyz"[hidden.axis]),
                  "give the set the particles at the surface, and surfaces that face other ways "
                  "sets and tractions of their own");
    else if (hidden.other_axis >= 0)
      in_.warning(*entries[k],
                  fmt::format("the particles of this traction are one layer along {} and along {}: "
                              "it acts on {:.4g} {} across {}; the surface across {} would have "
                              "{:.4g} {}",
                              "xyz"[std::min(hidden.axis, hidden.other_axis)],
                              "xyz"[std::max(hidden.axis, hidden.other_axis)], hidden.area, m2,
                              "xyz"[hidden.axis], "xyz"[hidden.other_axis], hidden.other_area, m2),
                  fmt::format("if the surface across {} is meant, multiply the traction by {:.4g}",
                              "xyz"[hidden.other_axis], hidden.other_area / hidden.area));
    else if (hidden.at_faces)
      continue;
    else if (layers_of_loads_[k] >= one_layer && hidden.count == 0)
      in_.warning(*entries[k],
                  fmt::format("this traction is on particles that lie behind each other, {:.2g} in "
                              "the mean: each gets it, so the load is as many times that of a "
                              "surface",
                              layers_of_loads_[k]),
                  "give the set one row of particles, that at the surface; or divide the traction");
    else if (hidden.deepest > most_in_slopes)
      in_.warning(*entries[k],
                  fmt::format("{} of the {} particles of this traction lie behind others along {}, "
                              "up to {} in a row, and get none: it is {:.4g} {} on {:.4g} {}, the "
                              "surface as seen along {}",
                              hidden.count, hidden.loaded, "xyz"[hidden.axis], hidden.deepest,
                              traction * hidden.area, newton, hidden.area, m2, "xyz"[hidden.axis]),
                  "give surfaces that face other ways sets and tractions of their own");
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
