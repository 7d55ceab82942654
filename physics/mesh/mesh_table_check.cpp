/// \file What can be wrong with the tables of a mesh; every bad node and cell is reported.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/base/error.h"
#include "physics/mesh/inverse_mapping.h"
#include "physics/mesh/mesh_table.h"

namespace lahar {
namespace {

/// Problems listed one by one; the rest is counted.
constexpr std::size_t listed_problems = 20;
/// A cell is degenerate where its Jacobian is below this fraction of the product of its edges [-].
constexpr double degenerate_jacobian = 1e-10;
/// Corners of a box may miss its faces by this fraction of its edges [-]: six digits in the file.
constexpr double box_deviation = 1e-5;

class Report {
 public:
  void add(std::string message, std::string hint = {}) {
    ++count_;
    if (count_ > listed_problems) return;
    Problem& problem = problems_.emplace_back();
    problem.message = std::move(message);
    problem.hint = std::move(hint);
  }
  bool empty() const { return count_ == 0; }
  /// Throw InputError if there is anything to report.
  void finish() {
    if (empty()) return;
    if (count_ > listed_problems)
      problems_.emplace_back().message =
          fmt::format("and {} more problems in this mesh", count_ - listed_problems);
    throw InputError(std::move(problems_));
  }

 private:
  std::vector<Problem> problems_;
  std::size_t count_ = 0;
};

template <int Dim>
std::string text(const Vec<Dim>& x) {
  return fmt::format("({})", fmt::join(x.data(), x.data() + Dim, ", "));
}

/// "node 3 (0, 1), node 7 (1, 1), ..."
template <int Dim>
std::string list_nodes(std::span<const Index> cell, const std::vector<Vec<Dim>>& nodes) {
  std::string list;
  for (Index n : cell)
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", n, text<Dim>(nodes[n]));
  return list;
}

/// Node ids within range and different from each other.
bool check_ids(Index c, const CellList& cells, Index n_nodes, Report& report) {
  const auto cell = cells[c];
  for (Index node : cell) {
    if (node >= 0 && node < n_nodes) continue;
    report.add(fmt::format("cell {} has node {}, but the {} nodes are numbered 0 to {}", c, node,
                           n_nodes, n_nodes - 1));
    return false;
  }
  for (std::size_t i = 0; i < cell.size(); ++i) {
    if (std::find(cell.begin() + i + 1, cell.end(), cell[i]) == cell.end()) continue;
    const ElementInfo& about = info(cells.element);
    report.add(fmt::format("cell {} has node {} twice; a {}{} has {} different nodes", c, cell[i],
                           about.noun, about.order > 1 ? fmt::format(" {}", about.name) : "",
                           cell.size()));
    return false;
  }
  return true;
}

template <int Dim>
ElementGeometry<Dim> geometry_of(Index c, const CellList& cells,
                                 const std::vector<Vec<Dim>>& nodes) {
  ElementGeometry<Dim> geometry{cells.element, {}};
  const auto cell = cells[c];
  for (std::size_t a = 0; a < cell.size(); ++a) geometry.X[a] = nodes[cell[a]];
  return geometry;
}

/// Jacobian divided by the lengths of its columns: 1 in a box, 0 in a flat cell.
template <int Dim>
double shape_quality(const ElementGeometry<Dim>& g, const Vec<Dim>& xi) {
  const auto J = g.jacobian(xi);
  const double scale = J.colwise().norm().prod();
  return scale > 0 ? J.determinant() / scale : 0.0;
}

/// How the nodes of a cell are to be listed.
std::string_view node_order(Element element) {
  switch (element) {
    case Element::T3:
    case Element::Q4:
      return "list the corners counter-clockwise";
    case Element::T6:
    case Element::Q8:
    case Element::Q9:
      return "list the corners counter-clockwise, then the middles of the sides in this order";
    case Element::Tet4:
      return "list a face counter-clockwise seen from the fourth corner, then that corner";
    case Element::H8:
      return "list the bottom face counter-clockwise seen from the top face, then the top";
    case Element::H20:
    case Element::H27:
      return "list the bottom face counter-clockwise seen from the top face, then the top, then "
             "the middles of the edges 0-1 0-3 0-4 1-2 1-5 2-3 2-6 3-7 4-5 4-7 5-6 6-7";
  }
  return "";
}

/// Positive Jacobian at the nodes; where that is not sufficient, also at Gauss points and the
/// centre.
template <int Dim>
bool check_jacobian(Index c, const CellList& cells, const std::vector<Vec<Dim>>& nodes,
                    Report& report) {
  const Element element = cells.element;
  const auto geometry = geometry_of<Dim>(c, cells, nodes);
  double worst = std::numeric_limits<double>::infinity();
  std::string place;
  const auto test = [&](const Vec<Dim>& xi, auto&& name) {
    const double quality = shape_quality<Dim>(geometry, xi);
    if (quality < worst) worst = quality, place = quality <= degenerate_jacobian ? name() : "";
  };
  const bool more = info(element).order > 1 || element == Element::H8;
  for (int k = 0; k < geometry.nodes(); ++k)
    test(node_xi<Dim>(element, k), [&] {
      return fmt::format("its {} at node {}", k < info(element).corners ? "corner" : "side",
                         cells[c][k]);
    });
  if (more) {
    const auto points = gauss_points<Dim>(element, 2);
    for (std::size_t k = 0; k < points.size(); ++k)
      test(points[k], [&] { return fmt::format("its Gauss point {}", k); });
    test(centre_xi<Dim>(element), [&] { return std::string("its centre"); });
  }
  if (worst > degenerate_jacobian) return true;
  report.add(fmt::format("cell {} is {} at {}: nodes {}", c,
                         worst < -degenerate_jacobian ? "inverted" : "flat", place,
                         list_nodes<Dim>(cells[c], nodes)),
             std::string(node_order(element)));
  return false;
}

/// All nodes of a cell of second order lie where those of the box lie that its corners span.
template <int Dim>
bool are_in_place(const ElementGeometry<Dim>& g, double deviation) {
  ElementGeometry<Dim> straight{multilinear<Dim>, {}};
  std::copy_n(g.X.begin(), info(g.element).corners, straight.X.begin());
  const auto [low, high] = straight.bounds();
  for (int a = info(g.element).corners; a < g.nodes(); ++a) {
    const Vec<Dim> off = g.X[a] - straight.point(node_xi<Dim>(g.element, a));
    if ((off.cwiseAbs().array() > deviation * (high - low).array()).any()) return false;
  }
  return true;
}

template <int Dim>
std::array<Vec<Dim>, corners<Dim>> corner_positions(std::span<const Index> cell,
                                                    const std::vector<Vec<Dim>>& nodes) {
  std::array<Vec<Dim>, corners<Dim>> corner;
  for (int k = 0; k < corners<Dim>; ++k) corner[k] = nodes[cell[k]];
  return corner;
}

}  // namespace

template <int Dim>
bool is_box(const std::array<Vec<Dim>, corners<Dim>>& corner, double deviation) {
  const auto tensor = box_orientation<Dim>(corner);
  unsigned seen = 0;
  for (int t : tensor) seen |= 1u << t;
  if (seen != (1u << corners<Dim>)-1) return false;
  Vec<Dim> low = corner[0], high = corner[0];
  for (const auto& X : corner) low = low.cwiseMin(X), high = high.cwiseMax(X);
  const Vec<Dim> allowed = deviation * (high - low);
  for (int k = 0; k < corners<Dim>; ++k) {
    for (int d = 0; d < Dim; ++d) {
      const double face = (tensor[k] >> d) & 1 ? high[d] : low[d];
      if (!(std::abs(corner[k][d] - face) <= allowed[d])) return false;
    }
  }
  return true;
}

/// [m] Volumes in three dimensions, and squares, are still numbers.
constexpr double largest_coordinate = 1e50;

template <int Dim>
void check_tables(const std::vector<Vec<Dim>>& nodes, const CellList& cells, bool isoparametric) {
  Report report;
  const Index n_nodes = static_cast<Index>(nodes.size());
  const Index n_cells = cells.size();
  if (nodes.empty()) report.add("the mesh has no nodes");
  if (n_cells == 0) report.add("the mesh has no cells");
  constexpr Index most = std::numeric_limits<Local>::max();
  if (n_cells > most || n_nodes > most)
    report.add(fmt::format("{} nodes and {} cells: at most {} of each can come from a table",
                           n_nodes, n_cells, most),
               "a structured mesh has no such limit");
  for (Index n = 0; n < n_nodes; ++n)
    if (!nodes[n].allFinite())
      report.add(fmt::format("node {} has coordinates {}; they must be finite numbers", n,
                             text<Dim>(nodes[n])));
    else if (nodes[n].cwiseAbs().maxCoeff() > largest_coordinate)
      report.add(fmt::format("node {} has coordinates {}; they must be at most {:g} m", n,
                             text<Dim>(nodes[n]), largest_coordinate));
  const bool coordinates_usable = report.empty();
  // A triangle's map is affine whatever its shape; CB-Geo's published ones say that they are not
  // isoparametric.
  const bool boxes = !isoparametric && !info(cells.element).simplex;
  for (Index c = 0; c < n_cells; ++c) {
    if (!check_ids(c, cells, n_nodes, report) || !coordinates_usable) continue;
    if (check_jacobian<Dim>(c, cells, nodes, report) && boxes &&
        !(is_box<Dim>(corner_positions<Dim>(cells[c], nodes), box_deviation) &&
          are_in_place<Dim>(geometry_of<Dim>(c, cells, nodes), box_deviation)))
      report.add(fmt::format("cell {} is not a box along the axes: nodes {}", c,
                             list_nodes<Dim>(cells[c], nodes)),
                 "set isoparametric to true for cells of any shape");
  }
  report.finish();
}

#define LAHAR_INSTANTIATE(Dim)                                                  \
  template bool is_box<Dim>(const std::array<Vec<Dim>, corners<Dim>>&, double); \
  template void check_tables<Dim>(const std::vector<Vec<Dim>>&, const CellList&, bool);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)

}  // namespace lahar
