// From elements of all kinds to a mesh of one, with its sets.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>

#include "io/mesh/element_file.h"

namespace lahar {

namespace {

[[noreturn]] void fail(const std::string& file, std::string message, std::string hint = "") {
  throw InputError({Problem{.file = file, .message = std::move(message), .hint = std::move(hint)}});
}

/// "12 3-node triangles, 4 4-node quadrilaterals" of kinds that `wanted` selects.
std::string counts_of(const FileElements& tables, const auto& wanted) {
  std::string text;
  for (std::size_t k = 0; k < tables.kinds.size(); ++k) {
    const ElementKind& kind = element_kinds()[k];
    const auto n = tables.kinds[k].nodes.size() / static_cast<std::size_t>(kind.nodes);
    if (n > 0 && wanted(kind))
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", n, kind.name);
  }
  return text;
}

/// The kind that all cells are of.
std::size_t kind_of_cells(const FileElements& tables, int dim, const std::string& file) {
  std::vector<std::size_t> found;
  for (std::size_t k = 0; k < tables.kinds.size(); ++k)
    if (!tables.kinds[k].nodes.empty() && element_kinds()[k].dim >= dim) found.push_back(k);
  const auto all = [](const ElementKind&) { return true; };
  const auto cells = [&](const ElementKind& kind) { return kind.dim == dim; };
  const auto too_high = counts_of(tables, [&](const ElementKind& k) { return k.dim > dim; });
  if (!too_high.empty())
    fail(file,
         fmt::format("the mesh is of three dimensions, and the case of two: it has {}", too_high));
  if (found.empty()) {
    const std::string has = counts_of(tables, all);
    fail(
        file,
        fmt::format("the mesh has no cells of {} dimensions: it has {}", dim,
                    has.empty() ? "no elements" : has),
        "in Gmsh, put them into a physical group too: it saves nothing else once there are groups");
  }
  if (found.size() > 1)
    fail(file,
         fmt::format("all cells have to be of one element, found {}", counts_of(tables, cells)),
         "let the generator recombine all of them, or none");
  if (!element_kinds()[found[0]].element)
    fail(file, fmt::format("there are no shape functions for {}", counts_of(tables, cells)),
         dim == 2 ? "cells may be triangles of 3 or 6 nodes, quadrilaterals of 4, 8 or 9"
                  : "cells may be tetrahedra of 4 nodes, hexahedra of 8, 20 or 27");
  return found[0];
}

/// Where the nodes of an element go when it is turned over.
std::vector<std::size_t> mirrored(Element element) {
  const auto n = info(element).nodes;
  std::vector<std::size_t> to;
  for (int a = 0; a < n; ++a) {
    detail::NodePlace place = detail::node_place(element, a);
    if (info(element).simplex)
      std::swap(place[0], place[1]);
    else
      place[0] = static_cast<signed char>(-place[0]);
    for (int b = 0; b < n; ++b)
      if (detail::node_place(element, b) == place) to.push_back(static_cast<std::size_t>(b));
  }
  return to;
}

/// The determinant of the Jacobian in the middle, from the corners.
template <int Dim>
double orientation(Element element, const Index* nodes, const std::vector<Vec<Dim>>& x) {
  Eigen::Matrix<double, Dim, Dim> jacobian = Eigen::Matrix<double, Dim, Dim>::Zero();
  const auto at = [&](int a) { return x[static_cast<std::size_t>(nodes[a])]; };
  for (int a = 0; a < info(element).corners; ++a)
    for (int d = 0; d < Dim; ++d) {
      const double side = detail::node_place(element, a)[static_cast<std::size_t>(d)];
      jacobian.col(d) += side * (info(element).simplex ? Vec<Dim>(at(a) - at(0)) : at(a));
    }
  return jacobian.determinant();
}

/// Position of each element among those that differ, which Gmsh 2.2 lists once per group.
std::vector<Local> without_copies(std::vector<Local>& nodes, std::size_t per_cell) {
  const std::size_t n = nodes.size() / per_cell;
  std::vector<Local> sorted = nodes, order(n), place(n);
  for (std::size_t i = 0; i < n; ++i)
    std::sort(sorted.begin() + static_cast<std::ptrdiff_t>(i * per_cell),
              sorted.begin() + static_cast<std::ptrdiff_t>((i + 1) * per_cell));
  const auto row = [&](Local i) { return sorted.data() + static_cast<std::size_t>(i) * per_cell; };
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Local a, Local b) {
    const auto [p, q] = std::mismatch(row(a), row(a) + per_cell, row(b));
    return p == row(a) + per_cell ? a < b : *p < *q;
  });
  // The first of each, then their positions in the order of the file.
  Local first = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (i == 0 || !std::equal(row(order[i]), row(order[i]) + per_cell, row(first)))
      first = order[i];
    place[static_cast<std::size_t>(order[i])] = first;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (place[i] != static_cast<Local>(i)) {
      place[i] = place[static_cast<std::size_t>(place[i])];
      continue;
    }
    std::copy_n(nodes.begin() + static_cast<std::ptrdiff_t>(i * per_cell), per_cell,
                nodes.begin() + static_cast<std::ptrdiff_t>(kept * per_cell));
    place[i] = static_cast<Local>(kept++);
  }
  nodes.resize(kept * per_cell);
  return place;
}

/// Makes the mesh, part by part.
template <int Dim>
class MeshMaker {
 public:
  MeshMaker(FileElements tables, const std::string& file, ProblemList& problems)
      : tables_(std::move(tables)),
        file_(file),
        problems_(problems),
        kind_(kind_of_cells(tables_, Dim, file)) {
    mesh_.element = *element_kinds()[kind_].element;
  }

  ElementMesh<Dim> make() {
    const auto per_cell = static_cast<std::size_t>(info(mesh_.element).nodes);
    const auto place = without_copies(tables_.kinds[kind_].nodes, per_cell);
    make_nodes();
    orient(per_cell);
    make_sets(place);
    return std::move(mesh_);
  }

 private:
  /// Nodes of cells, in the order of the file.
  void make_nodes() {
    auto& cells = tables_.kinds[kind_].nodes;
    number_.assign(tables_.points.size(), -1);
    for (const Local node : cells) number_[static_cast<std::size_t>(node)] = 0;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t i = 0; i < number_.size(); ++i) {
      if (number_[i] < 0) continue;
      number_[i] = static_cast<Local>(mesh_.nodes.size());
      const Vec<3>& x = tables_.points[i];
      mesh_.nodes.push_back(x.template head<Dim>());
      low = std::min(low, x.z());
      high = std::max(high, x.z());
    }
    if (Dim == 2) check_plane(low, high);
    tables_.points = {};
    mesh_.cells.reserve(cells.size());
    for (const Local node : cells) mesh_.cells.push_back(number_[static_cast<std::size_t>(node)]);
    cells = {};
  }

  void check_plane(double low, double high) const {
    constexpr double flat = 1e-6;  // of the mesh [-]
    Vec<Dim> least = mesh_.nodes[0], most = least;
    for (const auto& x : mesh_.nodes) {
      least = least.cwiseMin(x);
      most = most.cwiseMax(x);
    }
    if (high - low > flat * (most - least).maxCoeff())
      fail(file_, fmt::format("a mesh of a 2D case has to lie in the plane x, y; here z is from "
                              "{:.6g} to {:.6g}",
                              low, high));
  }

  void orient(std::size_t per_cell) {
    const auto to = mirrored(mesh_.element);
    std::vector<Index> cell(per_cell);
    Index turned = 0, first = -1;
    for (std::size_t at = 0; at < mesh_.cells.size(); at += per_cell) {
      if (!(orientation<Dim>(mesh_.element, mesh_.cells.data() + at, mesh_.nodes) < 0)) continue;
      std::copy_n(mesh_.cells.begin() + static_cast<std::ptrdiff_t>(at), per_cell, cell.begin());
      for (std::size_t a = 0; a < per_cell; ++a) mesh_.cells[at + a] = cell[to[a]];
      if (turned++ == 0) first = static_cast<Index>(at / per_cell);
    }
    const auto all = static_cast<Index>(mesh_.cells.size() / per_cell);
    if (turned > 0) refuse_folds(per_cell);
    if (turned > 0)
      problems_.warning(
          {.file = file_,
           .message = fmt::format("{} of {} cells are turned over and have been mended, the first "
                                  "is cell {}",
                                  turned, all, first),
           .hint = Dim == 2 ? "corners have to be counter-clockwise; the surface faces downwards"
                            : "a volume was mirrored"});
  }

  /// Two cells that see a face from the same side lie over each other.
  void refuse_folds(std::size_t per_cell) const {
    struct Face {
      std::array<Index, most_face_corners> corner;  ///< in their order, from the lowest
      Index cell;
    };
    const ElementInfo& element = info(mesh_.element);
    std::vector<Face> faces;
    for (std::size_t at = 0; at < mesh_.cells.size(); at += per_cell)
      for (std::size_t f = 0; f < static_cast<std::size_t>(element.faces); ++f) {
        Face face{{-1, -1, -1, -1}, static_cast<Index>(at / per_cell)};
        std::size_t n = 0;
        for (const int corner : element.face[f])
          if (corner >= 0) face.corner[n++] = mesh_.cells[at + static_cast<std::size_t>(corner)];
        const auto end = face.corner.begin() + static_cast<std::ptrdiff_t>(n);
        if (Dim == 3)
          std::rotate(face.corner.begin(), std::min_element(face.corner.begin(), end), end);
        faces.push_back(face);
      }
    const auto same = [](const Face& a, const Face& b) { return a.corner == b.corner; };
    std::sort(faces.begin(), faces.end(), [&](const Face& a, const Face& b) {
      return same(a, b) ? a.cell < b.cell : a.corner < b.corner;
    });
    const auto at = std::adjacent_find(faces.begin(), faces.end(), same);
    if (at != faces.end())
      fail(file_, fmt::format("the mesh is folded: cells {} and {} lie over each other", at->cell,
                              (at + 1)->cell));
  }

  void make_sets(const std::vector<Local>& place) {
    using Set = typename ElementMesh<Dim>::Set;
    // Groups of several dimensions may have one name.
    std::map<std::tuple<bool, std::string, Index>, std::size_t> known;
    std::vector<std::size_t> target;  // position of each set of the file among its kind
    for (const auto& set : tables_.sets) {
      const bool cells = set.dim == Dim;
      auto& to = cells ? mesh_.cell_sets : mesh_.node_sets;
      const auto [at, is_new] =
          known.try_emplace({cells, set.name, set.name.empty() ? set.id : Index{-1}}, to.size());
      if (is_new) to.push_back(Set{set.name, set.id, {}});
      target.push_back(at->second);
    }
    add_members(place, target);
    for (auto* sets : {&mesh_.node_sets, &mesh_.cell_sets})
      for (Set& set : *sets) {
        std::sort(set.members.begin(), set.members.end());
        set.members.erase(std::unique(set.members.begin(), set.members.end()), set.members.end());
      }
  }

  /// `place` of cells among those that differ, `target` of sets.
  void add_members(const std::vector<Local>& place, const std::vector<std::size_t>& target) {
    const auto add_node = [&](Local set, Local point) {
      const Local node = number_[static_cast<std::size_t>(point)];
      auto& to = mesh_.node_sets[target[static_cast<std::size_t>(set)]];
      if (node >= 0) to.members.push_back(node);
    };
    const auto dim_of = [&](Local set) { return tables_.sets[static_cast<std::size_t>(set)].dim; };
    for (const auto& [set, point] : tables_.point_sets)
      if (dim_of(set) < 0) add_node(set, point);
    for (std::size_t k = 0; k < tables_.kinds.size(); ++k) {
      const auto& kind = tables_.kinds[k];
      const auto n = static_cast<std::size_t>(element_kinds()[k].nodes);
      for (const auto& [set, element] : kind.members) {
        if (dim_of(set) != element_kinds()[k].dim) continue;
        const auto e = static_cast<std::size_t>(element);
        if (k == kind_)
          mesh_.cell_sets[target[static_cast<std::size_t>(set)]].members.push_back(place[e]);
        else
          for (std::size_t a = 0; a < n; ++a) add_node(set, kind.nodes[e * n + a]);
      }
    }
  }

  FileElements tables_;
  const std::string& file_;
  ProblemList& problems_;
  std::size_t kind_;
  ElementMesh<Dim> mesh_;
  std::vector<Local> number_;  ///< of each point of the file, as a node; -1 = is none
};

}  // namespace

template <int Dim>
ElementMesh<Dim> mesh_of(FileElements tables, const std::string& file, ProblemList& problems) {
  return MeshMaker<Dim>(std::move(tables), file, problems).make();
}

template ElementMesh<2> mesh_of(FileElements, const std::string&, ProblemList&);
template ElementMesh<3> mesh_of(FileElements, const std::string&, ProblemList&);

}  // namespace lahar
