/// \file Models of `lahar bench` whose steps begin with a linear solve, and soil full of water.
#pragma once

#include "runtime/bench/bench_cases.h"

namespace lahar {

/// A block of elastic material on a floor that holds it, for which gravity acts from the first step
/// on. Newmark's method takes steps of many times what a wave takes through a cell, so that linear
/// systems need a multigrid cycle after the first iterations.
template <int Dim>
Model<Dim> implicit_block(const BlockSize& size);

/// A column of water as high as wide at one side of a tank, twice as wide: projection.
template <int Dim>
Model<Dim> projected_dam(const BlockSize& size);

/// The lattice block (bench_cases.h) as soil that is dry, or full of water.
enum class PoreState { dry, full };
template <int Dim>
Model<Dim> pore_block(const BlockSize& size, PoreState state);

}  // namespace lahar
