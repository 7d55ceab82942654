#include "runtime/solve/coarse_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "runtime/base/parallel.h"
#include "runtime/exchange/exact_sum.h"

namespace lahar {

namespace {

/// Spacing of the first lattice in cells: a cycle has two steps of smoothing before and after,
/// which suffice for what a lattice of this spacing does not know.
constexpr double cells_per_box = 3.0;
constexpr double steps_of_scale = 0x1p46;
/// What a patch may give: the sum of 2^10 patches is still an integer.
constexpr double most_steps = 0x1p52;
/// The most that the blocks of all patches may take: every rank gets them in one message.
constexpr double most_bytes = 1.5e9;

}  // namespace

/// [m] Of unstructured meshes: three times the mean distance of a node from the nearest one.
template <int Dim>
Vec<Dim> CoarseGrid<Dim>::spacing() const {
  const Mesh<Dim>& mesh = patches_.mesh();
  if (mesh.is_structured()) {
    const auto [low, high] = mesh.bounds();
    Vec<Dim> cell;
    for (int d = 0; d < Dim; ++d)
      cell[d] =
          (high[d] - low[d]) / static_cast<double>(mesh.counts()[static_cast<std::size_t>(d)]);
    return cells_per_box * cell;
  }
  ExactSum distance, nodes;
  for (int p = 0; p < patches_.size(); ++p) {
    const auto& [topology, system] = std::tie(patches_[p].topology, patches_[p].system);
    if (system.column.empty()) continue;
    for (std::size_t i = 0; i < topology.nodes.size(); ++i) {
      if (system.solver.inverse.empty() || system.solver.inverse[i * node_width + mass_lane] == 0)
        continue;
      double nearest = std::numeric_limits<double>::infinity();
      for (std::size_t k = system.first[i]; k < system.first[i + 1]; ++k)
        if (const auto j = static_cast<std::size_t>(system.column[k]); j != i)
          nearest = std::min(nearest,
                             (mesh.node(topology.nodes[i]) - mesh.node(topology.nodes[j])).norm());
      if (!std::isfinite(nearest)) continue;
      distance += nearest;
      nodes += 1;
    }
  }
  std::vector<Index> all(distance.elements().begin(), distance.elements().end());
  all.insert(all.end(), nodes.elements().begin(), nodes.elements().end());
  ranks_.sum(all);
  const std::span<const Index> sums(all);
  const double mean = ExactSum(sums.template first<ExactSum::size>()).value() /
                      ExactSum(sums.template last<ExactSum::size>()).value();
  return Vec<Dim>::Constant(cells_per_box * mean);
}

/// Around the nodes of all patches that particles touch.
template <int Dim>
Lattice<Dim> CoarseGrid<Dim>::lattice() const {
  Vec<Dim> low = Vec<Dim>::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (int p = 0; p < patches_.size(); ++p)
    for (const NodeRange& range : patches_[p].active_nodes)
      for (Local i = range.begin; i < range.end; ++i) {
        const Vec<Dim> at =
            patches_.mesh().node(patches_[p].topology.nodes[static_cast<std::size_t>(i)]);
        low = low.cwiseMin(at);
        high = high.cwiseMax(at);
      }
  Lattice<Dim> lattice;
  lattice.spacing = spacing();
  for (int d = 0; d < Dim; ++d) {
    lattice.origin[d] = ranks_.min(low[d]);
    const double length = ranks_.max(high[d]) - lattice.origin[d];
    lattice.boxes[static_cast<std::size_t>(d)] =
        std::max<Index>(1, static_cast<Index>(std::ceil(length / lattice.spacing[d] - 1e-6)));
  }
  return lattice;
}

template <int Dim>
bool CoarseGrid<Dim>::set_up(bool is_scalar) {
  width_ = is_scalar ? 1 : Dim;
  const Lattice<Dim> lattice = this->lattice();
  const auto n = static_cast<std::size_t>(patches_.size());
  std::vector<CoarsePlaces<Dim>> places(n);
  std::vector<std::vector<CoarseBlock<Dim>>> parts(n);
  std::vector<char> is_suited(n, 0);
  parallel_for(threads_, patches_.size(), [&](int p) {
    const auto k = static_cast<std::size_t>(p);
    NodalSystem<Dim>& system = patches_[p].system;
    system.rough_blocks.assign(system.blocks.begin(), system.blocks.end());
    is_suited[k] = place_on_lattice(patches_[p], patches_.mesh(), lattice, places[k]) &&
                   add_coarse_blocks(patches_[p], places[k], lattice, parts[k]);
  });
  Index own = 0;
  for (const auto& part : parts) own += static_cast<Index>(part.size());
  const bool suited = std::find(is_suited.begin(), is_suited.end(), 0) == is_suited.end();
  const Index all = ranks_.sum(own);
  if (ranks_.any(!suited) || static_cast<double>(all) * sizeof(CoarseBlock<Dim>) > most_bytes)
    return false;
  std::vector<CoarseBlock<Dim>> blocks;
  for (auto& part : parts) {
    blocks.insert(blocks.end(), part.begin(), part.end());
    part = {};
  }
  if (ranks_.several()) blocks = ranks_.gather_all(std::span<const CoarseBlock<Dim>>(blocks));
  std::sort(blocks.begin(), blocks.end(), [](const auto& a, const auto& b) {
    return std::tie(a.row, a.column, a.patch) < std::tie(b.row, b.column, b.patch);
  });
  std::vector<Index> nodes;
  for (const auto& block : blocks)
    for (const Index node : {block.row, block.column}) nodes.push_back(node);
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  for (std::size_t k = 0; k < n; ++k) {
    std::vector<Index>& own = patches_[static_cast<int>(k)].system.solver.coarse.number;
    own = std::move(places[k].numbers);
    for (Index& number : own) {
      const auto at = std::lower_bound(nodes.begin(), nodes.end(), number);
      number = at != nodes.end() && *at == number ? at - nodes.begin() : -1;
    }
  }
  levels_ = std::make_unique<CoarseLevels<Dim>>(nodes, blocks, lattice, width_);
  sums_.assign(nodes.size() * static_cast<std::size_t>(width_), 0);
  return true;
}

template <int Dim>
std::span<const Index> CoarseGrid<Dim>::give(double scale) {
  std::fill(sums_.begin(), sums_.end(), 0);
  if (!(scale > 0)) return sums_;
  const auto width = static_cast<std::size_t>(width_);
  for (int p = 0; p < patches_.size(); ++p) {
    const CoarseNodes& coarse = patches_[p].system.solver.coarse;
    for (std::size_t i = 0; i < coarse.number.size(); ++i) {
      if (coarse.number[i] < 0) continue;
      for (std::size_t a = 0; a < width; ++a) {
        const double steps = coarse.sums[i * node_width + a] / scale * steps_of_scale;
        // Larger values, and those that are no numbers, show in the sums of the rounds that follow.
        if (std::abs(steps) < most_steps)
          sums_[static_cast<std::size_t>(coarse.number[i]) * width + a] += std::llrint(steps);
      }
    }
  }
  return sums_;
}

template <int Dim>
void CoarseGrid<Dim>::take(std::span<const Index> sums, double scale) {
  const auto width = static_cast<std::size_t>(width_);
  NodeArray& right = levels_->right_side();
  for (std::size_t i = 0; i < right.size() / node_width; ++i)
    for (std::size_t a = 0; a < width; ++a)
      right[i * node_width + a] = static_cast<double>(sums[i * width + a]) / steps_of_scale * scale;
  levels_->cycle();
}

template class CoarseGrid<2>;
template class CoarseGrid<3>;

}  // namespace lahar
