/// \file One patch: its particles, its node arrays, and what the kernels of a step need.
#pragma once

#include <tsl/robin_map.h>

#include <Eigen/Core>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "physics/base/node_vector.h"
#include "physics/base/simd.h"
#include "physics/boundary/acting_node.h"
#include "physics/boundary/constrained_node.h"
#include "physics/boundary/contact_state.h"
#include "physics/boundary/driven_node.h"
#include "physics/mesh/partition.h"
#include "physics/model/model.h"
#include "physics/particles/columns.h"
#include "physics/particles/implicit_nodes.h"
#include "physics/particles/nodal_system.h"
#include "physics/particles/particles.h"
#include "physics/particles/patch_work.h"
#include "physics/particles/projection_nodes.h"
#include "physics/particles/removed_particle.h"
#include "physics/particles/shown_nodes.h"

namespace lahar {

/// Consecutive particles of one cell and one material: what a kernel accumulates in registers.
/// Slots [end, limit) are free; arrivals take them, so that most movements cost no sorting.
struct ParticleBin {
  Local cell;
  Local begin, end;        ///< particles [begin, end)
  Local limit;             ///< first slot that is not this bin's
  Local next = -1;         ///< another bin of the same cell, -1 = none
  std::uint16_t material;  ///< index into the materials
  bool loaded;             ///< some particle has a load or a prescribed velocity
};
/// Bins that a kernel works on: all of a patch, or some that fit in a first- or second-level cache.
using ParticleBins = std::span<ParticleBin>;

/// Node quantities that neighbours sum. Each is a private partial sum of this patch, exchanged once
/// per step where the scheme says so.
enum class NodeSum : int {
  mass_momentum,
  force,
  momentum,
  pressure,
  gradient,
  surface,
  displacement,
  waves,
  prescribed_mass,
  prescribed_momentum,
  smoothed,        ///< momentum of interpolated velocities, of even orders
  smoothed_again,  ///< the same of odd orders: neighbours may still read the others
  liquid_mass_momentum,
  liquid_force,
  drag,             ///< two_phase.h
  liquid_momentum,  ///< of MUSL's second mapping
  pore_pressure,
  advection,  ///< of the liquid, as in CB-Geo MPM
  inertia,    ///< mass times acceleration, of implicit steps (nodal_system.h)
  residual,   ///< forces that are not in balance
  product,    ///< of a matrix with a vector
  diagonal,   ///< of a matrix
  // Of projections (projection.h), in place of those of implicit steps.
  kept_pressure = inertia,  ///< {., m p}
  divergence = residual,    ///< {discharge, V, filled space}
  // Of contact of bodies (contact_surface.h), which implicit steps do not have.
  surface_around = inertia  ///< as `surface`, of all particles around
};
inline constexpr int n_node_sums = 22;
/// Sums lie in pairs, {mass_momentum, force}, {momentum, pressure}, {gradient, surface},
/// {displacement, waves}, {prescribed_mass, prescribed_momentum}, {smoothed, smoothed_again},
/// {liquid_mass_momentum, liquid_force}, {drag, liquid_momentum}, {pore_pressure, advection},
/// {inertia, residual} and {product, diagonal}: a cache line per node.
inline constexpr int sum_stride = 2 * node_width;
inline constexpr int n_sum_arrays = (n_node_sums + 1) / 2;
/// Array that holds a kind of sum, and where in a node's line it begins.
constexpr std::size_t sum_array(NodeSum which) {
  return static_cast<std::size_t>(which) / 2;
}
constexpr int sum_offset(NodeSum which) {
  return static_cast<int>(which) % 2 * node_width;
}

/// How many copies of each array of sums there are, used in turn by step. Two where a patch may
/// begin to sum for the next step while neighbours still read the sums of this one.
struct NodeSumCopies {
  std::array<int, n_sum_arrays> of{1};
  bool operator==(const NodeSumCopies&) const = default;
};

/// Consecutive local nodes [begin, end), and the first of topology.shared_node that is not before.
struct NodeRange {
  Local begin, end;
  std::size_t first_shared;
};

/// Something that a kernel found wrong with a particle or node. The step reports it.
struct ParticleFault {
  enum class Kind { none, left_mesh, not_finite, volume, moved_too_far, law, domain, folded };
  Kind kind = Kind::none;
  Index particle = -1;
  std::array<double, 3> position{};
  std::array<double, 3> velocity{};
  std::array<double, 6> stress{};  ///< [Pa] before the increment; of Kind::law
  std::uint16_t material = 0;      ///< index into the materials; of Kind::law
  Index count = 0;                 ///< particles with this fault in this patch and step
};

/// What all patches share and kernels only read.
template <int Dim>
struct StepContext {
  const Model<Dim>* model = nullptr;
  const Partition<Dim>* partition = nullptr;
  Index step = 0;   ///< updates done before this one, or rounds of a solver
  double time = 0;  ///< [s] at the beginning of the step
  double dt = 0;    ///< [s]
  /// Where free rigid bodies are at the end of the step, by body; null without any.
  const Placement<Dim>* placements = nullptr;
  bool begins = false;  ///< it is the first step of the run
};

/// Particles on their way from one patch to another.
template <int Dim>
struct Outbox {
  Particles<Dim> particles;
  std::vector<Index> cell;  ///< global id of the new cell
  char* filled = nullptr;   ///< the flag of this outbox where it goes to: Patch::arrived
};

template <int Dim>
struct Patch {
  PatchTopology<Dim> topology;
  BasisKind basis = BasisKind::linear;  ///< others need topology.support_nodes
  Element element = multilinear<Dim>;   ///< of the mesh
  bool lagrange_functions = false;      ///< Analysis::lagrange_functions
  Particles<Dim> particles;             ///< slots; those in bins are in use
  std::vector<ParticleBin> bins;
  std::vector<Local> first_bin;  ///< by local cell, -1 = none
  Local count = 0;               ///< particles in bins
  int added_bins = 0;            ///< since the last sort, for cells without a free slot
  bool sorted = false;           ///< bins describe the particles
  bool moving = false;           ///< has been sorted after particles moved: bins get a free slot
  bool idle = false;             ///< no particles and all partial sums zero
  /// By local cell: a patch that does not exist is so near that particles may soon be in it; empty
  /// where none is. Where such a cell gets particles, the patch needs its surroundings.
  std::vector<char> halo_edge_cells;
  bool needs_surroundings = false;
  int clear_sums = 0;  ///< steps for which no particle has been mapped, at most 2

  // Geometry of the local cells.
  bool cartesian = true;
  std::vector<std::array<double, 2 * Dim>> box;  ///< Cartesian: centre [m], 2 / edge length [1/m]
  /// [m] node_width per node; isoparametric cells, and affine velocities where functions
  /// are given one by one (corners, CPDI).
  NodeArray node_position;
  double smallest_cell = 0;                 ///< [m] least of cell_size
  std::vector<double> cell_size;            ///< [m], for the time step limit
  std::vector<double> space;                ///< [m^3] of space_around_cells(); only with gaps
  tsl::robin_map<Index, Local> local_cell;  ///< local number of a global cell id; first body

  // Node arrays by local node, node_width doubles each, sums sum_stride apart.
  std::array<std::vector<NodeArray>, n_sum_arrays> sums;  ///< private; read by neighbours; empty
                                                          ///< before there are active nodes
  NodeArray velocity;      ///< {v [m/s], m [kg]}, m summed over all patches
  NodeArray acceleration;  ///< {a [m/s^2], 0}
  NodeArray transfer;      ///< {v [m/s], 0} of velocity_transfer.h; only where it needs one
  NodeArray held;          ///< {1 along what holds the node, 1 if any}; only with separation.h
  std::vector<double> pressure;  ///< [Pa]; only with pressure smoothing
  NodeArray damping;             ///< {damping force [N], 0}; only where there is damping
  // Bodies in contact have nodes and cells of their own (contact.h).
  Local body_nodes = 0;          ///< nodes of one body; 0 = not set, there is one
  std::vector<Local> body_cell;  ///< by material: first local cell of its body; empty = one body
  ContactState<Dim> contact;
  /// Nodes of cells that have bins: of a patch that is filled in part, or lies around the body,
  /// nothing else is summed and integrated. Sums at other nodes are zero, their state is undefined.
  std::vector<NodeRange> active_nodes;
  std::vector<char> node_is_active;      ///< the same by local node
  std::vector<Local> cells_to_activate;  ///< had no bins when active_nodes was made
  /// By parity of the step: a sum may be other than zero. Read by neighbours, as the sums are.
  std::array<char, 2> contributes{};

  /// Where the sums of a neighbour are.
  struct NeighbourSums {
    const NodeArray* array;
    std::ptrdiff_t first = 0;  ///< number in `array` with which they begin
    const double* data() const { return array->data() + first; }
  };
  /// By kind, parity of the step, and position in topology.neighbours.
  std::array<std::array<std::vector<NeighbourSums>, 2>, n_node_sums> neighbour_sums;
  std::vector<const std::array<char, 2>*> neighbour_contributes;
  std::vector<const double*> sum_sources;  ///< scratch of nodal kernels

  /// The liquid in pores at nodes (two_phase.h); empty with one phase.
  struct Liquid {
    NodeArray velocity;             ///< {v [m/s], m [kg]}
    NodeArray acceleration;         ///< {a [m/s^2], 0}
    NodeArray before;               ///< {v [m/s], m} before the step, for affine velocities
    NodeArray force;                ///< {f [N], 0} of pressure and tractions
    NodeArray drag;                 ///< {Q [N s/m], 0}
    NodeArray discharge;            ///< {v + n (v_l - v) [m/s], 0}; only with `porosity`
    std::vector<double> porosity;   ///< n [-]; only if has_nodal_porosity()
    std::vector<double> advection;  ///< [kg/s] of map_advection(); only where it is mapped
    std::vector<double> pressure;   ///< [Pa]
  } liquid;

  NodalSystem<Dim> system;      ///< of implicit steps and projections
  ImplicitNodes<Dim> implicit;  ///< of implicit steps only
  ProjectionNodes projection;   ///< of projections only

  // Constraints and loads of the local nodes.
  struct FixedVelocity {
    Local node;
    int dir;
    double velocity;  ///< [m/s]
  };
  std::vector<FixedVelocity> fixed;         ///< one per node and direction, ascending nodes
  std::vector<FixedVelocity> fixed_liquid;  ///< the same of the liquid in pores
  /// A velocity in one of these lists or in `walls` that is a function of time
  /// (timed_velocities.h).
  struct TimedVelocity {
    enum class List { fixed, fixed_liquid, walls } list;
    std::size_t entry;  ///< position in it
    int dir;            ///< of nodes at walls the local axis
    double velocity;    ///< [m/s] by which the function is multiplied
    int function;
  };
  std::vector<TimedVelocity> timed;
  struct FixedDisplacement {
    Local node;
    int dir;
    double displacement;  ///< [m] of a step (NodeDisplacement)
    int function;         ///< -1 = constant
  };
  /// Of implicit steps; one per node and direction, ascending. None of them is in `fixed`.
  std::vector<FixedDisplacement> fixed_displacement;
  struct FixedPressure {
    Local node;
    double pressure;  ///< [Pa]
    int function;     ///< -1 = constant
    bool inside;      ///< NodePressure::inside
  };
  std::vector<FixedPressure> fixed_pressure;  ///< ascending nodes
  std::vector<WallPush<Dim>> wall_pushes;     ///< by `walls`; if velocities are mapped again
  /// Ascending; their prescribed velocities are not in `fixed`.
  std::vector<ConstrainedNode<Dim>> walls;
  struct PointForce {
    Local node;
    int dir;
    double force;  ///< [N]
    int function;  ///< -1 = constant
  };
  std::vector<PointForce> forces;       ///< ascending nodes
  ActingLists<Dim> acting;              ///< conditions that act with forces, by ascending nodes
  std::vector<char> cells_of_means;     ///< by local cell: has functions at nodes that take means
  std::vector<DrivenNode<Dim>> driven;  ///< of this step; ascending nodes
  bool has_conditions = false;          ///< the lists above were filled, and those of injections

  // Particles on their way to neighbours, by position in topology.neighbours.
  using Outbox = lahar::Outbox<Dim>;
  std::vector<Outbox> outbox;
  std::vector<const Outbox*> inbox;    ///< by position in topology.neighbours
  std::vector<char> arrived;           ///< which of them hold particles; set by the neighbours
  char left_rank = 0;                  ///< the flag of outboxes to patches of other ranks
  std::vector<Local> filled_outboxes;  ///< positions
  Particles<Dim> movers;               ///< left their cell in this step; `cell` is the old one
  std::vector<SlotCopy> leaving, filling, placing;  ///< scratch of locate() and receive()
  std::vector<Local> placing_cell;
  std::vector<ParticleBin> unmapped;  ///< placed after their bins were mapped: still to be mapped

  /// By local cell: rigid bodies are near it. Empty without any.
  enum class Near : char { unknown, no, yes };
  std::vector<Near> near_bodies;
  std::vector<Placement<Dim>> placements;  ///< of rigid bodies at the end of the step
  std::vector<Reaction> reactions;         ///< of particles on them, there

  /// A node at which a gauge measures what holds it (node_supports.h).
  struct MeasuredNode {
    Local node;
    std::size_t gauge;               ///< number of the gauge among those of forces
    std::array<bool, Dim> counts{};  ///< the components of the force that are the gauge's
  };
  std::vector<MeasuredNode> measured;  ///< ascending nodes
  std::vector<Reaction> supports;      ///< of this step, on what holds them, by gauge of forces
  /// [N s] and [N m s] of supports and rigid bodies since the last row, by gauge of forces.
  std::vector<Reaction> impulses;

  std::vector<InjectionCell> injection_cells;  ///< ascending events
  std::vector<Vec<Dim>> injection_points;      ///< [m]
  std::vector<Index> injected;                 ///< events of this step; for whoever counts them

  ShownNodes shown_nodes;  ///< with Analysis::shows_nodes only

  double least_mass = 0;  ///< [kg] nodes of at most this mass are not accelerated
  PatchWork work;
  double unbalanced = 0;  ///< [N] of this patch's share of its nodes; with Analysis::until
  double time_step_limit = std::numeric_limits<double>::infinity();  ///< [s], adaptive runs
  double max_speed = 0;                  ///< [m/s] of the particles, at most; by G2P
  std::vector<RemovedParticle> removed;  ///< left the mesh, since the driver took the list
  ParticleFault fault;
  ParticleFault unsolved;  ///< a law without a stress in an iteration of an implicit step

  Local n_nodes() const { return static_cast<Local>(topology.nodes.size()); }

  std::size_t bodies() const {
    return body_nodes == 0 ? 1 : topology.nodes.size() / static_cast<std::size_t>(body_nodes);
  }
  /// Local number of a cell of this patch for particles of a material.
  Local cell_of(Local first, std::uint16_t material) const {
    return body_cell.empty() ? first : first + body_cell[material];
  }

  /// Some condition takes NodeMeans.
  bool takes_means() const { return !cells_of_means.empty(); }

  /// This patch's own lines of sums for a step, sum_stride each: of `which` and the kind beside it.
  double* own_lines(NodeSum which, Index step) {
    auto& copies = sums[sum_array(which)];
    return copies[static_cast<std::size_t>(step) % copies.size()].data();
  }
  const double* own_lines(NodeSum which, Index step) const {
    return const_cast<Patch*>(this)->own_lines(which, step);
  }
  /// This patch's own sums for a step, sum_stride apart.
  double* own_sums(NodeSum which, Index step) { return own_lines(which, step) + sum_offset(which); }
  const double* own_sums(NodeSum which, Index step) const {
    return const_cast<Patch*>(this)->own_sums(which, step);
  }
  /// Those of this patch and then of all neighbours, by position in topology.neighbours; null where
  /// all are zero. sum_offset() is still to be added. Valid until the next call.
  const double* const* all_sums(NodeSum which, Index step) {
    const auto& sums_of =
        neighbour_sums[static_cast<std::size_t>(which)][static_cast<std::size_t>(step % 2)];
    sum_sources.assign(1, own_lines(which, step));
    for (std::size_t k = 0; k < sums_of.size(); ++k) {
      const bool any = (*neighbour_contributes[k])[static_cast<std::size_t>(step % 2)];
      sum_sources.push_back(any ? sums_of[k].data() : nullptr);
    }
    return sum_sources.data();
  }
  /// Call body(p) with the slot of every particle.
  template <class Body>
  void for_each_particle(Body body) const {
    for (const ParticleBin& bin : bins)
      for (Local p = bin.begin; p < bin.end; ++p) body(p);
  }
};

}  // namespace lahar
