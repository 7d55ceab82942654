/// \file The models that `lahar bench` runs, and what is measured with them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "physics/model/model.h"
#include "runtime/step/simulation.h"

namespace lahar {

/// Steps of a run that ends when the measurement does; a history row every 1 % of it is none.
inline constexpr Index endless = 1'000'000'000'000;

/// A square or cube of linear elastic material in a larger structured mesh of cells of 1 m: 4 x 4
/// particles per cell in 2D, 2 x 2 x 2 in 3D, USL. The material is so soft that it moves as it was
/// thrown: what a step costs does not depend on stiffness, and nodes of little mass at an irregular
/// rim, with which USL is unstable, need no care.
struct BlockSize {
  Index cells;           ///< along an edge of the block
  Index mesh_cells = 0;  ///< along an edge of the mesh; 0 = what a flying block needs
  double filled = 1;     ///< share of the block, along x, that has particles
  Index particles(int dim) const;
};

/// In lattice order: it moves so slowly that no particle changes its cell.
template <int Dim>
Model<Dim> lattice_block(const BlockSize& size);

/// Two halves of it, one on the other, that meet with friction or, `bodies` 1, are one body; MUSL
/// and quadratic splines.
template <int Dim>
Model<Dim> stacked_block(const BlockSize& size, int bodies);

/// The same in a mesh of other elements with nodes in a table; particles lie a little beside the
/// lattice, so that none is on the edge of two triangles.
template <int Dim>
Model<Dim> element_block(const BlockSize& size, Element element);

/// After large deformation: positions are those of deformed(), and the body flies along no axis, so
/// fast that `crossings_per_step` of the particles change their cell per step. It is in the mesh
/// for `flight_steps`.
template <int Dim>
Model<Dim> deformed_block(const BlockSize& size);
inline constexpr double crossings_per_step = 0.01;
inline constexpr Index flight_steps = 10'000;

/// The deformation, for a block of edge `edge` [m] about the origin: circles turn in their planes,
/// the inner ones by more than a full turn and the outermost not at all, so that the block stays in
/// its outline. In 2D the whole and then each quarter turns, in 3D the whole about one axis and
/// then about another. Lengths along and across the circles do not change, so neither do volumes.
template <int Dim>
Vec<Dim> deformed(const Vec<Dim>& x, double edge);

/// The lattice block of Mohr-Coulomb soil under pressure, sheared as a whole: at yield from the
/// first step on, or far from it.
enum class SoilState { elastic, yielding };
Model<3> soil_block(const BlockSize& size, SoilState state);

/// Soil that stands as a column or a cliff at first and runs out, as users compute it: Mohr-Coulomb
/// with MUSL, splines and gaps. In 2D sand without cohesion, in 3D soil with a little.
template <int Dim>
Model<Dim> collapse();
/// From its beginning, steps in which it falls.
template <int Dim>
inline constexpr Index collapse_steps = Dim == 2 ? 6000 : 300;
template <int Dim>
inline constexpr Index collapse_particles = Dim == 2 ? 1600 : 8000;

/// A block of length x length/2 x length/2 cells at one end of a mesh that is twice as long, which
/// it crosses to the other end in sliding_steps() as it was thrown, or in which it rests; 2 x 2 x 2
/// particles per cell.
Model<3> sliding_block(Index length, bool moves);
Index sliding_steps(Index length);
Index sliding_particles(Index length);

/// The plate of examples/plate-with-hole.json, all 40,155 particles; overrides as for --set.
Model<2> bench_plate(const std::vector<std::string>& overrides);
/// Its mesh as a table of cells that are no boxes: inner nodes are moved by up to 15 % of a cell.
Model<2> bench_plate_isoparametric();

/// One process of a measurement: a model and how it is run.
struct BenchJob {
  std::string name;
  std::function<AnyModel()> model;
  ExecutionOptions execution;
  int copies = 1;        ///< of the process, started together
  double particles = 0;  ///< about, for the memory that is needed
  double goal = 0;       ///< [ns] at most per particle-step; 0 = none
  Index steps = 0;       ///< of a sample; 0 = by time
  Index life = 0;        ///< steps after which the model has to be made anew; 0 = never
  bool output = false;   ///< write history and frames
  bool traced = false;   ///< record all that tasks do
};

/// Time per particle-step of job `over` divided by that of job `under`.
struct BenchRatio {
  std::string name;
  std::size_t over, under;
  double at_most = 0, at_least = 0;  ///< goals; 0 = none
};

/// Jobs whose samples are taken in turn, so that a busy moment of the machine hits all of them.
struct BenchPlan {
  enum class Kind {
    time,     ///< per particle-step
    memory,   ///< beyond that of the last job, per particle of the others
    start_up  ///< from the model's description to the first step
  } kind = Kind::time;
  std::string name, title;
  std::vector<BenchJob> jobs = {};
  std::vector<BenchRatio> ratios = {};
  bool large = false;        ///< only if named, or with --large
  int threads = 1;           ///< that it needs at least
  bool stages = false;       ///< the report lists the stages
  double bound_at_most = 0;  ///< goal of the first job's time over that of the bandwidth; 0 = none
  bool solves = false;       ///< steps of the first job begin with a linear solve, by iterations

  double bytes() const;               ///< [B] needed at a time, about
  double seconds(int repeats) const;  ///< [s] needed, very roughly
};

/// Every case, in the order of the report; `threads` is the largest number to use.
std::vector<BenchPlan> bench_plans(int threads);

/// Those named, or the default ones (`large`: all) that `threads` suffice for. Throws InputError
/// with a problem for each name that is unknown or needs more threads.
std::vector<BenchPlan> choose_plans(std::vector<BenchPlan> all,
                                    const std::vector<std::string>& names, bool large, int threads);

/// Throws InputError naming the cases that need more than `available` [B].
void check_bench_memory(const std::vector<BenchPlan>& plans, double available);

}  // namespace lahar
