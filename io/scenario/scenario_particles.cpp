// Particles: generators, placement, volumes, initial stresses, sets and materials.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

#include "io/base/text.h"
#include "io/scenario/particle_files.h"
#include "io/scenario/scenario_builder.h"
#include "io/scenario/surface_order.h"

namespace lahar {

template <int Dim>
void ScenarioBuilder<Dim>::build_particles() {
  const auto entries = get_list(root_, "particles");
  const JsonValue* list = root_.find("particles");
  if (list && list->is<JsonValue::Array>() && list->as<JsonValue::Array>().empty())
    in_.error(*list, "there are no particles", "add a generator");
  if (!list) particles_complete_ = false;
  bool check_duplicates = false;
  std::size_t left = entries.size();
  for (const JsonValue* entry : entries) {
    if (left-- == in_.placed) placed_row_ = rows_.total();
    const JsonValue* generator = entry->find("generator");
    if (!generator) {
      particles_complete_ = false;
      continue;
    }
    if (get_text(*generator, "type") == "inject") {
      build_injection(*generator);
      continue;
    }
    generate(*generator);
    // Particles of one region lie in parts of their own of the cells of a grid.
    const bool different = entries.size() == 1 && get_text(*generator, "type") == "region" &&
                           mesh_ && mesh_->is_structured();
    check_duplicates |= !different && get_bool(*generator, "check_duplicates").value_or(true);
  }
  if (!particles_complete_) sets_.particles.all_known = false;
  if (rows_.total() > 0) phase(fmt::format("cells of {} particles", format_count(rows_.total())));
  // Where stages place particles, others may be there no more.
  if (check_duplicates && in_.placed == 0) warn_of_coincident(*list);
  place_particles();
  assign_volumes();
  assign_stresses();
  collect_particle_sets();
  build_particle_sets();
  assign_material_sets();
  check_masses();
  if (!team_.alone()) model_.particles.id = rows_.own_rows(0, rows_.total());
}

template <int Dim>
void ScenarioBuilder<Dim>::warn_of_coincident(const JsonValue& particles) {
  const auto [a, b] = find_coincident<Dim>(model_.particles.x, rows_, team_);
  if (a >= 0)
    in_.warning(particles, fmt::format("particles {} and {} are at the same place", a, b));
}

template <int Dim>
void ScenarioBuilder<Dim>::generate(const JsonValue& generator) {
  const std::string type = get_text(generator, "type").value_or("");
  const JsonValue* shape = generator.find("region");
  const Region<Dim> region = shape && mesh_ ? region_of(*shape) : Region<Dim>();
  if (generator.find("layers")) return generate_layers(generator, region);
  const int material = find_material(generator);
  NewParticles<Dim> fresh;
  if (type == "file") {
    fresh = read_particles(generator);
  } else if (type == "gauss") {
    fresh = fill_gauss(generator);
  } else if (type == "region" && mesh_) {
    fresh = fill_region_of(generator, region);
    if (in_.problems.empty() && !team_.any(!fresh.x.empty())) {
      std::string hint = shape ? wrong_order<Dim>(*shape, geometry_) : "";
      if (hint.empty()) {
        hint = "does it lie inside the mesh? per_cell may be too small for it";
        const auto bounds = region.bounds();
        if (bounds.first.allFinite() && bounds.second.allFinite())
          hint += fmt::format(". It extends {}, the mesh {}", extent<Dim>(bounds),
                              extent<Dim>(mesh_->bounds()));
      }
      in_.error(generator, "the region contains no particle", hint);
    }
  }
  add_particles(generator, generator, material, std::move(fresh));
  if (generators_.empty() || generators_.back().generator != &generator)
    particles_complete_ = false;
}

/// Append what a generator made. `owner` has the particle set: the generator, or one of its layers.
template <int Dim>
void ScenarioBuilder<Dim>::add_particles(const JsonValue& generator, const JsonValue& owner,
                                         int material, NewParticles<Dim> fresh) {
  ParticleTable<Dim>& p = model_.particles;
  const Index first = rows_.total(), own = p.size();
  rows_.append(static_cast<Index>(fresh.x.size()), team_);
  if (rows_.total() > first) generators_.push_back({&generator, first, rows_.total(), fresh.parts});
  const auto append = [](auto& to, auto& from) {
    if (to.empty())
      to = std::move(from);
    else
      to.insert(to.end(), from.begin(), from.end());
  };
  append(p.x, fresh.x);
  append(p.cell, fresh.cell);
  append(p.volume, fresh.volume);
  p.material.resize(p.x.size(), static_cast<std::uint16_t>(std::max(material, 0)));
  const auto velocity = get_vector<Dim>(generator, "velocity");
  moving_ = moving_ || velocity;
  if (moving_) {
    p.velocity.resize(static_cast<std::size_t>(own), Vec<Dim>::Zero());
    p.velocity.resize(p.x.size(), velocity.value_or(Vec<Dim>::Zero()));
  }
  name_particle_set(owner, first, rows_.total());
}

template <int Dim>
NewParticles<Dim> ScenarioBuilder<Dim>::read_particles(const JsonValue& generator) {
  auto file = in_.open(generator, "location");
  if (!file) return {};
  auto points = read_particle_file<Dim>(*file, team_, in_.problems);
  if (!points) return {};
  need_particles(generator, team_.sum(static_cast<Index>(points->size())));
  NewParticles<Dim> fresh;
  fresh.x = std::move(*points);
  fresh.cell.assign(fresh.x.size(), -1);
  fresh.volume.assign(fresh.x.size(), 0.0);
  const Index first = rows_.total();
  const Index n = team_.sum(static_cast<Index>(fresh.x.size()));
  sources_.push_back({std::move(*file), first, first + n});
  return fresh;
}

template <int Dim>
bool ScenarioBuilder<Dim>::check_gauss_points(const JsonValue& generator) {
  const auto n = get_integer(generator, "nparticles_per_dir");
  const Element element = mesh_ ? mesh_->element() : multilinear<Dim>;
  if (!n || *n <= most_gauss_points(element)) return true;
  in_.error(*generator.find("nparticles_per_dir"),
            fmt::format("'nparticles_per_dir' must be at most {} {}, found {}",
                        most_gauss_points(element),
                        info(element).simplex ? fmt::format("in a {}", info(element).noun)
                                              : std::string("in three dimensions"),
                        *n));
  return false;
}

template <int Dim>
NewParticles<Dim> ScenarioBuilder<Dim>::fill_gauss(const JsonValue& generator) {
  const auto n = get_integer(generator, "nparticles_per_dir");
  const auto cells = cells_of(generator);
  if (!check_gauss_points(generator) || !mesh_ || !n || !cells) return {};
  phase("particles at Gauss points");
  need_particles(generator, gauss_count(*cells, static_cast<int>(*n)));
  return fill_cells<Dim>(*mesh_with(*cells), *cells, static_cast<int>(*n));
}

template <int Dim>
void ScenarioBuilder<Dim>::name_particle_set(const JsonValue& generator, Index first, Index last) {
  const JsonValue* name = in_.either(generator, "pset_id", "pset");
  if (!name) return;
  EntitySets& sets = sets_.particles;
  std::vector<Index> ids = rows_.own_rows(first, last);
  if (name->is<std::string>()) {
    // Several generators may feed one set.
    auto& set = sets.by_name[name->as<std::string>()];
    set.insert(set.end(), ids.begin(), ids.end());
    return;
  }
  const auto id = static_cast<Index>(name->number());
  if (generator_sets_.insert(id).second) {
    // As in the reference, the generator's set comes first and keeps the id.
    const auto file = sets_.outlines.find(id);
    if (file != sets_.outlines.end()) {
      const auto& [begin, count, consecutive] = file->second;
      const bool same = count == last - first && (count == 0 || (consecutive && begin == first));
      if (!same) shadowed_sets_.insert(id);
    }
    sets.by_id[id] = std::move(ids);
  } else {
    auto& set = sets.by_id[id];
    set.insert(set.end(), ids.begin(), ids.end());
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::place_particles() {
  if (!mesh_) return;
  ParticleTable<Dim>& p = model_.particles;
  std::vector<Index> suggested;
  const JsonValue& mesh = section("mesh");
  const bool documented = !mesh.find("particle_cells") && !in_.as_cbgeo;
  if (const auto file = in_.open(mesh, documented ? "particles_cells" : "particle_cells")) {
    suggested.assign(p.x.size(), -1);
    const auto take = [&](Index i, Index cell) { suggested[static_cast<std::size_t>(i)] = cell; };
    if (!read_particle_cell_file(*file, known_rows(), n_cells(), team_, in_.problems, take))
      suggested.clear();
  }
  std::vector<Index> strays = find_cells(suggested);
  if (listed_cells_ >= 0) {  // cells around those of the file are not the mesh's
    for (std::size_t i = 0; i < p.cell.size(); ++i)
      if (p.cell[i] >= listed_cells_) strays.push_back(static_cast<Index>(i));
    std::sort(strays.begin(), strays.end());
  }
  report_strays(strays);
}

namespace {

template <int Dim>
struct Stray {
  Index row;
  std::array<double, Dim> x;
};

// The first of some rows of all members, ascending.
template <int Dim>
std::vector<Stray<Dim>> first_strays(const std::vector<Index>& strays,
                                     const std::vector<Vec<Dim>>& x, const RowShares& rows,
                                     const Team& team, std::size_t most) {
  std::vector<Stray<Dim>> own, all;
  for (const Index i : strays) {
    if (own.size() == most) break;
    auto& stray = own.emplace_back(Stray<Dim>{rows.row(i), {}});
    for (std::size_t d = 0; d < Dim; ++d)
      stray.x[d] = x[static_cast<std::size_t>(i)][static_cast<int>(d)];
  }
  for (const auto& part : team.gather(own)) all.insert(all.end(), part.begin(), part.end());
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.row < b.row; });
  all.resize(std::min(all.size(), most));
  return all;
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::report_strays(const std::vector<Index>& strays) {
  constexpr Index shown = 5;
  const Index total = team_.sum(static_cast<Index>(strays.size()));
  if (total == 0) return;
  const auto point = [](const auto& p) { return fmt::format("({})", fmt::join(p, ", ")); };
  const auto [low, high] = mesh_->bounds();
  const std::string extent =
      fmt::format("the mesh extends from {} to {}", point(std::span(low.data(), Dim)),
                  point(std::span(high.data(), Dim)));
  const auto first =
      first_strays<Dim>(strays, model_.particles.x, rows_, team_, static_cast<std::size_t>(shown));
  by_the_first(team_, in_.problems, [&](ProblemList& problems) {
    for (const auto& [row, x] : first) {
      const auto source = std::find_if(sources_.begin(), sources_.end(), [&](const Source& s) {
        return s.first <= row && row < s.last;
      });
      if (source == sources_.end()) continue;
      const int line = source->file.line_of_row(row - source->first + 1);
      problems.error(source->file.at_line(
          line, fmt::format("particle {} at {} lies outside the mesh", row, point(x)), extent));
    }
  });
  if (total > shown) {
    Problem p;
    p.file = sources_.empty() ? "" : sources_.front().file.name;
    p.message = fmt::format("and {} more particles lie outside the mesh", total - shown);
    in_.problems.error(std::move(p));
  }
}

// A file has volumes as they are; others are areas until they are multiplied by their depth.
template <int Dim>
void ScenarioBuilder<Dim>::assign_volumes() {
  ParticleTable<Dim>& p = model_.particles;
  const auto depth = [&](std::size_t i) { return depth_at(model_.analysis, p.x[i][0]); };
  if (const auto file = in_.open(section("mesh"), "particles_volumes"))
    read_volume_file(*file, known_rows(), team_, in_.problems, [&](Index i, double volume) {
      const auto at = static_cast<std::size_t>(i);
      p.volume[at] = volume / depth(at);
    });
  warn_of_missing_volumes();
  if (mesh_) share_volumes<Dim>(*mesh_, team_, p);
  for (std::size_t i = 0; i < p.x.size(); ++i) p.volume[i] *= depth(i);
}

template <int Dim>
void ScenarioBuilder<Dim>::assign_stresses() {
  auto& stress = model_.particles.stress;
  const JsonValue* given = section("mesh").find("particles_stresses");
  if (!given) return;
  const bool from_object = given->is<JsonValue::Object>();
  const std::string type = from_object ? get_text(*given, "type").value_or("") : "";
  if (type == "isotropic") return assign_stress(*given);
  if (type == "k0") return;  // build_k0(), when gravity is known
  if (from_object && !given->find("location"))
    return in_.error(*given, "'location' is missing", "the file of stresses");
  const auto file =
      from_object ? in_.open(*given, "location") : in_.open(section("mesh"), "particles_stresses");
  if (!file) return;
  stress.resize(model_.particles.x.size());
  read_stress_file(*file, known_rows(), team_, in_.problems, [&](Index i, const Voigt& value) {
    stress[static_cast<std::size_t>(i)] = value;
  });
}

// Under `key`: six components, or one number for all directions; nothing = reported.
template <int Dim>
std::optional<Voigt> ScenarioBuilder<Dim>::stress_of(const JsonValue& given, std::string_view key) {
  const auto alone = get_number(given, key);
  const std::vector<double> values = alone ? std::vector{*alone} : get_numbers(given, key);
  Voigt stress{};
  if (values.size() == 1) {
    stress[0] = stress[1] = stress[2] = values[0];
  } else if (values.size() == stress.size()) {
    std::copy(values.begin(), values.end(), stress.begin());
  } else {
    in_.error(given, fmt::format("'{}' must have 1 or 6 numbers, found {}", key, values.size()),
              "xx yy zz xy yz xz, or one number for xx, yy and zz [Pa]");
    return std::nullopt;
  }
  return stress;
}

// The same stress for all particles.
template <int Dim>
void ScenarioBuilder<Dim>::assign_stress(const JsonValue& given) {
  if (const auto stress = stress_of(given, "values"))
    model_.particles.stress.assign(model_.particles.x.size(), *stress);
}

// Those of generators win over those of the mesh, which are not for particles that a stage places.
template <int Dim>
void ScenarioBuilder<Dim>::assign_generator_stresses() {
  auto& stress = model_.particles.stress;
  for (const GeneratorRows& rows : generators_) {
    std::optional<Voigt> own;
    if (written(*rows.generator, "stress"))
      own = stress_of(*rows.generator, "stress");
    else if (rows.first >= placed_row_ && !stress.empty())
      own = Voigt{};
    if (!own) continue;
    stress.resize(model_.particles.x.size());
    for (const Index row : rows_.own_rows(rows.first, rows.end))
      stress[static_cast<std::size_t>(rows_.local(row))] = *own;
  }
}

// The members of the sets of entity_sets.json that this member of the team holds.
template <int Dim>
void ScenarioBuilder<Dim>::collect_particle_sets() {
  EntitySets& sets = sets_.particles;
  const Index n = rows_.total();
  if (!particles_complete_) return;
  std::unordered_map<Index, Index> beyond;  // first particle of a set that does not exist
  all_or_none(team_, [&] {
    visit_particle_sets(sets_, [&](Index set, Index particle) {
      if (generator_sets_.count(set)) return;
      if (particle >= n)
        beyond.emplace(set, particle);
      else if (rows_.holds(particle))
        sets.by_id[set].push_back(particle);
    });
  });
  for (const auto& [id, members] : sets.by_id)
    if (beyond.count(id))
      in_.error(*section("mesh").find("entity_sets"),
                n > 0 ? fmt::format("particle set {} has particle {}, but the ids are 0 to {}", id,
                                    beyond[id], n - 1)
                      : fmt::format("particle set {} has particle {}, but at the start there are "
                                    "no particles",
                                    id, beyond[id]));
}

template <int Dim>
void ScenarioBuilder<Dim>::build_particle_sets() {
  const auto& x = model_.particles.x;
  EntitySets& sets = sets_.particles;
  const JsonValue* regions = section("sets").find("particles");
  if (!regions) return;
  for (const auto& [name, offset, value] : regions->as<JsonValue::Object>()) {
    const Region<Dim> region = region_of(value);
    if (sets.by_name.count(name))
      in_.error(value, fmt::format("the particle set '{}' is made by a generator as well", name));
    auto& ids = sets.by_name[name];
    for (const auto& range : rows_.own_ranges())
      for (Index row = range.first; row < range.end; ++row)
        if (region.contains(x[static_cast<std::size_t>(range.local + row - range.first)]))
          ids.push_back(row);
    if (!team_.any(!ids.empty()) && particles_complete_ && value.valid())
      in_.warning(value, fmt::format("the particle set '{}' is empty", name));
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::assign_material_sets() {
  ParticleTable<Dim>& p = model_.particles;
  for (const JsonValue* entry : get_list(root_, "material_sets")) {
    if (get_integer(*entry, "phase_id").value_or(0) != 0)
      in_.error(*entry->find("phase_id"), "'phase_id': 1 is not supported yet",
                "write the skeleton and its liquid together: \"material\": [skeleton, liquid]");
    const int material = find_material(*entry);
    const auto ids = members(*entry, "pset_id", "pset", sets_.particles);
    if (material < 0 || !ids || !particles_complete_) continue;
    for (const Index i : *ids)
      p.material[static_cast<std::size_t>(rows_.local(i))] = static_cast<std::uint16_t>(material);
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
