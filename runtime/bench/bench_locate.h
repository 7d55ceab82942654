/// \file `lahar bench locate`: how long it takes to find the cells of particles in meshes from
/// tables.
#pragma once

namespace lahar {

struct LocateBenchArguments {
  bool quick = false;  ///< short samples: a look, not a measurement
  int repeats = 5;     ///< samples of each
};

/// Prints a table per kind of cell, all on one thread: particles whose cells are not known (looking
/// into all cells, and by the bounding grid), that have moved to a neighbouring cell (by the grid,
/// and by the walk through neighbours), and that have stayed in their cell (the same, and the stage
/// of a step).
int bench_locate(const LocateBenchArguments& arguments);

}  // namespace lahar
