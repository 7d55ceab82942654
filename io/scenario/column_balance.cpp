#include "io/scenario/column_balance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "physics/basis/axis_functions.h"

namespace lahar {

namespace {

/// Level ground takes smaller changes, in parts of the weight of a cell [-].
constexpr double most_change = 0.5;

/// Linear functions of the four nodes around a cell.
void linear_functions(double s, Scalar (&w)[axis_nodes]) {
  for (int k = 0; k < axis_nodes; ++k) w[k] = Scalar(std::max(0.0, 1.0 - std::abs(s - (k - 1))));
}

/// CPDI: means of linear functions at the ends of the domain; a box has not turned.
void domain_functions(double s, double r, Scalar (&w)[axis_nodes], Scalar (&dw)[axis_nodes]) {
  Scalar low[axis_nodes], high[axis_nodes];
  linear_functions(s - r, low);
  linear_functions(s + r, high);
  for (int k = 0; k < axis_nodes; ++k) {
    w[k] = 0.5 * (low[k] + high[k]);
    dw[k] = (0.5 / r) * (high[k] - low[k]);
  }
}

/// Functions at a row: those of the four nodes from `first` on.
struct RowFunctions {
  int first = 0;
  std::array<double, axis_nodes> value{}, slope{};  ///< slopes in 1 / cells
};

RowFunctions functions_at(const ColumnRow& row, int cells, ShapeFunctions functions) {
  const int cell = std::clamp(static_cast<int>(std::floor(row.height)), 0, cells - 1);
  const Scalar s(row.height - cell), r(std::clamp(row.half, 1e-6, 1.0));
  Scalar w[axis_nodes], dw[axis_nodes];
  switch (functions) {
    case ShapeFunctions::quadratic_spline:
      QuadraticSpline::at(s, w);
      QuadraticSpline::slopes(s, dw);
      break;
    case ShapeFunctions::cubic_spline:
      CubicSpline::at(s, w);
      CubicSpline::slopes(s, dw);
      break;
    case ShapeFunctions::gimp:
    case ShapeFunctions::uniform_gimp:
      GimpFunction::at(s, r, w);
      GimpFunction::slopes(s, r, dw);
      break;
    case ShapeFunctions::cpdi:
    case ShapeFunctions::cpdi2:
      domain_functions(s[0], r[0], w, dw);
      break;
    case ShapeFunctions::element:
      linear_functions(s[0], w);
      dw[0] = dw[3] = Scalar(0.0);
      dw[1] = Scalar(-1.0);
      dw[2] = Scalar(1.0);
      break;
  }
  for (auto* of : {&w, &dw}) {
    if (cell == 0) fold_first(*of);
    if (cell == cells - 1) fold_last(*of);
  }
  RowFunctions found{.first = cell - 1};
  for (std::size_t k = 0; k < axis_nodes; ++k) {
    found.value[k] = w[k][0];
    found.slope[k] = dw[k][0];
  }
  return found;
}

/// A symmetric matrix of which each row has three entries beside its diagonal; solved in place.
class Banded {
 public:
  static constexpr int width = axis_nodes;
  explicit Banded(int n) : n_(n), a_(static_cast<std::size_t>(n) * width, 0.0) {}
  /// Entry (i, i - k).
  double& at(int i, int k) { return a_[static_cast<std::size_t>(i * width + k)]; }

  /// Cholesky's method; rows that follow from others give zero.
  void solve(std::vector<double>& x) {
    constexpr double least = 1e-10;  // of a row's diagonal
    for (int i = 0; i < n_; ++i) {
      const double diagonal = at(i, 0);
      for (int j = std::max(0, i - width + 1); j <= i; ++j) {
        double sum = at(i, i - j);
        for (int k = std::max(0, i - width + 1); k < j; ++k)
          if (j - k < width) sum -= at(i, i - k) * at(j, j - k);
        if (j < i)
          at(i, i - j) = at(j, 0) > 0 ? sum / at(j, 0) : 0.0;
        else
          at(i, 0) = sum > least * diagonal ? std::sqrt(sum) : 0.0;
      }
    }
    for (int i = 0; i < n_; ++i) {
      double sum = x[static_cast<std::size_t>(i)];
      for (int j = std::max(0, i - width + 1); j < i; ++j)
        sum -= at(i, i - j) * x[static_cast<std::size_t>(j)];
      x[static_cast<std::size_t>(i)] = at(i, 0) > 0 ? sum / at(i, 0) : 0.0;
    }
    for (int i = n_ - 1; i >= 0; --i) {
      double sum = x[static_cast<std::size_t>(i)];
      for (int j = i + 1; j < std::min(n_, i + width); ++j)
        sum -= at(j, j - i) * x[static_cast<std::size_t>(j)];
      x[static_cast<std::size_t>(i)] = at(i, 0) > 0 ? sum / at(i, 0) : 0.0;
    }
  }

 private:
  int n_;
  std::vector<double> a_;
};

}  // namespace

std::vector<double> balance_column(std::span<const ColumnRow> rows, double cell, int cells,
                                   ShapeFunctions functions) {
  std::vector<double> change(rows.size(), 0.0);
  if (rows.empty()) return change;
  std::vector<RowFunctions> at;
  for (const ColumnRow& row : rows) at.push_back(functions_at(row, cells, functions));
  // Nodes from the upper one of the lowest cell on: what lies below holds the column.
  const int lowest = at.front().first + 2, nodes = at.back().first + axis_nodes - lowest;
  double heaviest = 0;
  for (const ColumnRow& row : rows) heaviest = std::max(heaviest, row.weight / row.volume);
  // What a stress changes by is measured by it, so that thin rows at the surface get no tension.
  const auto share_of = [&](const ColumnRow& row) {
    const double share = std::clamp(row.stress / (heaviest * cell), 0.0, 1.0);
    return share * share;
  };
  Banded matrix(nodes);
  std::vector<double> force(static_cast<std::size_t>(nodes), 0.0);
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (int a = 0; a < axis_nodes; ++a) {
      const int i = at[k].first + a - lowest;
      if (i < 0) continue;
      const double slope = at[k].slope[static_cast<std::size_t>(a)] / cell;
      force[static_cast<std::size_t>(i)] +=
          rows[k].weight * at[k].value[static_cast<std::size_t>(a)] -
          rows[k].volume * rows[k].stress * slope;
      for (int b = 0; b <= a; ++b)
        if (at[k].first + b - lowest >= 0)
          matrix.at(i, a - b) += share_of(rows[k]) * rows[k].volume * slope *
                                 at[k].slope[static_cast<std::size_t>(b)] / cell;
    }
  matrix.solve(force);  // what is missing upwards
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (int a = 0; a < axis_nodes; ++a)
      if (const int i = at[k].first + a - lowest; i >= 0)
        change[k] += share_of(rows[k]) * force[static_cast<std::size_t>(i)] *
                     at[k].slope[static_cast<std::size_t>(a)] / cell;
  const auto is_large = [&](double one) { return std::abs(one) > most_change * heaviest * cell; };
  if (std::any_of(change.begin(), change.end(), is_large))
    std::fill(change.begin(), change.end(), 0.0);
  return change;
}

}  // namespace lahar
