/// \file Meshes of every element whose inner nodes are moved at random, for patch tests.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <vector>

#include "physics/mesh/element_grid.h"

namespace lahar::verification {

constexpr int patch_cells = 4;  ///< per direction

/// How far nodes inside leave the grid [distances of nodes].
inline double most_shift(Element element) {
  switch (element) {
    case Element::Q4:
      return 0.25;
    case Element::H8:
      return 0.14;
    default:
      return info(element).order == 1 ? 0.12 : 0.08;
  }
}

/// Files of a distorted mesh of the unit square or cube and of its nodes' velocities, removed at
/// the end.
template <int Dim>
class DistortedMesh {
 public:
  DistortedMesh(Element element, const Eigen::Matrix<double, Dim, Dim>& L, bool straight) {
    folder_ = std::filesystem::temp_directory_path() /
              fmt::format("lahar_patch_{}_{}", info(element).name, getpid());
    std::filesystem::create_directories(folder_);
    std::ofstream mesh(folder_ / "mesh.txt"), velocity(folder_ / "velocity.txt");
    mesh.precision(17);
    velocity.precision(17);
    std::array<Index, Dim> counts;
    counts.fill(patch_cells);
    const auto grid = element_grid<Dim>(element, Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts);
    const std::size_t per_cell = static_cast<std::size_t>(info(element).nodes);
    std::vector<Vec<Dim>> nodes;
    mesh << grid.nodes.size() << " " << grid.cells.size() / per_cell << "\n";
    for (std::size_t n = 0; n < grid.nodes.size(); ++n) {
      const Vec<Dim>& at = grid.nodes[n];
      Vec<Dim> x;
      for (int d = 0; d < Dim; ++d) {
        // Those of the sides stay there.
        const bool side = at[d] == 0 || at[d] == patch_cells;
        const double shift =
            std::sin(3.7 * at[0] + 5.1 * at[1] * (d + 1) + 2.3 * (Dim == 3 ? at[Dim - 1] : 0) + d);
        x[d] =
            (at[d] + (side ? 0 : most_shift(element) / info(element).order * shift)) / patch_cells;
      }
      nodes.push_back(x);
    }
    for (std::size_t first = 0; straight && first < grid.cells.size(); first += per_cell)
      straighten(element, &grid.cells[first], nodes);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      const Vec<Dim>& x = nodes[n];
      const Vec<Dim> v = L * (x - Vec<Dim>::Constant(0.5));
      for (int d = 0; d < Dim; ++d) {
        mesh << x[d] << (d + 1 < Dim ? " " : "\n");
        velocity << n << " " << d << " " << v[d] << "\n";
      }
    }
    for (std::size_t k = 0; k < grid.cells.size(); ++k)
      mesh << grid.cells[k] << ((k + 1) % per_cell == 0 ? "\n" : " ");
  }
  ~DistortedMesh() { std::filesystem::remove_all(folder_); }
  const std::filesystem::path& folder() const { return folder_; }

 private:
  /// Nodes between corners move to the middles of these.
  static void straighten(Element element, const Index* cell, std::vector<Vec<Dim>>& nodes) {
    const ElementInfo& about = info(element);
    for (int a = about.corners; a < about.nodes; ++a) {
      Vec<Dim> sum = Vec<Dim>::Zero();
      int count = 0;
      const auto xi = node_xi<Dim>(element, a);
      for (int c = 0; c < about.corners; ++c) {
        const Vec<Dim> corner = node_xi<Dim>(element, c);
        bool beside = about.simplex ? c == a - 3 || c == (a - 2) % 3 : true;
        for (int d = 0; d < Dim && !about.simplex; ++d)
          beside = beside && (xi[d] == 0 || xi[d] == corner[d]);
        if (!beside) continue;
        sum += nodes[static_cast<std::size_t>(cell[c])];
        ++count;
      }
      nodes[static_cast<std::size_t>(cell[a])] = sum / count;
    }
  }

  std::filesystem::path folder_;
};

}  // namespace lahar::verification
