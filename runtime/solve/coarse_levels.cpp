#include "runtime/solve/coarse_levels.h"

#include <tsl/robin_map.h>

#include <algorithm>

namespace lahar {

namespace {

/// Unknowns that are solved for directly.
constexpr std::size_t most_direct = 400;
/// What is added to the diagonal there, as a share of it: functions of coarse nodes of which few
/// nodes of the mesh are left may depend on each other.
constexpr double least_pivot = 1e-10;

}  // namespace

template <int Dim>
CoarseLevels<Dim>::CoarseLevels(const std::vector<Index>& nodes,
                                const std::vector<CoarseBlock<Dim>>& blocks,
                                const Lattice<Dim>& lattice, int width)
    : width_(width) {
  const auto size = static_cast<std::size_t>(width * width);
  Level level;
  for (const Index node : nodes) level.place.push_back(lattice.place(node));
  level.first.assign(nodes.size() + 1, 0);
  std::size_t row = 0;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const CoarseBlock<Dim>& block = blocks[k];
    while (nodes[row] < block.row) level.first[++row] = level.column.size();
    if (k == 0 || block.row != blocks[k - 1].row || block.column != blocks[k - 1].column) {
      const auto at = std::lower_bound(nodes.begin(), nodes.end(), block.column);
      level.column.push_back(static_cast<Local>(at - nodes.begin()));
      level.blocks.resize(level.blocks.size() + size, 0.0);
    }
    for (std::size_t c = 0; c < size; ++c)
      level.blocks[level.blocks.size() - size + c] += block.values[c];
  }
  while (row < nodes.size()) level.first[++row] = level.column.size();
  levels_.push_back(std::move(level));
  while (levels_.back().nodes() * static_cast<std::size_t>(width) > most_direct) {
    width == 1 ? add_level<1>() : add_level<Dim>();  // ends: places halve, to 0 and 1
  }
  for (Level& any : levels_)
    for (NodeArray* vector : {&any.right_side, &any.solution, &any.residual})
      vector->assign(any.nodes() * node_width, 0.0);
  keep_matrix(levels_.back());
}

template <int Dim>
template <int Width>
void CoarseLevels<Dim>::add_level() {
  Level& fine = levels_.back();
  Level coarse;
  Lattice<Dim> lattice;  // for numbers
  for (const Place& place : fine.place)
    for (std::size_t d = 0; d < Dim; ++d)
      lattice.boxes[d] = std::max(lattice.boxes[d], Index{place[d] / 2 + 1});
  std::vector<Index> numbers;
  fine.weights.assign(fine.nodes() * n_corners, 0.0);
  fine.parents.assign(fine.nodes() * n_corners, -1);
  const auto for_each_corner = [&](std::size_t i, auto body) {
    for (std::size_t c = 0; c < n_corners; ++c) {
      Place corner = fine.box[i];
      double weight = 1;
      for (std::size_t d = 0; d < Dim; ++d) {
        const bool upper = c >> d & 1;
        corner[d] += upper;
        if (fine.place[i][d] % 2 != 0)
          weight *= 0.5;
        else if (upper)
          weight = 0;
      }
      if (weight > 0) body(c, lattice.number(corner), weight);
    }
  };
  for (const Place& place : fine.place) {
    Place box = place;
    for (int& along : box) along /= 2;
    fine.box.push_back(box);
  }
  for (std::size_t i = 0; i < fine.nodes(); ++i)
    for_each_corner(i, [&](std::size_t, Index number, double) { numbers.push_back(number); });
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  tsl::robin_map<Index, Local> position;
  for (const Index number : numbers) {
    position[number] = static_cast<Local>(coarse.place.size());
    coarse.place.push_back(lattice.place(number));
  }
  for (std::size_t i = 0; i < fine.nodes(); ++i)
    for_each_corner(i, [&](std::size_t c, Index number, double weight) {
      fine.weights[i * n_corners + c] = weight;
      fine.parents[i * n_corners + c] = position.at(number);
    });

  int farthest = 0;
  for (std::size_t i = 0; i < fine.nodes(); ++i)
    for (std::size_t k = fine.first[i]; k < fine.first[i + 1]; ++k)
      for (std::size_t d = 0; d < Dim; ++d)
        farthest = std::max(
            farthest,
            std::abs(fine.box[i][d] - fine.box[static_cast<std::size_t>(fine.column[k])][d]));
  CoarseRows<Width, Dim> rows(coarse.nodes(), farthest);
  for (std::size_t i = 0; i < fine.nodes(); ++i) {
    rows.begin_row(fine.box[i]);
    for (std::size_t k = fine.first[i]; k < fine.first[i + 1]; ++k) {
      const auto j = static_cast<std::size_t>(fine.column[k]);
      rows.add(&fine.blocks[k * Width * Width], fine.box[j], &fine.weights[j * n_corners]);
    }
    rows.end_row([&](int c) { return fine.parents[i * n_corners + static_cast<std::size_t>(c)]; },
                 &fine.weights[i * n_corners]);
  }
  coarse.first = {0};
  for (std::size_t row = 0; row < coarse.nodes(); ++row) {
    rows.for_each_block(row, coarse.place[row], [&](const Place& place, const double* block) {
      coarse.column.push_back(position.at(lattice.number(place)));
      coarse.blocks.insert(coarse.blocks.end(), block, block + Width * Width);
    });
    coarse.first.push_back(coarse.column.size());
  }
  levels_.push_back(std::move(coarse));
}

/// Of the coarsest level.
template <int Dim>
void CoarseLevels<Dim>::keep_matrix(const Level& level) {
  const auto n = static_cast<Index>(level.nodes()) * width_;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t i = 0; i < level.nodes(); ++i)
    for (std::size_t k = level.first[i]; k < level.first[i + 1]; ++k)
      for (int a = 0; a < width_; ++a)
        for (int b = 0; b < width_; ++b)
          matrix(static_cast<Index>(i) * width_ + a, Index{level.column[k]} * width_ + b) =
              level.blocks[(k * static_cast<std::size_t>(width_) + static_cast<std::size_t>(a)) *
                               static_cast<std::size_t>(width_) +
                           static_cast<std::size_t>(b)];
  for (Index i = 0; i < n; ++i)
    matrix(i, i) = matrix.row(i).isZero(0) ? 1 : matrix(i, i) * (1 + least_pivot);
  coarsest_.compute(matrix);
  rhs_ = Eigen::VectorXd::Zero(n);
  x_ = rhs_;
}

template <int Dim>
void CoarseLevels<Dim>::smooth(Level& level, bool forwards) const {
  const auto width = static_cast<std::size_t>(width_);
  const std::size_t n = level.nodes();
  for (std::size_t q = 0; q < n; ++q) {
    const std::size_t i = forwards ? q : n - 1 - q;
    std::array<double, Dim> rest{};
    for (std::size_t a = 0; a < width; ++a) rest[a] = level.right_side[i * node_width + a];
    const double* own = nullptr;
    for (std::size_t k = level.first[i]; k < level.first[i + 1]; ++k) {
      const double* const block = &level.blocks[k * width * width];
      const auto j = static_cast<std::size_t>(level.column[k]);
      if (j == i) {
        own = block;
        continue;
      }
      const double* const x = &level.solution[j * node_width];
      for (std::size_t a = 0; a < width; ++a)
        for (std::size_t b = 0; b < width; ++b) rest[a] -= block[a * width + b] * x[b];
    }
    if (!own) continue;
    double* const x = &level.solution[i * node_width];
    for (std::size_t s = 0; s < width; ++s) {
      const std::size_t a = forwards ? s : width - 1 - s;
      if (!(own[a * width + a] > 0)) continue;
      double sum = rest[a];
      for (std::size_t b = 0; b < width; ++b)
        if (b != a) sum -= own[a * width + b] * x[b];
      x[a] = sum / own[a * width + a];
    }
  }
}

template <int Dim>
void CoarseLevels<Dim>::find_residual(Level& level) const {
  const auto width = static_cast<std::size_t>(width_);
  for (std::size_t i = 0; i < level.nodes(); ++i) {
    std::array<double, Dim> rest{};
    for (std::size_t a = 0; a < width; ++a) rest[a] = level.right_side[i * node_width + a];
    for (std::size_t k = level.first[i]; k < level.first[i + 1]; ++k) {
      const double* const block = &level.blocks[k * width * width];
      const double* const x =
          &level.solution[static_cast<std::size_t>(level.column[k]) * node_width];
      for (std::size_t a = 0; a < width; ++a)
        for (std::size_t b = 0; b < width; ++b) rest[a] -= block[a * width + b] * x[b];
    }
    for (std::size_t a = 0; a < width; ++a) level.residual[i * node_width + a] = rest[a];
  }
}

template <int Dim>
void CoarseLevels<Dim>::solve_coarsest() {
  Level& level = levels_.back();
  const auto at = [&](Index i) {
    return static_cast<std::size_t>(i / width_ * node_width + i % width_);
  };
  for (Index i = 0; i < rhs_.size(); ++i) rhs_[i] = level.right_side[at(i)];
  x_ = coarsest_.solve(rhs_);
  for (Index i = 0; i < rhs_.size(); ++i) level.solution[at(i)] = x_[i];
}

template <int Dim>
void CoarseLevels<Dim>::cycle(std::size_t number) {
  if (number + 1 == levels_.size()) return solve_coarsest();
  Level& fine = levels_[number];
  Level& coarse = levels_[number + 1];
  std::fill(fine.solution.begin(), fine.solution.end(), 0.0);
  smooth(fine, true);
  find_residual(fine);
  std::fill(coarse.right_side.begin(), coarse.right_side.end(), 0.0);
  const auto for_each_parent = [&](auto body) {
    for (std::size_t k = 0; k < fine.parents.size(); ++k)
      if (fine.parents[k] >= 0)
        for (std::size_t a = 0; a < static_cast<std::size_t>(width_); ++a)
          body(k / n_corners * node_width + a,
               static_cast<std::size_t>(fine.parents[k]) * node_width + a, fine.weights[k]);
  };
  for_each_parent([&](std::size_t from, std::size_t to, double weight) {
    coarse.right_side[to] += weight * fine.residual[from];
  });
  cycle(number + 1);
  for_each_parent([&](std::size_t to, std::size_t from, double weight) {
    fine.solution[to] += weight * coarse.solution[from];
  });
  smooth(fine, false);
}

template class CoarseLevels<2>;
template class CoarseLevels<3>;

}  // namespace lahar
