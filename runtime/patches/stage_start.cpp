#include "runtime/patches/stage_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "physics/materials/law.h"
#include "physics/mesh/inverse_mapping.h"
#include "runtime/patches/patch_state_layout.h"

namespace lahar {

namespace {

/// Rows of a particle that column_text() describes: the first of each column, and their number.
struct StoredRows {
  std::array<int, n_columns> first, components;
  int all = 0;

  explicit StoredRows(const std::string& columns) {
    first.fill(-1);
    components.fill(0);
    for (std::size_t at = 0; at < columns.size();) {
      const std::size_t space = columns.find(' ', at), end = columns.find(", ", at);
      const std::string name = columns.substr(at, space - at);
      const int n = space < columns.size() ? std::atoi(columns.c_str() + space) : 0;
      for (const ColumnInfo& info : column_table) {
        if (info.name != name) continue;
        first[static_cast<std::size_t>(info.column)] = all;
        components[static_cast<std::size_t>(info.column)] = n;
      }
      all += n;
      at = end == columns.npos ? columns.size() : end + 2;
    }
  }
  /// -1 = there is none.
  int row(Column column, int k) const {
    const auto i = static_cast<std::size_t>(column);
    return first[i] >= 0 && k < components[i] ? first[i] + k : -1;
  }
};

/// What a column that was not there begins with: another one, or zero.
int stand_in(const StoredRows& stored, Column column, int k) {
  if (column == Column::next_domain) return stored.row(Column::domain, k);
  if (column == Column::next_corners) return stored.row(Column::corners, k);
  if (column == Column::size) return stored.row(Column::volume, 0);
  return -1;
}

template <int Dim>
void fill_row(const std::byte* rows, const StoredRows& stored, Column column, int k,
              std::vector<double>& values) {
  int from = stored.row(column, k);
  const bool found = from >= 0;
  if (!found) from = stand_in(stored, column, k);
  const std::size_t bytes = values.size() * sizeof(double);
  if (from < 0)
    std::fill(values.begin(), values.end(), 0.0);
  else if (bytes > 0)
    std::memcpy(values.data(), rows + static_cast<std::size_t>(from) * bytes, bytes);
  if (column == Column::size && !found)
    for (double& value : values) value = std::pow(value, 1.0 / Dim);
}

}  // namespace

bool has_column(const std::string& columns, Column column) {
  return StoredRows(columns).row(column, 0) >= 0;
}

template <int Dim>
std::vector<std::byte> state_for(StateUse use, std::vector<std::byte> state,
                                 const std::string& columns, const ColumnLayout<Dim>& layout) {
  if (use == StateUse::go_on || state.size() < sizeof(StateHead)) return state;
  const StateHead head = StateReader(state.data()).get<StateHead>();
  if (head.marker != state_marker || state.size() != bytes_of(head)) return state;
  StateWriter(state.data() + sizeof(StateHead)).put(PatchWork{});
  const StoredRows stored(columns);
  if (use == StateUse::alike || stored.all != head.rows) return state;

  StateHead other = head;
  other.rows = layout.rows();
  other.loads = other.active_nodes = other.impulses = 0;
  std::vector<std::byte> converted(bytes_of(other));
  StateWriter out(converted.data());
  StateReader in(state.data() + ids_offset(head) - n_bytes(head.bins, sizeof(PackedBin)));
  out.put(other);
  out.put(PatchWork{});
  for (Index r = 0; r < head.bins; ++r) {
    auto bin = in.get<PackedBin>();
    bin.loaded = 0;
    out.put(bin);
  }
  const auto n = static_cast<std::size_t>(head.particles);
  out.put(state.data() + ids_offset(head), n * sizeof(Index));
  const std::byte* const rows = state.data() + ids_offset(head) + n * sizeof(Index) +
                                (head.loads != 0 ? n * sizeof(std::uint64_t) : 0);
  std::vector<double> values(n);
  for (const ColumnInfo& info : column_table)
    for (int k = 0; layout.has(info.column) && k < layout.components(info); ++k) {
      fill_row<Dim>(rows, stored, info.column, k, values);
      out.put(values.data(), n);
    }
  return converted;
}

template <int Dim>
std::vector<ParticleLoads> loads_in(const ParticleTable<Dim>& particles) {
  std::vector<ParticleLoads> some;
  for (std::size_t row = 0; row < particles.loads.size(); ++row)
    if (particles.loads[row] != 0) {
      some.push_back({particles.id_of(row), particles.loads[row], {}});
      if (!particles.edges.empty())
        std::copy_n(particles.edges[row].begin(), Dim, some.back().edges.begin());
    }
  return some;
}

template <int Dim>
ParticleMarks marks_of(std::span<const std::unique_ptr<Patch<Dim>>> patches,
                       const std::vector<ParticleLoads>& marks, const Communicator& ranks) {
  const auto size = static_cast<std::size_t>(ranks.size());
  ParticleMarks own;
  if (!ranks.any(!marks.empty())) return own;
  // The rank with number id % size keeps the marks of a particle. The rank that has the particle
  // asks it.
  std::vector<std::vector<ParticleLoads>> told(size);
  for (const ParticleLoads& one : marks)
    told[static_cast<std::size_t>(one.id) % size].push_back(one);
  ParticleMarks known;
  for (const auto& part : ranks.exchange(told))
    for (const ParticleLoads& one : part) {
      const auto [at, is_new] = known.try_emplace(one.id, one);
      if (!is_new) at.value().loads |= one.loads;
    }
  std::vector<std::vector<Index>> asked(size);
  for (const auto& patch : patches)
    for (const ParticleBin& bin : patch->bins)
      for (auto p = static_cast<std::size_t>(bin.begin); p < static_cast<std::size_t>(bin.end); ++p)
        asked[static_cast<std::size_t>(patch->particles.id[p]) % size].push_back(
            patch->particles.id[p]);
  std::vector<std::vector<ParticleLoads>> answers;
  for (const auto& part : ranks.exchange(asked)) {
    auto& answer = answers.emplace_back();
    for (const Index id : part)
      if (const auto at = known.find(id); at != known.end()) answer.push_back(at->second);
  }
  for (const auto& part : ranks.exchange(answers))
    for (const ParticleLoads& one : part) own[one.id] = one;
  return own;
}

template <int Dim>
void give_loads(std::span<const std::unique_ptr<Patch<Dim>>> patches,
                const std::vector<ParticleLoads>& loads, const Communicator& ranks) {
  const ParticleMarks own = marks_of(patches, loads, ranks);
  if (own.empty()) return;
  for (const auto& patch : patches)
    for (ParticleBin& bin : patch->bins)
      for (auto p = static_cast<std::size_t>(bin.begin); p < static_cast<std::size_t>(bin.end);
           ++p) {
        const auto at = own.find(patch->particles.id[p]);
        if (at == own.end()) continue;
        auto& of_patch = patch->particles.loads;
        if (of_patch.empty()) of_patch.assign(patch->particles.id.size(), 0);
        of_patch[p] = at->second.loads;
        bin.loaded = true;
        for (int d = 0; d < Dim; ++d)
          if (const double edge = at->second.edges[static_cast<std::size_t>(d)]; edge > 0)
            patch->particles.row(Column::size, d)[p] = edge;
      }
}

template <int Dim>
void follow_parameters(Patch<Dim>& patch, std::span<const Material> materials) {
  Particles<Dim>& particles = patch.particles;
  if (!particles.layout().has(Column::state)) return;
  std::vector<double> state(static_cast<std::size_t>(particles.layout().components(Column::state)));
  patch.for_each_particle([&](Local p) {
    for (std::size_t k = 0; k < state.size(); ++k)
      state[k] = particles.row(Column::state, static_cast<int>(k))[p];
    follow_parameters(materials[particles.material[static_cast<std::size_t>(p)]].law, state.data());
    for (std::size_t k = 0; k < state.size(); ++k)
      particles.row(Column::state, static_cast<int>(k))[p] = state[k];
  });
}

template <int Dim>
void find_natural_coordinates(Patch<Dim>& patch) {
  const auto x = patch.particles.template rows<Dim>(Column::x);
  const auto xi = patch.particles.template rows<Dim>(Column::xi);
  for (const ParticleBin& bin : patch.bins) {
    const auto& box = patch.box[static_cast<std::size_t>(bin.cell)];
    for (Local p = bin.begin; p < bin.end; ++p) {
      Vec<Dim> natural;
      for (std::size_t d = 0; d < Dim; ++d)
        natural[static_cast<Eigen::Index>(d)] = (x[d][p] - box[d]) * box[Dim + d];
      natural = clamp_to_cell<Dim>(natural);
      for (std::size_t d = 0; d < Dim; ++d) xi[d][p] = natural[static_cast<Eigen::Index>(d)];
    }
  }
}

#define LAHAR_INSTANTIATE(Dim)                                                                    \
  template std::vector<std::byte> state_for(StateUse, std::vector<std::byte>, const std::string&, \
                                            const ColumnLayout<Dim>&);                            \
  template std::vector<ParticleLoads> loads_in(const ParticleTable<Dim>&);                        \
  template ParticleMarks marks_of(std::span<const std::unique_ptr<Patch<Dim>>>,                   \
                                  const std::vector<ParticleLoads>&, const Communicator&);        \
  template void give_loads(std::span<const std::unique_ptr<Patch<Dim>>>,                          \
                           const std::vector<ParticleLoads>&, const Communicator&);               \
  template void follow_parameters(Patch<Dim>&, std::span<const Material>);                        \
  template void find_natural_coordinates(Patch<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
