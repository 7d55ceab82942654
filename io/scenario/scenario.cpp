#include "io/scenario/scenario.h"

#include <fmt/format.h>

#include "io/scenario/scenario_builder.h"
#include "io/scenario/stages.h"
#include "io/schema/keys.h"

namespace lahar {

namespace {

/// Cells of a grid that are searched in a moment.
constexpr Index quickly_searched = 10'000'000;

}  // namespace

template <int Dim>
ScenarioBuilder<Dim>::ScenarioBuilder(ScenarioInput& in)
    : in_(in), team_(*in.team), root_(in.document.root) {}

template <int Dim>
Model<Dim> ScenarioBuilder<Dim>::build() {
  build_as_cbgeo();
  name_output();
  build_plane();
  build_implicit();
  build_projection();
  build_mesh();
  // Who is wrong is not kept waiting for what else may be wrong. All members have these problems.
  if (!in_.problems.empty() && section("mesh").find("structured") && n_cells() > quickly_searched)
    return std::move(model_);
  build_geometry();
  build_sets();
  build_materials();
  build_functions();
  build_rigid_bodies();
  build_particles();
  build_changes();
  check_phases();
  build_conditions();
  build_particle_constraints();
  build_gravity();
  build_pore_pressures();
  build_tractions();
  build_analysis();
  check_removal_times();
  build_k0();
  assign_generator_stresses();
  build_contact();
  build_transfer_rates();  // of its bodies
  check_rigid_bodies();
  find_sides();
  check_two_phase();
  check_implicit();
  check_projection();
  build_b_bar();
  check_plane();
  check_until();
  build_output();
  build_gauges();
  build_frame_set();
  if (in_.problems.empty()) find_pressures_inside();
  if (in_.problems.empty()) find_loaded_surfaces();
  warn_of_doubts();
  if (in_.problems.empty()) collect_marks();
  if (in_.problems.empty()) split_fields();
  if (in_.problems.empty()) place_tractions();
  if (in_.problems.empty()) integrate_accelerations();
  build_resume();
  return std::move(model_);
}

template Model<2> ScenarioBuilder<2>::build();
template Model<3> ScenarioBuilder<3>::build();

namespace {

// A place that says how many dimensions the case has.
struct Claim {
  const JsonValue* value;
  std::string key;
  int dim;
};

// The dimension that a name contains ("MPMExplicit2D", "ED3H8", "Ascii2D"); 0 = none.
int dimension_in(const std::string& name) {
  if (name.rfind("ED2", 0) == 0 || name.find("2D") != std::string::npos) return 2;
  if (name.rfind("ED3", 0) == 0 || name.find("3D") != std::string::npos) return 3;
  return 0;
}

class Claims {
 public:
  explicit Claims(const JsonValue& root) {
    if (const auto* analysis = root.find("analysis")) name(*analysis, "type", "analysis.type");
    if (const auto* mesh = root.find("mesh")) {
      name(*mesh, "cell_type", "mesh.cell_type");
      name(*mesh, "io_type", "mesh.io_type");
      name(*mesh, "node_type", "mesh.node_type");
      if (const auto* structured = mesh->find("structured"))
        for (const char* key : {"counts", "cell_size", "extent", "origin"})
          length(*structured, key);
    }
    if (const auto* loads = root.find("external_loading_conditions")) {
      length(*loads, "gravity");
      if (const auto* ramped = loads->find("gravity")) length(*ramped, "gravity");
    }
    for (const auto* material : get_list(root, "materials")) name(*material, "type", "type");
    for (const auto* entry : get_list(root, "particles"))
      if (const auto* generator = entry->find("generator"))
        for (const char* key : {"io_type", "particle_type"}) name(*generator, key, key);
  }

  /// What the first says; without one, what the first array has; 0 = nothing does.
  int dimension() const {
    return !names_.empty() ? names_[0].dim : lengths_.empty() ? 0 : lengths_[0].dim;
  }

  /// Report names that disagree with the first. (Arrays of the wrong length the tables report.)
  void check(ScenarioInput& in) const {
    for (const Claim& c : names_)
      if (c.dim != names_[0].dim)
        in.error(*c.value,
                 fmt::format("{} is {}D, but {} {} says that the case is {}D", to_json(*c.value),
                             c.dim, names_[0].key, to_json(*names_[0].value), names_[0].dim));
  }

 private:
  void name(const JsonValue& object, const char* key, const char* shown) {
    const JsonValue* v = object.find(key);
    if (!v || !v->is<std::string>()) return;
    if (const int dim = dimension_in(v->as<std::string>())) names_.push_back({v, shown, dim});
  }
  void length(const JsonValue& object, const char* key) {
    const JsonValue* v = object.find(key);
    if (!v || !v->is<JsonValue::Array>()) return;
    const auto n = v->as<JsonValue::Array>().size();
    if (n == 2 || n == 3) lengths_.push_back({v, key, static_cast<int>(n)});
  }
  std::vector<Claim> names_, lengths_;
};

// The position of the value that problem.where points to, or of the nearest one around it.
Problem place_problem(const JsonDocument& document, const Problem& problem) {
  const JsonValue* value = &document.root;
  std::string_view rest = problem.where;
  while (rest.starts_with('/')) {
    rest.remove_prefix(1);
    const std::string_view key = rest.substr(0, rest.find('/'));
    const JsonValue* next = value->find(key);
    if (!next) break;
    value = next;
    rest.remove_prefix(key.size());
  }
  return document.at(*value, problem.message, problem.hint);
}

// Problems of a stage after the first name it.
std::vector<Problem> of_stage(std::vector<Problem> problems, const std::string& stage) {
  if (!stage.empty())
    for (Problem& problem : problems)
      problem.message = fmt::format("stage {}: {}", stage, problem.message);
  return problems;
}

[[noreturn]] void fail(const ScenarioInput& in) {
  throw InputError(of_stage(in.problems.errors(in.file), in.stage));
}

Scenario read_case(ScenarioInput in, std::string text, const ScenarioOptions& options) {
  in.memory = options.memory;
  in.phase = options.phase;
  in.marks = options.marks;
  JsonValue& root = in.document.root;
  if (root.valid())
    for (const auto& argument : options.overrides)
      in.document.override_value(argument, in.problems);
  if (root.valid() && !root.is<JsonValue::Object>())
    in.error(root, fmt::format("a scenario must be an object, found {}", describe(root)));
  if (!root.is<JsonValue::Object>()) fail(in);
  const bool had_problems = !in.problems.empty();
  std::vector<std::string> stages = take_stage(in, options.stage);
  if (!had_problems && !in.problems.empty()) fail(in);

  const Claims claims(root);
  const int dim = claims.dimension();
  claims.check(in);
  if (dim == 0) {
    in.error(root, "nothing says whether the case is 2D or 3D",
             "mesh.cell_type says it, such as \"ED2Q4\" or \"ED3H8\"");
    fail(in);
  }
  check_section(scenario_section(), root, dim, in.document, in.problems);
  if (options.planned)
    in.planned = [&](const std::string& folder) {
      try {
        options.planned(folder, stages);
      } catch (const InputError& error) {
        std::vector<Problem> problems = error.problems();
        for (Problem& problem : problems)
          if (!problem.where.empty()) problem = place_problem(in.document, problem);
        throw InputError(std::move(problems));
      }
    };

  Scenario scenario;
  if (dim == 2)
    scenario.model = ScenarioBuilder<2>(in).build();
  else
    scenario.model = ScenarioBuilder<3>(in).build();
  if (!in.problems.empty()) fail(in);
  scenario.stages = std::move(stages);
  scenario.stage = options.stage;
  scenario.classes = in.classes;
  scenario.loads = std::move(in.loads);
  scenario.warnings = of_stage(in.problems.take_warnings(in.file), in.stage);
  scenario.map = std::move(in.map);
  scenario.side_files = std::move(in.side_files);
  scenario.text = std::move(text);
  scenario.full = to_json(root) + "\n";
  auto document = std::make_shared<const JsonDocument>(std::move(in.document));
  scenario.place = [document](const Problem& problem) { return place_problem(*document, problem); };
  return scenario;
}

// The scenario's text, which one member of the team reads, so that all have the same.
std::string read_scenario_file(const std::filesystem::path& file, const Team& team) {
  std::vector<char> text;
  all_or_none(team, [&] {
    if (team.index() != 0) return;
    std::string reason;
    const auto read = read_text_file(file.string(), reason);
    if (!read)
      throw InputError({Problem{.file = file.string(), .message = "the scenario " + reason}});
    text.assign(read->begin(), read->end());
  });
  const auto said = team.gather(text);
  return {said.front().begin(), said.front().end()};
}

// Alone, unless the options say more.
const Team& team_of(const ScenarioOptions& options) {
  static const Team alone;
  return options.team ? *options.team : alone;
}

}  // namespace

Scenario read_scenario(const std::filesystem::path& file, const ScenarioOptions& options) {
  std::string text = read_scenario_file(file, team_of(options));
  ProblemList problems;
  JsonDocument document(file.string(), text, problems);
  ScenarioInput in{
      file.string(),        std::move(document),
      std::move(problems),  options.folder.empty() ? file.parent_path() : options.folder,
      file.stem().string(), options.as_cbgeo,
      &team_of(options)};
  Scenario scenario = read_case(std::move(in), std::move(text), options);
  scenario.file = file;
  return scenario;
}

Scenario read_scenario_text(const std::string& text, const std::filesystem::path& folder,
                            const ScenarioOptions& options) {
  ProblemList problems;
  JsonDocument document(options.text_name, text, problems, options.printed);
  ScenarioInput in{options.text_name,
                   std::move(document),
                   std::move(problems),
                   folder,
                   std::filesystem::path(options.text_name).stem().string(),
                   options.as_cbgeo,
                   &team_of(options)};
  return read_case(std::move(in), text, options);
}

}  // namespace lahar
