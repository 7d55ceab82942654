// Scheme, time step, duration and output.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "io/scenario/scenario_builder.h"
#include "physics/materials/law.h"
#include "physics/particles/derived_fields.h"

namespace lahar {

namespace {

Scheme scheme_of(const std::string& name) {
  return name == "usl"          ? Scheme::usl
         : name == "musl"       ? Scheme::musl
         : name == "newmark"    ? Scheme::newmark
         : name == "projection" ? Scheme::projection
                                : Scheme::usf;
}

// A title as a folder name: letters, digits, '-', '_' and '.', the rest becomes '-'.
std::string folder_name(const std::string& title) {
  std::string out;
  for (const char c : title) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.';
    if (plain)
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (!out.empty() && out.back() != '-')
      out += '-';
  }
  while (!out.empty() && (out.back() == '-' || out.back() == '.')) out.pop_back();
  return out;
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::build_as_cbgeo() {
  JsonValue* analysis = root_.find("analysis");
  if (!analysis) return;
  in_.as_cbgeo = in_.as_cbgeo || get_bool(*analysis, "as_cbgeo").value_or(false);
  set(*analysis, "as_cbgeo", in_.as_cbgeo);
  model_.analysis.as_cbgeo = in_.as_cbgeo;
  // CB-Geo's input always names its equations, scenarios written for Lahar need not.
  const JsonValue* type = analysis->find("type");
  const bool named = type && !type->defaulted;
  const std::string preset = get_text(*analysis, "preset").value_or(named ? "cbgeo" : "lahar");
  in_.cbgeo_defaults = in_.as_cbgeo || preset == "cbgeo";
  set(*analysis, "preset", std::string(in_.cbgeo_defaults ? "cbgeo" : preset));
}

// What keys that are not written mean in scenarios written for Lahar: what gave stable results that
// hardly depend on the step (tests/verification/results.md). Where grains part and meet again,
// run-outs grow with the step.
template <int Dim>
void ScenarioBuilder<Dim>::build_defaults(JsonValue& analysis) {
  JsonValue* step = analysis.find("time_step");
  const bool implicit = is_implicit(model_.analysis), projects = is_projection(model_.analysis);
  const bool adaptive = !in_.cbgeo_defaults && !implicit && !projects && !analysis.find("dt") &&
                        !written(analysis, "dt");
  if (step && step->is<JsonValue::Object>()) {
    if (!written(*step, "adaptive")) set(*step, "adaptive", adaptive);
    const double safety = implicit ? 0.2 : in_.cbgeo_defaults ? 0.5 : any_granular() ? 0.2 : 0.4;
    if (!written(*step, "safety")) set(*step, "safety", safety);
  }
  if (in_.cbgeo_defaults) return;
  const JsonValue* update = analysis.find("velocity_update");
  default_transfer_ =
      !implicit && (!update || update->defaulted) && !written(analysis, "velocity_update_settings");
  // Particles that cross cells make no noise with functions that are smooth.
  const std::string type = cell_type();
  const bool linear = type.empty() || type == "ED2Q4" || type == "ED3H8";
  if (!written(analysis, "shape_functions") && linear && !projects && mesh_ && is_grid())
    set(analysis, "shape_functions", std::string("quadratic_spline"));
  if (!written(analysis, "mpm_scheme") && !written(analysis, "stress_update") &&
      !written(analysis, "stress_analysis"))
    set(analysis, "mpm_scheme", default_scheme(analysis));
}

template <int Dim>
std::string ScenarioBuilder<Dim>::cell_type() const {
  return get_text(section("mesh"), "cell_type").value_or("");
}

// The second mapping of musl takes velocities of particles that nodes have not moved them by.
// Stress under tension makes energy of the difference: an elastic bar that is pulled by a tenth of
// its length tears in fine cells, with FLIP in most. With usl it does not. Affine velocities lose
// in impacts what they lose with musl; FLIP loses as much then. Contact needs musl, and forces at
// nodes strain the particles around less with it.
template <int Dim>
std::string ScenarioBuilder<Dim>::default_scheme(const JsonValue& analysis) const {
  const JsonValue* meets = analysis.find("interface");
  const bool smooth = functions_of(analysis) != ShapeFunctions::element;
  const bool touches = root_.find("rigid_bodies") ||
                       section("external_loading_conditions").find("concentrated_nodal_forces") ||
                       (meets && meets->is<bool>() && meets->as<bool>());
  return smooth && !touches && is_of_elastic_bodies() ? "usl" : "musl";
}

template <int Dim>
void ScenarioBuilder<Dim>::build_analysis() {
  JsonValue* analysis = root_.find("analysis");
  if (!analysis) return;
  build_defaults(*analysis);
  build_scheme(*analysis);
  build_velocity_update(*analysis);
  build_shape_functions(*analysis);
  build_time_step(*analysis);
  build_watchdog(*analysis);
  build_until(*analysis);
  Analysis& a = model_.analysis;
  build_damping(*analysis);
  a.pressure_smoothing = get_bool(*analysis, "pressure_smoothing").value_or(false);
  a.closed_faces = !in_.cbgeo_defaults;
  a.volume_as_cbgeo = in_.cbgeo_defaults;
  build_stress_rate(*analysis);
  a.damping_as_cbgeo = in_.cbgeo_defaults;
  a.sudden_velocities = !in_.cbgeo_defaults;
  if (const JsonValue* opening = analysis->find("opening");
      opening && get_bool(*analysis, "opening").value_or(false) &&
      (a.two_phase || begins_with_solve(a)))
    in_.error(*opening,
              fmt::format("'opening' does not go together with {}",
                          a.two_phase        ? "a liquid in pores"
                          : is_projection(a) ? "a projection"
                                             : "implicit steps"),
              "leave it out: no gaps open between grains");
  a.opening = get_bool(*analysis, "opening")
                  .value_or(!in_.cbgeo_defaults && !a.two_phase && !begins_with_solve(a));
  set(*analysis, "opening", a.opening);
  const auto opens = [](const Material& material) { return can_open(material.law); };
  a.opening = a.opening && std::any_of(model_.materials.begin(), model_.materials.end(), opens);
  build_lost_share(*analysis);
  a.patch_particles = get_integer(*analysis, "patch_particles").value_or(a.patch_particles);
  a.split_steps = get_integer(*analysis, "split_steps").value_or(a.split_steps);
  if (const JsonValue* steps = analysis->find("nload_balance_steps"))
    in_.warning(*steps, "'nload_balance_steps' has no effect",
                "work moves between ranks by itself, where that pays");
}

/// How far single grains fly is chance: a few of many may leave the mesh.
template <int Dim>
void ScenarioBuilder<Dim>::build_lost_share(JsonValue& analysis) {
  constexpr double few = 5e-3;
  Analysis& a = model_.analysis;
  const auto must_stay = get_bool(analysis, "locate_particles");
  const bool fly = !must_stay && !in_.cbgeo_defaults && any_granular();
  const double share = get_number(analysis, "lost_share").value_or(fly ? few : 0.0);
  set(analysis, "locate_particles", must_stay.value_or(true));
  set(analysis, "lost_share", share);
  a.remove_leaving_particles = !must_stay.value_or(true);
  if (a.remove_leaving_particles || share == 0) return;
  const Index all = team_.sum(static_cast<Index>(model_.particles.x.size()));
  const auto most = static_cast<Index>(share * static_cast<double>(all));
  if (most == 0) return;
  a.remove_leaving_particles = true;
  a.most_lost = most;
}

// One for all materials; the fork writes it in each.
template <int Dim>
void ScenarioBuilder<Dim>::build_stress_rate(JsonValue& analysis) {
  std::optional<std::string> rate;
  if (written(analysis, "stress_rate")) rate = get_text(analysis, "stress_rate");
  for (const JsonValue* material : get_list(root_, "materials")) {
    const auto own = get_text(*material, "stress_rate");
    if (!own) continue;
    if (rate && *own != *rate)
      in_.error(*material->find("stress_rate"),
                fmt::format("'stress_rate' is \"{}\" here and \"{}\" before", *own, *rate),
                "write one for all materials: analysis.stress_rate");
    rate = own;
  }
  model_.analysis.turns_stress = rate ? *rate == "jaumann" : !in_.cbgeo_defaults;
  set(analysis, "stress_rate", std::string(model_.analysis.turns_stress ? "jaumann" : "none"));
}

template <int Dim>
void ScenarioBuilder<Dim>::build_damping(const JsonValue& analysis) {
  const JsonValue* damping = analysis.find("damping");
  if (!damping) return;
  if (!written(*damping, "damping_factor") && !written(*damping, "damping_ratio"))
    return in_.error(*damping, "'damping_factor' is missing in analysis.damping",
                     "damping_factor: share of the unbalanced force [-], or rate of \"Viscous\" "
                     "damping [1/s]");
  const JsonValue* given = in_.either(*damping, "damping_factor", "damping_ratio");
  const JsonValue* documented = damping->find("damping_ratio");
  if (documented && in_.as_cbgeo)
    return in_.warning(*documented, "'damping_ratio' is ignored, as by CB-Geo: nothing is damped");
  if (documented)
    in_.warning(*documented, "'damping_ratio' is read as 'damping_factor'",
                "CB-Geo MPM, whose documentation has it, ignores this key and damps nothing; "
                "--as-cbgeo does the same");
  if (!given || !get_text(*damping, "type")) return;
  model_.analysis.damping = given->number();
  model_.analysis.viscous_damping = get_text(*damping, "type") == "Viscous";
  if (!model_.analysis.viscous_damping && given->number() > 1)
    in_.error(
        *given,
        fmt::format("'damping_factor' must be at least 0 and at most 1, found {}", given->number()),
        "\"type\": \"Cundall\" takes this share of the unbalanced force");
}

template <int Dim>
void ScenarioBuilder<Dim>::build_scheme(JsonValue& analysis) {
  const JsonValue* scheme = analysis.find("mpm_scheme");
  const char* key = analysis.find("stress_update") ? "stress_update" : "stress_analysis";
  const JsonValue* older = analysis.find(key);
  std::string name = "usf";
  if (scheme) name = scheme->as<std::string>();
  if (older) {
    std::string wanted = older->as<std::string>();
    std::transform(wanted.begin(), wanted.end(), wanted.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (scheme && wanted != name)
      in_.warning(*older, fmt::format("'{}' says {}, but 'mpm_scheme' says {}, which counts", key,
                                      wanted, name));
    else if (!scheme && in_.as_cbgeo)
      in_.warning(*older,
                  fmt::format("'{}': {} is ignored; usf is run, as by CB-Geo", key, wanted));
    else if (!scheme && wanted != "usf")
      in_.warning(*older,
                  fmt::format("'{}' is the older spelling of 'mpm_scheme'; {} is run", key, wanted),
                  "CB-Geo ignores this key and runs usf; --as-cbgeo does the same");
    if (!scheme && !in_.as_cbgeo) name = wanted;
  }
  if (in_.as_cbgeo && name == "musl") {
    in_.warning(*scheme, "'mpm_scheme': usf is run in place of musl, as by CB-Geo");
    name = "usf";
  }
  model_.analysis.scheme = scheme_of(name);
  set(analysis, "mpm_scheme", name);
  auto& members = std::get<JsonValue::Object>(analysis.data);
  std::erase_if(members, [](const auto& m) {
    return m.key == "stress_update" || m.key == "stress_analysis";
  });
}

// Those that the type of the cells names (P2B, G); else element.
template <int Dim>
ShapeFunctions ScenarioBuilder<Dim>::functions_of_cells() const {
  const std::string type = cell_type();
  if (type.ends_with("P2B")) return ShapeFunctions::quadratic_spline;
  // Called contiguous in CB-Geo, whose domains keep their size.
  if (type.ends_with("G"))
    return in_.as_cbgeo ? ShapeFunctions::uniform_gimp : ShapeFunctions::gimp;
  return ShapeFunctions::element;
}

template <int Dim>
ShapeFunctions ScenarioBuilder<Dim>::functions_of(const JsonValue& analysis) const {
  const std::string name = get_text(analysis, "shape_functions").value_or("element");
  for (const ShapeFunctionsRow& row : shape_functions_table)
    if (name == row.key && name != "element") return row.functions;
  return functions_of_cells();
}

template <int Dim>
void ScenarioBuilder<Dim>::build_shape_functions(const JsonValue& analysis) {
  ShapeFunctions& functions = model_.analysis.functions;
  const std::string type = cell_type();
  const JsonValue* key = analysis.find("shape_functions");
  const std::string name = key ? key->as<std::string>() : "element";
  if (name != "element" && functions_of_cells() != ShapeFunctions::element)
    return in_.error(*key,
                     fmt::format("'shape_functions' and the cell_type {} say both what the "
                                 "functions are",
                                 type),
                     "leave one of them out");
  functions = functions_of(analysis);
  model_.analysis.cbgeo_domains = in_.as_cbgeo && type.ends_with("G");
  model_.analysis.refuse_large_domains =
      get_text(analysis, "large_domains").value_or("clip") == "error";
  const bool opens = std::any_of(model_.materials.begin(), model_.materials.end(),
                                 [](const Material& m) { return can_open(m.law); });
  if (functions == ShapeFunctions::element && model_.analysis.affine != Affine::none && opens &&
      !in_.cbgeo_defaults)
    in_.error(*analysis.find("velocity_update"),
              fmt::format("'velocity_update': \"{}\" does not go together with the functions of "
                          "elements where material may come apart: where a particle is nearly "
                          "alone at a node, gradients of nodal velocities have no bound, and the "
                          "run makes energy",
                          analysis.find("velocity_update")->template as<std::string>()),
              "take \"shape_functions\": \"quadratic_spline\" or \"gimp\", or \"flip\"");
  if (functions == ShapeFunctions::cpdi2 && model_.analysis.transfer.separation > 0.0)
    in_.error(*key,
              "\"cpdi2\" does not go together with \"velocity_update\": \"asflip\": corners of "
              "domains move with the nodes, and particles would not",
              "take \"cpdi\", or set separation to 0 in velocity_update_settings");
  if (functions != ShapeFunctions::element && mesh_ && !is_grid())
    in_.error(name != "element" ? *key : *section("mesh").find("cell_type"),
              fmt::format("\"{}\" needs a mesh of equal boxes along the axes that fill a box",
                          name != "element" ? name : type),
              "give the mesh as \"structured\", or a file of such cells with \"isoparametric\": "
              "false");
}

// Whether the cells are equal boxes that fill the box around them.
template <int Dim>
bool ScenarioBuilder<Dim>::is_grid() const {
  constexpr double tolerance = 1e-6;  // as for cells that are boxes
  if (mesh_->is_structured()) return true;
  if (!mesh_->is_cartesian()) return false;
  const bool shared = mesh_->is_share();
  const auto [first, end] =
      shared ? own_cells(mesh_->n_cells(), team_) : std::pair(Index{0}, mesh_->n_cells());
  Vec<Dim> length = Vec<Dim>::Zero();  // of the first cell, which one member has
  std::vector<double> own;
  if (first == 0 && end > 0) {
    length = mesh_->geometry(0).length;
    own.assign(length.data(), length.data() + Dim);
  }
  if (shared)
    for (const auto& part : team_.gather(own))
      if (!part.empty()) length = Vec<Dim>(part.data());
  bool different = false;
  for (Index c = first; c < end && !different; ++c)
    different = !mesh_->geometry(c).length.isApprox(length, tolerance);
  if (shared ? team_.any(different) : different) return false;
  const auto [low, high] = mesh_->bounds();
  const double cells = (high - low).cwiseQuotient(length).prod();
  return std::abs(cells - static_cast<double>(mesh_->n_cells())) < 0.5;
}

template <int Dim>
void ScenarioBuilder<Dim>::build_time_step(const JsonValue& analysis) {
  Analysis& a = model_.analysis;
  if (const JsonValue* step = analysis.find("time_step")) {
    a.step.adaptive = get_bool(*step, "adaptive").value_or(false);
    a.step.safety = get_number(*step, "safety").value_or(a.step.safety);
    a.step.accept_unstable = get_bool(*step, "accept_unstable").value_or(false);
  }
  const auto dt = get_number(analysis, "dt");
  a.step.dt = dt.value_or(std::numeric_limits<double>::infinity());
  const bool needs_dt = !a.step.adaptive || begins_with_solve(a);  // nothing else limits these
  if (!dt && needs_dt && !written(analysis, "dt"))
    in_.error(analysis, "'dt' is missing in analysis",
              begins_with_solve(a)
                  ? "dt [s]: the time step, which waves do not limit; with an "
                    "adaptive step the largest one"
                  : "dt [s]: the time step; or \"time_step\": {\"adaptive\": true}");
  const auto nsteps = get_integer(analysis, "nsteps");
  const auto end = get_number(analysis, "end_time");
  if (!nsteps && !end && !written(analysis, "nsteps") && !written(analysis, "end_time"))
    in_.error(analysis, "'nsteps' is missing in analysis",
              "nsteps: the number of steps; or end_time [s]");
  if (end) a.end_time = *end;
  // A fixed step that divides the end time to rounding needs no step more [-].
  constexpr double rounding = 1e-9;
  a.nsteps = nsteps.value_or(std::numeric_limits<Index>::max());
  if (!nsteps && end && dt && !a.step.adaptive)
    a.nsteps = static_cast<Index>(std::min(std::ceil(*end / *dt * (1 - rounding)), 9e15));
}

template <int Dim>
void ScenarioBuilder<Dim>::build_watchdog(JsonValue& analysis) {
  JsonValue* given = analysis.find("watchdog");
  if (!given || !given->is<JsonValue::Object>()) return;
  using Action = Watchdog::Action;
  Watchdog& dog = model_.watchdog;
  // The reference code goes on whatever happens.
  const std::string action =
      get_text(*given, "action").value_or(in_.cbgeo_defaults ? "warn" : "stop");
  set(*given, "action", action);
  dog.action = action == "off" ? Action::none : action == "warn" ? Action::warn : Action::stop;
  const Watchdog usual;
  dog.energy = get_number(*given, "energy").value_or(usual.energy);
  dog.speed = get_number(*given, "speed").value_or(usual.speed);
  dog.time_step = get_number(*given, "time_step").value_or(usual.time_step);
  dog.compression = get_number(*given, "compression").value_or(usual.compression);
  dog.expansion = get_number(*given, "expansion").value_or(usual.expansion);
}

/// Refuse intervals that a run has more multiples of than can be counted.
template <int Dim>
void ScenarioBuilder<Dim>::check_interval(const JsonValue& post, std::string_view key) {
  constexpr double most = 9e15;  // whole numbers up to this are exact
  const Analysis& a = model_.analysis;
  const double by_steps = a.step.adaptive ? std::numeric_limits<double>::infinity()
                                          : static_cast<double>(a.nsteps) * a.step.dt;
  const double duration = std::min(a.end_time, by_steps);
  const double interval = get_number(post, key).value_or(0);
  if (!(interval > 0) || !std::isfinite(duration) || duration / interval <= most) return;
  in_.error(*post.find(key),
            fmt::format("'{}' is {} s: the run of {:.4g} s has {:.4g} multiples of it; at most "
                        "{:.0e} can be counted",
                        key, interval, duration, duration / interval, most),
            "give a longer interval [s]");
}

template <int Dim>
void ScenarioBuilder<Dim>::build_output() {
  OutputPlan& out = model_.output;
  const JsonValue& post = section("post_processing");
  out.frame_steps = get_integer(post, "output_steps").value_or(out.frame_steps);
  out.frame_dt = get_number(post, "output_dt").value_or(out.frame_dt);
  out.max_frames = get_integer(post, "max_frames").value_or(out.max_frames);
  out.history_steps = get_integer(post, "history_steps").value_or(out.history_steps);
  out.history_dt = get_number(post, "history_dt").value_or(out.history_dt);
  if (out.frame_steps > 0 && out.frame_dt > 0)
    in_.error(*post.find("output_dt"), "'output_steps' and 'output_dt' both say when frames come",
              "leave one of them out");
  if (out.history_steps > 0 && out.history_dt > 0)
    in_.error(*post.find("history_dt"), "'history_steps' and 'history_dt' both say when rows come",
              "leave one of them out");
  out.measured.steps = get_integer(post, "gauge_steps").value_or(0);
  out.measured.dt = get_number(post, "gauge_dt").value_or(0);
  if (out.measured.steps > 0 && out.measured.dt > 0)
    in_.error(*post.find("gauge_dt"), "'gauge_steps' and 'gauge_dt' both say when rows come",
              "leave one of them out");
  for (const std::string_view key : {"output_dt", "history_dt", "gauge_dt"})
    check_interval(post, key);
  out.checkpoint_steps = get_integer(post, "checkpoint_steps").value_or(out.checkpoint_steps);
  out.checkpoint_minutes = get_number(post, "checkpoint_minutes").value_or(out.checkpoint_minutes);
  out.checkpoints_kept = get_integer(post, "checkpoints_kept").value_or(out.checkpoints_kept);
  out.single_precision = get_text(post, "frame_precision") == "single";
  if (const JsonValue* fields = post.find("frame_fields")) check_fields(*fields);
  out.frame_fields = get_texts(post, "frame_fields");
  if (const JsonValue* fields = post.find("node_fields")) read_node_fields(*fields);
  std::vector<std::string> names = get_texts(post, "vtk");
  names.insert(names.end(), out.frame_fields.begin(), out.frame_fields.end());
  for (const DerivedField& field : derived_fields)
    if (std::find(names.begin(), names.end(), field.name) != names.end())
      out.derived_fields.push_back(&field);
}

template <int Dim>
void ScenarioBuilder<Dim>::name_output() {
  model_.title = get_text(root_, "title").value_or("");
  if (model_.title.empty()) model_.title = in_.stem;
  std::string name = get_text(section("analysis"), "uuid").value_or("");
  if (name == "." || name == ".." || name.find_first_of(std::string_view("/\0", 2)) != name.npos) {
    in_.error(*section("analysis").find("uuid"),
              fmt::format("'uuid' must be the name of a folder, found {}", json_quoted(name)),
              "results are in post_processing.path/uuid; --output FOLDER writes them elsewhere");
    name.clear();
  }
  if (name.empty()) name = folder_name(get_text(root_, "title").value_or(""));
  if (name.empty()) name = in_.stem;
  // The files that a run goes on from stay where they are.
  if (const JsonValue* resume = section("analysis").find("resume");
      resume && resume->is<JsonValue::Object>() && get_bool(*resume, "resume").value_or(false) &&
      get_text(*resume, "uuid") == name)
    name += "-resumed";
  if (JsonValue* analysis = root_.find("analysis")) set(*analysis, "uuid", name);
  const std::string path = get_text(section("post_processing"), "path").value_or("results/");
  model_.output.folder = (in_.folder / path / name).lexically_normal().string();
  if (in_.planned && in_.problems.empty()) in_.planned(model_.output.folder);
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
