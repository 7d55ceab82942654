// Going on from a particle file of CB-Geo MPM (analysis.resume).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/frames/cbgeo_table.h"
#include "io/scenario/scenario_builder.h"
#include "physics/materials/law.h"

namespace lahar {

namespace {

/// Rows that a member reads at a time.
constexpr Index block_rows = 1 << 14;

bool is_finite(const CbgeoParticle& p) {
  double sum = p.mass + p.volume + p.pressure;  // not finite if one of its terms is not
  for (int k = 0; k < 3; ++k) sum += p.coord[k] + p.displacement[k] + p.velocity[k];
  for (int k = 0; k < 6; ++k) sum += p.stress[k] + p.strain[k];
  for (const double state : p.svars) sum += state;
  return std::isfinite(sum);
}

[[noreturn]] void refuse(const std::string& file, std::string message, std::string hint = "") {
  throw InputError({Problem{.file = file, .message = std::move(message), .hint = std::move(hint)}});
}

/// Every member reads its part of the rows of each file, and gives each row to who holds it.
std::vector<CbgeoParticle> read_share(const std::vector<std::filesystem::path>& files,
                                      const Team& team, auto&& owner) {
  std::vector<CbgeoParticle> own;
  for (const auto& file : files) {
    Index n = 0;
    all_or_none(team, [&] { n = count_cbgeo_rows(file); });
    Index row = team.part(n, team.index());
    const Index end = team.index() + 1 < team.size() ? team.part(n, team.index() + 1) : n;
    while (team.any(row < end)) {
      std::vector<std::vector<CbgeoParticle>> to(static_cast<std::size_t>(team.size()));
      all_or_none(team, [&] {
        for (CbgeoParticle& p : read_cbgeo_rows(file, row, std::min(block_rows, end - row))) {
          if (p.id < 0 || p.id >= first_injected_id)
            refuse(file.string(), fmt::format("{} is not the id of a particle", p.id));
          to[static_cast<std::size_t>(owner(p.id))].push_back(p);
        }
      });
      row = std::min(end, row + block_rows);
      for (const auto& part : team.exchange(std::move(to)))
        own.insert(own.end(), part.begin(), part.end());
    }
  }
  std::sort(own.begin(), own.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return own;
}

template <class T>
std::string list_steps(const std::vector<T>& steps) {
  std::vector<std::string> words;
  for (const auto step : steps) words.push_back(fmt::format("{}", step));
  return list_some(words);
}

}  // namespace

template <int Dim>
std::vector<std::filesystem::path> ScenarioBuilder<Dim>::find_resume_files(const JsonValue& resume,
                                                                           const std::string& run,
                                                                           Index step) {
  std::vector<std::filesystem::path> files;
  by_the_first(team_, in_.problems, [&](ProblemList& problems) {
    const auto folder =
        (in_.folder / get_text(section("post_processing"), "path").value_or("results/") / run)
            .lexically_normal();
    files = find_cbgeo_files(folder, step);
    if (!files.empty()) return;
    const auto steps = cbgeo_steps(folder);
    std::string hint = "CB-Geo MPM writes particlesNNN.h5 to post_processing.path / uuid";
    if (std::binary_search(steps.begin(), steps.end(), step))
      hint = "of a parallel run the files of all ranks are needed";
    else if (!steps.empty())
      hint = "there are those of steps " + list_steps(steps);
    problems.error(in_.document.at(
        resume, fmt::format("there is no particle file of step {} in {}", step, folder.string()),
        hint));
  });
  std::vector<char> names;
  for (const auto& file : files) {
    const std::string name = file.string();
    names.insert(names.end(), name.c_str(), name.c_str() + name.size() + 1);
  }
  files.clear();
  const auto said = team_.gather(names).front();
  for (auto at = said.begin(); at != said.end();) {
    const auto end = std::find(at, said.end(), '\0');
    files.emplace_back(std::string(at, end));
    at = end + 1;
  }
  return files;
}

template <int Dim>
void ScenarioBuilder<Dim>::build_resume() {
  const JsonValue* resume = section("analysis").find("resume");
  if (!resume || !resume->is<JsonValue::Object>() || !get_bool(*resume, "resume").value_or(false))
    return;
  const auto run = get_text(*resume, "uuid");
  const auto step = get_integer(*resume, "step");
  for (const char* key : {"uuid", "step"})
    if (!written(*resume, key))
      in_.error(*resume, fmt::format("'{}' is missing in analysis.resume", key),
                "uuid: the run to go on from; step: that of its particle file");
  if (!run || !step) return;
  Analysis& a = model_.analysis;
  if (a.functions == ShapeFunctions::cpdi2) {
    in_.error(
        *resume, "a run with \"cpdi2\" cannot be resumed from a particle file",
        "the file does not have the corners of the particles' domains; go on from a checkpoint "
        "(--restart), or take \"cpdi\", whose domains begin anew as boxes");
    return;
  }
  if (a.free_bodies) {
    in_.error(
        *resume, "a run with free rigid bodies cannot be resumed from a particle file",
        "the file does not have where bodies are and how they move; leave out \"resume\", and "
        "go on from a checkpoint of that run: lahar run ... --restart latest");
    return;
  }
  const auto is_prescribed = [](const RigidBody<Dim>& body) {
    return body.motion == RigidBody<Dim>::Motion::prescribed;
  };
  if (a.step.adaptive && std::ranges::any_of(model_.rigid_bodies, is_prescribed))
    in_.warning(*resume,
                "rigid bodies with prescribed motion begin where they were at time 0: without a "
                "fixed 'dt' the time begins anew",
                "go on from a checkpoint (--restart), or give their regions where they are");
  if (a.affine != Affine::none)
    in_.warning(
        *resume,
        "the particle file has no affine velocities: \"apic\", \"tpic\" and \"asflip\" begin "
        "without them",
        "the first step smooths velocities as PIC does; go on from a checkpoint (--restart) "
        "to keep them");
  if (is_implicit(a) && !a.implicit.quasi_static)
    in_.warning(*resume, "the particle file has no accelerations: they begin at zero",
                "go on from a checkpoint (--restart) to keep them");
  a.sudden_velocities = false;  // nodes moved in the steps before, too
  // The file does not have its time: steps before may have been of any length.
  a.first_step = a.step.adaptive ? 0 : *step + 1;
  if (a.nsteps < a.first_step) {
    in_.error(*resume,
              fmt::format("the run ends with step {}, but is to go on from step {}", a.nsteps,
                          a.first_step),
              written(section("analysis"), "nsteps")
                  ? "raise nsteps: it counts the steps before as well"
                  : "raise end_time: with a fixed dt it counts the time before, steps times dt, as "
                    "well; or leave dt out");
    return;
  }
  const auto files = find_resume_files(*resume, *run, *step);
  if (!in_.problems.empty()) return;
  try {
    resume_from(files);
  } catch (const InputError& error) {
    for (const Problem& problem : error.problems()) in_.problems.error(problem);
  }
  for (const auto& file : files) in_.side_files.push_back(file);
}

template <int Dim>
void ScenarioBuilder<Dim>::resume_from(const std::vector<std::filesystem::path>& files) {
  model_.particles = {};
  const auto owner = [&](Index id) {
    return id < rows_.total() ? rows_.member(id) : static_cast<int>(id % team_.size());
  };
  std::vector<CbgeoParticle> rows = read_share(files, team_, owner);
  std::vector<Index> suggested;
  all_or_none(team_, [&] {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (i > 0 && rows[i - 1].id == rows[i].id)
        refuse(files.front().string(), fmt::format("there are two particles {}", rows[i].id));
      add_resumed(rows[i], files.front().string());
      suggested.push_back(rows[i].cell_id < n_cells() ? rows[i].cell_id : -1);
    }
    rows = {};
  });
  const auto strays = find_cells(suggested);
  all_or_none(team_, [&] {
    if (!strays.empty())
      refuse(files.front().string(),
             fmt::format("particle {} lies outside the mesh (and {} more)",
                         model_.particles.id[static_cast<std::size_t>(strays.front())],
                         strays.size() - 1));
  });
  // Sets are those of the particles that are still there.
  const auto keep_present = [&](auto& loads) {
    for (auto& load : loads) {
      const auto& ids = model_.particles.id;
      if (load.all) load.particles = ids;  // those that were injected, too
      std::erase_if(load.particles,
                    [&](Index id) { return !std::binary_search(ids.begin(), ids.end(), id); });
    }
  };
  keep_present(model_.tractions);
  keep_present(model_.particle_velocities);
}

template <int Dim>
void ScenarioBuilder<Dim>::add_resumed(const CbgeoParticle& row, const std::string& file) {
  const auto material =
      std::find_if(model_.materials.begin(), model_.materials.end(),
                   [&](const Material& m) { return m.id == static_cast<Index>(row.material_id); });
  if (material == model_.materials.end())
    refuse(file, fmt::format("particle {} is of material {}, which materials does not have", row.id,
                             row.material_id));
  if (!is_finite(row)) refuse(file, fmt::format("particle {} is not finite", row.id));
  if (!(row.mass > 0) || !(row.volume > 0))
    refuse(file, fmt::format("the mass and volume of particle {} must be above 0, found {} kg and "
                             "{} m^3",
                             row.id, row.mass, row.volume));
  ParticleTable<Dim>& to = model_.particles;
  to.id.push_back(row.id);
  to.x.push_back(Vec<Dim>(row.coord));
  to.cell.push_back(-1);
  to.volume.push_back(row.volume);
  to.mass.push_back(row.mass);
  to.opening.push_back(std::max(0.0, row.svars[CbgeoParticle::opening]));
  to.material.push_back(static_cast<std::uint16_t>(material - model_.materials.begin()));
  to.velocity.push_back(Vec<Dim>(row.velocity));
  to.displacement.push_back(Vec<Dim>(row.displacement));
  to.stress.emplace_back();
  to.strain.emplace_back();
  for (std::size_t k = 0; k < 6; ++k) {
    to.stress.back()[k] = row.stress[k];
    to.strain.back()[k] = row.strain[k];
  }
  const std::size_t n = state_variables(material->law).size();
  if (row.nstate_vars != n)
    refuse(file,
           fmt::format("particle {} has {} state variables, its material {} has {}", row.id,
                       row.nstate_vars, row.material_id, n),
           "materials need the types that they had in the run before; their parameters may differ");
  std::copy_n(row.svars, n, to.state.emplace_back().begin());
  follow_parameters(material->law, to.state.back().data());
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
