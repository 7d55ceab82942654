#include "tests/properties/scenario_generator.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "tests/properties/scenario_parts.h"

namespace lahar::test {

namespace {

double with_four_digits(double value) {
  return std::stod(fmt::format("{:.4g}", value));
}

std::string element_of(Choices& choices, const Outline& outline) {
  if (!choices.chance("element.other", 35)) return outline.dim == 2 ? "ED2Q4" : "ED3H8";
  if (outline.projects()) return outline.dim == 2 ? "ED2T3" : "ED3T4";
  const std::string name = outline.dim == 2
                               ? choices.of("element", {"ED2T3", "ED2Q9", "ED2T6", "ED2Q8"})
                               : choices.of("element", {"ED3T4", "ED3H27", "ED3H20"});
  const bool only_cbgeo = name == "ED2Q8" || name == "ED3H20";
  return !only_cbgeo || outline.cbgeo ? name : outline.dim == 2 ? "ED2Q9" : "ED3H27";
}

void decide_mesh(Choices& choices, Outline& outline) {
  outline.element = element_of(choices, outline);
  outline.second_order = outline.element != "ED2Q4" && outline.element != "ED3H8" &&
                         outline.element != "ED2T3" && outline.element != "ED3T4";
  outline.table = choices.chance("mesh.table", 25);
  const double h = choices.chance("mesh.anisotropic", 25) ? 1.25 : 1.0;
  for (int d = 0; d < outline.dim; ++d) {
    outline.h.push_back(0.1 * (d == 0 ? h : 1.0));
    const int least = outline.dim == 2 ? 9 : 6;
    outline.counts.push_back(least +
                             choices.pick(name("mesh", d, "cells"), outline.dim == 2 ? 9 : 4));
  }
}

/// Which functions and updates of velocities go together with the rest.
void decide_method(Choices& choices, Outline& outline) {
  outline.functions = choices.of("functions", {"element", "quadratic_spline", "gimp", "cpdi",
                                               "cubic_spline", "uniform_gimp", "cpdi2"});
  const bool linear_box = outline.element == "ED2Q4" || outline.element == "ED3H8";
  if (outline.table || !linear_box || outline.projects()) outline.functions = "element";
  if (outline.is_implicit() && outline.functions.starts_with("cpdi")) outline.functions = "gimp";
  outline.update = choices.of("update", {"flip", "pic", "apic", "tpic", "asflip", "xpic", "fmpm"});
  if (outline.is_implicit()) outline.update = "flip";
  const bool moments = outline.update == "apic" || outline.update == "asflip";
  if (moments && outline.second_order) outline.update = "tpic";
  const bool affine = moments || outline.update == "tpic";
  if (affine && outline.functions == "element" && outline.opens && !outline.cbgeo)
    outline.update = "flip";
  if (outline.update == "asflip" && outline.functions == "cpdi2") outline.update = "apic";
  const bool has_order = outline.update == "xpic" || outline.update == "fmpm";
  if (outline.pores && (has_order || outline.update == "asflip")) outline.update = "flip";
  const bool meets = outline.bodies > 1 && outline.solves.empty();
  outline.contact =
      meets && !outline.second_order && !outline.pores && choices.chance("contact", 40);
  outline.scheme = choices.of("scheme", {"usf", "usl", "musl"});
  if (outline.contact && !outline.cbgeo) outline.scheme = "musl";
  if (!outline.solves.empty()) outline.scheme = outline.projects() ? "projection" : "newmark";
  const auto is_fluid = [](const std::string& type) {
    return type == "Newtonian" || type == "Bingham";
  };
  const auto& materials = outline.materials;
  const bool fluid = std::any_of(materials.begin(), materials.end(), is_fluid);
  const bool plane = outline.dim == 2 && !outline.cbgeo && !outline.contact && !outline.pores &&
                     !outline.projects();
  if (plane && choices.chance("plane", 30))
    outline.plane = fluid || choices.chance("plane.ring", 60) ? "axisymmetric" : "stress";
  outline.accelerates = !outline.contact && !(outline.is_implicit() && outline.cbgeo) &&
                        choices.chance("accelerates", 15);
  outline.displaces = outline.is_implicit() && outline.plane != "axisymmetric" &&
                      !outline.accelerates && choices.chance("displaces", 25);
  const bool presses = outline.pores && !outline.functions.ends_with("spline");
  outline.pressured = (outline.projects() || presses) && choices.chance("pressured", 35);
  outline.functions_of_time = choices.pick("functions_of_time", 3);
}

/// What comes from files, what is measured, and what stages do. Some of it excludes parts of the
/// method.
void decide_more(Choices& choices, Outline& outline) {
  outline.shapes = choices.chance("shapes", 30);
  if (outline.dim == 3 && choices.chance("map_origin", 40)) outline.map_origin = {5000, 30000};
  outline.fields = choices.chance("fields", 25);
  outline.pores = !outline.is_implicit() && choices.chance("pores", outline.projects() ? 40 : 12);
  outline.k0 = choices.chance("k0", 20);
  outline.stages = choices.chance("stages", 25);
  outline.gauges = choices.chance("gauges", 40);
  outline.ends_at_rest =
      (outline.solves.empty() || outline.solves == "equilibrium") && choices.chance("until", 15);
}

}  // namespace

std::string name(const char* thing, int i, const char* what) {
  return fmt::format("{}{}.{}", thing, i, what);
}

Json point(const Outline& outline, const std::vector<double>& cells) {
  Json at = Json::array();
  for (int d = 0; d < outline.dim; ++d) {
    const auto k = static_cast<std::size_t>(d);
    at.push_back(with_four_digits(cells[k] * outline.h[k]));
  }
  return at;
}

double stable_step(const Outline& outline) {
  const double h = *std::min_element(outline.h.begin(), outline.h.end());
  return with_four_digits(h / (outline.wave + 1.5 * outline.speed));
}

Outline outline_of(Choices& choices) {
  Outline outline;
  outline.dim = choices.chance("three_dimensions", 35) ? 3 : 2;
  outline.cbgeo = choices.chance("preset.cbgeo", 25);
  outline.bodies = 1 + choices.pick("bodies", 3);
  if (choices.chance("solves", 12))
    outline.solves = choices.of("solves.for", {"equilibrium", "dynamics", "pressure"});
  decide_mesh(choices, outline);
  decide_more(choices, outline);
  return outline;
}

GeneratedCase generate_case(Choices& choices) {
  GeneratedCase made;
  Outline outline = outline_of(choices);
  made.dim = outline.dim;
  Json scenario, sets;
  const Json materials = materials_of(choices, outline, made);
  // Soils that come apart take increments in up to 1024 parts.
  if (outline.has_soil) outline.speed = 1;
  const bool is_long = choices.chance("long", 12);
  const bool solves = !outline.solves.empty();
  made.steps = 1 + choices.pick("steps", solves && outline.has_soil ? 3
                                         : solves                   ? 12 / (outline.dim - 1)
                                         : outline.has_soil         ? 15
                                         : is_long                  ? 90
                                                                    : 45);
  decide_method(choices, outline);
  scenario["mesh"] = mesh_of(choices, outline, made);
  scenario["mesh"]["boundary_conditions"] = boundary_of(choices, outline, made, sets);
  scenario["materials"] = materials;
  scenario["particles"] = bodies_of(choices, outline, made, sets);
  scenario["external_loading_conditions"] = loads_of(choices, outline, sets);
  if (outline.functions_of_time > 0) scenario["math_functions"] = functions_of(choices, outline);
  if (outline.bodies > 1 && choices.chance("material_set", 15)) {
    sets["particles"]["others"]["half_space"] = {
        {"point", point(outline, {5, 5, 3})},
        {"normal", outline.dim == 2 ? Json{1, 1} : Json{1, 1, 0}}};
    scenario["material_sets"] =
        Json::array({{{"material_id", material_of(outline, 0)}, {"pset", "others"}}});
  }
  scenario["analysis"] = analysis_of(choices, outline, made);
  scenario["post_processing"] = output_of(choices, outline, made, stable_step(outline));
  add_gauges(choices, outline, stable_step(outline), scenario["post_processing"], sets);
  if (const Json shapes = geometry_of(choices, outline, made); !shapes.empty())
    scenario["geometry"] = shapes;
  Json stages = stages_of(choices, outline, made, materials);
  if (Json bodies = rigid_bodies_of(choices, outline); !bodies.empty()) {
    if (outline.gauges && choices.chance("gauge.rigid", 50)) {
      bodies[0]["name"] = "lowest";
      scenario["post_processing"]["gauges"].push_back(
          {{"name", "on_lowest"}, {"type", "force"}, {"rigid_body", "lowest"}});
    }
    scenario["rigid_bodies"] = bodies;
    for (std::size_t k = 1; k < stages.size() && bodies.size() > 1; ++k) {
      if (!choices.chance(fmt::format("stages.{}.body_goes", k), 40)) continue;
      bodies.erase(bodies.size() - 1);
      stages[k]["rigid_bodies"] = bodies;
    }
  }
  if (!stages.empty()) scenario["stages"] = stages;
  if (!sets.empty()) scenario["sets"] = sets;
  made.text = scenario.dump(1);
  return made;
}

void write_case(const GeneratedCase& made, const std::filesystem::path& folder) {
  for (const auto& [file, contents] : made.files)
    std::ofstream(folder / file, std::ios::binary) << contents;
  std::ofstream(folder / "case.json", std::ios::binary) << made.text << "\n";
}

}  // namespace lahar::test
