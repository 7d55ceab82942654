/// \file What can be wrong with the tables of a mesh; every bad node and cell is reported.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/error.h"
#include "physics/inverse_mapping.h"
#include "physics/mesh_table.h"

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
std::string list_nodes(const std::array<Index, corners<Dim>>& cell,
                       const std::vector<Vec<Dim>>& nodes) {
  std::string list;
  for (Index n : cell)
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", n, text<Dim>(nodes[n]));
  return list;
}

/// Node ids within range and different from each other.
template <int Dim>
bool check_ids(Index c, const std::array<Index, corners<Dim>>& cell, Index n_nodes,
               Report& report) {
  for (Index node : cell) {
    if (node >= 0 && node < n_nodes) continue;
    report.add(fmt::format("cell {} has node {}, but the {} nodes are numbered 0 to {}", c, node,
                           n_nodes, n_nodes - 1));
    return false;
  }
  for (std::size_t i = 0; i < cell.size(); ++i) {
    if (std::find(cell.begin() + i + 1, cell.end(), cell[i]) == cell.end()) continue;
    report.add(fmt::format("cell {} has node {} twice; a {} has {} different nodes", c, cell[i],
                           Dim == 2 ? "quadrilateral" : "hexahedron", cell.size()));
    return false;
  }
  return true;
}

/// Jacobian divided by the lengths of its columns: 1 in a box, 0 in a flat cell.
template <int Dim>
double shape_quality(const CellGeometry<Dim>& g, const Vec<Dim>& xi) {
  const auto J = jacobian<Dim>(g, xi);
  const double scale = J.colwise().norm().prod();
  return scale > 0 ? J.determinant() / scale : 0.0;
}

/// Positive Jacobian at the corners; in a hexahedron, where that is not sufficient, also at the
/// Gauss points and the centre.
template <int Dim>
bool check_jacobian(Index c, const std::array<Index, corners<Dim>>& cell,
                    const std::vector<Vec<Dim>>& nodes, Report& report) {
  CellGeometry<Dim> g;
  g.cartesian = false;
  for (int k = 0; k < corners<Dim>; ++k) g.corner[tensor_corner(k)] = nodes[cell[k]];
  double worst = std::numeric_limits<double>::infinity();
  std::string place;
  const auto test = [&](const Vec<Dim>& xi, auto&& name) {
    const double quality = shape_quality<Dim>(g, xi);
    if (quality < worst) worst = quality, place = quality <= degenerate_jacobian ? name() : "";
  };
  for (int k = 0; k < corners<Dim>; ++k) {
    Vec<Dim> xi;
    for (int d = 0; d < Dim; ++d) xi[d] = corner_sign(tensor_corner(k), d);
    test(xi, [&] { return fmt::format("its corner at node {}", cell[k]); });
    if (Dim == 3) test(xi / std::sqrt(3.0), [&] { return fmt::format("its Gauss point {}", k); });
  }
  if (Dim == 3) test(Vec<Dim>::Zero(), [&] { return std::string("its centre"); });
  if (worst > degenerate_jacobian) return true;
  report.add(fmt::format("cell {} is {} at {}: nodes {}", c,
                         worst < -degenerate_jacobian ? "inverted" : "flat", place,
                         list_nodes<Dim>(cell, nodes)),
             Dim == 2
                 ? "list the corners counter-clockwise"
                 : "list the bottom face counter-clockwise seen from the top face, then the top");
  return false;
}

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

template <int Dim>
std::array<Vec<Dim>, corners<Dim>> corner_positions(const std::array<Index, corners<Dim>>& cell,
                                                    const std::vector<Vec<Dim>>& nodes) {
  std::array<Vec<Dim>, corners<Dim>> corner;
  for (int k = 0; k < corners<Dim>; ++k) corner[k] = nodes[cell[k]];
  return corner;
}

}  // namespace

template <int Dim>
bool all_boxes(const std::vector<Vec<Dim>>& nodes,
               const std::vector<std::array<Index, corners<Dim>>>& cells, double deviation) {
  return std::all_of(cells.begin(), cells.end(), [&](const auto& cell) {
    return is_box<Dim>(corner_positions<Dim>(cell, nodes), deviation);
  });
}

template <int Dim>
void check_tables(const std::vector<Vec<Dim>>& nodes,
                  const std::vector<std::array<Index, corners<Dim>>>& cells, bool isoparametric) {
  Report report;
  const Index n_nodes = static_cast<Index>(nodes.size());
  const Index n_cells = static_cast<Index>(cells.size());
  if (nodes.empty()) report.add("the mesh has no nodes");
  if (cells.empty()) report.add("the mesh has no cells");
  constexpr Index most = std::numeric_limits<Local>::max();
  if (n_cells > most || n_nodes > most)
    report.add(fmt::format("{} nodes and {} cells: at most {} of each can come from a table",
                           n_nodes, n_cells, most),
               "a structured mesh has no such limit");
  for (Index n = 0; n < n_nodes; ++n)
    if (!nodes[n].allFinite())
      report.add(fmt::format("node {} has coordinates {}; they must be finite numbers", n,
                             text<Dim>(nodes[n])));
  const bool coordinates_usable = report.empty();
  for (Index c = 0; c < n_cells; ++c) {
    const auto& cell = cells[c];
    if (!check_ids<Dim>(c, cell, n_nodes, report) || !coordinates_usable) continue;
    if (check_jacobian<Dim>(c, cell, nodes, report) && !isoparametric &&
        !is_box<Dim>(corner_positions<Dim>(cell, nodes), box_deviation))
      report.add(fmt::format("cell {} is not a box along the axes: nodes {}", c,
                             list_nodes<Dim>(cell, nodes)),
                 "set isoparametric to true for cells of any shape");
  }
  report.finish();
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template bool all_boxes<Dim>(const std::vector<Vec<Dim>>&,                                 \
                               const std::vector<std::array<Index, corners<Dim>>>&, double); \
  template void check_tables<Dim>(const std::vector<Vec<Dim>>&,                              \
                                  const std::vector<std::array<Index, corners<Dim>>>&, bool);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)

}  // namespace lahar
