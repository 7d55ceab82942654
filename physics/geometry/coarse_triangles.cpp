#include "physics/geometry/coarse_triangles.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <queue>
#include <utility>

namespace lahar {

namespace {

/// What an edge costs for its length, as a share of its fourth power: flat parts keep triangles of
/// about one size.
constexpr double cost_of_length = 1e-4;

/// Between normals of a triangle before and after an edge is collapsed.
constexpr double least_cosine = 0.5;

/// Edge a-b becomes the point a, at `place`.
struct Collapse {
  double cost;  ///< [m^4]
  Local a, b;
  int changes;  ///< of both ends when this was found
  Vec<3> place;
  bool operator<(const Collapse& other) const { return cost > other.cost; }  // least first
};

class Coarsening {
 public:
  explicit Coarsening(Triangles surface)
      : surface_(std::move(surface)),
        origin_(surface_.points.front()),
        left_(surface_.corners.size()),
        around_(surface_.points.size()),
        quadrics_(surface_.points.size(), Eigen::Matrix4d::Zero()),
        on_border_(surface_.points.size()),
        changes_(surface_.points.size()) {
    const TriangleEdges edges = edges_of(surface_);
    for (Local t = 0; t < static_cast<Local>(left_); ++t) {
      const Vec<3> twice_area = surface_.area_vector(t);
      for (int k = 0; k < 3; ++k) {
        const Local a = corner(t, k), b = corner(t, (k + 1) % 3);
        around_[at(a)].push_back(t);
        add_plane(a, a, twice_area.stableNormalized(), twice_area.norm());
        if (edges.neighbour[at(t)][at(k)] != TriangleEdges::none) continue;
        on_border_[at(a)] = on_border_[at(b)] = true;
        const Vec<3> along = point(b) - point(a);
        const Vec<3> outwards = along.cross(twice_area).stableNormalized();
        for (const Local end : {a, b}) add_plane(end, a, outwards, along.squaredNorm());
      }
    }
    for (const auto& [a, b, c] : surface_.corners) {  // inner edges twice, which does no harm
      suggest(a, b);
      suggest(b, c);
      suggest(c, a);
    }
  }

  Triangles reach(std::size_t most) {
    while (left_ > most && !queue_.empty()) {
      const Collapse next = queue_.top();
      queue_.pop();
      if (next.changes == changes_[at(next.a)] + changes_[at(next.b)] && is_allowed(next))
        collapse(next);
    }
    remove_collapsed(surface_);
    remove_unused_points();
    return std::move(surface_);
  }

 private:
  static std::size_t at(Local k) { return static_cast<std::size_t>(k); }
  Local corner(Local t, int k) const { return surface_.corners[at(t)][at(k)]; }
  const Vec<3>& point(Local p) const { return surface_.points[at(p)]; }
  bool has(Local t, Local p) const { return std::ranges::count(surface_.corners[at(t)], p) > 0; }

  /// Squared distances from a plane through a point count for what becomes of p.
  void add_plane(Local p, Local through, const Vec<3>& normal, double weight) {
    const Eigen::Vector4d plane(normal[0], normal[1], normal[2],
                                -normal.dot(point(through) - origin_));
    quadrics_[at(p)] += weight * plane * plane.transpose();
  }

  void suggest(Local a, Local b) {
    const Eigen::Matrix4d quadric = quadrics_[at(a)] + quadrics_[at(b)];
    const double length = (point(b) - point(a)).squaredNorm();
    Collapse best{.cost = std::numeric_limits<double>::max(),
                  .a = a,
                  .b = b,
                  .changes = changes_[at(a)] + changes_[at(b)],
                  .place = point(a)};
    for (const Vec<3>& place : {point(a), point(b), Vec<3>(0.5 * (point(a) + point(b)))}) {
      Eigen::Vector4d x = Eigen::Vector4d::Ones();
      x.head<3>() = place - origin_;
      const double cost = x.dot(quadric * x) + cost_of_length * length * length;
      if (cost < best.cost) best.cost = cost, best.place = place;
    }
    queue_.push(best);
  }

  /// Points that are joined with p, ascending.
  std::vector<Local> neighbours(Local p) const {
    std::vector<Local> list;
    for (const Local t : around_[at(p)])
      for (const Local other : surface_.corners[at(t)])
        if (other != p) list.push_back(other);
    std::ranges::sort(list);
    list.erase(std::unique(list.begin(), list.end()), list.end());
    return list;
  }

  /// Whether the surface stays one around the edge (its ends have no common neighbours but those
  /// of its triangles), and no triangle turns over.
  bool is_allowed(const Collapse& edge) const {
    const auto shared =
        std::ranges::count_if(around_[at(edge.b)], [&](const Local t) { return has(t, edge.a); });
    std::vector<Local> common;
    std::ranges::set_intersection(neighbours(edge.a), neighbours(edge.b),
                                  std::back_inserter(common));
    if (static_cast<std::ptrdiff_t>(common.size()) != shared) return false;
    if (shared > 1 && on_border_[at(edge.a)] && on_border_[at(edge.b)]) return false;
    return keeps_sides(edge.a, edge.b, edge.place) && keeps_sides(edge.b, edge.a, edge.place);
  }

  bool keeps_sides(Local moved, Local other, const Vec<3>& place) const {
    return std::ranges::all_of(around_[at(moved)], [&](const Local t) {
      if (has(t, other)) return true;
      const auto area = [&](const auto& where) {
        const Vec<3> a = where(corner(t, 0)), b = where(corner(t, 1)), c = where(corner(t, 2));
        return Vec<3>(Vec<3>(b - a).cross(Vec<3>(c - a)));
      };
      const Vec<3> before = area([&](Local p) { return point(p); }),
                   after = area([&](Local p) { return p == moved ? place : point(p); });
      return before.dot(after) >= least_cosine * before.norm() * after.norm();
    });
  }

  void collapse(const Collapse& edge) {
    const auto& [cost, a, b, changes, place] = edge;
    surface_.points[at(a)] = place;
    quadrics_[at(a)] += quadrics_[at(b)];
    on_border_[at(a)] = on_border_[at(a)] || on_border_[at(b)];
    ++changes_[at(a)], ++changes_[at(b)];
    for (const Local t : around_[at(b)]) {
      if (has(t, a)) {
        --left_;
        for (const Local p : surface_.corners[at(t)])
          if (p != b) std::erase(around_[at(p)], t);
        surface_.corners[at(t)] = {a, a, a};
      } else {
        std::ranges::replace(surface_.corners[at(t)], b, a);
        around_[at(a)].push_back(t);
      }
    }
    around_[at(b)].clear();
    for (const Local p : neighbours(a)) suggest(a, p);
  }

  void remove_unused_points() {
    std::vector<Local> number(surface_.points.size(), -1);
    std::vector<Vec<3>> used;
    for (auto& corners : surface_.corners)
      for (Local& p : corners) {
        if (number[at(p)] < 0) {
          number[at(p)] = static_cast<Local>(used.size());
          used.push_back(point(p));
        }
        p = number[at(p)];
      }
    surface_.points = std::move(used);
  }

  Triangles surface_;
  Vec<3> origin_;     ///< [m] of quadrics: near, because squares of distances are subtracted
  std::size_t left_;  ///< triangles
  std::vector<std::vector<Local>> around_;  ///< triangles of each point
  std::vector<Eigen::Matrix4d> quadrics_;   ///< [m^2], of each point: x^T Q x [m^4]
  std::vector<char> on_border_;
  std::vector<int> changes_;
  std::priority_queue<Collapse> queue_;
};

}  // namespace

Triangles coarser(Triangles surface, std::size_t most) {
  if (surface.corners.size() <= most) return surface;
  return Coarsening(std::move(surface)).reach(most);
}

}  // namespace lahar
