#include "physics/kernels/coarse_nodes.h"

#include <algorithm>
#include <cstdlib>

#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

template <int Dim>
constexpr auto n_corners = static_cast<std::size_t>(corners<Dim>);

template <int Dim>
bool is_free(const SolverVectors& solver, Local node) {
  const double* const of = at(solver.inverse, node);
  return std::any_of(of, of + Dim, [](double value) { return value != 0; });
}

/// Call body(node) for the active nodes that have a free unknown.
template <int Dim, class Body>
void for_each_free(const Patch<Dim>& patch, Body body) {
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i)
      if (is_free<Dim>(patch.system.solver, i)) body(i);
}

/// Finds the turned node at a node, for nodes in ascending order.
template <int Dim>
class Turned {
 public:
  using Node = typename NodalSystem<Dim>::TurnedNode;
  explicit Turned(const NodalSystem<Dim>& system)
      : next_(system.turned.data()), end_(next_ + system.turned.size()) {}
  const Node* find(Local node) {
    while (next_ != end_ && next_->node < node) ++next_;
    return next_ != end_ && next_->node == node ? next_ : nullptr;
  }

 private:
  const Node *next_, *end_;
};

template <int Dim>
NodeVector product(const Eigen::Matrix<double, Dim, Dim>& axes, const NodeVector& vector) {
  double values[node_width] = {};
  for (int a = 0; a < Dim; ++a)
    for (int b = 0; b < Dim; ++b) values[a] += axes(a, b) * vector[b];
  return load<NodeVector>(values);
}

template <int Dim>
void set_weights(double* weights, const Vec<Dim>& point, const Lattice<Dim>& lattice,
                 const typename Lattice<Dim>::Place& box) {
  for (int c = 0; c < corners<Dim>; ++c) {
    double weight = 1;
    for (std::size_t d = 0; d < Dim; ++d) {
      const int a = static_cast<int>(d);
      const double at = (point[a] - lattice.origin[a]) / lattice.spacing[a] - box[d];
      const double upper = std::clamp(at, 0.0, 1.0);
      weight *= c >> d & 1 ? upper : 1 - upper;
    }
    weights[c] = std::abs(weight) < 1e-12 ? 0 : weight;
  }
}

/// Block k of a patch between mesh axes, without what is held.
template <int Width, int Dim>
class FreeBlocks {
 public:
  using Block = Eigen::Matrix<double, Width, Width, Eigen::RowMajor>;
  explicit FreeBlocks(const NodalSystem<Dim>& system) : system_(system) {
    if (system.is_scalar || system.turned.empty()) return;
    turned_.assign(system.first.size() - 1, nullptr);
    for (const auto& node : system.turned) turned_[static_cast<std::size_t>(node.node)] = &node;
  }
  Block of(std::size_t k, Local row, Local column) const {
    Block block = Eigen::Map<const Block>(&system_.blocks[k * Width * Width]);
    const double* const rows = at(system_.solver.inverse, row);
    const double* const columns = at(system_.solver.inverse, column);
    for (int a = 0; a < Width; ++a)
      for (int b = 0; b < Width; ++b)
        if (rows[a] == 0 || columns[b] == 0) block(a, b) = 0;
    if constexpr (Width == Dim) {
      if (const auto* node = turned(row)) block = node->axes * block;
      if (const auto* node = turned(column)) block = block * node->axes.transpose();
    }
    return block;
  }

 private:
  const typename NodalSystem<Dim>::TurnedNode* turned(Local node) const {
    return turned_.empty() ? nullptr : turned_[static_cast<std::size_t>(node)];
  }

  const NodalSystem<Dim>& system_;
  std::vector<const typename NodalSystem<Dim>::TurnedNode*> turned_;
};

/// Cells of graded meshes may be larger than boxes: so many boxes apart may nodes of a block be,
/// and so many coarse nodes may a patch have per node.
constexpr int most_boxes_apart = 3;
constexpr double most_coarse_nodes = 16;

template <int Width, int Dim>
bool add_blocks(const Patch<Dim>& patch, const CoarsePlaces<Dim>& places,
                const Lattice<Dim>& lattice, std::vector<CoarseBlock<Dim>>& blocks) {
  using Place = typename Lattice<Dim>::Place;
  const NodalSystem<Dim>& system = patch.system;
  const CoarseNodes& coarse = system.solver.coarse;
  const std::vector<Place>& box = places.box;
  int farthest = 0;
  const auto for_each_column = [&](Local i, auto body) {
    const auto row = static_cast<std::size_t>(i);
    for (std::size_t k = system.first[row]; k < system.first[row + 1]; ++k)
      if (is_free<Dim>(system.solver, system.column[k])) body(k, system.column[k]);
  };
  for_each_free(patch, [&](Local i) {
    for_each_column(i, [&](std::size_t, Local j) {
      for (std::size_t d = 0; d < Dim; ++d)
        farthest = std::max(farthest, std::abs(box[static_cast<std::size_t>(i)][d] -
                                               box[static_cast<std::size_t>(j)][d]));
    });
  });
  if (farthest > most_boxes_apart) return false;
  const std::vector<Index>& numbers = places.numbers;
  CoarseRows<Width, Dim> rows(numbers.size(), farthest);
  const FreeBlocks<Width, Dim> free(system);
  for_each_free(patch, [&](Local i) {
    const auto node = static_cast<std::size_t>(i);
    rows.begin_row(box[node]);
    for_each_column(i, [&](std::size_t k, Local j) {
      const auto block = free.of(k, i, j);
      const auto column = static_cast<std::size_t>(j);
      rows.add(block.data(), box[column], &coarse.weights[column * n_corners<Dim>]);
    });
    rows.end_row(
        [&](int c) { return coarse.first[node] + coarse.corner[static_cast<std::size_t>(c)]; },
        &coarse.weights[node * n_corners<Dim>]);
  });
  for (std::size_t row = 0; row < numbers.size(); ++row) {
    if (numbers[row] < 0) continue;
    rows.for_each_block(
        row, lattice.place(numbers[row]), [&](const Place& of, const double* block) {
          CoarseBlock<Dim> entry{numbers[row], lattice.number(of), patch.topology.patch, {}};
          std::copy_n(block, Width * Width, entry.values.begin());
          blocks.push_back(entry);
        });
  }
  return true;
}

}  // namespace

template <int Dim>
bool place_on_lattice(Patch<Dim>& patch, const Mesh<Dim>& mesh, const Lattice<Dim>& lattice,
                      CoarsePlaces<Dim>& places) {
  using Place = typename Lattice<Dim>::Place;
  CoarseNodes& coarse = patch.system.solver.coarse;
  const auto n = static_cast<std::size_t>(patch.n_nodes());
  coarse = {};
  Place low, high;
  low.fill(std::numeric_limits<int>::max());
  high.fill(-1);
  std::vector<Index>& numbers = places.numbers;
  std::vector<Place>& box = places.box;
  box.assign(n, Place{});
  for_each_free(patch, [&](Local i) {
    const auto node = static_cast<std::size_t>(i);
    box[node] = lattice.box_of(mesh.node(patch.topology.nodes[node]));
    for (std::size_t d = 0; d < Dim; ++d) {
      low[d] = std::min(low[d], box[node][d]);
      high[d] = std::max(high[d], box[node][d] + 1);
    }
  });
  numbers.clear();
  if (high[0] < 0) return true;
  Place counts;
  double all = 1;
  for (std::size_t d = 0; d < Dim; ++d) {
    counts[d] = high[d] - low[d] + 1;
    all *= counts[d];
  }
  if (all > most_coarse_nodes * static_cast<double>(n)) return false;
  const auto local = [&](const Place& place) {
    Local number = 0;
    for (std::size_t d = Dim; d-- > 0;) number = number * counts[d] + place[d] - low[d];
    return number;
  };
  for (std::size_t c = 0; c < n_corners<Dim>; ++c) {
    Place corner = low;
    for (std::size_t d = 0; d < Dim; ++d) corner[d] += static_cast<int>(c >> d & 1);
    coarse.corner[c] = local(corner);
  }
  coarse.first.assign(n, 0);
  coarse.weights.assign(n * n_corners<Dim>, 0.0);
  numbers.assign(static_cast<std::size_t>(all), -1);
  coarse.sums.assign(numbers.size() * node_width, 0.0);
  for_each_free(patch, [&](Local i) {
    const auto node = static_cast<std::size_t>(i);
    double* const weights = &coarse.weights[node * n_corners<Dim>];
    coarse.first[node] = local(box[node]);
    set_weights<Dim>(weights, mesh.node(patch.topology.nodes[node]), lattice, box[node]);
    for (std::size_t c = 0; c < n_corners<Dim>; ++c) {
      if (weights[c] == 0) continue;
      Place corner = box[node];
      for (std::size_t d = 0; d < Dim; ++d) corner[d] += static_cast<int>(c >> d & 1);
      numbers[static_cast<std::size_t>(coarse.first[node] + coarse.corner[c])] =
          lattice.number(corner);
    }
  });
  return true;
}

template <int Dim>
bool add_coarse_blocks(const Patch<Dim>& patch, const CoarsePlaces<Dim>& places,
                       const Lattice<Dim>& lattice, std::vector<CoarseBlock<Dim>>& blocks) {
  if (places.numbers.empty() || patch.system.column.empty()) return true;
  return patch.system.is_scalar ? add_blocks<1>(patch, places, lattice, blocks)
                                : add_blocks<Dim>(patch, places, lattice, blocks);
}

template <int Dim>
void restrict_residual(Patch<Dim>& patch) {
  SolverVectors& solver = patch.system.solver;
  CoarseNodes& coarse = solver.coarse;
  std::fill(coarse.sums.begin(), coarse.sums.end(), 0.0);
  Turned<Dim> turned(patch.system);
  for_each_free(patch, [&](Local i) {
    if (at(solver.inverse, i)[mass_lane] == 0) return;
    const auto node = static_cast<std::size_t>(i);
    NodeVector t = load<NodeVector>(at(solver.t, i));
    if (const auto* along = turned.find(i)) t = product<Dim>(along->axes, t);
    const double* const weights = &coarse.weights[node * n_corners<Dim>];
    for (std::size_t c = 0; c < n_corners<Dim>; ++c) {
      double* const to = at(coarse.sums, coarse.first[node] + coarse.corner[c]);
      store(load<NodeVector>(to) + NodeVector(weights[c]) * t, to);
    }
  });
}

template <int Dim>
void prolong(Patch<Dim>& patch, const double* of_coarse_nodes) {
  SolverVectors& solver = patch.system.solver;
  const CoarseNodes& coarse = solver.coarse;
  Turned<Dim> turned(patch.system);
  const NodeVector zero(0.0);
  for_each_free(patch, [&](Local i) {
    const auto node = static_cast<std::size_t>(i);
    const double* const weights = &coarse.weights[node * n_corners<Dim>];
    NodeVector sum(0.0);
    for (std::size_t c = 0; c < n_corners<Dim>; ++c) {
      if (weights[c] == 0) continue;
      const Index number =
          coarse.number[static_cast<std::size_t>(coarse.first[node] + coarse.corner[c])];
      if (number < 0) continue;
      sum += NodeVector(weights[c]) * load<NodeVector>(of_coarse_nodes + number * node_width);
    }
    if (const auto* along = turned.find(i)) sum = product<Dim>(along->axes.transpose(), sum);
    const NodeVector inverse = load<NodeVector>(at(solver.inverse, i));
    const NodeVector change = NodeVector::of(inverse.v != zero.v ? sum.v : zero.v);
    store(change, at(solver.d, i));
  });
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template bool place_on_lattice<Dim>(Patch<Dim>&, const Mesh<Dim>&, const Lattice<Dim>&,    \
                                      CoarsePlaces<Dim>&);                                   \
  template bool add_coarse_blocks<Dim>(const Patch<Dim>&, const CoarsePlaces<Dim>&,          \
                                       const Lattice<Dim>&, std::vector<CoarseBlock<Dim>>&); \
  template void restrict_residual<Dim>(Patch<Dim>&);                                         \
  template void prolong<Dim>(Patch<Dim>&, const double*);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
