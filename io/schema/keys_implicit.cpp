// Tables of implicit analyses: the scheme and its linear systems.
#include "io/schema/keys.h"

namespace lahar {

const Section& scheme_settings_section() {
  static const Section section{
      .name = "analysis.scheme_settings",
      .path = "analysis.scheme_settings",
      .help =
          "Implicit steps, with \"mpm_scheme\": \"newmark\". The unknowns of a step are the nodal "
          "displacements for which forces balance at its end. Newton's method solves for them. An "
          "iteration is the last one if one of the three tolerances is met.",
      .keys = {
          {.key = "nonlinear",
           .kinds = boolean,
           .help = "Newton's method. false: one linear system per step",
           .fallback = "true"},
          {.key = "quasi_static",
           .kinds = boolean,
           .help = "a sequence of equilibria without inertia. Time is what loads depend on",
           .fallback = "false"},
          {.key = "beta",
           .kinds = number,
           .help = "Newmark's parameter of the displacement. Default (gamma + 0.5)^2 / 4, the "
                   "least with which all steps are stable; with the preset cbgeo 0.25. 0.25 with "
                   "gamma 0.5 is the rule of mean acceleration, which keeps the energy of linear "
                   "systems. With "
                   "\"mpm_scheme\": \"projection\" the share of the pressure that acts before it "
                   "is corrected: 0 of fluids, 1 with a liquid in pores or with --as-cbgeo",
           .unit = "-",
           .min = 0,
           .max = 1},
          {.key = "gamma",
           .kinds = number,
           .help = "Newmark's parameter of the velocity. Values above 0.5 damp short waves",
           .unit = "-",
           .fallback = "0.5",
           .min = 0.5,
           .max = 1},
          {.key = "max_iteration",
           .kinds = integer,
           .help = "most iterations of Newton's method in a step, or in a part of it",
           .fallback = "40",
           .min = 1,
           .max = 1e9},
          {.key = "displacement_tolerance",
           .kinds = number,
           .help = "change of the nodal displacements in an iteration, as root mean square",
           .unit = "m",
           .fallback = "1e-10",
           .min = 0},
          {.key = "residual_tolerance",
           .kinds = number,
           .help = "unbalanced nodal force, as root mean square",
           .unit = "N",
           .fallback = "1e-10",
           .min = 0},
          {.key = "relative_residual_tolerance",
           .kinds = number,
           .help = "unbalanced nodal force as a share of the first one of the step",
           .unit = "-",
           .fallback = "1e-6",
           .min = 0},
          {.key = "b_bar",
           .kinds = boolean,
           .help = "older place of `b_bar` of analysis",
           .native = true},
          {.key = "verbosity", .kinds = integer, .help = "no effect", .min = 0},
      }};
  return section;
}

namespace {

// Keys that the solver of all systems has, and that of one kind of unknown.
std::vector<KeySpec> solver_keys() {
  return {
      {.key = "solver_type",
       .kinds = text,
       .help = "DirectEigen: a sparse factorization; IterativeEigen and KrylovPETSC: conjugate "
               "gradients, or a method for unsymmetric systems where these are. Default: by size",
       .allowed = {"DirectEigen", "IterativeEigen", "KrylovPETSC"}},
      {.key = "max_iter",
       .kinds = integer,
       .help = "most iterations of the iterative solver; default: by size",
       .min = 1,
       .max = 9e15},
      {.key = "tolerance",
       .kinds = number,
       .help = "residual of the iterative solver as a share of the right side; default: what "
               "Newton's method needs, between 1e-9 and 1e-4; in projections 1e-7",
       .unit = "-",
       .min = 0},
  };
}

const Section& solver_settings_section() {
  static const Section section = [] {
    Section one{.name = "an entry of solver_settings",
                .path = "analysis.linear_solver.solver_settings[]",
                .help =
                    "The solver of one kind of unknown. It takes precedence over the keys of "
                    "`linear_solver`.",
                .keys = {{.key = "dof",
                          .kinds = text,
                          .help = "unknown. Entries of others than displacement have no effect",
                          .required = true,
                          .allowed = {"displacement", "acceleration", "pressure"}}}};
    for (const KeySpec& key : solver_keys()) one.keys.push_back(key);
    for (const char* key : {"sub_solver_type", "preconditioner_type"})
      one.keys.push_back({.key = key, .kinds = text, .help = "no effect"});
    for (const char* key : {"abs_tolerance", "div_tolerance"})
      one.keys.push_back({.key = key, .kinds = number, .help = "no effect", .min = 0});
    one.keys.push_back({.key = "verbosity", .kinds = integer, .help = "no effect", .min = 0});
    return one;
  }();
  return section;
}

}  // namespace

const Section& linear_solver_section() {
  static const Section section = [] {
    Section all{.name = "analysis.linear_solver",
                .path = "analysis.linear_solver",
                .help =
                    "Solver of the linear systems of implicit steps. Results do not depend on "
                    "it beyond `tolerance`.",
                .keys = solver_keys()};
    all.keys.push_back({.key = "solver_settings",
                        .kinds = list,
                        .help = "solvers by kind of unknown",
                        .section = solver_settings_section});
    all.keys.push_back({.key = "assembler_type", .kinds = text, .help = "no effect"});
    all.keys.push_back({.key = "verbosity", .kinds = integer, .help = "no effect", .min = 0});
    return all;
  }();
  return section;
}

}  // namespace lahar
