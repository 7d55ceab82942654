// Methods, time steps and output of generated scenarios.
#include <fmt/format.h>

#include "physics/particles/derived_fields.h"
#include "tests/properties/scenario_parts.h"

namespace lahar::test {

namespace {

/// What particles keep of their own velocities; empty: the defaults.
Json settings_of(Choices& choices, const Outline& outline) {
  const std::string& update = outline.update;
  Json settings = Json::object();
  if (update == "pic") return settings;
  const bool affine = update == "apic" || update == "tpic" || update == "asflip";
  const bool has_order = update == "xpic" || update == "fmpm";
  int order = has_order ? 2 : 1;
  if (!affine && !outline.pores && choices.chance("transfer.order", 35)) {
    order = 1 + choices.pick("transfer.order.number", 4);
    settings["order"] = order;
  }
  switch (choices.pick("transfer", 5)) {
    case 1:
      settings["relaxation"] = choices.number("transfer.relaxation", 0.1, 0, 1);
      if (order == 1 && update != "asflip" && choices.chance("transfer.both", 40))
        settings["viscosity"] = 0.002;
      if (order > 1 && settings["relaxation"] > 0.0 && choices.chance("transfer.pressure", 40))
        settings["viscosity_length"] = 0.001;
      break;
    case 2:
      settings["relaxation_time"] = choices.number("transfer.time", 0.05, 1e-3, 0.1);
      break;
    case 3:
      settings["blending_ratio"] = choices.number("transfer.ratio", 0.95, 0, 1);
      break;
    case 4:
      if (order == 1 && update != "asflip") settings["viscosity"] = 0.005;
      break;
    default:
      break;
  }
  if (update == "asflip" && choices.chance("transfer.separation", 40)) settings["separation"] = 0.5;
  return settings;
}

void add_step(Choices& choices, const Outline& outline, GeneratedCase& made, Json& analysis) {
  const double dt = stable_step(outline);
  Json step = Json::object();
  if (choices.chance("adaptive", 45)) {
    step["adaptive"] = true;
    step["safety"] = choices.number("safety", 0.4, 0.15, 0.7);
    if (choices.chance("adaptive.limited", 30) || outline.projects()) analysis["dt"] = 0.3 * dt;
  } else {
    analysis["dt"] = choices.number("dt", 0.3, 0.1, 0.6) * dt;
    if (!choices.chance("dt.refused", 2)) step["accept_unstable"] = true;
  }
  if (!step.empty()) analysis["time_step"] = step;
  analysis["nsteps"] = made.steps;
  if (choices.chance("end_time", 15)) analysis["end_time"] = 0.25 * dt * made.steps;
}

void add_contact(Choices& choices, const Outline& outline, Json& analysis) {
  analysis["interface"] = true;
  Json contact = Json::object();
  contact["friction"] = choices.number("contact.friction", 0, 0, 0.6);
  if (outline.materials.size() == 1 || choices.chance("contact.bodies", 30))
    contact["bodies"] = Json::array({{{"pset", "body0"}}});
  analysis["contact"] = contact;
}

void add_watchdog(Choices& choices, Json& analysis) {
  if (!choices.chance("watchdog", 60)) return;
  Json watchdog{{"action", choices.of("watchdog.action", {"off", "warn", "stop"})}};
  if (choices.chance("watchdog.strict", 20)) watchdog["speed"] = 0.1;
  analysis["watchdog"] = watchdog;
}

}  // namespace

Json analysis_of(Choices& choices, const Outline& outline, GeneratedCase& made) {
  const char* phases = outline.pores ? "TwoPhase" : "";
  Json analysis{{"type", fmt::format("MPMExplicit{}{}D", phases, outline.dim)},
                {"preset", outline.cbgeo ? "cbgeo" : "lahar"},
                {"mpm_scheme", outline.scheme},
                {"shape_functions", outline.functions},
                {"velocity_update", outline.update}};
  if (outline.is_implicit() || (outline.update == "flip" && choices.chance("transfer.default", 20)))
    analysis.erase("velocity_update");
  else if (const Json settings = settings_of(choices, outline); !settings.empty())
    analysis["velocity_update_settings"] = settings;
  if (outline.is_implicit())
    analysis["nsteps"] = made.steps;
  else
    add_step(choices, outline, made, analysis);
  if (!outline.solves.empty()) analysis.update(solving_steps_of(choices, outline));
  if (outline.contact) add_contact(choices, outline, analysis);
  add_watchdog(choices, analysis);
  if (outline.cbgeo && choices.chance("as_cbgeo", 30)) analysis["as_cbgeo"] = true;
  if (!choices.chance("must_stay", 25)) analysis["locate_particles"] = false;
  if (!outline.is_implicit() && choices.chance("damping", 25)) {
    analysis["damping"] = {{"type", "Cundall"}, {"damping_factor", 0.05}};
    if (outline.projects() || choices.chance("damping.viscous", 40))
      analysis["damping"] = {{"type", "Viscous"}, {"damping_factor", 3.0}};
  }
  const bool across = outline.plane != "strain";
  if (across) analysis["plane"] = outline.plane;
  if (!across && outline.solves.empty() && choices.chance("pressure_smoothing", 20))
    analysis["pressure_smoothing"] = true;
  if (outline.ends_at_rest)
    analysis["until"] = {{"imbalance", choices.number("until.imbalance", 0.9, 0.01, 1)},
                         {"kinetic_energy", choices.number("until.energy", 1, 1e-3, 10)}};
  if (!outline.pores && choices.chance("opening", 40))
    analysis["opening"] = outline.solves.empty() && !choices.chance("opening.off", 50);
  const bool smooth = analysis.contains("pressure_smoothing");
  const bool locks = outline.is_implicit() ? !across : !outline.projects();
  if (!smooth && locks && outline.plane != "stress" && !outline.functions.starts_with("cpdi") &&
      !outline.pores && !outline.fields && choices.chance("b_bar", 25))
    analysis["b_bar"] = true;
  else if (outline.is_implicit() && outline.fields)
    analysis["b_bar"] = false;  // the default of some
  if (choices.chance("large_domains", 15)) analysis["large_domains"] = "error";
  analysis["patch_particles"] = choices.of("patch_particles", {4096, 64, 24, 8, 3, 1});
  analysis["split_steps"] = choices.of("split_steps", {0, 100, 10, 3, 1});
  return analysis;
}

Json output_of(Choices& choices, const Outline&, const GeneratedCase&, double dt) {
  Json output = Json::object();
  switch (choices.pick("frames", 3)) {
    case 1:
      output["output_steps"] = 1 + choices.pick("frames.steps", 20);
      break;
    case 2:
      output["output_dt"] = choices.number("frames.dt", 2, 0.5, 6) * dt;
      break;
    default:
      break;
  }
  switch (choices.pick("history", 3)) {
    case 1:
      output["history_steps"] = 1 + choices.pick("history.steps", 20);
      break;
    case 2:
      output["history_dt"] = choices.number("history.dt", 1, 0.3, 4) * dt;
      break;
    default:
      break;
  }
  if (choices.chance("frames.most", 10)) output["max_frames"] = 2;
  if (choices.chance("frames.derived", 30))
    for (const DerivedField& field : derived_fields) output["vtk"].push_back(field.name);
  if (choices.chance("frames.set", 20)) output["frame_pset"] = "body0";
  if (choices.chance("frames.nodes", 20)) output["node_fields"] = {"mass", "velocity"};
  return output;
}

}  // namespace lahar::test
