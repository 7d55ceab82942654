#include "physics/particles/patch_split.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

namespace lahar {
namespace {

/// Cells of a mesh from tables whose centres differ by less than this along an axis are of one
/// layer, which is not cut [mean cells].
constexpr double same_layer = 1e-6;

/// An axis is as good as another if the heavier half holds at most this share of the particles
/// more: one of so many.
constexpr Index level_share = 10;

/// Some cells of a patch, as positions in the list of its cells.
using Cells = std::vector<std::size_t>;

template <int Dim>
class Cutter {
 public:
  Cutter(const Mesh<Dim>& mesh, std::vector<Index> cells, std::span<const Index> particles,
         Index most)
      : structured_(mesh.is_structured()),
        cells_(std::move(cells)),
        particles_(particles),
        most_(most),
        position_(cells_.size()) {
    if (structured_)
      take_positions(mesh);
    else
      take_centres(mesh);
  }

  /// Cut these cells, which are patch `patch` when all cuts before have been made.
  void cut(Cells cells, Index patch, std::vector<PatchSplit>& splits) const {
    const Index total = count(cells);
    if (total <= most_) return;
    std::optional<Cut> best = best_of_all(cells, total);
    if (!best) return;  // all particles are in one cell
    splits.push_back({patch, best->axis, best->at});
    // The upper half first: its cuts do not change the id of the lower one.
    cut(std::move(best->upper), patch + 1, splits);
    cut(std::move(best->lower), patch, splits);
  }

 private:
  struct Cut {
    Index axis, at;
    Index heavier;  ///< particles in the half with more of them
    double length;  ///< of the cells along the axis [mean cells]
    Cells lower, upper;
  };

  void take_positions(const Mesh<Dim>& mesh) {
    const auto counts = mesh.counts();
    size_.fill(1.0);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      Index rest = cells_[i];
      for (std::size_t d = 0; d < Dim; ++d) {
        position_[i][d] = static_cast<double>(rest % counts[d]);
        rest /= counts[d];
      }
    }
  }

  void take_centres(const Mesh<Dim>& mesh) {
    Vec<Dim> sum = Vec<Dim>::Zero();
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const auto nodes = mesh.element_nodes(cells_[i]);
      const Vec<Dim> centre = mesh.cell_centre(cells_[i]);
      Vec<Dim> low = centre, high = centre;
      for (const Index node : nodes) {
        const Vec<Dim> x = mesh.node(node);
        low = low.cwiseMin(x), high = high.cwiseMax(x);
      }
      sum += high - low;
      for (int d = 0; d < Dim; ++d) position_[i][static_cast<std::size_t>(d)] = centre[d];
    }
    for (int d = 0; d < Dim; ++d)
      size_[static_cast<std::size_t>(d)] = sum[d] / static_cast<double>(cells_.size());
  }

  Index count(const Cells& cells) const {
    return std::accumulate(cells.begin(), cells.end(), Index{0},
                           [&](Index n, std::size_t i) { return n + particles_[i]; });
  }

  /// The longest axis of those that halve the particles as well as any.
  std::optional<Cut> best_of_all(const Cells& cells, Index total) const {
    std::array<std::optional<Cut>, Dim> cuts;
    Index least = total;
    for (int d = 0; d < Dim; ++d) {
      auto& cut = cuts[static_cast<std::size_t>(d)] = best_along(d, cells, total);
      if (cut) least = std::min(least, cut->heavier);
    }
    std::optional<Cut> best;
    for (auto& cut : cuts)
      if (cut && cut->heavier - least <= total / level_share &&
          (!best || cut->length > best->length + same_layer))
        best = std::move(cut);
    return best;
  }

  /// The plane across an axis that leaves the fewest particles in the heavier half.
  std::optional<Cut> best_along(int axis, const Cells& cells, Index total) const {
    const auto d = static_cast<std::size_t>(axis);
    Cells order = cells;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return std::tie(position_[a][d], cells_[a]) < std::tie(position_[b][d], cells_[b]);
    });
    Index before = 0, heavier = total;
    std::size_t best = 0;
    for (std::size_t i = 1; i < order.size(); ++i) {
      before += particles_[order[i - 1]];
      const double gap = position_[order[i]][d] - position_[order[i - 1]][d];
      const Index heavier_here = std::max(before, total - before);
      if (gap > same_layer * size_[d] && heavier_here < heavier) heavier = heavier_here, best = i;
    }
    if (best == 0) return {};
    const std::size_t first = order[best];
    const auto middle = order.begin() + static_cast<std::ptrdiff_t>(best);
    return Cut{.axis = axis,
               .at = structured_ ? static_cast<Index>(position_[first][d]) : cells_[first],
               .heavier = heavier,
               .length = (position_[order.back()][d] - position_[order.front()][d]) / size_[d],
               .lower = Cells(order.begin(), middle),
               .upper = Cells(middle, order.end())};
  }

  bool structured_;
  std::vector<Index> cells_;
  std::span<const Index> particles_;
  Index most_;
  std::vector<std::array<double, Dim>> position_;  ///< of the cells: layers, or centres [m]
  std::array<double, Dim> size_;                   ///< mean of the cells, in the same unit
};

}  // namespace

template <int Dim>
bool is_crowded(const Patch<Dim>& patch, Index most) {
  if (patch.count <= most) return false;
  const auto filled = [](const ParticleBin& bin) { return bin.begin < bin.end; };
  const auto cell = [&](const ParticleBin& bin) {  // of whichever body
    return patch.topology.cells[static_cast<std::size_t>(bin.cell)];
  };
  const auto first = std::find_if(patch.bins.begin(), patch.bins.end(), filled);
  return std::any_of(first, patch.bins.end(), [&](const ParticleBin& bin) {
    return filled(bin) && cell(bin) != cell(*first);
  });
}

template <int Dim>
std::vector<PatchSplit> choose_splits(const Mesh<Dim>& mesh, const Partition<Dim>& partition,
                                      Index patch, std::span<const Index> particles, Index most) {
  std::vector<PatchSplit> splits;
  Cells all(particles.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  Cutter<Dim>(mesh, partition.cells(patch), particles, most).cut(std::move(all), patch, splits);
  return splits;
}

template bool is_crowded(const Patch<2>&, Index);
template bool is_crowded(const Patch<3>&, Index);
template std::vector<PatchSplit> choose_splits(const Mesh<2>&, const Partition<2>&, Index,
                                               std::span<const Index>, Index);
template std::vector<PatchSplit> choose_splits(const Mesh<3>&, const Partition<3>&, Index,
                                               std::span<const Index>, Index);

}  // namespace lahar
