#include "physics/kernels/matrix_pattern.h"

#include <span>
#include <utility>
#include <vector>

#include "physics/basis/support.h"

namespace lahar {

namespace {

/// The nodes whose functions may not be zero in a local cell.
template <int Dim>
std::span<const Local> nodes_of_cell(const Patch<Dim>& patch, std::size_t cell) {
  if (general::is(patch)) return patch.topology.support(cell);
  return patch.topology.corner_nodes[cell];
}

template <int Dim>
bool has_particles(const Patch<Dim>& patch, std::size_t cell) {
  for (Local b = patch.first_bin[cell]; b >= 0; b = patch.bins[static_cast<std::size_t>(b)].next)
    if (const ParticleBin& bin = patch.bins[static_cast<std::size_t>(b)]; bin.begin < bin.end)
      return true;
  return false;
}

/// Cells with particles around each node, one node after the other.
template <int Dim>
struct CellsOfNodes {
  std::vector<std::size_t> first;
  std::vector<std::size_t> cell;

  CellsOfNodes(const Patch<Dim>& patch, const std::vector<char>& also)
      : first(static_cast<std::size_t>(patch.n_nodes()) + 1, 0) {
    std::vector<std::size_t> filled;
    for (std::size_t c = 0; c < patch.first_bin.size(); ++c)
      if (has_particles(patch, c) || (!also.empty() && also[c])) filled.push_back(c);
    for (const std::size_t c : filled)
      for (const Local node : nodes_of_cell(patch, c)) ++first[static_cast<std::size_t>(node) + 1];
    for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    cell.resize(first.back());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (const std::size_t c : filled)
      for (const Local node : nodes_of_cell(patch, c))
        cell[next[static_cast<std::size_t>(node)]++] = c;
  }
};

}  // namespace

template <int Dim>
void find_pattern(Patch<Dim>& patch, const std::vector<char>& also) {
  NodalSystem<Dim>& system = patch.system;
  const CellsOfNodes<Dim> cells(patch, also);
  const auto n = static_cast<std::size_t>(patch.n_nodes());
  system.first.assign(1, 0);
  system.column.clear();
  std::vector<std::size_t> seen(n, n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t begin = system.column.size();
    for (std::size_t k = cells.first[i]; k < cells.first[i + 1]; ++k)
      for (const Local node : nodes_of_cell(patch, cells.cell[k]))
        if (std::exchange(seen[static_cast<std::size_t>(node)], i) != i)
          system.column.push_back(node);
    std::sort(system.column.begin() + static_cast<std::ptrdiff_t>(begin), system.column.end());
    system.first.push_back(system.column.size());
  }
}

template void find_pattern<2>(Patch<2>&, const std::vector<char>&);
template void find_pattern<3>(Patch<3>&, const std::vector<char>&);

}  // namespace lahar
