// A liquid in the pores of a skeleton: materials of two phases, initial and prescribed pressures.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "io/scenario/interpolation.h"
#include "io/scenario/particle_files.h"
#include "io/scenario/scenario_builder.h"
#include "io/scenario/surface_faces.h"
#include "physics/base/sort_unique.h"
#include "physics/materials/law.h"
#include "physics/model/transfer_options.h"

namespace lahar {

namespace {

constexpr std::array<const char*, 3> conductivity_keys{"k_x", "k_y", "k_z"};

// Whether analysis.type, as written, is of two phases; nothing where it is not written.
std::optional<bool> type_has_two_phases(const JsonValue& analysis) {
  const JsonValue* type = analysis.find("type");
  if (!type || type->defaulted) return std::nullopt;
  return type->as<std::string>().find("TwoPhase") != std::string::npos;
}

// Values that look as if they were in another unit. Entries of materials: the skeleton, the liquid.
void doubt_units(ScenarioInput& in, const JsonValue& entry, const JsonValue& fluid,
                 const Material& solid) {
  constexpr double most_conductivity = 1.0;     // [m/s] that of coarse gravel
  constexpr double least_stiffness = 0.1;       // [-] of the water against the skeleton
  constexpr double least_conductivity = 1e-11;  // [m/s] that of clay
  const bool intrinsic = get_bool(entry, "intrinsic_permeability").value_or(false);
  for (const char* key : conductivity_keys) {
    const auto k = get_number(entry, key);
    if (intrinsic || !k) continue;
    if (*k > most_conductivity)
      in.warning(*entry.find(key),
                 fmt::format("'{}' is {:.3g} m/s: even coarse gravel has less", key, *k),
                 fmt::format("is it in m/day? {:.3g} m/day are {:.3g} m/s", *k, *k / 86400));
    if (*k < least_conductivity)
      in.warning(*entry.find(key), fmt::format("'{}' is {:.3g} m/s: even clay has more", key, *k),
                 "it is a conductivity [m/s]. Is it a permeability in m^2? Then write "
                 "\"intrinsic_permeability\": true");
  }
  const PoreLiquid& pores = *solid.liquid;
  const double water = pores.bulk_modulus / pores.porosity, skeleton = wave_modulus(solid.law);
  if (water < least_stiffness * skeleton)
    in.warning(*fluid.find("bulk_modulus"),
               fmt::format("the liquid is softer than the skeleton '{}': bulk_modulus / porosity = "
                           "{:.3g} Pa against {:.3g} Pa",
                           solid.name, water, skeleton),
               "water has 2.2e9 Pa; is 'bulk_modulus' in MPa or GPa instead of Pa?");
}

}  // namespace

// The pores of a skeleton are full of one liquid wherever it is used.
template <int Dim>
void ScenarioBuilder<Dim>::saturate(int skeleton, int liquid, const JsonValue& at) {
  Material& solid = model_.materials[static_cast<std::size_t>(skeleton)];
  const Material& fluid = model_.materials[static_cast<std::size_t>(liquid)];
  const auto [known, is_new] = liquids_.try_emplace(skeleton, liquid);
  if (!is_new) {
    if (known->second != liquid)
      in_.error(at, fmt::format("'{}' has another liquid in its pores elsewhere", solid.name),
                "give it an entry of materials for each liquid");
    return;
  }
  const auto entries = get_list(root_, "materials");
  const JsonValue& entry = *entries[static_cast<std::size_t>(skeleton)];
  const auto* law = std::get_if<Newtonian>(&fluid.law);
  if (!law || law->incompressible) {
    in_.error(at, fmt::format("'{}' cannot be in pores", fluid.name),
              "the second material must be a Newtonian liquid with a bulk modulus");
    return;
  }
  if (has_pressure(solid.law)) {
    in_.error(at, fmt::format("'{}' is a fluid, which has no pores", solid.name),
              "the first material must be a solid");
    return;
  }
  PoreLiquid pores{.density = fluid.density,
                   .bulk_modulus = law->bulk_modulus,
                   .grain_density = solid.density,
                   .constant_mass = in_.as_cbgeo};
  const auto porosity = get_number(entry, "porosity");
  if (!porosity && !written(entry, "porosity"))
    in_.error(entry,
              fmt::format("'porosity' is missing: '{}' has a liquid in its pores", solid.name));
  pores.porosity = porosity.value_or(0.5);
  const bool intrinsic = get_bool(entry, "intrinsic_permeability").value_or(false);
  if (intrinsic && !(law->dynamic_viscosity > 0))
    in_.error(at, fmt::format("'dynamic_viscosity' of '{}' must be greater than 0", fluid.name),
              "with 'intrinsic_permeability' the drag follows from it");
  if (in_.cbgeo_defaults && !written(entry, "intrinsic_permeability"))
    in_.warning(entry,
                fmt::format("'intrinsic_permeability' is missing: k_x of '{}' is taken as a "
                            "conductivity [m/s]",
                            solid.name),
                "write \"intrinsic_permeability\": false; without it CB-Geo's fork has no drag");
  const auto k_x = get_number(entry, "k_x");
  if (!k_x && !written(entry, "k_x"))
    in_.error(entry, fmt::format("'k_x' is missing: '{}' has a liquid in its pores", solid.name),
              "k_x [m/s]: hydraulic conductivity, of sand 1e-5 to 1e-2");
  for (std::size_t d = 0; d < Dim; ++d) {
    const double k = get_number(entry, conductivity_keys[d]).value_or(k_x.value_or(1));
    pores.resistance[d] =
        (intrinsic ? law->dynamic_viscosity : conductivity_gravity * pores.density) / k;
  }
  solid.density *= 1.0 - pores.porosity;
  solid.liquid = pores;
  if (!in_.cbgeo_defaults)
    doubt_units(in_, entry, *entries[static_cast<std::size_t>(liquid)], solid);
}

// Every use of a skeleton says its liquid, or none does.
template <int Dim>
void ScenarioBuilder<Dim>::check_phases() {
  Analysis& a = model_.analysis;
  const JsonValue& analysis = section("analysis");
  a.two_phase = !liquids_.empty();
  const auto wanted = type_has_two_phases(analysis);
  if (wanted && *wanted != a.two_phase && in_.problems.empty())
    in_.error(*analysis.find("type"),
              a.two_phase
                  ? "particles have a liquid in their pores, but 'type' is of one phase"
                  : "no particles have a liquid in their pores, but 'type' is of two phases",
              a.two_phase ? fmt::format("\"MPM{}TwoPhase{}D\"",
                                        is_projection(a) ? "SemiImplicit" : "Explicit", Dim)
                          : "material of a generator: [skeleton, liquid]");
  for (const auto& [skeleton, at] : single_)
    if (liquids_.count(skeleton))
      in_.error(*at,
                fmt::format("'{}' has a liquid in its pores elsewhere, and none here",
                            model_.materials[static_cast<std::size_t>(skeleton)].name),
                "give the dry one an entry of its own in materials");
  const auto entries = get_list(root_, "materials");
  const bool later = a.two_phase && in_.assigns_later;  // another stage may use it with the liquid
  for (std::size_t m = 0; m < entries.size(); ++m)
    for (const char* key : {"porosity", "k_x"})
      if (const JsonValue* at = entries[m]->find(key);
          at && in_.stage.empty() && !later && !liquids_.count(static_cast<int>(m)))
        in_.warning(*at, fmt::format("'{}' has no effect without a liquid in the pores", key));
  if (!a.two_phase) return;
  if (!wanted && !is_projection(a))
    set(*root_.find("analysis"), "type", fmt::format("MPMExplicitTwoPhase{}D", Dim));
  a.explicit_drag = in_.as_cbgeo;
  a.pore_pressure_smoothing = get_bool(analysis, "pore_pressure_smoothing").value_or(false);
}

// Without porosities of nodes n p is in balance where layers meet, in place of p.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_porosities() {
  constexpr double noticed = 0.02;
  double least = 1, most = 0;
  for (const Material& material : model_.materials) {
    if (!material.liquid) continue;
    least = std::min(least, material.liquid->porosity);
    most = std::max(most, material.liquid->porosity);
  }
  if (most - least <= noticed) return;
  const JsonValue* scheme = section("analysis").find("mpm_scheme");
  in_.warning(scheme ? *scheme : section("analysis"),
              fmt::format("layers of the porosities {:g} and {:g} are not at rest with this "
                          "'mpm_scheme': pore pressures are wrong where they meet",
                          least, most),
              "take \"musl\", or one porosity");
}

// Who holds a plane in the direction of its normal means the soil: with both phases held, the water
// that the prescribed pressure drives has no way.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_held_water() {
  if (!prescribes_pressure()) return;
  for (int d = 0; d < Dim; ++d) {
    std::vector<Index> held;
    for (const NodeVelocity& v : model_.liquid_velocities)
      if (v.dir == d) held.push_back(v.node);
    std::sort(held.begin(), held.end());
    bool all_held = true;
    double low = infinity, high = -infinity;
    for (const NodePressure& given : entries_of<NodePressure>(model_)) {
      if (given.pressure == 0.0) continue;
      all_held = all_held && std::binary_search(held.begin(), held.end(), given.node);
      low = std::min(low, mesh_->node(given.node)[d]);
      high = std::max(high, mesh_->node(given.node)[d]);
    }
    const auto ends = team_.most({-low, high});
    if (team_.any(!all_held) || ends[0] + ends[1] > 0) continue;
    in_.warning(*boundary().find("pressure_constraints"),
                fmt::format("water is held along {} at the nodes where its pressure is prescribed: "
                            "it does not pass them",
                            "xyz"[d]),
                "write \"phase\": \"skeleton\" in the velocity constraint");
  }
}

template <int Dim>
bool ScenarioBuilder<Dim>::prescribes_pressure() {
  const auto& all = entries_of<NodePressure>(model_);
  return team_.any(
      std::any_of(all.begin(), all.end(), [](const NodePressure& p) { return p.pressure != 0.0; }));
}

// Nodes at the surface of soil with water, which may leave them later. Where the water is held, as
// at walls and planes of symmetry, it does not end.
template <int Dim>
void ScenarioBuilder<Dim>::find_pressures_inside() {
  const Analysis& a = model_.analysis;
  if (!a.prescribes_pore_pressure || !a.two_phase || (!is_projection(a) && a.as_cbgeo)) return;
  auto& given = entries_of<NodePressure>(model_);
  std::vector<Index> own;
  for (const NodePressure& entry : given) own.push_back(entry.node);
  std::vector<Index> nodes = joined(team_.gather(own));
  sort_unique(nodes);
  std::vector<Index> filled, cells;
  const auto& p = model_.particles;
  for (std::size_t i = 0; i < p.cell.size(); ++i)
    if (model_.materials[p.material[i]].liquid) filled.push_back(p.cell[i]);
  sort_unique(filled);
  const auto mesh = mesh_with(filled);
  const auto is_given = [&](Index node) {
    return std::binary_search(nodes.begin(), nodes.end(), node);
  };
  for (const Index cell : filled) {
    bool any = false;
    for (const Index node : mesh->element_nodes(cell)) any = any || is_given(node);
    if (any) cells.push_back(cell);
  }
  const std::vector<CellFace<Dim>> faces = faces_of_surface<Dim>(*mesh, cells, filled, team_);
  std::vector<Index> corners, own_held;
  for (const CellFace<Dim>& face : faces)
    corners.insert(corners.end(), face.nodes.begin(), face.nodes.end());
  sort_unique(corners);
  for (const NodeVelocity& v : model_.liquid_velocities)
    if (std::binary_search(corners.begin(), corners.end(), v.node))
      own_held.push_back(v.node * Dim + v.dir);
  std::vector<Index> held = joined(team_.gather(own_held)), open;
  sort_unique(held);
  for (const CellFace<Dim>& face : faces) {
    std::array<double, static_cast<std::size_t>(Dim)> extent{};
    for (int c = 1; c < face.corners; ++c)
      for (std::size_t d = 0; d < extent.size(); ++d)
        extent[d] =
            std::max(extent[d], std::abs(face.x[static_cast<std::size_t>(c)][d] - face.x[0][d]));
    const auto across =
        static_cast<Index>(std::min_element(extent.begin(), extent.end()) - extent.begin());
    const bool closed = std::all_of(face.nodes.begin(), face.nodes.end(), [&](Index node) {
      return node < 0 || std::binary_search(held.begin(), held.end(), node * Dim + across);
    });
    if (!closed) open.insert(open.end(), face.nodes.begin(), face.nodes.end());
  }
  sort_unique(open);
  for (NodePressure& entry : given)
    entry.inside = !std::binary_search(open.begin(), open.end(), entry.node);
}

// What a liquid in pores does not go together with.
template <int Dim>
void ScenarioBuilder<Dim>::check_two_phase() {
  Analysis& a = model_.analysis;
  if (!a.two_phase) return;
  const JsonValue& analysis = section("analysis");
  // Published cases use these shape functions.
  a.liquid_advection = in_.as_cbgeo && a.functions == ShapeFunctions::element &&
                       a.affine == Affine::none && mesh_ && mesh_->is_multilinear() &&
                       !is_projection(a);
  const auto refuse = [&](const JsonValue* at, std::string_view what, std::string_view hint) {
    in_.error(at ? *at : analysis,
              fmt::format("{} does not go together with a liquid in pores", what),
              std::string(hint));
  };
  if (a.contact.bodies > 1) refuse(root_.find("interface"), "contact between bodies", "");
  if (a.takes_means)
    refuse(&boundary(), "an absorbing boundary or a spring", "put the boundary further away");
  const bool splines = a.functions == ShapeFunctions::quadratic_spline ||
                       a.functions == ShapeFunctions::cubic_spline;
  if (!is_projection(a) && !a.as_cbgeo && splines && prescribes_pressure())
    in_.error(*boundary().find("pressure_constraints"),
              "a pressure other than 0 is not supported yet with splines: they reach "
              "beyond the surface, where nodes with little mass would shake the water",
              "take \"element\" or \"gimp\", or give the pressure p of water outside as two "
              "tractions: p on the mixture, and with \"phase\": \"liquid\" p times the porosity");
  if (!is_projection(a) && a.as_cbgeo && prescribes_pressure())
    in_.warning(*boundary().find("pressure_constraints"),
                "CB-Geo MPM lets particles take a pressure other than 0 where pore pressures are "
                "smoothed, but does not press on the ground with it",
                "leave --as-cbgeo out, or add its two tractions: p on both phases, and with "
                "\"phase\": \"liquid\" p times the porosity");
  if (has_filter(a.transfer))
    refuse(analysis.find("velocity_update"), "a velocity transfer of an order above 1",
           "use \"flip\", \"pic\", \"apic\" or \"tpic\"");
  const JsonValue* resume = analysis.find("resume");
  if (resume && get_bool(*resume, "resume").value_or(false))
    refuse(resume, "'resume'", "continue a run of Lahar with --restart");
  if (!in_.cbgeo_defaults && !has_nodal_porosity(a)) warn_of_porosities();
  warn_of_held_water();
}

template <int Dim>
void ScenarioBuilder<Dim>::refuse_without_liquid(const JsonValue& at) {
  in_.error(at, "no material has a liquid in its pores",
            "material of a generator: [skeleton, liquid]");
}

// Water does not pass what holds soil, unless the entry names a phase; in CB-Geo's input each phase
// has its own.
template <int Dim>
bool ScenarioBuilder<Dim>::holds_both_phases(const JsonValue& object) const {
  return model_.analysis.two_phase && !in_.cbgeo_defaults && !written(object, "phase");
}

// 0 to dim - 1, or with dim added of the liquid in pores.
template <int Dim>
std::optional<int> ScenarioBuilder<Dim>::phase_direction_of(const JsonValue& object) {
  const auto dir = get_direction(object, "dir");
  const bool named = get_text(object, "phase") == "liquid";
  if (dir && *dir >= Dim && *dir < 2 * Dim && model_.analysis.two_phase && !named) return dir;
  const auto axis = direction_of(object);
  if (!axis || !named) return axis;
  if (model_.analysis.two_phase) return *axis + Dim;
  refuse_without_liquid(*object.find("phase"));
  return std::nullopt;
}

template <int Dim>
void ScenarioBuilder<Dim>::build_pore_pressures() {
  const JsonValue* given = section("mesh").find("particles_pore_pressures");
  if (!given) return;
  if (!model_.analysis.two_phase && !in_.problems.empty()) return;  // reported
  if (!model_.analysis.two_phase) return refuse_without_liquid(*given);
  auto& pressure = model_.particles.pore_pressure;
  pressure.assign(model_.particles.x.size(), 0.0);
  const std::string type = get_text(*given, "type").value_or("");
  if (type == "file") {
    if (const auto file = in_.open(*given, "location"))
      read_particle_values(
          *file, "the pore pressure", known_rows(), team_, in_.problems,
          [&](Index i, double value) { pressure[static_cast<std::size_t>(i)] = value; });
    else if (!written(*given, "location"))
      in_.error(*given, "'location' is missing", "the file of pore pressures");
  } else if (type == "isotropic") {
    if (!written(*given, "values")) in_.error(*given, "'values' is missing", "a pressure [Pa]");
    std::fill(pressure.begin(), pressure.end(), get_number(*given, "values").value_or(0));
  } else if (type == "water_table") {
    build_water_table(*given);
  }
}

/// Level of the water [m] above or below a point; NaN where there is none.
template <int Dim>
std::optional<std::function<double(const Vec<Dim>&)>> ScenarioBuilder<Dim>::water_level(
    const JsonValue& given, int up, int along) {
  using Level = std::function<double(const Vec<Dim>&)>;
  if (written(given, "surface") == written(given, "water_tables")) {
    in_.error(given, "a water table needs either 'surface' or 'water_tables'",
              "the name of a surface of geometry, or [{\"position\": 0, \"h0\": 1}]: levels along "
              "dir_h [m]");
    return std::nullopt;
  }
  if (written(given, "surface")) {
    if (up != Dim - 1 || along != 0) {
      const char* key = along != 0 ? "dir_h" : "dir_v";
      in_.error(*given.find(key), fmt::format("'{}' does not go together with 'surface'", key),
                "surfaces have heights along the last axis");
      return std::nullopt;
    }
    const auto surface = surface_under(given, "surface");
    if (!surface) return std::nullopt;
    return Level([surface](const Vec<Dim>& x) { return surface->height(x); });
  }
  std::map<double, double> levels;
  for (const JsonValue* entry : get_list(given, "water_tables"))
    levels[get_number(*entry, "position").value_or(0)] = get_number(*entry, "h0").value_or(0);
  if (levels.empty()) {
    in_.error(*given.find("water_tables"), "'water_tables' is empty",
              "[{\"position\": 0, \"h0\": 1}]: levels along dir_h [m]");
    return std::nullopt;
  }
  std::vector<std::array<double, 2>> points;
  for (const auto& [position, level] : levels) points.push_back({position, level});
  return Level([along, points](const Vec<Dim>& x) { return interpolated(points, x[along]); });
}

template <int Dim>
void ScenarioBuilder<Dim>::build_water_table(const JsonValue& given) {
  const int up = get_direction(given, "dir_v").value_or(Dim - 1);
  const int along = get_direction(given, "dir_h").value_or(0);
  for (const char* key : {"dir_v", "dir_h"})
    if (get_direction(given, key).value_or(0) >= Dim)
      return in_.error(*given.find(key), fmt::format("'{}' must be below {}", key, Dim));
  const auto level = water_level(given, up, along);
  if (!level) return;
  if (!(model_.gravity[up] < 0))
    in_.warning(given,
                fmt::format("gravity does not act along -{}: water has no pressure", "xyz"[up]),
                "'dir_v' is the axis upward, and gravity acts against it");
  const ParticleTable<Dim>& p = model_.particles;
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const auto& liquid = model_.materials[p.material[i]].liquid;
    const double weight = liquid ? -liquid->density * model_.gravity[up] : 0.0;
    // Of 0 and NaN, max() takes 0.
    model_.particles.pore_pressure[i] = std::max(0.0, weight * ((*level)(p.x[i]) - p.x[i][up]));
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
