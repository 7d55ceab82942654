// Particles: generators, placement, volumes, initial stresses, sets and materials.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "io/scenario_builder.h"

namespace lahar {

template <int Dim>
void ScenarioBuilder<Dim>::build_particles() {
  const auto entries = get_list(root_, "particles");
  const JsonValue* list = root_.find("particles");
  if (list && list->is<JsonValue::Array>() && list->as<JsonValue::Array>().empty())
    in_.error(*list, "there are no particles", "add a generator");
  if (!list) particles_complete_ = false;
  bool check_duplicates = false;
  for (const JsonValue* entry : entries) {
    const JsonValue* generator = entry->find("generator");
    if (!generator) {
      particles_complete_ = false;
      continue;
    }
    generate(*generator);
    // Particles of one region lie in parts of their own of the cells of a grid.
    const bool different = entries.size() == 1 && get_text(*generator, "type") == "region" &&
                           mesh_ && mesh_->is_structured();
    check_duplicates |= !different && get_bool(*generator, "check_duplicates").value_or(true);
  }
  if (!particles_complete_) sets_.particles.all_known = false;
  if (check_duplicates) {
    const auto [a, b] = find_coincident<Dim>(model_.particles.x);
    if (a >= 0) in_.warning(*list, fmt::format("particles {} and {} are at the same place", a, b));
  }
  place_particles();
  assign_volumes();
  assign_stresses();
  build_particle_sets();
  assign_material_sets();
}

template <int Dim>
void ScenarioBuilder<Dim>::generate(const JsonValue& generator) {
  const std::string type = get_text(generator, "type").value_or("");
  const int material = find_material(generator);
  NewParticles<Dim> fresh;
  if (type == "file")
    fresh = read_particles(generator);
  else if (type == "gauss" || type == "inject")
    fresh = fill_gauss(generator);
  else if (type == "region" && mesh_) {
    const JsonValue* shape = generator.find("region");
    const Region<Dim> region =
        shape ? Region<Dim>(*shape, region_tolerance_, in_.document, in_.problems) : Region<Dim>();
    const auto n = get_integer(generator, "per_cell");
    if (n) fresh = fill_region<Dim>(*mesh_, region, static_cast<int>(*n));
    if (n && fresh.x.empty() && in_.problems.empty())
      in_.error(generator, "the region contains no particle",
                "does it lie inside the mesh? per_cell may be too small for it");
  }
  if (fresh.x.empty()) particles_complete_ = false;
  ParticleTable<Dim>& p = model_.particles;
  const Index first = p.size();
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
  if (velocity || !p.velocity.empty()) {
    p.velocity.resize(static_cast<std::size_t>(first), Vec<Dim>::Zero());
    p.velocity.resize(p.x.size(), velocity.value_or(Vec<Dim>::Zero()));
  }
  name_particle_set(generator, first, p.size());
}

template <int Dim>
NewParticles<Dim> ScenarioBuilder<Dim>::read_particles(const JsonValue& generator) {
  auto file = in_.open(generator, "location");
  if (!file) return {};
  auto points = read_particle_file<Dim>(*file, in_.problems);
  if (!points) return {};
  NewParticles<Dim> fresh;
  fresh.x = std::move(*points);
  fresh.cell.assign(fresh.x.size(), -1);
  fresh.volume.assign(fresh.x.size(), 0.0);
  const Index first = model_.particles.size();
  sources_.push_back({std::move(*file), first, first + static_cast<Index>(fresh.x.size())});
  return fresh;
}

template <int Dim>
NewParticles<Dim> ScenarioBuilder<Dim>::fill_gauss(const JsonValue& generator) {
  const JsonValue* set = in_.either(generator, "cset_id", "cset");
  const auto n = get_integer(generator, "nparticles_per_dir");
  if (Dim == 3 && n == 4) {
    in_.error(*generator.find("nparticles_per_dir"),
              "'nparticles_per_dir' must be at most 3 in three dimensions, found 4");
    return {};
  }
  std::vector<Index> all;
  const std::vector<Index>* cells = &all;
  if (set && !(set->is_number() && set->number() == -1)) {
    cells = sets_.cells.find(*set, in_);
  } else if (mesh_) {
    all.resize(static_cast<std::size_t>(n_cells()));
    std::iota(all.begin(), all.end(), Index{0});
  }
  if (!mesh_ || !cells || !n || get_text(generator, "type") == "inject") return {};
  return fill_cells<Dim>(*mesh_, *cells, static_cast<int>(*n));
}

template <int Dim>
void ScenarioBuilder<Dim>::name_particle_set(const JsonValue& generator, Index first, Index last) {
  const JsonValue* name = in_.either(generator, "pset_id", "pset");
  if (!name) return;
  EntitySets& sets = sets_.particles;
  std::vector<Index> ids(static_cast<std::size_t>(last - first));
  std::iota(ids.begin(), ids.end(), first);
  if (name->is<std::string>()) {
    // Several generators may feed one set.
    auto& set = sets.by_name[name->as<std::string>()];
    set.insert(set.end(), ids.begin(), ids.end());
    return;
  }
  const auto id = static_cast<Index>(name->number());
  if (generator_sets_.insert(id).second) {
    // As in the reference, the generator's set comes first and keeps the id.
    if (sets.by_id.count(id) && sets.by_id[id] != ids) shadowed_sets_.insert(id);
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
  const Index n = particles_complete_ ? p.size() : -1;
  if (const auto file = in_.open(section("mesh"), "particle_cells")) {
    const auto rows = read_particle_cell_file(*file, n, n_cells(), in_.problems);
    if (rows && n >= 0) {
      suggested.assign(p.x.size(), -1);
      for (const auto& [particle, cell] : *rows)
        suggested[static_cast<std::size_t>(particle)] = cell;
    }
  }
  report_strays(place<Dim>(*mesh_, suggested, p));
}

template <int Dim>
void ScenarioBuilder<Dim>::report_strays(const std::vector<Index>& strays) {
  constexpr std::size_t shown = 5;
  const auto& x = model_.particles.x;
  const auto [low, high] = strays.empty() ? std::pair<Vec<Dim>, Vec<Dim>>() : mesh_->bounds();
  const auto point = [](const Vec<Dim>& p) {
    return fmt::format("({})", fmt::join(p.data(), p.data() + Dim, ", "));
  };
  for (std::size_t i = 0; i < std::min(shown, strays.size()); ++i) {
    const Index id = strays[i];
    const auto source = std::find_if(sources_.begin(), sources_.end(),
                                     [&](const Source& s) { return s.first <= id && id < s.last; });
    if (source == sources_.end()) continue;
    const std::string message = fmt::format("particle {} at {} lies outside the mesh", id,
                                            point(x[static_cast<std::size_t>(id)]));
    in_.problems.error(source->file.at_line(
        source->file.line_of_row(id - source->first + 1), message,
        fmt::format("the mesh extends from {} to {}", point(low), point(high))));
  }
  if (strays.size() > shown) {
    Problem p;
    p.file = sources_.empty() ? "" : sources_.front().file.name;
    p.message = fmt::format("and {} more particles lie outside the mesh", strays.size() - shown);
    in_.problems.error(std::move(p));
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::assign_volumes() {
  ParticleTable<Dim>& p = model_.particles;
  const Index n = particles_complete_ ? p.size() : -1;
  if (const auto file = in_.open(section("mesh"), "particles_volumes")) {
    const auto rows = read_volume_file(*file, n, in_.problems);
    if (rows && n >= 0)
      for (const auto& [particle, volume] : *rows)
        p.volume[static_cast<std::size_t>(particle)] = volume;
  }
  if (mesh_) share_volumes<Dim>(*mesh_, p);
}

template <int Dim>
void ScenarioBuilder<Dim>::assign_stresses() {
  const Index n = particles_complete_ ? model_.particles.size() : -1;
  if (const auto file = in_.open(section("mesh"), "particles_stresses"))
    if (auto stresses = read_stress_file(*file, n, in_.problems))
      model_.particles.stress = std::move(*stresses);
}

template <int Dim>
void ScenarioBuilder<Dim>::build_particle_sets() {
  const auto& x = model_.particles.x;
  const auto n = static_cast<Index>(x.size());
  EntitySets& sets = sets_.particles;
  // Ids of entity_sets.json could not be checked before the particles were there.
  for (const auto& [id, members] : sets.by_id)
    for (const Index i : members)
      if (i >= n && particles_complete_) {
        in_.error(
            *section("mesh").find("entity_sets"),
            fmt::format("particle set {} has particle {}, but the ids are 0 to {}", id, i, n - 1));
        break;
      }
  const JsonValue* regions = section("sets").find("particles");
  if (!regions) return;
  for (const auto& [name, offset, value] : regions->as<JsonValue::Object>()) {
    const Region<Dim> region(value, region_tolerance_, in_.document, in_.problems);
    if (sets.by_name.count(name))
      in_.error(value, fmt::format("the particle set '{}' is made by a generator as well", name));
    auto& ids = sets.by_name[name];
    for (Index i = 0; i < n; ++i)
      if (region.contains(x[static_cast<std::size_t>(i)])) ids.push_back(i);
    if (ids.empty() && particles_complete_ && value.valid())
      in_.warning(value, fmt::format("the particle set '{}' is empty", name));
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::assign_material_sets() {
  ParticleTable<Dim>& p = model_.particles;
  for (const JsonValue* entry : get_list(root_, "material_sets")) {
    if (get_integer(*entry, "phase_id").value_or(0) != 0)
      in_.error(*entry->find("phase_id"), "'phase_id': 1 is not supported yet");
    const int material = find_material(*entry);
    const auto ids = members(*entry, "pset_id", "pset", sets_.particles, p.size());
    if (material < 0 || !ids) continue;
    for (const Index i : *ids)
      if (i < p.size())
        p.material[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(material);
  }
}

#define LAHAR_INSTANTIATE(Dim)                                                           \
  template void ScenarioBuilder<Dim>::build_particles();                                 \
  template void ScenarioBuilder<Dim>::generate(const JsonValue&);                        \
  template NewParticles<Dim> ScenarioBuilder<Dim>::read_particles(const JsonValue&);     \
  template NewParticles<Dim> ScenarioBuilder<Dim>::fill_gauss(const JsonValue&);         \
  template void ScenarioBuilder<Dim>::name_particle_set(const JsonValue&, Index, Index); \
  template void ScenarioBuilder<Dim>::place_particles();                                 \
  template void ScenarioBuilder<Dim>::report_strays(const std::vector<Index>&);          \
  template void ScenarioBuilder<Dim>::assign_volumes();                                  \
  template void ScenarioBuilder<Dim>::assign_stresses();                                 \
  template void ScenarioBuilder<Dim>::build_particle_sets();                             \
  template void ScenarioBuilder<Dim>::assign_material_sets();
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
