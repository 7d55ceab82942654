#include "physics/geometry/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lahar {

namespace {

constexpr float inf = std::numeric_limits<float>::infinity();

/// Boxes are wider by this share of the whole, so that rounding to float loses nothing [-].
constexpr float margin = 4e-7F;
/// Squares of distances in float are lower than the right ones by more than their rounding [-].
constexpr float rounded_down = 1 - 2e-6F;

}  // namespace

/// A triangle while the tree is made.
struct TriangleTree::Item {
  std::array<float, 3> centre;  ///< [m] from the centre of all
  Local triangle;
};

class TriangleTree::Builder {
 public:
  explicit Builder(TriangleTree& tree) : tree_(tree) {
    const Triangles& from = tree.triangles_;
    items_.resize(from.corners.size());
    for (std::size_t i = 0; i < items_.size(); ++i) {
      const Vec<3> c = from.centre(static_cast<Index>(i)) - tree.centre_;
      for (int d = 0; d < 3; ++d)
        items_[i].centre[static_cast<std::size_t>(d)] = static_cast<float>(c[d]);
      items_[i].triangle = static_cast<Local>(i);
    }
    margin_ = margin * static_cast<float>((tree.high_ - tree.low_).maxCoeff());
  }

  void build() {
    tree_.nodes_.reserve(items_.size() / 8 + 1);
    make_node(0, static_cast<Index>(items_.size()));
    reorder();
  }

 private:
  /// Divides [begin, end) by the longest side of the box around the centres; leaves stay full.
  Index split(Index begin, Index end) {
    if (end - begin <= in_leaf) return end;
    std::array<float, 3> low{inf, inf, inf}, high{-inf, -inf, -inf};
    for (Index i = begin; i < end; ++i)
      for (std::size_t d = 0; d < 3; ++d) {
        low[d] = std::min(low[d], items_[static_cast<std::size_t>(i)].centre[d]);
        high[d] = std::max(high[d], items_[static_cast<std::size_t>(i)].centre[d]);
      }
    std::size_t axis = 0;
    for (std::size_t d = 1; d < 3; ++d)
      if (high[d] - low[d] > high[axis] - low[axis]) axis = d;
    const Index half = begin + ((end - begin) / 2 + in_leaf - 1) / in_leaf * in_leaf;
    std::nth_element(items_.begin() + begin, items_.begin() + half, items_.begin() + end,
                     [axis](const Item& a, const Item& b) {
                       return a.centre[axis] != b.centre[axis] ? a.centre[axis] < b.centre[axis]
                                                               : a.triangle < b.triangle;
                     });
    return half;
  }

  Local make_node(Index begin, Index end) {
    const auto id = tree_.nodes_.size();
    tree_.nodes_.emplace_back();
    const Index half = split(begin, end);
    const std::array<Index, ways + 1> cut{begin, split(begin, half), half, split(half, end), end};
    for (int k = 0; k < ways; ++k) {
      const Index from = cut[static_cast<std::size_t>(k)],
                  to = cut[static_cast<std::size_t>(k) + 1];
      set_box(tree_.nodes_[id], k, from, to);
      Local first = static_cast<Local>(from);
      if (to - from > in_leaf) first = make_node(from, to);
      Node& node = tree_.nodes_[id];  // others may have moved it
      node.first[k] = first;
      node.count[k] = to - from > in_leaf ? 0 : static_cast<std::uint8_t>(to - from);
    }
    return static_cast<Local>(id);
  }

  void set_box(Node& node, int k, Index from, Index to) const {
    for (int d = 0; d < 3; ++d) {
      node.low[d][k] = inf;
      node.high[d][k] = -inf;
    }
    for (Index i = from; i < to; ++i)
      for (int corner = 0; corner < 3; ++corner) {
        const Vec<3> x =
            tree_.triangles_.point(items_[static_cast<std::size_t>(i)].triangle, corner) -
            tree_.centre_;
        for (int d = 0; d < 3; ++d) {
          node.low[d][k] = std::min(node.low[d][k], static_cast<float>(x[d]) - margin_);
          node.high[d][k] = std::max(node.high[d][k], static_cast<float>(x[d]) + margin_);
        }
      }
  }

  /// Triangles in the order of leaves, points in that of triangles.
  void reorder() const {
    const Triangles from = std::move(tree_.triangles_);
    Triangles& to = tree_.triangles_;
    to = {};
    to.corners.reserve(from.corners.size());
    std::vector<Local> place(from.points.size(), -1);
    for (const Item& item : items_) {
      Triangles::Corners corner = from.corners[static_cast<std::size_t>(item.triangle)];
      for (Local& c : corner) {
        Local& p = place[static_cast<std::size_t>(c)];
        if (p < 0) {
          p = static_cast<Local>(to.points.size());
          to.points.push_back(from.points[static_cast<std::size_t>(c)]);
        }
        c = p;
      }
      to.corners.push_back(corner);
    }
    to.points.shrink_to_fit();
  }

  TriangleTree& tree_;
  std::vector<Item> items_;
  float margin_;
};

TriangleTree::TriangleTree(Triangles triangles) : triangles_(std::move(triangles)) {
  low_ = Vec<3>::Constant(inf);
  high_ = -low_;
  for (const Triangles::Corners& corner : triangles_.corners)
    for (const Local c : corner) {
      const Vec<3>& x = triangles_.points[static_cast<std::size_t>(c)];
      low_ = low_.cwiseMin(x);
      high_ = high_.cwiseMax(x);
    }
  centre_ = 0.5 * (low_ + high_);
  Builder(*this).build();
}

namespace {

/// The nearest point of a triangle: by the regions of its corners, edges and face (Ericson 2005,
/// Real-Time Collision Detection, section 5.1.5).
void look_at_triangle(const Vec<3>& x, const Vec<3>& a, const Vec<3>& b, const Vec<3>& c,
                      Local triangle, TriangleTree::Hit& best) {
  using Part = TriangleTree::Part;
  const auto offer = [&](const Vec<3>& point, Part part, int corner) {
    const double square = (x - point).squaredNorm();
    if (square < best.square)
      best = {triangle, part, static_cast<std::uint8_t>(corner), square, point};
  };
  const Vec<3> ab = b - a, ac = c - a, ax = x - a;
  const double d1 = ab.dot(ax), d2 = ac.dot(ax);
  if (d1 <= 0 && d2 <= 0) return offer(a, Part::corner, 0);
  const Vec<3> bx = x - b;
  const double d3 = ab.dot(bx), d4 = ac.dot(bx);
  if (d3 >= 0 && d4 <= d3) return offer(b, Part::corner, 1);
  const double of_c = d1 * d4 - d3 * d2;
  if (of_c <= 0 && d1 >= 0 && d3 <= 0) return offer(a + d1 / (d1 - d3) * ab, Part::edge, 0);
  const Vec<3> cx = x - c;
  const double d5 = ab.dot(cx), d6 = ac.dot(cx);
  if (d6 >= 0 && d5 <= d6) return offer(c, Part::corner, 2);
  const double of_b = d5 * d2 - d1 * d6;
  if (of_b <= 0 && d2 >= 0 && d6 <= 0) return offer(a + d2 / (d2 - d6) * ac, Part::edge, 2);
  const double of_a = d3 * d6 - d5 * d4, towards_c = d4 - d3, towards_b = d5 - d6;
  if (of_a <= 0 && towards_c >= 0 && towards_b >= 0)
    return offer(b + towards_c / (towards_c + towards_b) * (c - b), Part::edge, 1);
  const double all = 1 / (of_a + of_b + of_c);
  offer(a + of_b * all * ab + of_c * all * ac, Part::face, 0);
}

}  // namespace

void TriangleTree::look_at(const Vec<3>& x, Local first, int count, Hit& best) const {
  for (Local t = first; t < first + count; ++t)
    look_at_triangle(x, triangles_.point(t, 0), triangles_.point(t, 1), triangles_.point(t, 2), t,
                     best);
}

/// What a query has still to look at.
struct TriangleTree::Waiting {
  float square;  ///< [m^2] of the distance to its box, rounded down
  Local first;
  int count;
};

TriangleTree::Hit TriangleTree::nearest(const Vec<3>& x, double square) const {
  // A node of a tree over 2^31 triangles has at most 15 above it, each leaves three waiting.
  std::array<Waiting, 64> stack;
  std::size_t n = 0;
  stack[n++] = {0, 0, 0};
  const float at[3] = {static_cast<float>(x[0] - centre_[0]), static_cast<float>(x[1] - centre_[1]),
                       static_cast<float>(x[2] - centre_[2])};
  Hit best;
  best.square = square;
  while (n > 0) {
    const Waiting now = stack[--n];
    if (now.square >= best.square) continue;
    if (now.count > 0) {
      look_at(x, now.first, now.count, best);
      continue;
    }
    const Node& node = nodes_[static_cast<std::size_t>(now.first)];
    float squares[ways] = {};
    for (int d = 0; d < 3; ++d)
      for (int k = 0; k < ways; ++k) {
        const float off = std::max(std::max(node.low[d][k] - at[d], at[d] - node.high[d][k]), 0.0F);
        squares[k] += off * off;
      }
    const std::size_t under = n;
    for (int k = 0; k < ways; ++k) {
      const Waiting child{squares[k] * rounded_down, node.first[k], node.count[k]};
      if (!(child.square < best.square)) continue;
      std::size_t place = n++;  // the nearest on top
      for (; place > under && stack[place - 1].square < child.square; --place)
        stack[place] = stack[place - 1];
      stack[place] = child;
    }
  }
  return best;
}

}  // namespace lahar
