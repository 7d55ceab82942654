/// \file Particles that come into the model during the run.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// At the beginning of every step that begins in [start, end), each of the cells that holds no
/// particle gets its particles (the generator `inject` of CB-Geo MPM); other cells are passed over.
template <int Dim>
struct Injection {
  std::vector<Index> cells;  ///< in this order
  /// Where several processes have some of the cells each (those of directory_rank()): where in the
  /// list of all each of them is; empty = the position.
  std::vector<Index> position;
  Index all_cells = -1;                  ///< of all processes; -1 = those that are here
  Index per_cell = 0;                    ///< particles of a cell
  std::vector<Vec<Dim>> x;               ///< [m] per_cell for each of the cells, in order
  std::vector<double> volume;            ///< [m^3] of each particle, by cell; over depth_at()
  Vec<Dim> velocity = Vec<Dim>::Zero();  ///< [m/s]
  double start = 0, end = std::numeric_limits<double>::infinity();  ///< [s]
  double filling = 0;          ///< [m^3] that fills all cells once, of all processes
  double flow = 0;             ///< [m^3/s] that the velocity takes out of the cells; 0 = unknown
  std::uint16_t material = 0;  ///< index into Model::materials

  Index n_cells() const { return all_cells < 0 ? static_cast<Index>(cells.size()) : all_cells; }
  Index position_of(std::size_t row) const {
    return position.empty() ? static_cast<Index>(row) : position[row];
  }
  bool active(double time) const { return start <= time && time < end; }
};

/// Ids of injected particles are made without asking anybody else: that of point k of event e in
/// step n is first_injected_id + (n * events + e) * points + k. An *event* is a cell of a
/// generator, counted over all generators in order. Such ids ascend in the order in which CB-Geo
/// MPM creates the particles, and are above all others. The dense ids of output follow from them:
/// they count on from the particles before (InjectionLog).
inline constexpr Index first_injected_id = Index{1} << 62;

/// How events are counted.
struct InjectionCounts {
  Index events = 0;  ///< that one step may have: cells of all generators
  Index points = 0;  ///< of the cell that gets most particles
  Index id(Index step, Index event, Index point) const {
    return first_injected_id + (step * events + event) * points + point;
  }
};

template <int Dim>
InjectionCounts count_injections(const std::vector<Injection<Dim>>& all) {
  InjectionCounts counts;
  for (const auto& one : all) {
    counts.events += one.n_cells();
    counts.points = std::max(counts.points, one.per_cell);
  }
  return counts;
}

/// A cell of a patch into which particles are injected.
struct InjectionCell {
  std::size_t generator;  ///< index into Model::injections
  Index event;
  double volume;  ///< [m^3] of each particle
  Local cell;
  std::size_t first_point;  ///< of the cell in Patch::injection_points
};

}  // namespace lahar
