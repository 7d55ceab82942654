// Tables of the analysis: scheme, time step, damping, restart.
#include "io/schema/keys.h"
#include "physics/model/shape_functions.h"
#include "physics/particles/patch_split.h"

namespace lahar {

namespace {

static_assert(split_factor == 4, "the help of split_steps says so");

const Section& resume_section() {
  static const Section section{
      .name = "analysis.resume",
      .path = "analysis.resume",
      .help =
          "Continue from a particle file of CB-Geo MPM: particlesNNN.h5 in the folder `uuid` of "
          "post_processing.path (for a parallel run: the files of all its ranks). The file "
          "contains the state and the ids of the particles, so that sets and loads act on the same "
          "particles. With a fixed `dt` the run begins with step `step` + 1, and `nsteps` and "
          "`end_time` include the earlier steps. With adaptive steps, time and steps begin at 0. "
          "Materials have the parameters of this scenario, whatever they were before. For "
          "MohrCoulomb, `phi`, `psi` and `cohesion` follow from these parameters and from "
          "`pdstrain`. `lahar export --to cbgeo` writes such files.",
      .keys = {
          {.key = "resume",
           .kinds = boolean,
           .help = "false: start from the beginning",
           .fallback = "false"},
          {.key = "uuid", .kinds = text, .help = "run to continue"},
          {.key = "step",
           .kinds = integer,
           .help = "step of the file, counted from 0: step + 1 steps are complete",
           .min = 0,
           .max = 9e15},
          {.key = "repartition",
           .kinds = boolean,
           .help = "without effect: patches do not depend on ranks",
           .support = Support::ignored},
      }};
  return section;
}

const Section& until_section() {
  static const Section section{
      .name = "analysis.until",
      .path = "analysis.until",
      .help =
          "A run, or a stage, ends when it has come to rest: both bounds are tested after the "
          "first "
          "step and then every 100 steps of explicit runs, and after each quasi-static step. "
          "`nsteps` or `end_time` bound the "
          "run; where they end it first, it warns. Neither measure depends on the mesh.",
      .keys = {
          {.key = "imbalance",
           .kinds = number,
           .help = "largest sum of the unbalanced forces of nodes, over the sum of all loads "
                   "(weights, tractions, forces). Of quasi-static steps these are the forces with "
                   "which the next step begins: with loads that grow the run goes on",
           .unit = "-",
           .required = true,
           .min = 0,
           .max = 1,
           .above_min = true,
           .native = true},
          {.key = "kinetic_energy",
           .kinds = number,
           .help = "explicit steps: largest kinetic energy, over the elastic energy of the "
                   "stresses. Default: the square of imbalance, which is that of an oscillation "
                   "whose forces are as large",
           .unit = "-",
           .min = 0,
           .above_min = true,
           .native = true},
      }};
  return section;
}

const Section& damping_section() {
  static const Section section{
      .name = "analysis.damping",
      .path = "analysis.damping",
      .help =
          "Forces against the nodal velocities. Cundall: local damping. The force against each "
          "velocity component is `damping_factor` times the component of the unbalanced nodal "
          "force (Cundall 1987). With analysis.preset \"cbgeo\" its size is `damping_factor` "
          "times the magnitude of the whole force. Walls that carry a side pressure then shake the "
          "material beside them forever. Viscous: mass-proportional damping. The force is "
          "`damping_factor` times mass times velocity: free motion decays as exp(-damping_factor "
          "t), and oscillations with half this rate.",
      .keys = {
          {.key = "type",
           .kinds = text,
           .help = "kind of damping",
           .required = true,
           .allowed = {"Cundall", "Viscous"}},
          {.key = "damping_factor",
           .kinds = number,
           .help = "Cundall: share of the unbalanced force [-], at most 1. Viscous: rate [1/s]",
           .min = 0},
          {.key = "damping_ratio",
           .kinds = number,
           .help = "the same as damping_factor. CB-Geo MPM documents this key but ignores it",
           .unit = "-",
           .min = 0,
           .max = 1},
      }};
  return section;
}

const Section& body_section() {
  static const Section section{
      .name = "a body",
      .path = "analysis.contact.bodies[]",
      .help =
          "The particles of a material, or of a particle set. A set may contain a part of a "
          "material. If several bodies name a particle, sets take precedence over materials, and "
          "the last set wins.",
      .keys = {
          {.key = "material_id", .kinds = id, .help = "material: an id or a name", .min = 0},
          {.key = "material",
           .kinds = id,
           .help = "the same as material_id",
           .min = 0,
           .native = true},
          {.key = "pset_id",
           .kinds = id,
           .help = "particle set: an id or a name of sets.particles",
           .min = 0},
          {.key = "pset", .kinds = id, .help = "the same as pset_id", .min = 0, .native = true},
      }};
  return section;
}

const Section& contact_section() {
  static const Section section{
      .name = "analysis.contact",
      .path = "analysis.contact",
      .help =
          "Contact with Coulomb friction (Bardenhagen et al. 2001). Bodies that would overlap at a "
          "node within the step get impulses. Normal impulses close the gap between the bodies and "
          "no more. Friction acts along the surface. Bodies that separate are free. The gap is the "
          "distance between the ends of their particles, along the normal that gives the largest "
          "gap. Impulses preserve prescribed velocities. More than two bodies at a node interact "
          "in pairs, in the order of the list, several times. Contact needs \"mpm_scheme\": "
          "\"musl\": with usf it gains or dissipates energy, with usl it dissipates too much. "
          "CB-Geo's input gets a warning instead. A nodal force acts on the first body at its "
          "node; constraints hold all bodies. In history.csv, damping contains the energy that "
          "contact dissipates, and friction the share that friction dissipates.",
      .keys = {
          {.key = "friction",
           .kinds = number,
           .help = "Coulomb's friction coefficient",
           .unit = "-",
           .fallback = "0",
           .min = 0,
           .native = true},
          {.key = "bodies",
           .kinds = list,
           .help = "the bodies. All other particles form one more body, the first. Without this "
                   "list each material is a body",
           .section = body_section,
           .native = true},
      }};
  return section;
}

const Section& blending_section() {
  static const Section section{
      .name = "analysis.velocity_update_settings",
      .path = "analysis.velocity_update_settings",
      .help =
          "Particle velocities have a part that nodes do not represent. These keys set how fast "
          "particles lose that part. It decays over time, so that half the time step does not "
          "change the damping. Only the blending_ratio of CB-Geo's input acts per step. "
          "history.csv counts the dissipated energy as damping.",
      .keys = {
          {.key = "blending_ratio",
           .kinds = number,
           .help =
               "share of FLIP: 1 = FLIP, 0 = PIC. Particles keep this share of the part in the "
               "time in which a wave crosses a cell; the same as relaxation = -ln(blending_ratio). "
               "With the preset cbgeo they keep this share in each step. Default 1; with apic, "
               "tpic, xpic and fmpm 0; with asflip relaxation 0.05; with the preset cbgeo 1",
           .unit = "-",
           .min = 0,
           .max = 1},
          {.key = "relaxation",
           .kinds = number,
           .help =
               "decay rate of the part, times the time h / c in which a wave crosses a cell: after "
               "that time exp(-relaxation) of the noise is left. h: cell size (mean size for a "
               "mesh from a file); c: lowest wave speed of the body's materials, of a projection "
               "without "
               "gravity 0. 0 = FLIP",
           .unit = "-",
           .min = 0,
           .native = true},
          {.key = "viscosity",
           .kinds = number,
           .help = "kinematic viscosity of the transfer for motion that the mesh resolves, "
                   "whatever the cell size. The part decays at the rate viscosity / (k h^2). k is "
                   "1/6 with functions of elements (second order: 1/12), 1/4 with quadratic "
                   "splines, 1/3 with cubic splines, and 3/16 with domains. With `relaxation` of "
                   "order 1 as well, the higher rate holds; relaxation of a higher order acts "
                   "beside the viscosity, which is of order 1",
           .unit = "m^2/s",
           .min = 0,
           .native = true},
          {.key = "viscosity_length",
           .kinds = number,
           .help = "length l of a viscosity l sqrt(p / density) of grains under the pressure p, "
                   "beside a relaxation of order 2 or more. Friction then grows with the rate of "
                   "shear, as in the law mu(I): of glass beads l is 1.2 diameters",
           .unit = "m",
           .min = 0,
           .native = true},
          {.key = "relaxation_time",
           .kinds = number,
           .help = "time in which noise decays to 37 %. A longer step removes all of it",
           .unit = "s",
           .min = 0,
           .above_min = true,
           .native = true},
          {.key = "order",
           .kinds = integer,
           .help =
               "order of the filter that separates the part. It damps a wave of wave number q at a "
               "rate of about (q^2 h^2 / 6)^order / relaxation time. 1 = PIC, with functions of "
               "any kind. Each further order costs one mapping. Default 1, with xpic and fmpm 2",
           .min = 1,
           .max = 10,
           .native = true},
          {.key = "separation",
           .kinds = number,
           .help = "for asflip. A particle keeps a part of its own velocity, and this share (beta) "
                   "of that part also moves it. The share is zero where the particle is "
                   "compressed, along directions in which a node in its reach is held, at walls, "
                   "and between bodies. 0: all particles move with the nodes. Default 1",
           .unit = "-",
           .min = 0,
           .max = 1,
           .native = true},
      }};
  return section;
}

const Section& time_step_section() {
  static const Section section{
      .name = "analysis.time_step",
      .path = "analysis.time_step",
      .help =
          "The stability limit of a particle is h / (c + |v|), with the cell size h, the wave "
          "speed c of its material and its speed v. A viscous fluid also has the limit h^2 density "
          "/ (2 dim 4/3 viscosity). A fixed `dt` above the smallest limit is an error unless "
          "`accept_unstable` is true. An adaptive step is `safety` times the smallest limit, and "
          "at most `analysis.dt` if that is given. Implicit steps have no such limit. Adaptive "
          "ones begin with `analysis.dt`, which is also the longest. The next step is longer by "
          "half where Newton's method took few iterations (`safety`), and half as long where it "
          "took more than three quarters of `max_iteration`. A step that is not solved, or moves "
          "nodes by more than a cell, is cut to a quarter, down to `analysis.watchdog.time_step`.",
      .keys = {
          {.key = "adaptive",
           .kinds = boolean,
           .help = "true: choose the time step from the limit. Default: true without `dt`; with "
                   "the preset cbgeo, and of implicit steps, false",
           .native = true},
          {.key = "safety",
           .kinds = number,
           .help =
               "adaptive step as a share of the limit. Default 0.4; 0.2 if a material is granular "
               "(it has a tension limit and is not a fluid); with the preset cbgeo 0.5. Of "
               "implicit steps: iterations of Newton's method after which the next step is longer, "
               "as a share of `max_iteration`; default 0.2",
           .unit = "-",
           .min = 0,
           .max = 1,
           .above_min = true,
           .native = true},
          {.key = "accept_unstable",
           .kinds = boolean,
           .help = "warn about a fixed step above the limit instead of refusing it",
           .fallback = "false",
           .native = true},
      }};
  return section;
}

const Section& watchdog_section() {
  static const Section section{
      .name = "analysis.watchdog",
      .path = "analysis.watchdog",
      .help =
          "Results beyond these bounds cannot be right. The run then ends with exit code 3. It "
          "writes a frame, a checkpoint, and a message with the location and the most likely "
          "cause. It checks sums, speeds and volumes every 64 steps, and adaptive steps every "
          "time. It ends 4 steps after the check. A run can continue from the checkpoint with "
          "other bounds.",
      .keys = {
          {.key = "action",
           .kinds = text,
           .help = "stop: end the run; warn: warn once and continue; off. Default: stop; with the "
                   "preset cbgeo warn",
           .allowed = {"stop", "warn", "off"},
           .native = true},
          {.key = "energy",
           .kinds = number,
           .help =
               "largest spurious energy, as a share of the energy that was put in. That is the "
               "kinetic energy at the start, the largest possible elastic energy of the initial "
               "stresses, and the largest external work. It is at least the energy of all material "
               "at a strain of 0.1 % and after a fall through 1 % of the mesh. 0: no check",
           .unit = "-",
           .fallback = "1",
           .min = 0,
           .native = true},
          {.key = "speed",
           .kinds = number,
           .help = "largest particle speed, as a multiple of the largest of these: wave speeds of "
                   "the materials; speeds at the start; prescribed and injection speeds; "
                   "prescribed accelerations times the time; the speed after a fall through the "
                   "mesh; the speed of the whole mass with the energy that was put in. 0: no check",
           .unit = "-",
           .fallback = "10",
           .min = 0,
           .native = true},
          {.key = "time_step",
           .kinds = number,
           .help = "smallest adaptive step, as a share of the first. Steps that are shortened for "
                   "output do not count. A step too small to change the time is always beyond the "
                   "bounds. Implicit steps are not cut further, whatever `action` is",
           .unit = "-",
           .fallback = "1e-3",
           .min = 0,
           .max = 1,
           .native = true},
          {.key = "compression",
           .kinds = number,
           .help = "smallest volume of a particle, as a share of the volume of its mass at the "
                   "initial density",
           .unit = "-",
           .fallback = "0.01",
           .min = 0,
           .max = 1,
           .native = true},
          {.key = "expansion",
           .kinds = number,
           .help = "largest volume of a particle, as the same share; 0: no check",
           .unit = "-",
           .fallback = "1e6",
           .min = 0,
           .native = true},
      }};
  return section;
}

const Section& free_surface_section() {
  static const Section section{
      .name = "analysis.free_surface_detection",
      .path = "analysis.free_surface_detection",
      .help =
          "Where a liquid ends. In a projection its pressure is zero at nodes of cells that are "
          "filled, if some cells around the node are not. Explicit steps need no detection: the "
          "weak form of the liquid's momentum has no pressure where nothing acts.",
      .keys = {
          {.key = "type",
           .kinds = text,
           .help = "none: no pressure is zero, but where `pressure_constraints` say so. Else as "
                   "above. Default density",
           .allowed = {"none", "density", "geometry"}},
          {.key = "volume_tolerance",
           .kinds = number,
           .help = "a cell is filled if its particles have at least this share of its volume",
           .unit = "-",
           .fallback = "0.25",
           .min = 0,
           .max = 1},
      }};
  return section;
}

}  // namespace

const Section& analysis_section() {
  static const Section section{
      .name = "analysis",
      .path = "analysis",
      .help =
          "How the equations are integrated. `dt` is required unless the step is adaptive. "
          "`nsteps` or `end_time` is required. With both, whichever comes first ends the run.",
      .keys = {
          {.key = "type",
           .kinds = text,
           .help = "which equations; the default follows from the "
                   "dimension",
           .fallback = "\"MPMExplicit2D\"",
           .fallback_3d = "\"MPMExplicit3D\"",
           .allowed = {"MPMExplicit2D", "MPMExplicit3D", "MPMExplicitTwoPhase2D",
                       "MPMExplicitTwoPhase3D", "MPMImplicit2D", "MPMImplicit3D",
                       "MPMSemiImplicitNavierStokes2D", "MPMSemiImplicitNavierStokes3D",
                       "MPMSemiImplicitTwoPhase2D", "MPMSemiImplicitTwoPhase3D"}},
          {.key = "preset",
           .kinds = text,
           .help = "defaults of keys that are not written. \"cbgeo\": those of CB-Geo MPM. "
                   "\"lahar\": stable ones. Default: \"cbgeo\" if `type` is written, as in "
                   "CB-Geo's input, or with --as-cbgeo; otherwise \"lahar\"",
           .allowed = {"lahar", "cbgeo"},
           .native = true},
          {.key = "mpm_scheme",
           .kinds = text,
           .help = "when stresses are updated: before the forces (usf), at the end of the step "
                   "(usl), or at the end after a second mapping of velocities (musl). newmark: "
                   "implicit steps, which find the displacements of nodes for which forces "
                   "balance (see scheme_settings). projection: liquids do not change their volume, "
                   "and their pressure is solved for. Default musl; of elastic bodies without "
                   "contact and nodal forces, with smooth functions, usl; with the preset cbgeo "
                   "usf; if `type` is MPMImplicit, newmark; if it is MPMSemiImplicit, projection",
           .allowed = {"usf", "usl", "musl", "newmark", "projection"}},
          {.key = "scheme_settings",
           .kinds = object,
           .help = "parameters of implicit steps",
           .section = scheme_settings_section},
          {.key = "linear_solver",
           .kinds = object,
           .help = "solver of the linear systems of implicit steps",
           .section = linear_solver_section},
          {.key = "stress_update",
           .kinds = text,
           .help = "older spelling of mpm_scheme, accepted with a warning. CB-Geo MPM ignores it "
                   "and runs usf; so does --as-cbgeo",
           .allowed = {"usf", "usl", "musl", "USF", "USL", "MUSL"}},
          {.key = "stress_analysis",
           .kinds = text,
           .help = "the same as stress_update, in some published cases",
           .allowed = {"usf", "usl", "musl", "USF", "USL", "MUSL"}},
          {.key = "velocity_update",
           .kinds = boolean | text,
           .help = "update of the particle velocity. false or \"flip\": add the nodal "
                   "acceleration. true or \"pic\": take the nodal velocity. \"apic\" and \"tpic\": "
                   "take the nodal velocity, and keep an affine field around the particle that "
                   "also maps to the nodes (apic: its moments; tpic: the velocity gradient). With "
                   "functions of elements the two are identical. apic needs linear functions: "
                   "second-order functions have no moments. \"asflip\": apic, but particles keep "
                   "of their own velocities what flip keeps, and move with it where material "
                   "separates (Fei et al. 2021). \"xpic\": a higher-order filter removes from the "
                   "particle velocity what nodes do not represent (Hammerquist and Nairn 2017). "
                   "\"fmpm\": the same filter acts on the change of velocity (Nairn and "
                   "Hammerquist 2021). With velocity_update_settings all of these act over time",
           .fallback = "false",
           .allowed = {"flip", "pic", "apic", "tpic", "asflip", "xpic", "fmpm"}},
          {.key = "shape_functions",
           .kinds = text,
           .help = "functions between particles and nodes. element: those of the elements. The "
                   "others need a mesh of equal boxes. gimp: means over the particle's box, which "
                   "stretches with the particle. uniform_gimp: boxes keep their size. cpdi: boxes "
                   "deform to parallelepipeds. cpdi2: boxes deform to hexahedra; their corners "
                   "move with the nodes, so that particles keep their common corners. "
                   "quadratic_spline, cubic_spline: B-splines of nodes; at walls only those of "
                   "wall nodes are not zero. Default: quadratic_spline on meshes of equal boxes "
                   "with Q4 or H8 cells; otherwise, and with the preset cbgeo, element",
           .allowed = shape_function_keys(),
           .native = true},
          {.key = "large_domains",
           .kinds = text,
           .help = "what to do if a domain of GIMP, CPDI or CPDI2 reaches further than a cell from "
                   "its centre. clip: use the functions of a smaller domain. error: stop the run",
           .fallback = "\"clip\"",
           .allowed = {"clip", "error"},
           .native = true},
          {.key = "velocity_update_settings",
           .kinds = object,
           .help = "how much particles keep of their own velocities. Default if `velocity_update` "
                   "is not written either: relaxation 0.05 (elastic bodies on boxes have "
                   "velocity_update apic). If gravity acts and any material is "
                   "not a fluid: relaxation 0.01 and viscosity 0.0075 sqrt(g H^3); if any is of "
                   "grains without a liquid in their pores, relaxation 0.03 of order 3 and "
                   "viscosity 0.001 sqrt(g H^3); with functions of elements always 0.05 of order 1 "
                   "and 0.015 sqrt(g H^3). H is the mean depth: the volume "
                   "of the particles, divided by the area of their bounding box seen along "
                   "gravity; if they are deeper than wide, the root of depth times width. Where "
                   "waves of what flows have a speed c above 15 sqrt(2 g H), "
                   "relaxation of order 1 is multiplied by 15 sqrt(2 g H) / c. The preset cbgeo "
                   "has no such default",
           .section = blending_section},
          {.key = "dt",
           .kinds = number,
           .help = "time step; the largest one if adaptive",
           .unit = "s",
           .min = 0,
           .above_min = true},
          {.key = "nsteps",
           .kinds = integer,
           .help = "number of steps; may be written 1.0E+5",
           .min = 0,
           .max = 9e15},
          {.key = "end_time",
           .kinds = number,
           .help = "time at which the run ends. A fixed step is not shortened: the last step ends "
                   "there or up to a step later",
           .unit = "s",
           .min = 0,
           .native = true},
          {.key = "until",
           .kinds = object,
           .help = "the run ends by itself when it has come to rest",
           .section = until_section,
           .native = true},
          {.key = "time_step",
           .kinds = object,
           .help = "adaptive steps and the stability limit",
           .fallback = "{}",
           .section = time_step_section,
           .native = true},
          {.key = "watchdog",
           .kinds = object,
           .help = "bounds beyond which results cannot be right, and what to do then",
           .fallback = "{}",
           .section = watchdog_section,
           .native = true},
          {.key = "uuid",
           .kinds = text,
           .help = "name of the run folder; default: the title, or "
                   "the scenario's file name"},
          {.key = "locate_particles",
           .kinds = boolean,
           .help = "false: remove particles that leave the mesh, instead of stopping the run. "
                   "Default true, but for the few of lost_share"},
          {.key = "lost_share",
           .kinds = number,
           .help = "share of the particles that may leave the mesh. They are removed, and the run "
                   "warns. It ends when more have left. Default 0.005 if a material is granular "
                   "(it has a tension limit and is not a fluid) and locate_particles is not given: "
                   "single grains fly far. Else 0",
           .unit = "-",
           .min = 0,
           .max = 1,
           .native = true},
          {.key = "damping", .kinds = object, .help = "damping", .section = damping_section},
          {.key = "pressure_smoothing",
           .kinds = boolean,
           .help =
               "average the pressure of fluids over nodes before the stress update. The pressure "
               "then no longer follows the volume: water at rest becomes denser and denser",
           .fallback = "false"},
          {.key = "b_bar",
           .kinds = boolean,
           .help = "the particles of a cell have the mean of their volumetric strains, and of "
                   "their pressures in the forces (B-bar, Hughes 1980). A volume that can hardly "
                   "change then does not lock the cell. For explicit and implicit steps, with "
                   "functions of elements, GIMP and splines. Default true in implicit steps for Q4 "
                   "and H8 with their own functions, else false; for CB-Geo's input as "
                   "`particle_type` says",
           .native = true},
          {.key = "plane",
           .kinds = text,
           .help = "what a model in two dimensions is a section of. strain: a body that does not "
                   "deform across the plane; a metre of it counts. stress: a sheet without stress "
                   "across the plane, whose thickness is one metre at first and changes. "
                   "axisymmetric: a body of revolution; x is the radius, from x = 0 on, and y the "
                   "axis. Volumes, masses, forces and energies are then those of the whole "
                   "circumference; the component zz of stresses is that around the axis. Nodes at "
                   "x = 0 are held along x",
           .fallback = "\"strain\"",
           .allowed = {"strain", "stress", "axisymmetric"},
           .native = true},
          {.key = "opening",
           .kinds = boolean,
           .help = "true: material at its tension limit expands by gaps between grains or drops. "
                   "The gaps close before the material has stress again. The field `opening` is "
                   "their volume as a share of the material's volume. The volume of a particle is "
                   "that of its material alone. Default true; for CB-Geo's input and in implicit "
                   "analyses false",
           .native = true},
          {.key = "interface",
           .kinds = boolean,
           .help = "contact between bodies. Each body has its own nodal velocities. Bodies "
                   "interact where they share a node",
           .fallback = "false"},
          {.key = "contact",
           .kinds = object,
           .help = "bodies and their friction",
           .section = contact_section,
           .native = true},
          {.key = "as_cbgeo",
           .kinds = boolean,
           .help = "reproduce what CB-Geo MPM computes where that deviates from its documentation "
                   "or from physics (see \"What --as-cbgeo changes\"); --as-cbgeo sets it",
           .fallback = "false",
           .native = true},
          {.key = "patch_particles",
           .kinds = integer,
           .help = "target number of particles per patch, the unit of parallel work. It changes "
                   "the rounding of results",
           .fallback = "4096",
           .min = 1,
           .max = 1e9,
           .native = true},
          {.key = "split_steps",
           .kinds = integer,
           .help =
               "steps between searches for patches with more than 4 times patch_particles. Such "
               "patches are split 4 steps later. 0: never. It changes the rounding of results",
           .fallback = "100",
           .min = 0,
           .max = 9e15,
           .native = true},
          {.key = "nload_balance_steps",
           .kinds = integer,
           .help = "without effect: work moves between ranks by itself, where that pays",
           .min = 0},
          {.key = "verbosity",
           .kinds = any,
           .help = "ignored by CB-Geo MPM",
           .support = Support::ignored},
          {.key = "free_surface_detection",
           .kinds = object,
           .help = "where the liquid in pores ends. Surfaces that nothing loads drain without it",
           .section = free_surface_section},
          {.key = "stress_rate",
           .kinds = text,
           .help = "jaumann: stresses and strains turn with the material; none: they do not, as in "
                   "CB-Geo MPM. NeoHookean always turns its own. Default jaumann; none with "
                   "preset cbgeo",
           .allowed = {"jaumann", "none"}},
          {.key = "newmark",
           .kinds = any,
           .help = "write scheme_settings",
           .support = Support::ignored},
          {.key = "state_variable_smoothing",
           .kinds = any,
           .help = "average state variables over nodes (from a branch of CB-Geo MPM)",
           .support = Support::planned},
          {.key = "pore_pressure_smoothing",
           .kinds = boolean,
           .help =
               "particles take the mean of pore pressures at nodes in every step, which drains a "
               "little in each; default false"},
          {.key = "gravity",
           .kinds = numbers,
           .help = "write external_loading_conditions.gravity. Another gravity here is an error",
           .unit = "m/s^2"},
          {.key = "resume",
           .kinds = object,
           .help =
               "continue an earlier run from its particle file. Files do not contain the domains "
               "of particles: domains of GIMP and CPDI begin again as boxes, and cpdi2 is "
               "refused, and so are free rigid bodies",
           .section = resume_section},
      }};
  return section;
}

}  // namespace lahar
