/// \file Everything a run needs, with names resolved and units SI: what io/ makes of a scenario.
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <variant>
#include <vector>

#include "physics/base/types.h"
#include "physics/boundary/conditions.h"
#include "physics/materials/material.h"
#include "physics/mesh/mesh.h"
#include "physics/model/gauges.h"
#include "physics/model/injection.h"
#include "physics/model/node_fields.h"
#include "physics/model/rigid_body.h"
#include "physics/model/shape_functions.h"
#include "physics/model/stage_changes.h"

namespace lahar {

enum class Scheme {
  usf,
  usl,
  musl,
  newmark,    ///< implicit (ImplicitSteps)
  projection  ///< velocities without divergence (Projection)
};

/// What the plane of a model in two dimensions is a section of (plane.h).
enum class Plane {
  strain,       ///< a body that does not deform across it, one metre of it
  stress,       ///< a sheet without stress across it, at first one metre thick
  axisymmetric  ///< a body of revolution: x is the radius, y the axis; the whole of it
};

/// An affine velocity field that particles carry beside their velocity.
enum class Affine {
  none,
  apic,  ///< affine particle-in-cell (Jiang et al. 2015)
  tpic   ///< Taylor particle-in-cell: the velocity gradient (Nakamura et al. 2023)
};

/// A factor that multiplies a load over time.
struct MathFunction {
  enum class Kind { linear, sine } kind = Kind::linear;
  std::vector<double> x = {},
                      f = {};  ///< linear: times [s], ascending, and values; constant outside
  double x0 = 0, a = 0;        ///< sine: sin(a (t - x0)) in [lo, hi], 0 outside
  double lo = std::numeric_limits<double>::min(), hi = std::numeric_limits<double>::max();
  bool differentiated = false;    ///< the factor is the slope of value() [1/s]
  bool integrated = false;        ///< the factor is the integral() [s]
  std::vector<double> sums = {};  ///< linear, with `integrated`: integrals from x.front() to x

  double operator()(double t) const {
    return integrated ? integral(t) : differentiated ? slope(t) : value(t);
  }
  double value(double t) const;
  double slope(double t) const;     ///< [1/s] of value(), behind t
  double integral(double t) const;  ///< [s] of value(), or of its slope() [-], from 0 to t
  /// In a step from t on. Exact of slopes, so that what moves by them is where value() says; else
  /// that in its middle.
  double mean(double t, double dt) const;
  double largest() const;  ///< the most of value(), or of slope()
};

/// The function whose values are the integral of another one.
MathFunction integral_of(MathFunction function);

/// Rotated axes in which the constraints of a node act. One per node.
template <int Dim>
struct NodeFrame {
  Index node;
  Eigen::Matrix<double, Dim, Dim, Eigen::DontAlign> axes;  ///< columns: local axes
};

/// Conditions of nodes, what the scenario lists of each. Of several processes that read a scenario
/// together each has those of some nodes (directory_rank()), and patches ask for theirs.
template <int Dim>
struct NodeConditions {
  ConditionLists conditions;
  std::vector<NodeFrame<Dim>> node_frames;
  std::vector<NodeVelocity> liquid_velocities;  ///< of the liquid in pores
};

/// The entries of a condition.
template <class T, int Dim>
std::vector<T>& entries_of(NodeConditions<Dim>& of) {
  return std::get<std::vector<T>>(of.conditions);
}
template <class T, int Dim>
const std::vector<T>& entries_of(const NodeConditions<Dim>& of) {
  return std::get<std::vector<T>>(of.conditions);
}
/// Call visit(list) for each list, or visit(list of one, list of the other).
void for_each_list(auto& of, auto&& visit) {
  visit(of.node_frames);
  visit(of.liquid_velocities);
  std::apply([&](auto&... list) { (visit(list), ...); }, of.conditions);
}
template <int Dim>
void for_each_list(const NodeConditions<Dim>& one, NodeConditions<Dim>& other, auto&& visit) {
  visit(one.node_frames, other.node_frames);
  visit(one.liquid_velocities, other.liquid_velocities);
  for_each_condition([&]<class T>() { visit(entries_of<T>(one), entries_of<T>(other)); });
}

/// Traction on particles: force = traction(t) * area, that of the particle's faces across `axis` at
/// the beginning. With a liquid in pores it acts on both phases together, or on the liquid alone.
struct ParticleTraction {
  std::vector<Index> particles;  ///< particle ids, ascending; those of ParticleTable alone
  int dir;
  double traction;    ///< [Pa]
  int function = -1;  ///< index into Model::functions; -1 = constant
  bool all = false;   ///< on all particles, those that are injected too
  bool on_liquid = false;
  /// Where it acts along `dir`: at the side of the particle with more (1) or less (-1) of this
  /// coordinate, or at its centre (0), as in CB-Geo MPM.
  int side = 0;
  /// Across the surface. -1: the area is volume / size, size = initial volume^(1/Dim), as in CB-Geo
  /// MPM.
  int axis = -1;
};

/// Prescribed velocity component of particles, applied at the end of G2P.
struct ParticleVelocity {
  std::vector<Index> particles;  ///< particle ids, ascending; those of ParticleTable alone
  int dir;
  double velocity;   ///< [m/s]
  bool all = false;  ///< of all particles, those that are injected too
  bool of_liquid = false;
  int function = -1;  ///< index into Model::functions, a factor over time; -1 = constant
};

/// Initial particles, structure of arrays; the particle's id is its position unless `id` is given:
/// where several processes have a share each.
template <int Dim>
struct ParticleTable {
  std::vector<Vec<Dim>> x;              ///< [m]
  std::vector<Index> cell;              ///< owning cell, by the placement rule; always filled
  std::vector<double> volume;           ///< [m^3]; always filled
  std::vector<std::uint16_t> material;  ///< index into Model::materials; always filled
  std::vector<Vec<Dim>> velocity;       ///< [m/s]; empty = zero
  std::vector<Voigt> stress;            ///< [Pa], effective where pores hold a liquid; empty = zero
  std::vector<double> pore_pressure;    ///< [Pa]; empty = zero
  std::vector<double> reach;   ///< [m] to the surface of what they are part of; 0, empty = unknown
  std::vector<double> extent;  ///< [m] to the end of their material there; 0, empty = as `reach`
  /// [m] edges, of particles with tractions; 0, empty = equal ones, of their volume.
  std::vector<std::array<double, Dim>> edges;
  // What particles of an earlier run bring with them.
  std::vector<Vec<Dim>> displacement;     ///< [m]; empty = zero
  std::vector<Vec<Dim>> liquid_velocity;  ///< [m/s] of the liquid in pores; empty = as `velocity`
  std::vector<Voigt> strain;              ///< engineering shear; empty = zero
  std::vector<double> mass;               ///< [kg]; empty = volume times the material's density
  std::vector<double> opening;            ///< [-] Column::opening; empty = zero
  /// State variables of the particle's material, in its order; empty = those of its beginning.
  std::vector<std::array<double, most_state>> state;
  std::vector<Index> id;             ///< ascending; empty = the position
  std::vector<std::uint64_t> loads;  ///< as Particles::loads; empty = not yet set

  /// Call visit(column) for every column but the ids.
  template <class Visit>
  void each_column(Visit visit) {
    visit(x);
    visit(cell);
    visit(volume);
    visit(material);
    visit(velocity);
    visit(stress);
    visit(pore_pressure);
    visit(reach);
    visit(extent);
    visit(edges);
    visit(displacement);
    visit(liquid_velocity);
    visit(strain);
    visit(mass);
    visit(opening);
    visit(state);
    visit(loads);
  }
  Index size() const { return static_cast<Index>(x.size()); }
  Index id_of(std::size_t row) const { return id.empty() ? static_cast<Index>(row) : id[row]; }
};

/// How the time step is chosen. The limit of a particle is h / (c + |v|), h = Mesh::cell_size,
/// c = wave_speed(); the step used is safety times the smallest limit.
struct TimeStep {
  bool adaptive = false;
  double dt = 0;                 ///< [s] fixed step, or the largest step allowed when adaptive
  double safety = 0.5;           ///< [-] adaptive only
  bool accept_unstable = false;  ///< a fixed step above the limit is a warning, not an error
};

/// What particles keep of the part of their velocities that nodes do not have.
///
/// With P = S S+, S+ from particles to nodes (means weighted by mass) and S back, FLIP changes
/// velocities by dt S a, and the transfer then takes from them
///     theta (I - P)^order v_p,    theta = rate dt <= 1, or the same in every step.
/// Order 1 is PIC (theta = 1) and its blend with FLIP; with theta = 1 higher orders are XPIC
/// (Hammerquist & Nairn 2017), and FMPM (Nairn & Hammerquist 2021) where the change of nodal
/// velocities is filtered with them. A wave of wave number q loses its velocity at the rate
/// (q^2 h^2 / 6)^order theta / dt or so: higher orders leave alone what the mesh resolves. Beside
/// them order 1 may take a share theta_1 (I - P) v_p of its own, as a viscosity of the material,
/// or shares theta_i of nodes, S theta_i (v_p - V_i), which keep momentum at each node: a viscosity
/// l sqrt(p / rho), which grains have in flow. With it friction grows with the rate of shear, as in
/// the law mu(I) where I is small (Jop, Forterre and Pouliquen, Nature 441, 2006, 727-730). Of
/// glass beads of diameter d, 0.6 of the volume, that has l = 0.936 d / sqrt(0.6) = 1.2 d.
struct VelocityTransfer {
  double flip = 1.0;  ///< 1 - theta where it is the same in every step
  /// [1/s] by body, infinite where nothing is kept; empty: `flip` holds. Of one body all particles
  /// have the same, else momentum would not be kept.
  std::vector<double> rates;
  int order = 1;
  /// [1/s] theta_1 / dt where `order` is above 1 and `rates` are set.
  double viscous = 0;
  /// [m] l of grains, where `order` is above 1 and `rates` are set, and theta_i over dt and the
  /// viscosity [1/m^2].
  double viscosity_length = 0, per_viscosity = 0;
  bool filters_change = false;  ///< FMPM
  /// For messages, of order 1: rate of the damping of what the mesh resolves over the wave number
  /// squared, as a share of `rates` [m^2], and the viscosity that was asked for [m^2/s].
  double smoothing = 0, viscosity = 0;
  /// [-] ASFLIP: share of what particles keep of their own velocities that also moves them, where
  /// material comes apart (separation.h). 0: particles move with the nodes.
  double separation = 0.0;

  /// 1 - theta - theta_1 of a body in a step of dt [s].
  double kept(int body, double dt) const;
  /// theta_1 in a step of dt [s].
  double taken_by_viscosity(double dt) const;
  bool takes() const { return !rates.empty() || flip < 1.0; }
};

/// Bodies that have velocities of their own at nodes, and meet there.
struct Contact {
  int bodies = 1;       ///< one has no contact
  double friction = 0;  ///< Coulomb's coefficient [-]
};

/// Steps that solve for equilibrium at their end: Newmark's method (1959), or without inertia.
struct ImplicitSteps {
  bool quasi_static = false;                  ///< no inertia: a sequence of equilibria
  double beta = 0.25, gamma = 0.5;            ///< Newmark's parameters
  bool nonlinear = true;                      ///< Newton's method; else one linear solve per step
  int most_iterations = 40;                   ///< of Newton's method
  double displacement_tolerance = 1e-10;      ///< [m] root mean square change of an iteration
  double residual_tolerance = 1e-10;          ///< [N] root mean square unbalanced force
  double relative_residual_tolerance = 1e-6;  ///< of the step's first unbalanced force
  /// Newton's method goes towards the loads in so many parts at most where it fails on all at once.
  int most_cuts = 64;
};

/// Steps whose pressure makes the velocities of their end free of divergence (projection.h).
struct Projection {
  double kept = 0;           ///< [-] share of the pressure that acts before it is corrected
  bool free_surface = true;  ///< the pressure is zero where a liquid ends inside of the mesh
  double least_fill = 0.25;  ///< [-] cells that are filled less are empty for that
};

/// How linear systems are solved.
struct LinearSolver {
  enum class Method { automatic, direct, iterative } method = Method::automatic;
  /// Of iterations: residual over right side. 0 = automatic: 1e-9, or what Newton's method needs.
  double tolerance = 0;
  int most_iterations = 0;  ///< 0 = automatic
};

/// A run ends by itself when it has come to rest (equilibrium.h): what is not in balance, and what
/// moves, is at most this. 0 = it does not end by itself.
struct UntilRest {
  double imbalance = 0;  ///< [-] unbalanced forces over loads
  double kinetic = 0;    ///< [-] kinetic energy over the elastic energy of stresses
  bool on() const { return imbalance > 0; }
};

struct Analysis {
  Scheme scheme = Scheme::usf;
  ImplicitSteps implicit;  ///< with Scheme::newmark
  Projection projection;   ///< with Scheme::projection
  LinearSolver linear;     ///< of both
  Plane plane = Plane::strain;
  ShapeFunctions functions = ShapeFunctions::element;
  Affine affine = Affine::none;
  /// GIMP as in CB-Geo: edges of domains are the cell's over the number of particles in it, not
  /// over its root.
  bool cbgeo_domains = false;
  /// A particle whose domain reaches beyond the cells around its own stops the run; else functions
  /// are those of a smaller one.
  bool refuse_large_domains = false;
  TimeStep step;
  Index first_step = 0;  ///< steps that an earlier run did, from which this one goes on
  Index nsteps = 0;      ///< steps to take, these included; with end_time whichever comes first
  double end_time = std::numeric_limits<double>::infinity();  ///< [s]
  UntilRest until;
  VelocityTransfer transfer;
  double damping = 0.0;  ///< Cundall's factor [-], or with `viscous_damping` a rate [1/s]; 0 = none
  /// Velocities decay with the rate `damping`, as in a fluid at rest (mass-proportional damping).
  bool viscous_damping = false;
  /// Each component of the velocity is damped by the magnitude of the whole unbalanced force, as in
  /// CB-Geo MPM, also by what walls carry; else by that of its own component (Cundall 1987).
  bool damping_as_cbgeo = false;
  bool pressure_smoothing = false;
  bool two_phase = false;  ///< some materials have a liquid in their pores (two_phase.h)
  bool pore_pressure_smoothing = false;
  bool prescribes_pore_pressure = false;  ///< some process has Model::pore_pressures
  bool explicit_drag = false;     ///< drag of the velocities before the step, as in CB-Geo MPM
  bool liquid_advection = false;  ///< as in CB-Geo MPM (map_advection())
  /// The particles of a cell have the mean of their volumetric strains (B-bar: Hughes 1980):
  /// volumes that can hardly change do not lock them (mean_volume.h, mean_gradients.h).
  bool mean_volume = false;
  bool opening = false;  ///< what opens between grains or drops is not volume of the particles
  Contact contact;
  bool rigid_bodies = false;  ///< there are Model::rigid_bodies
  bool free_bodies = false;   ///< some of them move by forces
  bool takes_means = false;   ///< some process has conditions of nodes with takes_means
  bool shows_nodes = false;   ///< there are OutputPlan::node_fields
  /// Velocities that nodes prescribe from the first step on are given to particles as an impulse
  /// (timed_velocities.h); in CB-Geo MPM particles keep theirs.
  bool sudden_velocities = false;
  /// Some process has prescribed velocities that are functions of time: of nodes, of particles.
  bool nodes_follow_time = false, particles_follow_time = false;
  /// Particles with prescribed velocities move by them, and drive the nodes around them
  /// (driven_nodes.h); else they move with nodes that do not know of them, as in CB-Geo MPM.
  bool drives_nodes = false;
  /// Elements of second order have Lagrange's functions, which are negative in parts, as in CB-Geo
  /// MPM; else T6, Q9 and H27 have Bernstein's (bernstein.h).
  bool lagrange_functions = false;
  /// The volumetric strain of fluids is that at the cell's centre, and pressure acts by gradients
  /// at particles, as in CB-Geo MPM. Then forces do not do the work of stresses, and flows may make
  /// energy. Else both are at the centre for Q4 and H8 with their own functions and no affine
  /// velocities, and at particles for others.
  bool volume_as_cbgeo = false;
  /// Particles do not pass faces of cells whose nodes are held (closed_faces.h). In CB-Geo MPM they
  /// do.
  bool closed_faces = true;
  /// Stresses turn with the material (Jaumann's rate, turn()). In CB-Geo MPM they do not.
  bool turns_stress = false;
  bool remove_leaving_particles =
      false;  ///< particles that leave the mesh are removed, not an error
  /// The run fails when more of them have left.
  Index most_lost = std::numeric_limits<Index>::max();
  bool few_may_leave() const { return most_lost < std::numeric_limits<Index>::max(); }
  bool all_may_leave() const { return remove_leaving_particles && !few_may_leave(); }
  bool as_cbgeo =
      false;  ///< what CB-Geo MPM computes where that deviates (io/schema/cbgeo_deviations.h)
  /// Target particles per patch; part of the result's identity. Measured on one core, plate and H8
  /// of 125 thousand and 1 million particles, against 4096: 1024 20 % slower, 2048 8 %; 8192 and
  /// 16384 3 to 7 % faster, but half and a quarter of the patches to share among threads.
  Index patch_particles = 4096;
  /// Every so many steps, patches that hold more than split_factor times as many are looked for,
  /// and split; 0 = never. Part of the result's identity.
  Index split_steps = 100;
};

/// Steps solve for equilibrium, and no wave limits them.
inline bool is_implicit(const Analysis& analysis) {
  return analysis.scheme == Scheme::newmark;
}

/// There is more than a plane state of strain in two dimensions.
inline bool deforms_across(const Analysis& analysis) {
  return analysis.plane != Plane::strain;
}

/// How deep the model is at a place x in two dimensions [m]: volume over area.
inline double depth_at(const Analysis& analysis, double x) {
  return analysis.plane == Plane::axisymmetric ? 2.0 * std::numbers::pi * x : 1.0;
}

/// A liquid does not change its volume: its pressure is solved for, and no wave of it limits steps.
inline bool is_projection(const Analysis& analysis) {
  return analysis.scheme == Scheme::projection;
}

/// Steps begin with global solves, for which all patches are at rest.
inline bool begins_with_solve(const Analysis& analysis) {
  return is_implicit(analysis) || is_projection(analysis);
}

/// When results cannot be right any more, and what to do then (runtime/step/watchdog.h).
struct Watchdog {
  enum class Action { none, warn, stop } action = Action::stop;
  double energy = 1;        ///< energy made out of nothing, as a share of what was put in
  double speed = 10;        ///< largest speed, as a multiple of speeds that mean something
  double time_step = 1e-3;  ///< least adaptive step, as a share of the first
  double compression = 0.01, expansion = 1e6;  ///< least and largest volume, as shares of the first
};

struct DerivedField;  // physics/particles/derived_fields.h

struct OutputPlan {
  std::string folder;             ///< run folder
  Index frame_steps = 0;          ///< a frame every so many steps; 0 = only the end
  Index history_steps = 0;        ///< a history row every so many steps; 0 = automatic
  Index checkpoint_steps = 0;     ///< a checkpoint every so many steps; 0 = none
  double checkpoint_minutes = 0;  ///< [min] of wall time between checkpoints; 0 = none
  Index checkpoints_kept = 2;     ///< the last so many; older ones are removed
  double frame_dt = 0;            ///< [s] frames at multiples of this time instead; 0 = none
  double history_dt = 0;          ///< [s] the same for rows
  Index max_frames = 10000;       ///< frames beside the first and the last
  std::vector<const DerivedField*> derived_fields;  ///< that frames have beside columns
  std::vector<std::string> frame_fields;            ///< of frames, by name; empty = all
  /// The only particles of frames: ids, ascending; null = all. Copies of the plan share it.
  std::shared_ptr<const std::vector<Index>> frame_particles;
  bool single_precision = false;       ///< numbers of frames have 32 bits
  std::vector<NodeField> node_fields;  ///< files of nodes come with frames; empty = none
  GaugePlan measured;                  ///< while the run goes on
};

template <int Dim>
struct Model : NodeConditions<Dim> {
  std::string title;
  std::shared_ptr<const Mesh<Dim>> mesh;
  ParticleTable<Dim> particles;
  std::vector<Injection<Dim>> injections;
  std::vector<Material> materials;
  std::vector<MathFunction> functions;
  Vec<Dim> gravity = Vec<Dim>::Zero();  ///< [m/s^2]
  int gravity_function = -1;            ///< index into functions; -1 = constant
  /// Force per mass [m/s^2] at time t [s] on the material that began at X [m], beside gravity; what
  /// makes a given motion a solution (`lahar verify`). No scenario sets it.
  std::function<Vec<Dim>(const Vec<Dim>& X, double t)> body_force;
  std::vector<ParticleTraction> tractions;
  std::vector<ParticleVelocity> particle_velocities;
  std::vector<RigidBody<Dim>> rigid_bodies;
  std::vector<RigidBody<Dim>> sides;  ///< half spaces beside the mesh that hold free bodies
  Analysis analysis;
  StageChanges<Dim> changes;  ///< of particles of the stage before
  OutputPlan output;
  Watchdog watchdog;
};

using AnyModel = std::variant<Model<2>, Model<3>>;

}  // namespace lahar
