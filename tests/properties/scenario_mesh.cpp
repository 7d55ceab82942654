// Meshes of generated scenarios, what holds their nodes, and bodies in them.
#include <fmt/format.h>

#include <cmath>

#include "physics/mesh/element_grid.h"
#include "tests/properties/scenario_parts.h"

namespace lahar::test {

namespace {

constexpr const char* axes[] = {"x", "y", "z"};

Element element_named(const std::string& name) {
  for (int e = 0; e < n_elements; ++e)
    if (info(static_cast<Element>(e)).name == name) return static_cast<Element>(e);
  return Element::Q4;
}

template <int Dim>
ElementTables<Dim> grid_of(const Outline& outline) {
  Vec<Dim> h;
  std::array<Index, Dim> counts;
  for (int d = 0; d < Dim; ++d) {
    const auto k = static_cast<std::size_t>(d);
    h[d] = outline.h[k];
    counts[k] = outline.counts[k];
  }
  return element_grid<Dim>(element_named(outline.element), Vec<Dim>::Zero(), h, counts);
}

/// Corners of cells inside of the mesh are moved, smoothly: nodes between them go along.
template <int Dim>
void bend(ElementTables<Dim>& grid, const Outline& outline, double amount) {
  for (Vec<Dim>& x : grid.nodes) {
    double shape = amount * outline.h[0];
    for (int d = 0; d < Dim; ++d) shape *= std::sin(M_PI * x[d] / outline.extent(d));
    const Vec<Dim> old = x;
    for (int d = 0; d < Dim; ++d)
      x[d] += shape * std::sin(40 * old[(d + 1) % Dim] + 25 * old[d] + d);
  }
}

template <int Dim>
std::string mesh_file(Choices& choices, const Outline& outline) {
  ElementTables<Dim> grid = grid_of<Dim>(outline);
  if (choices.chance("mesh.bent", 75)) bend(grid, outline, outline.second_order ? 0.06 : 0.25);
  const auto per_cell = static_cast<std::size_t>(info(grid.element).nodes);
  std::string text = fmt::format("{} {}\n", grid.nodes.size(), grid.cells.size() / per_cell);
  for (const Vec<Dim>& x : grid.nodes) {
    for (int d = 0; d < Dim; ++d) text += fmt::format("{:.9g} ", x[d]);
    text += "\n";
  }
  for (std::size_t at = 0; at < grid.cells.size(); ++at)
    text += fmt::format("{}{}", grid.cells[at], (at + 1) % per_cell == 0 ? "\n" : " ");
  return text;
}

/// Axes of some nodes are turned.
template <int Dim>
std::string angles_file(const Outline& outline) {
  const auto nodes = static_cast<Index>(grid_of<Dim>(outline).nodes.size());
  std::string text;
  for (Index node = 1; node < nodes; node += 5)
    text += fmt::format("{} {} {}{}\n", node, 0.1 * static_cast<double>(node % 7), 0.05,
                        Dim == 3 ? " 0.2" : "");
  return text;
}

struct Side {
  std::string set;
  int axis;
  int sign;  ///< of the direction that points out of the mesh
};

/// What a side of the mesh does.
void add_side(Choices& choices, const Outline& outline, const Side& side, Json& boundary) {
  const std::string of = side.set + ".";
  const char* dir = axes[side.axis];
  const auto fix = [&](const char* along, double velocity) {
    if (outline.displaces) {
      boundary["displacement_constraints"].push_back(
          {{"nset", side.set}, {"dir", along}, {"displacement", 0.02 * velocity}});
      return;
    }
    boundary["velocity_constraints"].push_back(
        {{"nset", side.set}, {"dir", along}, {"velocity", velocity}});
    if (outline.pores && choices.chance(of + along + ".phase", 25))
      boundary["velocity_constraints"].back()["phase"] =
          choices.of(of + along + ".phase.name", {"skeleton", "liquid"});
  };
  if (!outline.pores && outline.solves.empty() && choices.chance(of + "springs", 15))
    boundary["spring_constraints"].push_back(
        {{"nset", side.set}, {"dir", dir}, {"stiffness", 20}, {"damping", 0.5}});
  const bool is_floor = side.axis == outline.dim - 1 && side.sign < 0;
  const bool stands = outline.solves == "equilibrium" && is_floor;
  switch (stands && !choices.chance(of + "other", 20) ? 2 : choices.pick(of + "kind", 8)) {
    case 1:
      return fix(dir, 0);
    case 2:
      for (int d = 0; d < outline.dim; ++d)
        if (!outline.accelerates || d == side.axis) fix(axes[d], 0);
      return;
    case 3: {
      Json normal = Json::array();
      for (int d = 0; d < outline.dim; ++d) normal.push_back(d == side.axis ? -side.sign : 0);
      Json wall{{"nset", side.set}, {"normal", normal}};
      if (choices.chance(of + "rough", 25))
        wall["friction"] = "rough";
      else
        wall["friction"] = choices.number(of + "friction", 0, 0, 0.6);
      boundary["walls"].push_back(wall);
      return;
    }
    case 4: {
      if (choices.chance(of + "held", 70)) fix(dir, 0);
      Json friction{{"nset", side.set},
                    {"dir", dir},
                    {"sign_n", side.sign},
                    {"friction", choices.number(of + "friction", 0.3, 0, 0.6)}};
      if (outline.is_implicit() || choices.chance(of + "one_sided", 60))
        friction["two_sided"] = false;
      boundary["friction_constraints"].push_back(friction);
      return;
    }
    case 5: {
      if (outline.pores || !outline.solves.empty()) return fix(dir, 0);
      Json absorbing{{"nset", side.set}, {"dir", dir}, {"delta", 4}, {"h_min", 0.1}};
      absorbing["position"] = outline.dim == 2 ? "edge" : "face";
      if (choices.chance(of + "weak", 50)) absorbing.update({{"a", 0.7}, {"b", 0.5}});
      boundary["absorbing_constraints"].push_back(absorbing);
      return;
    }
    case 6:
      fix(dir, choices.number(of + "speed", 0, -0.5, 0.5));
      if (outline.functions_of_time > 0 && choices.chance(of + "timed", 50))
        boundary[outline.displaces ? "displacement_constraints" : "velocity_constraints"]
            .back()["math_function_id"] = 0;
      return;
    case 7: {
      if (!outline.accelerates) return;
      Json accelerated{{"nset", side.set}, {"dir", dir}, {"acceleration", 5}};
      if (outline.functions_of_time > 0) accelerated["math_function_id"] = 0;
      boundary["acceleration_constraints"].push_back(accelerated);
      return;
    }
    default:
      return;
  }
}

}  // namespace

Json mesh_of(Choices& choices, const Outline& outline, GeneratedCase& made) {
  Json mesh;
  const bool box = outline.element == "ED2Q4" || outline.element == "ED3H8";
  if (!box) mesh["cell_type"] = outline.element;
  if (outline.table) {
    made.files["mesh.txt"] =
        outline.dim == 2 ? mesh_file<2>(choices, outline) : mesh_file<3>(choices, outline);
    mesh["mesh"] = "mesh.txt";
  } else {
    mesh["structured"] = {{"cell_size", outline.h}, {"counts", outline.counts}};
  }
  if (outline.map_origin[0] != 0) mesh["map_origin"] = outline.map_origin;
  if (outline.pores && choices.chance("pressure", 70)) {
    Json& pressures = mesh["particles_pore_pressures"];
    pressures["type"] = choices.of("pressure.kind", {"water_table", "isotropic"});
    if (pressures["type"] == "isotropic")
      pressures["values"] = 300;
    else if (outline.shapes && choices.chance("pressure.surface", 60))
      pressures["surface"] = "ground";
    else
      pressures["water_tables"] = {{{"position", 0}, {"h0", 0.6}}, {{"position", 1}, {"h0", 0.3}}};
  }
  if (outline.k0) {
    Json& stresses = mesh["particles_stresses"];
    stresses = {{"type", "k0"}, {"k0", choices.number("k0.ratio", 0.5, 0.2, 1.2)}};
    const std::string& first = outline.materials[0];
    if (choices.chance("k0.jaky", 50) && (first == "MohrCoulomb" || first == "DruckerPrager"))
      stresses["materials"] = {{{"material", 0}, {"k0", "jaky"}}};
    if (outline.has_soil) stresses["surcharge"] = 2000;
  } else if (outline.has_soil || choices.chance("stressed", 10))
    mesh["particles_stresses"] = {{"type", "isotropic"},
                                  {"values", outline.has_soil ? Json{-2000, -2000, -2000, 0, 0, 0}
                                                              : Json{-800, -500, -600, 100, 0, 0}}};
  return mesh;
}

Json boundary_of(Choices& choices, const Outline& outline, GeneratedCase& made, Json& sets) {
  Json boundary = Json::object();
  for (int axis = 0; axis < outline.dim; ++axis)
    for (const int sign : {-1, 1}) {
      const std::string set = fmt::format("{}_{}", sign < 0 ? "low" : "high", axes[axis]);
      std::vector<double> at(3, 0.0);
      Json normal = Json::array();
      for (int d = 0; d < outline.dim; ++d) {
        at[static_cast<std::size_t>(d)] =
            sign > 0 ? outline.counts[static_cast<std::size_t>(d)] : 0.0;
        normal.push_back(d == axis ? -sign : 0);
      }
      const std::size_t before = boundary.size();
      const Json old = boundary;
      add_side(choices, outline, {set, axis, sign}, boundary);
      if (boundary != old || boundary.size() != before)
        sets["nodes"][set]["half_space"] = {{"point", point(outline, at)}, {"normal", normal}};
    }
  if (choices.chance("obstacle", 20)) {
    const double low = outline.dim == 2 ? 5 : 3;
    sets["nodes"]["obstacle"]["box"] = {{"min", point(outline, {low, low, low})},
                                        {"max", point(outline, {low + 1, low + 1, low + 1})}};
    if (!outline.accelerates && !outline.displaces)
      boundary["velocity_constraints"].push_back(
          {{"nset", "obstacle"}, {"dir", "y"}, {"velocity", 0}});
    boundary["friction_constraints"].push_back({{"nset", "obstacle"},
                                                {"dir", "x"},
                                                {"sign_n", 1},
                                                {"friction", 0.2},
                                                {"two_sided", false}});
  }
  if (outline.pressured || (outline.projects() && choices.chance("drained", 20))) {
    sets["nodes"]["reservoir"]["half_space"] = {
        {"point", point(outline, {0, 0, 0})},
        {"normal", outline.dim == 2 ? Json{1, 0} : Json{1, 0, 0}}};
    Json pressure{{"nset", "reservoir"}, {"pressure", 0}};
    if (outline.pressured) pressure["pressure"] = choices.number("pressured.by", 200, -100, 500);
    if (outline.functions_of_time > 0 && choices.chance("pressured.timed", 40))
      pressure["math_function_id"] = 0;
    boundary["pressure_constraints"].push_back(pressure);
  }
  if (outline.plane != "axisymmetric" && choices.chance("turned_axes", 15)) {
    made.files["angles.txt"] = outline.dim == 2 ? angles_file<2>(outline) : angles_file<3>(outline);
    boundary["nodal_euler_angles"] = "angles.txt";
  }
  if (outline.solves.empty() && choices.chance("driven", 15)) {
    const bool all = choices.chance("driven.all", 20);
    const bool part = !all && choices.chance("driven.part", 60);
    Json driven{{"dir", axes[choices.pick("driven.axis", outline.dim)]},
                {"velocity", choices.number("driven.speed", 1, -2, 2)}};
    if (outline.functions_of_time > 0 && choices.chance("driven.timed", 50))
      driven["math_function_id"] = 0;
    driven[all ? "pset_id" : "pset"] = all ? Json(-1) : Json(part ? "driven" : "body0");
    if (part)
      sets["particles"]["driven"]["half_space"] = {
          {"point", point(outline, {4, 4, 3})},
          {"normal", outline.dim == 2 ? Json{0, 1} : Json{0, 1, 0}}};
    boundary["particles_velocity_constraints"].push_back(driven);
  }
  return boundary;
}

}  // namespace lahar::test
