// Steps of generated scenarios that solve systems: implicit ones and projections.
#include <fmt/format.h>

#include "tests/properties/scenario_parts.h"

namespace lahar::test {

namespace {

Json linear_solver_of(Choices& choices) {
  Json solver = Json::object();
  switch (choices.pick("solves.solver", 3)) {
    case 1:
      solver["solver_type"] = "DirectEigen";
      break;
    case 2:
      solver["solver_type"] = "IterativeEigen";
      if (choices.chance("solves.exact", 30)) solver["tolerance"] = 1e-11;
      if (choices.chance("solves.stops", 10)) solver["max_iter"] = 4;
      break;
    default:
      break;
  }
  return solver;
}

Json implicit_steps_of(Choices& choices, const Outline& outline) {
  Json settings = Json::object();
  if (outline.solves == "equilibrium") settings["quasi_static"] = true;
  if (choices.chance("solves.linear", 15)) settings["nonlinear"] = false;
  if (choices.chance("solves.damped", 30)) settings["gamma"] = 0.7;
  settings["max_iteration"] = choices.of("solves.iterations", {10, 6, 3});
  if (choices.chance("solves.closely", 30)) settings["relative_residual_tolerance"] = 1e-9;
  Json steps{{"type", fmt::format("MPMImplicit{}D", outline.dim)},
             {"mpm_scheme", "newmark"},
             {"dt", choices.number("solves.dt", 0.5, 0.1, 2) * stable_step(outline)},
             {"scheme_settings", settings}};
  if (!outline.displaces && choices.chance("solves.adapts", 30)) {
    steps["time_step"]["adaptive"] = true;
    if (choices.chance("solves.adapts.soon", 50)) steps["time_step"]["safety"] = 0.6;
  }
  return steps;
}

Json projection_of(Choices& choices, const Outline& outline) {
  const char* phases = outline.pores ? "TwoPhase" : "NavierStokes";
  Json steps{{"type", fmt::format("MPMSemiImplicit{}{}D", phases, outline.dim)},
             {"mpm_scheme", "projection"}};
  const bool free = outline.pores || !outline.pressured;  // else nothing may be kept
  if (choices.chance("solves.kept", 40))
    steps["scheme_settings"]["beta"] = free ? choices.number("solves.share", 0, 0, 1) : 0;
  else if (!free && outline.cbgeo)
    steps["scheme_settings"]["beta"] = 0;
  if (choices.chance("solves.surface", 30)) {
    Json& surface = steps["free_surface_detection"];
    surface["type"] = choices.of("solves.surface.kind", {"density", "geometry", "none"});
    if (choices.chance("solves.surface.full", 50)) surface["volume_tolerance"] = 0.6;
  }
  return steps;
}

}  // namespace

Json solving_steps_of(Choices& choices, const Outline& outline) {
  Json steps =
      outline.projects() ? projection_of(choices, outline) : implicit_steps_of(choices, outline);
  if (const Json solver = linear_solver_of(choices); !solver.empty())
    steps["linear_solver"] = solver;
  return steps;
}

Json explicit_steps_of(Choices& choices, const std::string& of, const Outline& outline) {
  return {{"type", fmt::format("MPMExplicit{}D", outline.dim)},
          {"mpm_scheme", choices.of(of + "scheme.name", {"musl", "usf"})},
          {"dt", 0.3 * stable_step(outline)},
          {"time_step", {{"adaptive", false}, {"accept_unstable", true}}},
          {"scheme_settings", nullptr},
          {"linear_solver", nullptr}};
}

}  // namespace lahar::test
