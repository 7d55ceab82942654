/// \file One patch: its particles, its node arrays, and what the kernels of a step need.
#pragma once

#include <tsl/robin_map.h>

#include <limits>
#include <string>
#include <vector>

#include "physics/columns.h"
#include "physics/model.h"
#include "physics/particles.h"
#include "physics/partition.h"

namespace lahar {

/// Consecutive particles of one cell and one material: what a kernel accumulates in registers.
struct Run {
  Local cell;
  Local begin, end;        ///< particles [begin, end)
  std::uint16_t material;  ///< index into the materials
  bool loaded;             ///< some particle has a load or a prescribed velocity
};

/// Node quantities that neighbours sum. Each is a private partial sum of this patch, exchanged once
/// per step where the scheme says so.
enum class NodeSum : int { mass_momentum, force, momentum, pressure };
inline constexpr int n_node_sums = 4;
/// Doubles per node: {m, m v}, {f}, {m v} (MUSL's second mapping), {m p}; padded to whole vectors.
template <int Dim>
inline constexpr std::array<int, n_node_sums> node_sum_width{4, Dim == 2 ? 2 : 4, Dim == 2 ? 2 : 4,
                                                             1};

/// What one patch contributes to a row of history.csv (HistoryRow), reset after each row.
struct PatchWork {
  double internal = 0, external = 0, damping = 0;  ///< [J]
  PatchWork& operator+=(const PatchWork& other) {
    internal += other.internal;
    external += other.external;
    damping += other.damping;
    return *this;
  }
};

/// Something that a kernel found wrong with a particle or node; kernels mark, the step reports.
struct Mark {
  enum class Kind { none, left_mesh, not_finite, volume, moved_too_far } kind = Kind::none;
  Index particle = -1;
  std::array<double, 3> position{};
  std::array<double, 3> velocity{};
  Index count = 0;  ///< particles marked in this patch and step
};

/// What all patches share and kernels only read.
template <int Dim>
struct StepContext {
  const Model<Dim>* model = nullptr;
  const Partition<Dim>* partition = nullptr;
  Index step = 0;   ///< updates done before this one
  double time = 0;  ///< [s] at the beginning of the step
  double dt = 0;    ///< [s]
};

template <int Dim>
struct Patch {
  PatchTopology<Dim> topology;
  Particles<Dim> particles;
  std::vector<Run> runs;
  bool runs_valid = false;
  bool idle = false;  ///< no particles and all partial sums zero: nothing to do until some arrive

  // Geometry of the local cells.
  bool cartesian = true;
  std::vector<std::array<double, 2 * Dim>> box;  ///< Cartesian: centre, edge lengths [m]
  std::vector<Vec<Dim>> node_position;           ///< isoparametric only [m]
  double smallest_cell = 0;                      ///< [m] least of cell_size
  std::vector<double> cell_size;                 ///< [m], for the time step limit
  tsl::robin_map<Index, Local> local_cell;       ///< local number of a global cell id

  // Node arrays, by local node.
  std::array<std::vector<double>, n_node_sums> partial;  ///< private sums, read by neighbours
  std::array<std::vector<double>, n_node_sums> total;    ///< sums over all patches
  std::vector<double> velocity, acceleration;            ///< Dim per node [m/s], [m/s^2]
  std::vector<const double*>
      neighbour_partial[n_node_sums];  ///< by position in topology.neighbours

  // Constraints and loads of the local nodes.
  struct FixedVelocity {
    Local node;
    int dir;
    double velocity;  ///< [m/s]
  };
  std::vector<FixedVelocity> fixed;  ///< one per node and direction
  struct PointForce {
    Local node;
    int dir;
    double force;  ///< [N]
    int function;  ///< -1 = constant
  };
  std::vector<PointForce> forces;

  // Particles on their way to neighbours, by position in topology.neighbours.
  struct Outbox {
    Particles<Dim> particles;
    std::vector<Index> cell;  ///< global id of the new cell
  };
  std::vector<Outbox> outbox;
  std::vector<const Outbox*> inbox;  ///< by position in topology.neighbours

  double least_mass = 0;  ///< [kg] nodes of at most this mass are not accelerated
  PatchWork work;
  double time_step_limit = std::numeric_limits<double>::infinity();  ///< [s], adaptive runs
  Index removed = 0;  ///< particles that left the mesh and were removed
  Mark mark;
  std::vector<Local> scratch;  ///< of kernels that need a list of particles or cells

  Local n_nodes() const { return static_cast<Local>(topology.nodes.size()); }
};

}  // namespace lahar
