// Entity sets and their look-up by id or name.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "io/base/text.h"
#include "io/scenario/scenario_input.h"
#include "physics/base/directory_rank.h"

namespace lahar {

std::optional<SideFile> ScenarioInput::open(const JsonValue& object, std::string_view key) {
  const JsonValue* value = object.find(key);
  if (!value || !value->is<std::string>()) return std::nullopt;
  return open_named(*value);
}

std::optional<SideFile> ScenarioInput::open_named(const JsonValue& value, bool whole) {
  const std::string& name = value.as<std::string>();
  std::string reason;
  std::optional<SideFile> file;
  if (name.empty())
    reason = "has no name";
  else
    file = open_side_file(name, (folder / name).string(), reason);
  if (file && whole && static_cast<double>(file->size) > memory.bytes)
    reason =
        fmt::format("has {}; {}", format_bytes(static_cast<double>(file->size)), memory.source);
  const std::vector<Index> sizes = team->each(file ? file->size : 0);
  if (std::adjacent_find(sizes.begin(), sizes.end(), std::not_equal_to<>()) != sizes.end())
    reason = reason.empty() ? "is not the same for all processes" : reason;
  for (const auto& said : team->gather(std::vector<char>(reason.begin(), reason.end()))) {
    if (said.empty()) continue;
    const std::string why(said.begin(), said.end());
    error(value, fmt::format("file '{}' {}", name, why),
          why == "does not exist" ? "file names are relative to the scenario's folder" : "");
    return std::nullopt;
  }
  side_files.push_back(folder / name);
  file->as_cbgeo = as_cbgeo;
  return file;
}

const JsonValue* ScenarioInput::either(const JsonValue& object, std::string_view key,
                                       std::string_view alias) {
  const JsonValue* a = object.find(key);
  const JsonValue* b = object.find(alias);
  if (a && b) error(*b, fmt::format("'{}' and '{}' mean the same; give one of them", key, alias));
  return a ? a : b;
}

std::string list_some(const std::vector<std::string>& names) {
  constexpr std::size_t shown = 12;
  std::vector<std::string> some(names.begin(), names.begin() + std::min(shown, names.size()));
  return join(some) + (names.size() > shown ? fmt::format(", ... ({} in all)", names.size()) : "");
}

const std::vector<Index>* EntitySets::find(const JsonValue& value, ScenarioInput& in) const {
  if (value.is<std::string>()) {
    const std::string& name = value.as<std::string>();
    const auto it = by_name.find(name);
    if (it != by_name.end()) return &it->second;
    std::vector<std::string> names;
    for (const auto& [known, ids] : by_name) names.push_back(known);
    if (all_known)
      in.error(value, fmt::format("there is no {} set named '{}'", kind, name),
               names.empty() ? fmt::format("name sets under sets.{}s", kind)
                             : suggest(name, names, "named sets"));
    return nullptr;
  }
  const auto id_wanted = static_cast<Index>(value.number());
  const auto it = by_id.find(id_wanted);
  if (it != by_id.end()) return &it->second;
  std::vector<Index> ids;
  for (const auto& [id, set] : by_id) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  std::vector<std::string> names;
  for (const Index id : ids) names.push_back(fmt::format("{}", id));
  if (all_known)
    in.error(value, fmt::format("there is no {} set {}", kind, id_wanted),
             names.empty()
                 ? fmt::format("no {} set has an id; sets come from mesh.entity_sets", kind)
                 : fmt::format("{} sets: {}", kind, list_some(names)));
  return nullptr;
}

namespace {

class EntityReader {
 public:
  EntityReader(JsonDocument& document, ProblemList& problems)
      : document_(document), problems_(problems) {}

  void read(EntityFile& file, Index n_nodes, Index n_cells) {
    if (!document_.root.is<JsonValue::Object>())
      return error(document_.root, "entity sets must be an object");
    for (const auto& m : document_.root.as<JsonValue::Object>()) {
      if (m.key == "node_sets")
        read_kind(m.value, file.nodes, n_nodes);
      else if (m.key == "cell_sets")
        read_kind(m.value, file.cells, n_cells);
      else if (m.key == "particle_sets")
        read_kind(m.value, file.particles, -1);
      else
        problems_.error(document_.at_key(
            document_.root, m, fmt::format("unknown key '{}' in the entity sets", m.key),
            suggest(m.key, {"node_sets", "cell_sets", "particle_sets"}, "known keys")));
    }
  }

 private:
  void error(const JsonValue& at, std::string message, std::string hint = "") {
    problems_.error(document_.at(at, std::move(message), std::move(hint)));
  }

  void read_kind(const JsonValue& list, EntitySets& sets, Index n) {
    if (!list.is<JsonValue::Array>())
      return error(list,
                   fmt::format("{} sets must be an array, found {}", sets.kind, describe(list)));
    for (const auto& entry : list.as<JsonValue::Array>()) read_set(entry, sets, n);
  }

  void read_set(const JsonValue& entry, EntitySets& sets, Index n) {
    const JsonValue *id = nullptr, *ids = nullptr;
    if (entry.is<JsonValue::Object>())
      for (const auto& m : entry.as<JsonValue::Object>()) {
        if (m.key == "id")
          id = &m.value;
        else if (m.key == "set")
          ids = &m.value;
        else
          problems_.error(document_.at_key(
              entry, m, fmt::format("unknown key '{}' in a {} set", m.key, sets.kind),
              suggest(m.key, {"id", "set"}, "known keys")));
      }
    if (!id || !id->is<std::int64_t>() || id->as<std::int64_t>() < 0 || !ids ||
        !ids->is<JsonValue::Array>()) {
      sets.all_known = false;
      return error(entry, fmt::format("a {} set must be an object with an integer \"id\" and an "
                                      "array \"set\"",
                                      sets.kind));
    }
    if (sets.by_id.count(id->as<std::int64_t>()))
      return error(*id, fmt::format("{} set {} occurs twice", sets.kind, id->as<std::int64_t>()));
    auto& set = sets.by_id[id->as<std::int64_t>()];
    set.reserve(ids->as<JsonValue::Array>().size());
    for (const auto& item : ids->as<JsonValue::Array>())
      if (member(item, sets, n)) set.push_back(item.as<std::int64_t>());
    drop_repeated(*ids, set, sets);
  }

  // A member's id: in range (n < 0: unknown). A few bad ones are enough to say so.
  bool member(const JsonValue& item, const EntitySets& sets, Index n) {
    constexpr int cap = 10;
    const bool whole = item.is<std::int64_t>();
    if (whole && item.as<std::int64_t>() >= 0 && (n < 0 || item.as<std::int64_t>() < n))
      return true;
    if (++bad_ <= cap)
      error(item, whole && item.as<std::int64_t>() >= 0
                      ? fmt::format("there is no {} {}; the ids are 0 to {}", sets.kind,
                                    to_json(item), n - 1)
                      : fmt::format("a {} id must be a non-negative integer, found {}", sets.kind,
                                    describe(item)));
    return false;
  }

  void drop_repeated(const JsonValue& at, std::vector<Index>& set, const EntitySets& sets) {
    auto sorted = set;
    std::sort(sorted.begin(), sorted.end());
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
    if (twice == sorted.end()) return;
    problems_.warning(document_.at(
        at,
        fmt::format("{} {} occurs more than once in this set; it counts once", sets.kind, *twice)));
    std::unordered_map<Index, bool> seen;
    std::erase_if(set, [&](Index i) { return !seen.emplace(i, true).second; });
  }

  JsonDocument& document_;
  ProblemList& problems_;
  int bad_ = 0;
};

}  // namespace

void SetOutline::add(Index id) {
  if (count++ == 0) first = id;
  consecutive = consecutive && id == first + count - 1;
}

EntityFile read_entity_sets(const JsonValue& mesh, Index n_nodes, Index n_cells,
                            ScenarioInput& in) {
  EntityFile out;
  if (!mesh.find("entity_sets")) return out;
  auto file = in.open(mesh, "entity_sets");
  if (file)
    if (auto sets = stream_entity_sets(*file, n_nodes, n_cells, *in.team)) return std::move(*sets);
  const std::size_t before = in.problems.count();
  if (file) {
    JsonDocument document(file->name, file->all(), in.problems);
    if (document.root.valid())
      EntityReader(document, in.problems).read(out, n_nodes, n_cells);
    else
      file.reset();
  }
  if (!file || in.problems.count() != before)
    out.nodes.all_known = out.cells.all_known = out.particles.all_known = false;
  const Team& team = *in.team;
  for (auto& [id, set] : out.nodes.by_id)
    std::erase_if(set, [&](Index i) { return directory_rank(i, team.size()) != team.index(); });
  for (auto& [id, set] : out.cells.by_id) {
    const auto n = static_cast<Index>(set.size());
    set = {set.begin() + team.part(n, team.index()), set.begin() + team.part(n, team.index() + 1)};
  }
  for (auto& [id, set] : out.particles.by_id) {
    for (const Index i : set) out.outlines[id].add(i);
    out.listed[id] = std::exchange(set, {});
  }
  return out;
}

}  // namespace lahar
