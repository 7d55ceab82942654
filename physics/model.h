/// \file Everything a run needs, with names resolved and units SI: what io/ makes of a scenario.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "physics/mesh.h"
#include "physics/types.h"

namespace lahar {

enum class Scheme { usf, usl, musl };

/// Functions that map between particles and nodes: those of the mesh's elements, or functions that
/// reach beyond the cell, for structured meshes.
enum class ShapeFunctions {
  element,
  gimp,          ///< domains of particles stretch with them (contiguous particles)
  uniform_gimp,  ///< domains keep their size
  cpdi,          ///< domains are parallelograms or parallelepipeds that deform with the particle
  quadratic_spline,
  cubic_spline
};

/// An affine velocity field that particles carry beside their velocity.
enum class Affine {
  none,
  apic,  ///< affine particle-in-cell (Jiang et al. 2015)
  tpic   ///< Taylor particle-in-cell: the velocity gradient (Nakamura et al. 2023)
};

/// Isotropic linear elasticity; 2D is plane strain.
struct LinearElastic {
  double youngs_modulus;  ///< [Pa] > 0
  double poisson_ratio;   ///< [-] -1 < nu < 0.5
};

/// Weakly compressible Newtonian fluid; state variable: pressure [Pa].
struct Newtonian {
  double bulk_modulus;          ///< [Pa] > 0
  double dynamic_viscosity;     ///< [Pa s] >= 0
  bool incompressible = false;  ///< true: no volumetric (pressure) stress, as in the reference
};

using Law = std::variant<LinearElastic, Newtonian>;

struct Material {
  Index id = 0;        ///< as in the scenario
  std::string name;    ///< as in the scenario; the id's digits where it has no name
  double density = 0;  ///< [kg/m^3] initial
  Law law;
};

/// A factor that multiplies a load over time.
struct MathFunction {
  enum class Kind { linear, sine } kind = Kind::linear;
  std::vector<double> x, f;  ///< linear: times [s], ascending, and values; constant outside
  double x0 = 0, a = 0;      ///< sine: sin(a (t - x0)) in [lo, hi], 0 outside
  double lo = std::numeric_limits<double>::min(), hi = std::numeric_limits<double>::max();
  double operator()(double t) const;
};

/// Prescribed velocity component of a node; of several for a node and direction the first wins.
struct NodeVelocity {
  Index node;
  int dir;
  double velocity;  ///< [m/s]
};

struct NodeForce {
  Index node;
  int dir;
  double force;       ///< [N] (2D: per metre of thickness)
  int function = -1;  ///< index into Model::functions; -1 = constant
};

/// Traction on particles: force = traction(t) * volume / size, size = initial volume^(1/Dim).
struct ParticleTraction {
  std::vector<Index> particles;  ///< particle ids, ascending; those of ParticleTable alone
  int dir;
  double traction;    ///< [Pa]
  int function = -1;  ///< index into Model::functions; -1 = constant
};

/// Prescribed velocity component of particles, applied at the end of G2P.
struct ParticleVelocity {
  std::vector<Index> particles;  ///< particle ids, ascending; those of ParticleTable alone
  int dir;
  double velocity;  ///< [m/s]
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
  std::vector<Voigt> stress;            ///< [Pa]; empty = zero
  std::vector<Index> id;                ///< ascending; empty = the position
  std::vector<std::uint64_t> loads;     ///< as Particles::loads; empty = not yet set
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

struct Analysis {
  Scheme scheme = Scheme::usf;
  ShapeFunctions functions = ShapeFunctions::element;
  Affine affine = Affine::none;
  /// GIMP as in CB-Geo: edges of domains are the cell's over the number of particles in it, not over
  /// its root.
  bool cbgeo_domains = false;
  /// A particle whose domain reaches beyond the cells around its own stops the run; else functions
  /// are those of a smaller one.
  bool refuse_large_domains = false;
  TimeStep step;
  Index nsteps = 0;  ///< steps to take; with end_time whichever comes first
  double end_time = std::numeric_limits<double>::infinity();  ///< [s]
  double flip = 1.0;     ///< velocity update: 1 = FLIP, 0 = PIC, between = blend
  double damping = 0.0;  ///< Cundall factor [-]; 0 = none
  bool pressure_smoothing = false;
  bool remove_leaving_particles =
      false;                     ///< particles that leave the mesh are removed, not an error
  /// Target particles per patch; part of the result's identity. Measured on one core, plate and H8 of
  /// 125 thousand and 1 million particles, against 4096: 1024 20 % slower, 2048 8 %; 8192 and 16384
  /// 3 to 7 % faster, but half and a quarter of the patches to share among threads.
  Index patch_particles = 4096;
};

struct OutputPlan {
  std::string folder;       ///< run folder
  Index frame_steps = 0;    ///< a frame every so many steps; 0 = only the end
  Index history_steps = 0;  ///< a history row every so many steps; 0 = automatic
  Index checkpoint_steps = 0;     ///< a checkpoint every so many steps; 0 = none
  double checkpoint_minutes = 0;  ///< [min] of wall time between checkpoints; 0 = none
  Index checkpoints_kept = 2;     ///< the last so many; older ones are removed
};

template <int Dim>
struct Model {
  std::string title;
  std::shared_ptr<const Mesh<Dim>> mesh;
  ParticleTable<Dim> particles;
  std::vector<Material> materials;
  std::vector<MathFunction> functions;
  Vec<Dim> gravity = Vec<Dim>::Zero();  ///< [m/s^2]
  std::vector<NodeVelocity> node_velocities;
  std::vector<NodeForce> node_forces;
  std::vector<ParticleTraction> tractions;
  std::vector<ParticleVelocity> particle_velocities;
  Analysis analysis;
  OutputPlan output;
};

using AnyModel = std::variant<Model<2>, Model<3>>;

}  // namespace lahar
