#include <algorithm>
#include <cstring>

#include "physics/kernels/solver.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

LAHAR_INLINE NodeVector load_block(const double* numbers) {
  return load<NodeVector>(numbers);
}
LAHAR_INLINE NodeVector load_block(const float* numbers) {
  using Floats [[gnu::vector_size(node_width * sizeof(float))]] = float;
  Floats floats;
  std::memcpy(&floats, numbers, sizeof floats);
  return NodeVector::of(__builtin_convertvector(floats, decltype(NodeVector::v)));
}

/// The product of a row of blocks with m, {n, 0}.
template <int Width>
class RowProduct;

template <>
class RowProduct<1> {
 public:
  template <class Number>
  LAHAR_INLINE void add(const Number* block, const NodeVector& m) {
    sum_ += NodeVector(static_cast<double>(*block)) * m;
  }
  LAHAR_INLINE NodeVector value() const { return sum_; }

 private:
  NodeVector sum_{0.0};
};

/// Both rows of a block are one vector.
template <>
class RowProduct<2> {
 public:
  template <class Number>
  LAHAR_INLINE void add(const Number* block, const NodeVector& m) {
    sum_ += load_block(block) * NodeVector::of(__builtin_shufflevector(m.v, m.v, 0, 1, 0, 1));
  }
  LAHAR_INLINE NodeVector value() const {
    const NodeVector zero(0.0);
    return NodeVector::of(__builtin_shufflevector(sum_.v, zero.v, 0, 2, 4, 4)) +
           NodeVector::of(__builtin_shufflevector(sum_.v, zero.v, 1, 3, 4, 4));
  }

 private:
  NodeVector sum_{0.0};
};

/// A load of one row of a block takes a number of another row too. In that lane m is zero.
template <>
class RowProduct<3> {
 public:
  template <class Number>
  LAHAR_INLINE void add(const Number* block, const NodeVector& m) {
    x_ += load_block(block) * m;
    y_ += load_block(block + 3) * m;
    z_ += load_block(block + 5) * NodeVector::of(__builtin_shufflevector(m.v, m.v, 3, 0, 1, 2));
  }
  LAHAR_INLINE NodeVector value() const {
    const double values[node_width] = {reduce(x_), reduce(y_), reduce(z_), 0.0};
    return load<NodeVector>(values);
  }

 private:
  NodeVector x_{0.0}, y_{0.0}, z_{0.0};
};

/// {diagonal of a row, 1}; zero where the patch has no row.
template <int Dim>
NodeVector diagonal_of(const NodalSystem<Dim>& system, std::size_t row) {
  double values[node_width] = {};
  for (std::size_t k = system.first[row]; k < system.first[row + 1]; ++k) {
    values[mass_lane] = 1;
    if (static_cast<std::size_t>(system.column[k]) != row) continue;
    const auto width = static_cast<std::size_t>(system.width());
    for (std::size_t d = 0; d < width; ++d)
      values[d] = system.blocks[k * width * width + d * (width + 1)];
  }
  return load<NodeVector>(values);
}

template <int Width, int Dim, class Number>
void add_products(Patch<Dim>& patch, const StepContext<Dim>& round,
                  const std::vector<Number>& blocks, const double* m) {
  constexpr std::size_t block_size = Width * Width;
  const NodalSystem<Dim>& system = patch.system;
  double* const products = patch.own_sums(NodeSum::product, round.step);
  double* const diagonals = patch.own_sums(NodeSum::diagonal, round.step);
  const bool is_first = round.step == system.solver.first_round;
  const bool has_rows = !system.column.empty();
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) {
      const auto row = static_cast<std::size_t>(i);
      const auto at = static_cast<std::ptrdiff_t>(i) * sum_stride;
      RowProduct<Width> product;
      if (has_rows) {
        const std::size_t last = system.first[row + 1];
        const Number* block = blocks.data() + system.first[row] * block_size;
        for (std::size_t k = system.first[row]; k < last; ++k, block += block_size)
          product.add(block, load<NodeVector>(m + static_cast<std::ptrdiff_t>(system.column[k]) *
                                                      node_width));
      }
      store(product.value(), products + at);
      if (is_first) store(has_rows ? diagonal_of(system, row) : NodeVector(0.0), diagonals + at);
    }
}

template <int Width, int Dim>
void multiply(Patch<Dim>& patch, const StepContext<Dim>& round) {
  const NodalSystem<Dim>& system = patch.system;
  const SolverVectors& solver = system.solver;
  switch (solver.multiplied) {
    case SolverOrder::Factor::d:  // smoothing
      return add_products<Width>(patch, round, system.rough_blocks, solver.d.data());
    case SolverOrder::Factor::z:
      return add_products<Width>(patch, round, system.blocks, solver.z.data());
    default:
      return add_products<Width>(patch, round, system.blocks, solver.factor.data());
  }
}

}  // namespace

template <int Dim>
void add_product(Patch<Dim>& patch, const StepContext<Dim>& round) {
  const bool multiplies = patch.system.solver.multiplied != SolverOrder::Factor::none;
  patch.contributes[static_cast<std::size_t>(round.step % 2)] =
      multiplies && !patch.system.column.empty();
  if (!multiplies || patch.active_nodes.empty()) return;
  if (patch.system.is_scalar)
    multiply<1>(patch, round);
  else
    multiply<Dim>(patch, round);
}

template void add_product<2>(Patch<2>&, const StepContext<2>&);
template void add_product<3>(Patch<3>&, const StepContext<3>&);

}  // namespace lahar
