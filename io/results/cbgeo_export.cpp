#include "io/results/cbgeo_export.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/base/atomic_file.h"
#include "io/frames/cbgeo_table.h"
#include "io/json/json_text.h"
#include "io/schema/keys.h"
#include "physics/base/error.h"
#include "physics/materials/materials.h"

namespace lahar {

namespace {

static_assert(most_state <= CbgeoParticle::opening, "a law has more than the file holds");

/// State variables of a law, by its name in scenarios.
template <class... Laws>
std::vector<std::string> states_of(std::string_view type, const std::variant<Laws...>*) {
  std::vector<std::string> names;
  const auto add = [&](std::string_view law, const auto& variables) {
    if (law == type)
      for (const StateVariable& variable : variables) names.emplace_back(variable.name);
  };
  (add(Laws::name, Laws::state), ...);
  return names;
}
std::vector<std::string> states_of(std::string_view type) {
  return states_of(type, static_cast<const Law*>(nullptr));
}

/// The columns of a frame where the rows of the table come from; null = the frame has none.
struct Columns {
  const FrameColumn *mass, *volume, *displacement, *velocity, *stress, *strain, *opening;
  std::map<Index, std::vector<const FrameColumn*>> states;  ///< by material id

  Columns(const Frame& frame, const CbgeoRun& run)
      : mass(frame.find("mass")),
        volume(frame.find("volume")),
        displacement(frame.find("displacement")),
        velocity(frame.find("velocity")),
        stress(frame.find("stress")),
        strain(frame.find("strain")),
        opening(frame.find("opening")) {
    for (const auto& [material, names] : run.states)
      for (const std::string& name : names) states[material].push_back(frame.find(name));
  }
};

template <std::size_t N>
void get(const FrameColumn* column, std::size_t i, int components, double (&to)[N]) {
  if (!column) return;
  const auto n = static_cast<std::size_t>(components);
  std::copy_n(column->values.begin() + static_cast<std::ptrdiff_t>(i * n), n, to);
}

CbgeoParticle particle_of(const Frame& frame, const Columns& columns, std::size_t i) {
  CbgeoParticle p;
  const auto dim = static_cast<std::size_t>(frame.dim);
  p.id = frame.id[i];
  if (columns.mass) p.mass = columns.mass->values[i];
  if (columns.volume) p.volume = columns.volume->values[i];
  std::copy_n(frame.coordinates.begin() + static_cast<std::ptrdiff_t>(i * dim), dim, p.coord);
  get(columns.displacement, i, frame.dim, p.displacement);
  get(columns.velocity, i, frame.dim, p.velocity);
  get(columns.stress, i, 6, p.stress);
  get(columns.strain, i, 6, p.strain);
  if (columns.opening) p.svars[CbgeoParticle::opening] = columns.opening->values[i];
  p.epsilon_v = p.strain[0] + p.strain[1] + p.strain[2];
  if (frame.material.empty()) return p;
  p.material_id = static_cast<std::uint32_t>(frame.material[i]);
  const auto states = columns.states.find(frame.material[i]);
  if (states == columns.states.end()) return p;
  p.nstate_vars = static_cast<std::uint32_t>(states->second.size());
  for (std::size_t k = 0; k < states->second.size(); ++k)
    if (states->second[k]) p.svars[k] = states->second[k]->values[i];
  if (const FrameColumn* pressure = frame.find("pressure"); pressure && p.nstate_vars > 0)
    p.pressure = pressure->values[i];
  return p;
}

/// Names of fields that the table needs and a frame does not have: state variables only of
/// materials that its particles have.
std::vector<std::string> missing_fields(const Frame& frame, const CbgeoRun& run) {
  std::vector<std::string> missing;
  const auto need = [&](const std::string& name) {
    if (!frame.find(name) && std::find(missing.begin(), missing.end(), name) == missing.end())
      missing.push_back(name);
  };
  for (const char* name : {"mass", "volume", "displacement", "velocity", "stress", "strain"})
    need(name);
  const auto& used = frame.material;
  for (const auto& [material, names] : run.states)
    if (std::find(used.begin(), used.end(), static_cast<std::int32_t>(material)) != used.end())
      for (const std::string& name : names) need(name);
  return missing;
}

}  // namespace

CbgeoRun read_cbgeo_run(const std::filesystem::path& run) {
  std::filesystem::path folder = run;
  if (!std::filesystem::is_directory(run)) folder = run.parent_path().parent_path();
  const auto file = folder / "scenario.full.json";
  CbgeoRun result;
  if (!std::filesystem::exists(file)) return result;
  try {
    const auto json = json_of_text(read_text_file(file));
    if (const auto& analysis = json.at("analysis"); analysis.contains("nsteps"))
      result.nsteps = static_cast<Index>(analysis["nsteps"].get<double>());
    Index position = 0;
    for (const auto& material : json.at("materials")) {
      const Index id = material.value("id", position++);
      result.states[id] = states_of(without_dimension(material.at("type").get<std::string>()));
    }
  } catch (const nlohmann::json::exception& error) {
    throw IoError(fmt::format("cannot read {}: {}", file.string(), error.what()));
  }
  return result;
}

void write_cbgeo(const Frame& frame, const CbgeoRun& run, const std::filesystem::path& file) {
  if (frame.step == 0)
    throw InputError({Problem{
        .message = "the state before the first step has no counterpart in the files of CB-Geo MPM",
        .hint = "choose a later step: --step"}});
  if (frame.find("pore_pressure"))
    throw InputError({Problem{
        .message = "the particle files of CB-Geo MPM have no liquid in pores: it would be lost",
        .hint = "write csv or vtu, or go on with --restart"}});
  if (const auto missing = missing_fields(frame, run); !missing.empty())
    throw InputError({Problem{
        .message = fmt::format("the frame has no {}, which the particle files of CB-Geo MPM have",
                               fmt::join(missing, ", ")),
        .hint = "run again without \"frame_fields\" in post_processing, or with all of these; csv "
                "and vtu are written with what there is"}});
  check_consistent(frame);
  const Columns columns(frame, run);
  write_cbgeo_table(file, frame.size(), [&](Index first, Index n) {
    std::vector<CbgeoParticle> rows;
    for (Index i = first; i < first + n; ++i)
      rows.push_back(particle_of(frame, columns, static_cast<std::size_t>(i)));
    return rows;
  });
}

}  // namespace lahar
