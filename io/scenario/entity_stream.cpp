// Entity sets read as a stream: what a mesh of millions of cells has of them does not fit into a
// tree of values.
#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "io/scenario/scenario_input.h"
#include "physics/base/directory_rank.h"

namespace lahar {

namespace {

enum class EntityKind { node, cell, particle };

// Follows the events of the JSON library through a file of entity sets, and gives up where anything
// is not as it should be. Derived classes get the members.
class SetStream {
 public:
  virtual ~SetStream() = default;

  bool start_object(std::size_t) {
    if (level_ != Level::outside && level_ != Level::sets) return false;
    level_ = level_ == Level::outside ? Level::kinds : Level::set;
    id_ = -1;
    has_members_ = false;
    return true;
  }
  bool end_object() {
    if (level_ == Level::kinds) {
      level_ = Level::end;
      return true;
    }
    level_ = Level::sets;
    return id_ >= 0 && has_members_ && end_of_set(kind_, id_);
  }
  bool start_array(std::size_t) {
    if (level_ == Level::kind)
      level_ = Level::sets;
    else if (level_ == Level::set && key_ == "set")
      level_ = Level::members;
    else
      return false;
    return true;
  }
  bool end_array() {
    level_ = level_ == Level::members ? Level::set : Level::kinds;
    return true;
  }
  bool key(std::string& name) {
    if (level_ == Level::kinds) {
      constexpr std::string_view names[] = {"node_sets", "cell_sets", "particle_sets"};
      const auto found = std::find(std::begin(names), std::end(names), name);
      if (found == std::end(names)) return false;
      const auto k = static_cast<std::size_t>(found - std::begin(names));
      kind_ = static_cast<EntityKind>(k);
      level_ = Level::kind;
      return !std::exchange(seen_[k], true);
    }
    key_ = name;
    if (key_ == "id") return id_ < 0;
    return key_ == "set" && !std::exchange(has_members_, true);
  }
  bool number_unsigned(std::uint64_t value) {
    if (value > static_cast<std::uint64_t>(INT64_MAX)) return false;
    const auto number = static_cast<Index>(value);
    if (level_ == Level::members) return member(kind_, number);
    if (level_ != Level::set || key_ != "id") return false;
    id_ = number;
    return true;
  }
  bool null() { return false; }
  bool boolean(bool) { return false; }
  bool number_integer(std::int64_t) { return false; }  // only negative ones
  bool number_float(double, const std::string&) { return false; }
  bool string(std::string&) { return false; }
  bool binary(std::vector<std::uint8_t>&) { return false; }
  bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception&) {
    return false;
  }

  /// Read a file; false if it was given up.
  bool read(const SideFile& file) {
    std::ifstream from_file;
    std::istringstream from_text;
    if (file.regular())
      from_file.open(file.path, std::ios::binary);
    else
      from_text.str(file.text);
    std::istream& in = file.regular() ? static_cast<std::istream&>(from_file) : from_text;
    return nlohmann::json::sax_parse(in, this, nlohmann::json::input_format_t::json, true, true);
  }

 private:
  virtual bool member(EntityKind kind, Index id) = 0;
  virtual bool end_of_set(EntityKind kind, Index id) = 0;

  enum class Level { outside, kinds, kind, sets, set, members, end } level_ = Level::outside;
  bool seen_[3] = {};
  EntityKind kind_ = EntityKind::node;
  std::string key_;
  Index id_ = -1;
  bool has_members_ = false;
};

// Keeps of sets of nodes what this member keeps, and outlines those of cells and particles.
class Outliner : public SetStream {
 public:
  Outliner(Index n_nodes, Index n_cells, const Team& team, EntityFile& out)
      : n_nodes_(n_nodes), n_cells_(n_cells), team_(team), out_(out) {}

  struct CellSet {
    Index id, members;
  };
  std::vector<CellSet> cell_sets;  ///< in the order of the file

 private:
  bool member(EntityKind kind, Index id) override {
    outline_.add(id);
    // Whether one occurs twice is looked at by one member of the team for each.
    if (directory_rank(id, team_.size()) == team_.index()) ids_.push_back(id);
    const Index n = kind == EntityKind::node ? n_nodes_ : kind == EntityKind::cell ? n_cells_ : -1;
    return n < 0 || id < n;
  }

  bool end_of_set(EntityKind kind, Index id) override {
    EntitySets& sets = kind == EntityKind::node   ? out_.nodes
                       : kind == EntityKind::cell ? out_.cells
                                                  : out_.particles;
    if (sets.by_id.count(id)) return false;
    auto& set = sets.by_id[id];
    const SetOutline outline = std::exchange(outline_, {});
    if (kind == EntityKind::particle) {
      out_.particle_sets.push_back(id);
      out_.outlines[id] = outline;
    } else if (kind == EntityKind::cell) {
      cell_sets.push_back({id, outline.count});
    } else {
      set = ids_;
    }
    std::sort(ids_.begin(), ids_.end());
    const bool once = std::adjacent_find(ids_.begin(), ids_.end()) == ids_.end();
    ids_.clear();
    return once;
  }

  Index n_nodes_, n_cells_;
  const Team& team_;
  EntityFile& out_;
  SetOutline outline_;
  std::vector<Index> ids_;
};

// Says what is in the particle sets, whose ids are known by now.
class ParticleSets : public SetStream {
 public:
  ParticleSets(const std::vector<Index>& ids, const std::function<void(Index, Index)>& visit)
      : ids_(ids), visit_(visit) {}

 private:
  bool member(EntityKind kind, Index id) override {
    if (kind == EntityKind::particle && at_ < ids_.size()) visit_(ids_[at_], id);
    return true;
  }
  bool end_of_set(EntityKind kind, Index) override {
    if (kind == EntityKind::particle) ++at_;
    return true;
  }

  const std::vector<Index>& ids_;
  const std::function<void(Index, Index)>& visit_;
  std::size_t at_ = 0;
};

// Keeps this member's part of each set of cells, whose sizes are known by now.
class CellSets : public SetStream {
 public:
  CellSets(const std::vector<Outliner::CellSet>& sets, const Team& team, EntitySets& out)
      : sets_(sets), team_(team), out_(out) {}

 private:
  bool member(EntityKind kind, Index id) override {
    if (kind != EntityKind::cell || at_ >= sets_.size()) return true;
    const auto& [set, members] = sets_[at_];
    const bool own = team_.part(members, team_.index()) <= position_ &&
                     position_ < team_.part(members, team_.index() + 1);
    if (own) out_.by_id[set].push_back(id);
    ++position_;
    return true;
  }
  bool end_of_set(EntityKind kind, Index) override {
    if (kind == EntityKind::cell) ++at_, position_ = 0;
    return true;
  }

  const std::vector<Outliner::CellSet>& sets_;
  const Team& team_;
  EntitySets& out_;
  std::size_t at_ = 0;
  Index position_ = 0;
};

}  // namespace

std::optional<EntityFile> stream_entity_sets(const SideFile& file, Index n_nodes, Index n_cells,
                                             const Team& team) {
  EntityFile out;
  bool good = false;
  all_or_none(team, [&] {
    Outliner outliner(n_nodes, n_cells, team, out);
    good = outliner.read(file);
    if (good && !outliner.cell_sets.empty())
      good = CellSets(outliner.cell_sets, team, out.cells).read(file);
  });
  if (team.any(!good)) return std::nullopt;
  if (!out.particle_sets.empty()) out.file = file;
  return out;
}

void visit_particle_sets(const EntityFile& sets, const std::function<void(Index, Index)>& visit) {
  if (sets.file && !ParticleSets(sets.particle_sets, visit).read(*sets.file))
    throw IoError(sets.file->path + ": the file changed while it was read");
  for (const auto& [id, members] : sets.listed)
    for (const Index i : members) visit(id, i);
}

}  // namespace lahar
