#include "physics/geometry/triangles.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace lahar {

namespace {

/// Heights of a triangle below this share of its longest edge are rounding [-].
constexpr double flat = 1e-12;

/// An edge of a triangle, in the list of the lower of its points.
struct EdgeUse {
  Local other;          ///< the higher point
  std::uint32_t which;  ///< 2 (3 triangle + edge) + (1: from the higher to the lower point)
};

Index triangle_of(const EdgeUse& use) {
  return use.which / 2 / 3;
}
int edge_of(const EdgeUse& use) {
  return static_cast<int>(use.which / 2 % 3);
}
bool descends(const EdgeUse& use) {
  return use.which % 2 == 1;
}

/// The edges of all triangles in lists of their lower points.
class EdgeLists {
 public:
  explicit EdgeLists(const Triangles& triangles) : begin_(triangles.points.size() + 1, 0) {
    for_edges(triangles, [&](Local low, EdgeUse) { ++begin_[index(low) + 1]; });
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    uses_.resize(begin_.back());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for_edges(triangles, [&](Local low, EdgeUse use) { uses_[next[index(low)]++] = use; });
  }

  /// visit(uses of one edge), edge by edge.
  void for_each_edge(const auto& visit) {
    for (std::size_t p = 0; p + 1 < begin_.size(); ++p) {
      const auto first = uses_.begin() + begin_[p], last = uses_.begin() + begin_[p + 1];
      std::sort(first, last, [](const EdgeUse& a, const EdgeUse& b) {
        return a.other != b.other ? a.other < b.other : a.which < b.which;
      });
      for (auto at = first; at != last;) {
        auto end = at;
        while (end != last && end->other == at->other) ++end;
        visit(&*at, static_cast<std::size_t>(end - at));
        at = end;
      }
    }
  }

 private:
  static std::size_t index(Local i) { return static_cast<std::size_t>(i); }
  static void for_edges(const Triangles& triangles, const auto& visit) {
    std::uint32_t which = 0;
    for (const Triangles::Corners& corner : triangles.corners)
      for (std::size_t k = 0; k < 3; ++k, which += 2) {
        const Local a = corner[k], b = corner[(k + 1) % 3];
        visit(std::min(a, b), EdgeUse{std::max(a, b), which + (a > b ? 1U : 0U)});
      }
  }
  std::vector<std::uint32_t> begin_;
  std::vector<EdgeUse> uses_;
};

Vec<3> middle(const Triangles& triangles, Index triangle, int edge) {
  return 0.5 * (triangles.point(triangle, edge) + triangles.point(triangle, (edge + 1) % 3));
}

}  // namespace

TriangleEdges edges_of(const Triangles& triangles) {
  constexpr Local none = TriangleEdges::none;
  TriangleEdges edges;
  edges.neighbour.assign(triangles.corners.size(), {none, none, none});
  EdgeLists(triangles).for_each_edge([&](const EdgeUse* use, std::size_t n) {
    const Index first = triangle_of(use[0]);
    const auto flaw = [&](TriangleFlaw& of) {
      of.add(first, middle(triangles, first, edge_of(use[0])));
    };
    const auto set = [&](const EdgeUse& of, Local to) {
      edges.neighbour[static_cast<std::size_t>(triangle_of(of))]
                     [static_cast<std::size_t>(edge_of(of))] = to;
    };
    if (n == 1) return flaw(edges.open);
    if (n > 2) {
      for (std::size_t i = 0; i < n; ++i) set(use[i], TriangleEdges::several);
      return flaw(edges.branched);
    }
    if (descends(use[0]) == descends(use[1])) flaw(edges.turned);
    for (int i = 0; i < 2; ++i) set(use[i], static_cast<Local>(triangle_of(use[1 - i])));
  });
  return edges;
}

TriangleFlaw remove_collapsed(Triangles& triangles) {
  TriangleFlaw flaw;
  Index i = 0;
  std::erase_if(triangles.corners, [&](const Triangles::Corners& c) {
    const bool collapsed = c[0] == c[1] || c[1] == c[2] || c[2] == c[0];
    if (collapsed) flaw.add(i, triangles.points[static_cast<std::size_t>(c[0])]);
    ++i;
    return collapsed;
  });
  return flaw;
}

TriangleFlaw find_flat(const Triangles& triangles) {
  TriangleFlaw flaw;
  for (Index i = 0; i < static_cast<Index>(triangles.corners.size()); ++i) {
    double longest = 0;
    for (int k = 0; k < 3; ++k)
      longest = std::max(longest,
                         (triangles.point(i, (k + 1) % 3) - triangles.point(i, k)).squaredNorm());
    if (!(triangles.area_vector(i).norm() > flat * longest)) flaw.add(i, triangles.centre(i));
  }
  return flaw;
}

std::vector<TriangleHole> find_holes(const Triangles& triangles, const TriangleEdges& edges,
                                     std::size_t most) {
  // Points of open edges that hang together, as a forest.
  std::map<Local, Local> parent;
  const auto root = [&](Local p) {
    while (parent[p] != p) p = parent[p] = parent[parent[p]];
    return p;
  };
  const auto for_open = [&](const auto& visit) {
    for (std::size_t i = 0; i < edges.neighbour.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        if (edges.neighbour[i][k] == TriangleEdges::none)
          visit(static_cast<Index>(i), static_cast<int>(k), triangles.corners[i][k],
                triangles.corners[i][(k + 1) % 3]);
  };
  for_open([&](Index, int, Local a, Local b) {
    parent.emplace(a, a);
    parent.emplace(b, b);
    parent[root(a)] = root(b);
  });
  std::map<Local, TriangleHole> holes;
  for_open([&](Index triangle, int edge, Local a, Local b) {
    TriangleHole& hole = holes[root(a)];
    ++hole.edges;
    hole.length += (triangles.points[static_cast<std::size_t>(a)] -
                    triangles.points[static_cast<std::size_t>(b)])
                       .norm();
    hole.centre += middle(triangles, triangle, edge);
  });
  std::vector<TriangleHole> found;
  for (auto& [point, hole] : holes) {
    hole.centre /= static_cast<double>(hole.edges);
    found.push_back(hole);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.length > b.length; });
  if (found.size() > most) found.resize(most);
  return found;
}

double enclosed_volume(const Triangles& triangles) {
  double six = 0;
  if (triangles.points.empty()) return six;
  const Vec<3> from = triangles.points.front();
  for (Index i = 0; i < static_cast<Index>(triangles.corners.size()); ++i)
    six += (triangles.point(i, 0) - from).dot(triangles.area_vector(i));
  return six / 6;
}

void turn_over(Triangles& triangles) {
  for (Triangles::Corners& corner : triangles.corners) std::swap(corner[1], corner[2]);
}

}  // namespace lahar
