// Where triangles of a tree pass through each other.
#include <array>
#include <cmath>

#include "physics/geometry/triangle_tree.h"

namespace lahar {

namespace {

/// The side of the plane through a, b and c on which x lies: 0 where rounding may decide (bound of
/// Shewchuk 1997, Discrete Comput. Geom. 18, 305-363, for the determinant in doubles).
int side_of(const Vec<3>& a, const Vec<3>& b, const Vec<3>& c, const Vec<3>& x) {
  constexpr double bound = 7.8e-16;
  const Vec<3> p = a - x, q = b - x, r = c - x;
  const double qr = q[0] * r[1], rq = r[0] * q[1], rp = r[0] * p[1], pr = p[0] * r[1],
               pq = p[0] * q[1], qp = q[0] * p[1];
  const double volume = p[2] * (qr - rq) + q[2] * (rp - pr) + r[2] * (pq - qp);
  const double rounding = bound * (std::abs(p[2]) * (std::abs(qr) + std::abs(rq)) +
                                   std::abs(q[2]) * (std::abs(rp) + std::abs(pr)) +
                                   std::abs(r[2]) * (std::abs(pq) + std::abs(qp)));
  return volume > rounding ? 1 : volume < -rounding ? -1 : 0;
}

using Corners = std::array<Vec<3>, 3>;

/// The sides of another triangle's plane on which the corners of one lie.
std::array<int, 3> sides_of(const Corners& plane, const Corners& of) {
  std::array<int, 3> sides;
  for (std::size_t k = 0; k < 3; ++k) sides[k] = side_of(plane[0], plane[1], plane[2], of[k]);
  return sides;
}

bool has_both(const std::array<int, 3>& sides) {
  const auto [least, most] = std::minmax({sides[0], sides[1], sides[2]});
  return least < 0 && most > 0;
}

/// The first edge of `one` that passes through the inside of `other`; 3: none does.
std::size_t piercing_edge(const Corners& one, const std::array<int, 3>& sides,
                          const Corners& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    if (sides[k] * sides[next] >= 0) continue;
    const Vec<3>&p = one[k], &q = one[next];
    const int turn = side_of(p, q, other[0], other[1]);
    if (turn != 0 && side_of(p, q, other[1], other[2]) == turn &&
        side_of(p, q, other[2], other[0]) == turn)
      return k;
  }
  return 3;
}

Vec<3> piercing_point(const Corners& one, std::size_t edge, const Corners& other) {
  const Vec<3>&p = one[edge], &q = one[(edge + 1) % 3];
  const Vec<3> normal = Vec<3>(other[1] - other[0]).cross(Vec<3>(other[2] - other[0]));
  const double from = normal.dot(other[0] - p), along = normal.dot(q - p);
  return p + (from / along) * (q - p);
}

}  // namespace

/// All pairs of triangles whose boxes meet, by going down the tree with two nodes at a time.
class TriangleTree::CrossingSearch {
 public:
  explicit CrossingSearch(const TriangleTree& tree) : tree_(tree) {}

  TriangleCrossings found() {
    within(tree_.nodes_.front());
    return found_;
  }

 private:
  void within(const Node& node) {
    for (int k = 0; k < ways; ++k) {
      if (node.low[0][k] > node.high[0][k]) continue;  // nothing is in it
      if (node.count[k] == 0)
        within(below(node, k));
      else
        leaves(node, k, node, k);
      for (int l = k + 1; l < ways; ++l) between(node, k, node, l);
    }
  }

  /// What is in child k of a node against what is in child l of another.
  void between(const Node& a, int k, const Node& b, int l) {
    if (found_.count == TriangleCrossings::most) return;
    for (int d = 0; d < 3; ++d)
      if (!(a.low[d][k] <= b.high[d][l] && b.low[d][l] <= a.high[d][k])) return;
    const bool a_ends = a.count[k] > 0, b_ends = b.count[l] > 0;
    if (a_ends && b_ends) return leaves(a, k, b, l);
    for (int i = 0; i < ways; ++i) {
      if (a_ends)
        between(a, k, below(b, l), i);
      else if (b_ends)
        between(below(a, k), i, b, l);
      else
        for (int j = 0; j < ways; ++j) between(below(a, k), i, below(b, l), j);
    }
  }

  /// Triangles of a leaf against those of another, or of the same. Most pairs are neighbours, or
  /// their boxes are apart.
  void leaves(const Node& a, int k, const Node& b, int l) {
    const bool same = &a == &b && k == l;
    for (Local s = a.first[k]; s < a.first[k] + a.count[k]; ++s) {
      const Corners one = corners_of(s);
      const Vec<3> low = one[0].cwiseMin(one[1]).cwiseMin(one[2]);
      const Vec<3> high = one[0].cwiseMax(one[1]).cwiseMax(one[2]);
      for (Local t = same ? s + 1 : b.first[l]; t < b.first[l] + b.count[l]; ++t) {
        const Corners other = corners_of(t);
        if ((other[0].cwiseMin(other[1]).cwiseMin(other[2]) - high).maxCoeff() <= 0 &&
            (low - other[0].cwiseMax(other[1]).cwiseMax(other[2])).maxCoeff() <= 0)
          pair(s, one, t, other);
      }
    }
  }

  void pair(Local s, const Corners& one, Local t, const Corners& other) {
    if (common_corners(s, t) > 1) return;  // neighbours, which meet in an edge
    const auto sides = sides_of(other, one);
    if (!has_both(sides)) return;
    const auto back = sides_of(one, other);
    if (!has_both(back)) return;
    if (const std::size_t edge = piercing_edge(one, sides, other); edge < 3)
      add(s, t, piercing_point(one, edge, other));
    else if (const std::size_t behind = piercing_edge(other, back, one); behind < 3)
      add(s, t, piercing_point(other, behind, one));
  }

  void add(Local s, Local t, const Vec<3>& at) {
    if (found_.count == TriangleCrossings::most) return;
    if (found_.count++ == 0) found_.first = s, found_.second = t, found_.at = at;
  }

  int common_corners(Local s, Local t) const {
    const auto& all = tree_.triangles_.corners;
    int common = 0;
    for (const Local p : all[static_cast<std::size_t>(s)])
      for (const Local q : all[static_cast<std::size_t>(t)]) common += p == q;
    return common;
  }
  Corners corners_of(Local t) const {
    const Triangles& all = tree_.triangles_;
    return {all.point(t, 0), all.point(t, 1), all.point(t, 2)};
  }
  const Node& below(const Node& node, int k) const {
    return tree_.nodes_[static_cast<std::size_t>(node.first[k])];
  }

  const TriangleTree& tree_;
  TriangleCrossings found_;
};

TriangleCrossings TriangleTree::crossings() const {
  return CrossingSearch(*this).found();
}

}  // namespace lahar
