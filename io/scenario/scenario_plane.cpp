// What the plane of a model in two dimensions is a section of: `plane` in analysis.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/scenario/scenario_builder.h"
#include "physics/materials/law.h"

namespace lahar {

template <int Dim>
void ScenarioBuilder<Dim>::build_plane() {
  const JsonValue& analysis = section("analysis");
  const std::string name = get_text(analysis, "plane").value_or("strain");
  Plane& plane = model_.analysis.plane;
  plane = name == "axisymmetric" ? Plane::axisymmetric
          : name == "stress"     ? Plane::stress
                                 : Plane::strain;
  if (plane == Plane::strain) return;
  const JsonValue& at = *analysis.find("plane");
  if (Dim == 3) in_.error(at, "'plane' is for two dimensions", "leave it out");
  if (in_.cbgeo_defaults)
    in_.error(at,
              fmt::format("'plane': {} does not go together with the preset cbgeo: CB-Geo MPM has "
                          "plane strain",
                          json_quoted(name)),
              "take \"preset\": \"lahar\", or leave 'type' out");
  if (Dim == 3 || in_.cbgeo_defaults) plane = Plane::strain;  // for the rest of the checks
}

// Nodes on the axis stay there.
template <int Dim>
void ScenarioBuilder<Dim>::find_axis() {
  if (model_.analysis.plane != Plane::axisymmetric || !mesh_) return;
  if (const double least = mesh_->bounds().first[0]; least < -region_tolerance_)
    in_.error(section("mesh"),
              fmt::format("an axisymmetric mesh begins at x = 0, the axis; this one at x = {:g} m",
                          least),
              "x is the radius: move the mesh, or leave out the half beyond the axis");
  Vec<Dim> low = Vec<Dim>::Constant(-std::numeric_limits<double>::infinity()), high = -low;
  high[0] = region_tolerance_;
  axis_nodes_ = nodes_in(Region<Dim>(low, high), section("mesh"));
}

// Prescribed velocities of the axis come first, and the first counts.
template <int Dim>
void ScenarioBuilder<Dim>::hold_axis() {
  auto& list = entries_of<NodeVelocity>(model_);
  for (const Index node : axis_nodes_) list.push_back({node, 0, 0.0});
}

template <int Dim>
void ScenarioBuilder<Dim>::check_axis() {
  const auto on_axis = [&](Index node) {
    return std::binary_search(axis_nodes_.begin(), axis_nodes_.end(), node);
  };
  const auto& frames = model_.node_frames;
  if (team_.any(std::any_of(frames.begin(), frames.end(),
                            [&](const auto& frame) { return on_axis(frame.node); })))
    in_.error(*boundary().find("nodal_euler_angles"), "nodes on the axis have no axes of their own",
              "the program holds them along x");
  auto& absorbing = entries_of<NodeAbsorption>(model_);
  std::vector<Index> nodes;
  for (const NodeAbsorption& entry : absorbing) nodes.push_back(entry.node);
  if (!team_.any(!nodes.empty())) return;
  const auto places = places_of(nodes);
  for (std::size_t i = 0; i < nodes.size(); ++i) {  // the axis has the area of its functions
    const double radius = std::max(places[i][0], absorbing[i].edge / 3.0);
    absorbing[i].area *= depth_at(model_.analysis, radius);
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::refuse_across(const JsonValue* at, const std::string& what,
                                         const std::string& hint) {
  const bool ring = model_.analysis.plane == Plane::axisymmetric;
  in_.error(at ? *at : section("analysis"),
            fmt::format("{} is not supported yet {}", what,
                        ring ? "in axisymmetric models" : "in plane stress"),
            hint);
}

// What models that deform across their plane do not go together with.
template <int Dim>
void ScenarioBuilder<Dim>::check_plane() {
  const Analysis& a = model_.analysis;
  if (!deforms_across(a)) return;
  const JsonValue& analysis = section("analysis");
  if (a.two_phase) refuse_across(root_.find("particles"), "a liquid in pores", "take plane strain");
  if (is_projection(a)) refuse_across(analysis.find("mpm_scheme"), "a projection", "take \"musl\"");
  if (a.contact.bodies > 1)
    refuse_across(analysis.find("interface"), "contact of bodies",
                  "bodies that stick to each other need no contact");
  if (a.pressure_smoothing)
    refuse_across(analysis.find("pressure_smoothing"), "'pressure_smoothing'", "leave it out");
  if (a.plane == Plane::axisymmetric) {
    if (model_.gravity[0] != 0)
      in_.error(*section("external_loading_conditions").find("gravity"),
                "gravity of an axisymmetric model acts along the axis, y",
                fmt::format("[0, {:g}]", model_.gravity[Dim - 1]));
    return check_axis();
  }
  check_sheet();
}

namespace {

/// Bears shear by friction alone.
bool is_loose(const Law& law) {
  return std::visit(
      [](const auto& own) {
        if constexpr (requires { own.cohesion, own.friction, own.tension_cutoff; })
          return own.cohesion == 0;
        else
          return false;
      },
      law);
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::check_sheet() {
  const Analysis& a = model_.analysis;
  const auto is_used = [&](std::size_t m) {
    const auto& of = model_.particles.material;
    const auto& injections = model_.injections;
    return team_.any(std::find(of.begin(), of.end(), m) != of.end() ||
                     std::any_of(injections.begin(), injections.end(),
                                 [&](const auto& one) { return one.material == m; }));
  };
  const auto materials = get_list(root_, "materials");
  for (std::size_t m = 0; m < model_.materials.size(); ++m) {  // bodies in contact have copies
    const Law& law = model_.materials[m].law;
    const std::string& name = model_.materials[m].name;
    if (has_pressure(law) && is_used(m))
      in_.error(*materials[m % materials.size()],
                fmt::format("'{}' is a fluid; plane stress is for solids", name),
                "take plane strain");
    if (is_loose(law) && is_used(m))
      in_.error(*materials[m % materials.size()],
                fmt::format("'{}' has no cohesion: without a stress across the sheet it bears none "
                            "in its plane",
                            name),
                "give it some cohesion, or take plane strain");
  }
  clear_stress_across();
  if (a.mean_volume)
    refuse_across(section("analysis").find("b_bar"), "B-bar",
                  "leave it out: a sheet that hardly changes its volume changes its thickness, and "
                  "does not lock");
  if (team_.any(!entries_of<NodeAbsorption>(model_).empty()))
    refuse_across(boundary().find(NodeAbsorption::key), fmt::format("'{}'", NodeAbsorption::key),
                  "waves in sheets are slower than those that it absorbs");
}

// The first step would take a stress across the sheet away, and a part of those in its plane with
// it.
template <int Dim>
void ScenarioBuilder<Dim>::clear_stress_across() {
  constexpr std::size_t zz = 2;
  double most = 0;
  for (Voigt& stress : model_.particles.stress) {
    most = std::max(most, std::abs(stress[zz]));
    stress[zz] = 0;
  }
  most = team_.most({most}).front();
  if (most == 0) return;
  const JsonValue* given = section("mesh").find("particles_stresses");
  for (const GeneratorRows& rows : generators_)
    if (written(*rows.generator, "stress")) given = rows.generator->find("stress");
  in_.warning(
      given ? *given : section("analysis"),
      fmt::format("the stress zz at the start, up to {:g} Pa, is taken as 0: no stress acts "
                  "across a sheet",
                  most),
      "give xx yy zz xy yz xz with zz = 0, or take plane strain");
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
