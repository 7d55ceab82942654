// Tables of the analysis: scheme, time step, damping, restart.
#include "io/schema/fields.h"
#include "physics/particles/patch_split.h"

namespace lahar {

namespace {

static_assert(split_factor == 4, "the help of split_steps says so");

const Section& resume_section() {
  static const Section section{
      .name = "analysis.resume",
      .path = "analysis.resume",
      .help =
          "Go on from a particle file of CB-Geo MPM, particlesNNN.h5 in the folder `uuid` of "
          "post_processing.path (of a parallel run: those of all its ranks). The file has the "
          "state of the particles, and their ids, so that sets and loads act on the same ones. "
          "With a fixed `dt` the run begins with step `step` + 1, and `nsteps` and `end_time` "
          "count "
          "what was before; with adaptive steps time and steps begin at 0. "
          "Materials have the parameters of this scenario, whatever they were before: of "
          "MohrCoulomb `phi`, `psi` and `cohesion` follow from them and from `pdstrain`. "
          "`lahar export --to cbgeo` writes such files.",
      .fields = {
          {.key = "resume",
           .kinds = boolean,
           .help = "false: start from the beginning",
           .fallback = "false"},
          {.key = "uuid", .kinds = text, .help = "run to continue"},
          {.key = "step",
           .kinds = integer,
           .help = "step of the file, counted from 0: after it, step + 1 steps are done",
           .min = 0,
           .max = 9e15},
          {.key = "repartition",
           .kinds = boolean,
           .help = "no meaning here: patches do not depend "
                   "on ranks",
           .support = Support::ignored},
      }};
  return section;
}

const Section& damping_section() {
  static const Section section{
      .name = "analysis.damping",
      .path = "analysis.damping",
      .help =
          "Local damping: a force against each velocity component, `damping_factor` times the "
          "component of the unbalanced nodal force (Cundall 1987). With analysis.preset \"cbgeo\" "
          "times the magnitude of the whole force: then walls that carry a side pressure shake "
          "what is beside them for ever.",
      .fields = {
          {.key = "type",
           .kinds = text,
           .help = "kind of damping",
           .required = true,
           .allowed = {"Cundall"}},
          {.key = "damping_factor",
           .kinds = number,
           .help = "share of the unbalanced force",
           .unit = "-",
           .min = 0,
           .max = 1},
          {.key = "damping_ratio",
           .kinds = number,
           .help =
               "the same as damping_factor, in the documentation of CB-Geo MPM, which ignores it",
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
          "The particles of a material, or of a particle set, which need not be all of their "
          "material. Of several bodies that name a particle the last set counts, and any set "
          "counts before materials.",
      .fields = {
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
          "Bodies that would overlap at a node within the step get the impulses that close the gap "
          "between them and no more, and Coulomb friction along the surface (Bardenhagen et al. "
          "2001); bodies that part are free. The gap lies between the ends of their particles, "
          "along "
          "the normal that gives the largest. Impulses keep prescribed velocities. More than two "
          "bodies at a node meet two at a time, in the order of the list, several times. Contact "
          "needs \"mpm_scheme\": \"musl\": with usf it makes energy or takes it, with usl it takes "
          "too much. CB-Geo's input gets a warning instead. A nodal force acts on the first body "
          "that is at its node; constraints hold all of them. In history.csv, damping has the "
          "energy that contact takes, and friction the part of it that friction takes.",
      .fields = {
          {.key = "friction",
           .kinds = number,
           .help = "Coulomb's friction coefficient",
           .unit = "-",
           .fallback = "0",
           .min = 0,
           .native = true},
          {.key = "bodies",
           .kinds = list,
           .help = "the bodies; all particles that no entry names are one more, the first. Without "
                   "the list each material is a body",
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
          "What particles keep of the part of their velocities that nodes do not have. They lose "
          "it in a time, so that halving the time step does not change how much is damped; only "
          "the blending_ratio of CB-Geo's input acts per step. What is taken is counted as "
          "damping in history.csv.",
      .fields = {
          {.key = "blending_ratio",
           .kinds = number,
           .help = "share of FLIP: 1 = FLIP, 0 = PIC; default 1, with apic, tpic, xpic and fmpm 0, "
                   "with asflip relaxation 0.05, with CB-Geo's defaults 1. "
                   "It is what is kept in the time of a wave through a cell, the same as "
                   "relaxation = -ln(blending_ratio); with CB-Geo's defaults (preset), in a step",
           .unit = "-",
           .min = 0,
           .max = 1},
          {.key = "relaxation",
           .kinds = number,
           .help = "share of the part that is lost in the time of a wave through a cell, h / c, "
                   "if at a constant rate: of noise exp(-relaxation) is left. h: the mesh's cells "
                   "(of a table, mean), c: the slowest of "
                   "the wave speeds of the body's materials. 0 = FLIP",
           .unit = "-",
           .min = 0,
           .native = true},
          {.key = "viscosity",
           .kinds = number,
           .help =
               "kinematic viscosity that the transfer gives to what the mesh resolves, whatever "
               "its cells: the part relaxes at the rate viscosity / (k h^2), k = 1/6 with "
               "functions of elements (second order: 1/12), 1/4 and 1/3 with quadratic and "
               "cubic splines, 3/16 with domains; with `relaxation` at the higher of both "
               "rates. Order 1 only",
           .unit = "m^2/s",
           .min = 0,
           .native = true},
          {.key = "relaxation_time",
           .kinds = number,
           .help = "the time in which noise falls to 37 %. A longer step takes all of it",
           .unit = "s",
           .min = 0,
           .above_min = true,
           .native = true},
          {.key = "order",
           .kinds = integer,
           .help = "of the filter that tells the part: a wave of wave number q is damped at the "
                   "rate (q^2 h^2 / 6)^order / relaxation time or so. 1 = PIC, with functions of "
                   "any kind; each order more costs one mapping. Default 1, with xpic and fmpm 2",
           .min = 1,
           .max = 10,
           .native = true},
          {.key = "separation",
           .kinds = number,
           .help = "of asflip: the share beta of what a particle keeps of its own velocity that "
                   "also moves it. It is zero where the particle is compressed, along directions "
                   "in which a node that it reaches is held, and at walls and between bodies. "
                   "0: all move with the nodes. Default 1",
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
          "The stability limit of a particle is h / (c + |v|) with the cell size h, the wave "
          "speed c of its material and its speed v; for a viscous fluid also h^2 density / (2 dim "
          "4/3 viscosity). A fixed `dt` above the smallest limit is "
          "an error unless `accept_unstable` says otherwise; an adaptive step is `safety` "
          "times the smallest limit, and at most `analysis.dt` where that is given.",
      .fields = {
          {.key = "adaptive",
           .kinds = boolean,
           .help =
               "choose the time step from the limit. Default: true where there is no `dt`; with "
               "the preset cbgeo false",
           .native = true},
          {.key = "safety",
           .kinds = number,
           .help = "share of the limit that an adaptive step takes. Default 0.4, and 0.2 where a "
                   "material is of grains: it has a limit of tension and is not a fluid; with the "
                   "preset cbgeo 0.5",
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
          "Results beyond these bounds cannot be right. The run then ends with exit code 3, a "
          "message that says what, where and why most likely, a frame and a checkpoint. Sums, "
          "speeds and volumes are looked at every 64 steps, adaptive steps each time; a run ends "
          "4 steps later. From the checkpoint a run may go on with other bounds.",
      .fields = {
          {.key = "action",
           .kinds = text,
           .help = "stop: end the run; warn: say it once and go on; off. Default: stop, with the "
                   "preset cbgeo warn",
           .allowed = {"stop", "warn", "off"},
           .native = true},
          {.key = "energy",
           .kinds = number,
           .help = "energy made out of nothing, as a share of what was "
                   "put in: kinetic at the start, most elastic energy that the initial stresses "
                   "may hold, largest work from outside. What a strain of 0.1 % or a fall through "
                   "1 % of the mesh would be in all of the material counts as put in. 0: not "
                   "watched",
           .unit = "-",
           .fallback = "1",
           .min = 0,
           .native = true},
          {.key = "speed",
           .kinds = number,
           .help = "largest particle speed, as a multiple of the largest of these: waves in the "
                   "materials, speeds at the start, prescribed and injected ones, prescribed "
                   "accelerations times the time, the fall through the mesh, and what the energy "
                   "that was put in would give to all of the mass. 0: not watched",
           .unit = "-",
           .fallback = "10",
           .min = 0,
           .native = true},
          {.key = "time_step",
           .kinds = number,
           .help = "least adaptive step, as a share of the first; shortened ones for output do not "
                   "count. A step that does not change the time is always beyond the bounds",
           .unit = "-",
           .fallback = "1e-3",
           .min = 0,
           .max = 1,
           .native = true},
          {.key = "compression",
           .kinds = number,
           .help = "least volume of a particle, as a share of that of its mass at the initial "
                   "density",
           .unit = "-",
           .fallback = "0.01",
           .min = 0,
           .max = 1,
           .native = true},
          {.key = "expansion",
           .kinds = number,
           .help = "largest volume of a particle, likewise; 0: not watched",
           .unit = "-",
           .fallback = "1e6",
           .min = 0,
           .native = true},
      }};
  return section;
}

}  // namespace

const Section& analysis_section() {
  static const Section section{
      .name = "analysis",
      .path = "analysis",
      .help =
          "How the equations are integrated. `dt` is required unless the step is adaptive; one "
          "of `nsteps` and `end_time` is required, whichever comes first ends the run.",
      .fields = {
          {.key = "type",
           .kinds = text,
           .help = "which equations; the default follows from the "
                   "dimension",
           .fallback = "\"MPMExplicit2D\"",
           .fallback_3d = "\"MPMExplicit3D\"",
           .allowed = {"MPMExplicit2D", "MPMExplicit3D"},
           .planned = {"MPMImplicit2D", "MPMImplicit3D", "MPMSemiImplicitNavierStokes2D",
                       "MPMSemiImplicitNavierStokes3D", "MPMExplicitTwoPhase2D",
                       "MPMExplicitTwoPhase3D", "MPMSemiImplicitTwoPhase2D",
                       "MPMSemiImplicitTwoPhase3D"}},
          {.key = "preset",
           .kinds = text,
           .help = "the defaults of keys that are not written. \"cbgeo\": as in CB-Geo MPM; the "
                   "default where `type` is written, as CB-Geo's input does, and with --as-cbgeo. "
                   "\"lahar\": stable ones; the default else",
           .allowed = {"lahar", "cbgeo"},
           .native = true},
          {.key = "mpm_scheme",
           .kinds = text,
           .help = "when stresses are updated: before the "
                   "forces (usf), at the end of the step (usl), or at the end with velocities "
                   "mapped once "
                   "more (musl). Default musl; with the preset cbgeo usf",
           .allowed = {"usf", "usl", "musl"}},
          {.key = "stress_update",
           .kinds = text,
           .help = "older spelling of mpm_scheme, honoured "
                   "with a warning (CB-Geo ignores it and runs usf; so does --as-cbgeo)",
           .allowed = {"usf", "usl", "musl"}},
          {.key = "stress_analysis",
           .kinds = text,
           .help = "the same as stress_update, in some published cases",
           .allowed = {"usf", "usl", "musl"}},
          {.key = "velocity_update",
           .kinds = boolean | text,
           .help =
               "particle velocity: false or "
               "\"flip\" adds the nodal acceleration, true or \"pic\" takes the nodal velocity; "
               "\"apic\" and \"tpic\" take it with an affine field around the particle, of which "
               "nodes get their share (apic: its moments; tpic: the velocity gradient). With the "
               "functions of elements the two are the same, and apic is for linear ones: those of "
               "order two have no moments. \"asflip\" is apic whose particles keep of their own "
               "velocities "
               "what flip does, and move with them where material comes apart (Fei et al. 2021). "
               "\"xpic\" takes from its own velocity what a filter of "
               "higher order says that nodes do not have (Hammerquist and Nairn 2017), \"fmpm\" "
               "filters the change of velocity with it (Nairn and Hammerquist 2021). "
               "velocity_update_settings make all of these act in a time",
           .fallback = "false",
           .allowed = {"flip", "pic", "apic", "tpic", "asflip", "xpic", "fmpm"}},
          {.key = "shape_functions",
           .kinds = text,
           .help = "functions between particles and nodes: those of the elements, or on a mesh of "
                   "equal boxes: gimp (means over the particle's box, which stretches with it), "
                   "uniform_gimp (boxes keep their size), cpdi (boxes deform to parallelepipeds), "
                   "cpdi2 (to hexahedra whose corners move with the nodes, so that particles that "
                   "share corners go on doing so), quadratic_spline, cubic_spline (B-splines "
                   "of nodes; at walls only those of wall nodes are not zero). Default: "
                   "quadratic_spline on meshes of equal boxes with Q4 or H8 cells; else, and with "
                   "the preset cbgeo, element",
           .allowed = {"element", "gimp", "uniform_gimp", "cpdi", "cpdi2", "quadratic_spline",
                       "cubic_spline"},
           .native = true},
          {.key = "large_domains",
           .kinds = text,
           .help = "particles of GIMP, CPDI and CPDI2 whose domain reaches further than a cell "
                   "from its "
                   "middle: clip takes the functions of a smaller one, error stops the run",
           .fallback = "\"clip\"",
           .allowed = {"clip", "error"},
           .native = true},
          {.key = "velocity_update_settings",
           .kinds = object,
           .help =
               "what particles keep of their own velocities. Default where `velocity_update` is "
               "not written either: relaxation 0.05; if gravity acts and any material is not a "
               "fluid, relaxation 0.01 and viscosity 0.0075 sqrt(g H^3), with functions of "
               "elements 0.05 and 0.015. H is the mean depth: volume over the box around the "
               "particles, seen along gravity. Nothing with the preset cbgeo",
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
           .help = "time at which the run ends. A fixed step is not shortened: the last one "
                   "ends there or up to a step later",
           .unit = "s",
           .min = 0,
           .native = true},
          {.key = "time_step",
           .kinds = object,
           .help = "adaptive steps and the stability limit",
           .fallback = "{}",
           .section = time_step_section,
           .native = true},
          {.key = "watchdog",
           .kinds = object,
           .help = "when results cannot be right any more, and what to do then",
           .fallback = "{}",
           .section = watchdog_section,
           .native = true},
          {.key = "uuid",
           .kinds = text,
           .help = "name of the run folder; default: the title, or "
                   "the scenario's file name"},
          {.key = "locate_particles",
           .kinds = boolean,
           .help = "false: particles that leave the "
                   "mesh are removed instead of stopping the run",
           .fallback = "true"},
          {.key = "damping", .kinds = object, .help = "damping", .section = damping_section},
          {.key = "pressure_smoothing",
           .kinds = boolean,
           .help = "average the pressure of fluids over nodes before the stress update. The "
                   "pressure then forgets the volume: water at rest gets denser and denser",
           .fallback = "false"},
          {.key = "opening",
           .kinds = boolean,
           .help = "true: what material at its limit of tension expands by are gaps between grains "
                   "or drops (the field `opening`, their volume as a share of the material's), "
                   "which close before it has stress again, and the volume of particles is the "
                   "material's alone. Without it true, for CB-Geo input false",
           .native = true},
          {.key = "interface",
           .kinds = boolean,
           .help = "contact between bodies: each has velocities of its own at the nodes, and they "
                   "meet where it shares a node with another",
           .fallback = "false"},
          {.key = "contact",
           .kinds = object,
           .help = "which bodies there are, and their friction",
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
           .help = "target number of particles per "
                   "patch, the unit of parallel work; part of the result's identity",
           .fallback = "4096",
           .min = 1,
           .max = 1e9,
           .native = true},
          {.key = "split_steps",
           .kinds = integer,
           .help = "every so many steps, patches that hold more than 4 times patch_particles are "
                   "looked for; they are split 4 steps later. 0: never; part of the result's "
                   "identity",
           .fallback = "100",
           .min = 0,
           .max = 9e15,
           .native = true},
          {.key = "nload_balance_steps",
           .kinds = integer,
           .help = "steps between load balances; "
                   "no effect on one rank",
           .min = 0},
          {.key = "verbosity",
           .kinds = any,
           .help = "ignored by the reference",
           .support = Support::ignored},
          {.key = "free_surface_detection",
           .kinds = any,
           .help = "where a liquid ends (dialect of the fork)",
           .support = Support::planned},
          {.key = "stress_rate",
           .kinds = text,
           .help = "objective stress rate (dialect of the fork)",
           .allowed = {"none"},
           .planned = {"jaumann"}},
          {.key = "newmark",
           .kinds = any,
           .help = "of implicit analyses",
           .support = Support::ignored},
          {.key = "scheme_settings",
           .kinds = any,
           .help = "of implicit analyses",
           .support = Support::ignored},
          {.key = "linear_solver",
           .kinds = any,
           .help = "of implicit analyses",
           .support = Support::ignored},
          {.key = "state_variable_smoothing",
           .kinds = any,
           .help = "average state variables over nodes (of a branch of CB-Geo MPM)",
           .support = Support::planned},
          {.key = "pore_pressure_smoothing",
           .kinds = any,
           .help = "average pore pressures over nodes (dialect of the fork)",
           .support = Support::planned},
          {.key = "gravity",
           .kinds = any,
           .help = "it is in external_loading_conditions",
           .support = Support::older},
          {.key = "resume",
           .kinds = object,
           .help =
               "continue an earlier run from its particle file. Files do not have the domains of "
               "particles: those of GIMP and CPDI begin anew as boxes, cpdi2 is refused",
           .section = resume_section},
      }};
  return section;
}

}  // namespace lahar
