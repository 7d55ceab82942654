/// \file The weight of what lies above a place, by columns of particles.
#pragma once

#include <array>
#include <vector>

#include "io/base/team.h"
#include "physics/base/types.h"

namespace lahar {

/// Columns stand on a lattice in plan, one on each cell, and every piece of material belongs to
/// some, so that all weight is counted once. Within a column the weight above a height is that of
/// the mean over the column. Between columns it is linear, with the smaller of the slopes to both
/// sides where these agree in sign, and constant where they do not: exact for layers and grounds
/// that are planes, without overshoot at cliffs. What is above a gap that is higher than a cell
/// does not weigh on what is below it: it is in the air, or something else holds it.
template <int Dim>
class Overburden {
 public:
  static constexpr std::size_t plan = Dim - 1;  ///< horizontal axes

  struct Lattice {
    int up = Dim - 1;     ///< the vertical axis
    double sense = 1;     ///< +1 where the way up is along the axis, else -1
    Vec<Dim> origin;      ///< [m]
    Vec<Dim> width;       ///< [m] of a column; of the vertical axis the height of a cell
    bool aligned = true;  ///< pieces lie in one column each; else they are spread as boxes
  };
  /// A particle: a box in proportion to a cell, around x.
  struct Piece {
    Vec<Dim> x;
    double volume = 0;  ///< [m^3], in two dimensions of a depth of 1 m
    double weight = 0;  ///< [N] of it
  };

  /// All members give their pieces. The result does not depend on who has which. Collective.
  Overburden(const Lattice& lattice, const std::vector<Piece>& own, const Team& team);

  /// Weight per area above x [Pa].
  double at(const Vec<Dim>& x) const;

 private:
  using Column = std::array<Index, plan>;
  /// Going down, from this height on the weight grows at another rate.
  struct Knot {
    Column column;
    double height;  ///< [m]
    double rate;    ///< [Pa/m] that is added to the rate above it
  };
  struct Level {
    double height, weight, rate;  ///< weight above the height, and how it grows below
  };
  void add(const Piece& piece, std::vector<Knot>& to) const;
  double height_of(const Vec<Dim>& x) const { return lattice_.sense * x[lattice_.up]; }
  /// Levels of a column, from the highest; none where there is nothing.
  std::pair<const Level*, const Level*> levels(const Column& column) const;
  double weight_above(const Column& column, double height) const;

  Lattice lattice_;
  std::array<int, plan> across_{};  ///< horizontal axes
  std::vector<Column> columns_;     ///< ascending
  std::vector<Index> first_;        ///< of each in levels_, and one more
  std::vector<Level> levels_;
};

extern template class Overburden<2>;
extern template class Overburden<3>;

}  // namespace lahar
