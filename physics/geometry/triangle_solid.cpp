#include "physics/geometry/triangle_solid.h"

#include <cmath>
#include <utility>

#include "physics/geometry/side_grid.h"
#include "physics/geometry/triangle_tree.h"

namespace lahar {

namespace {

using Near = Solid<3>::Nearest;
using Part = TriangleTree::Part;

/// Nearer to an edge or corner than this share of the whole, the direction from it is rounding [-].
constexpr double on_it = 1e-11;

/// The side of a point whose nearest one is on an edge or at a corner is that of the normals there,
/// weighted with the angles of the triangles (Baerentzen & Aanaes 2005, IEEE Trans. Vis. Comput.
/// Graph. 11, 243-253).
class TriangleSolid final : public Solid<3> {
 public:
  TriangleSolid(TriangleTree tree, double band)
      : tree_(std::move(tree)),
        neighbour_(edges_of(tree_.triangles()).neighbour),
        band_(band),
        rounding_(on_it * (tree_.high() - tree_.low()).norm()),
        sides_(tree_.triangles(), tree_.low(), tree_.high(),
               [this](const Vec<3>& x) { return exact(tree_.nearest(x, inf), x).distance < 0; }) {}

  Near nearest(const Vec<3>& x) const override {
    const Side side = sides_.at(x);
    const double reach = side == Side::on_surface ? inf : band_;
    const auto hit = tree_.nearest(x, reach * reach);
    return hit.triangle < 0 ? far(x, side) : exact(hit, x);
  }

  bool contains(const Vec<3>& x) const override {
    const Side side = sides_.at(x);
    if (side != Side::on_surface) return side == Side::inside;
    return exact(tree_.nearest(x, inf), x).distance <= 0;
  }

  std::pair<Vec<3>, Vec<3>> bounds() const override { return {tree_.low(), tree_.high()}; }

 private:
  static constexpr double inf = std::numeric_limits<double>::infinity();

  /// Beyond the band.
  Near far(const Vec<3>& x, Side side) const {
    const Vec<3> out = x - x.cwiseMax(tree_.low()).cwiseMin(tree_.high());
    const double from_box = out.norm();
    if (from_box > 0) return {std::max(from_box, band_), out / from_box};
    return {side == Side::inside ? -band_ : band_, Vec<3>::UnitZ()};
  }

  Near exact(const TriangleTree::Hit& hit, const Vec<3>& x) const {
    if (hit.part == Part::face) {
      const Vec<3> normal = normal_of(hit.triangle);
      return {normal.dot(x - tree_.triangles().point(hit.triangle, 0)), normal};
    }
    const Vec<3> normal = hit.part == Part::edge ? at_edge(hit.triangle, hit.corner)
                                                 : at_corner(hit.triangle, hit.corner);
    const Vec<3> from = x - hit.point;
    const double side = from.dot(normal) < 0 ? -1 : 1, distance = std::sqrt(hit.square);
    if (distance <= rounding_) return {side * distance, normal};
    return {side * distance, side / distance * from};
  }

  Vec<3> normal_of(Index triangle) const {
    return tree_.triangles().area_vector(triangle).normalized();
  }
  Local behind(Local triangle, int edge) const {
    return neighbour_[static_cast<std::size_t>(triangle)][static_cast<std::size_t>(edge)];
  }

  Vec<3> at_edge(Local triangle, int edge) const {
    return unit(normal_of(triangle) + normal_of(behind(triangle, edge)), triangle);
  }

  /// Around a corner, from triangle to triangle.
  Vec<3> at_corner(Local triangle, int corner) const {
    const Triangles& all = tree_.triangles();
    const auto number = [&](Local t, int k) {
      return all.corners[static_cast<std::size_t>(t)][static_cast<std::size_t>(k)];
    };
    const Local point = number(triangle, corner);
    Vec<3> sum = Vec<3>::Zero();
    Local t = triangle;
    int k = corner;
    do {
      const Vec<3> to_next = (all.point(t, (k + 1) % 3) - all.point(t, k)).normalized();
      const Vec<3> to_last = (all.point(t, (k + 2) % 3) - all.point(t, k)).normalized();
      sum += std::atan2(to_next.cross(to_last).norm(), to_next.dot(to_last)) * normal_of(t);
      t = behind(t, (k + 2) % 3);
      for (k = 0; number(t, k) != point;) ++k;
    } while (t != triangle);
    return unit(sum, triangle);
  }

  /// Where faces lie back to back, their sum has no direction.
  Vec<3> unit(const Vec<3>& sum, Local triangle) const {
    const double length = sum.norm();
    return length > 0 ? Vec<3>(sum / length) : normal_of(triangle);
  }

  TriangleTree tree_;
  std::vector<std::array<Local, 3>> neighbour_;
  double band_, rounding_;
  SideGrid sides_;
};

}  // namespace

SolidPtr<3> solid_of_triangles(TriangleTree tree, double band) {
  return std::make_shared<TriangleSolid>(std::move(tree), band);
}

SolidPtr<3> solid_of_triangles(Triangles triangles, double band) {
  return solid_of_triangles(TriangleTree(std::move(triangles)), band);
}

}  // namespace lahar
