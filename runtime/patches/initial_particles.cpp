#include "runtime/patches/initial_particles.h"

#include <tsl/robin_set.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <string>
#include <utility>

#include "physics/base/error.h"
#include "physics/particles/loads.h"
#include "physics/particles/removal_in_time.h"

namespace lahar {

namespace {

/// Call `visit(cell)` for the different cells of a list. Particles of a cell usually follow each
/// other, and cells ascend where a generator made them; otherwise each cell is remembered.
void for_different(const std::vector<Index>& cells, auto&& visit) {
  tsl::robin_set<Index> seen;
  const bool ascending = std::is_sorted(cells.begin(), cells.end());
  for (std::size_t p = 0; p < cells.size(); ++p)
    if (p == 0 || cells[p] != cells[p - 1])
      if (ascending || seen.insert(cells[p]).second) visit(cells[p]);
}

/// Different cells of all ranks. Each cell is counted by one of them.
Index count_different(const std::vector<Index>& cells, const Communicator& ranks) {
  Index different = 0;
  const auto count = [&](Index) { ++different; };
  if (!ranks.several()) {
    for_different(cells, count);
    return different;
  }
  const auto size = static_cast<std::size_t>(ranks.size());
  std::vector<std::vector<Index>> to(size);
  for_different(cells,
                [&](Index cell) { to[static_cast<std::size_t>(cell) % size].push_back(cell); });
  std::vector<Index> all;
  for (const auto& part : ranks.exchange(to)) all.insert(all.end(), part.begin(), part.end());
  for_different(all, count);
  return ranks.sum(different);
}

}  // namespace

template <int Dim>
ParticleCensus take_census(const Model<Dim>& model, const Communicator& ranks) {
  ParticleCensus census;
  census.particles = ranks.sum(model.particles.size());
  const auto& ids = model.particles.id;
  const Index next = ids.empty() ? model.particles.size() : ids.back() + 1;  // they ascend
  census.next_id = -ranks.min(-next);
  census.occupied_cells = count_different(model.particles.cell, ranks);
  census.stressed = ranks.any(!model.particles.stress.empty());
  std::vector<Index> used(model.materials.size(), 0);
  for (const auto m : model.particles.material) used[m] = 1;
  for (const auto& injection : model.injections) used[injection.material] = 1;
  for (const auto material : model.changes.given) used[material] = 1;
  ranks.sum(used);
  for (const Index n : used) census.used.push_back(n > 0);
  return census;
}

template <int Dim>
std::vector<Index> particles_of_patches(const ParticleTable<Dim>& particles,
                                        const Partition<Dim>& partition,
                                        const Communicator& ranks) {
  std::vector<Index> count(static_cast<std::size_t>(partition.n_patches()), 0);
  Index last_cell = -1, patch = -1;
  for (const Index cell : particles.cell) {
    if (cell != last_cell) patch = partition.patch_of(last_cell = cell);
    ++count[static_cast<std::size_t>(patch)];
  }
  ranks.sum(count);
  return count;
}

template <int Dim>
void set_loads(Model<Dim>& model) {
  const std::size_t entries = first_removal_load(model);
  const std::size_t all = entries + (model.changes.takes_time() ? model.changes.removed.size() : 0);
  if (all > max_particle_loads)
    throw InputError("at most " + std::to_string(max_particle_loads) +
                     " particle tractions, prescribed particle velocities and groups that are "
                     "removed little by little together are supported; found " +
                     std::to_string(all) +
                     ". Merge entries that share direction and value into one particle set.");
  ParticleTable<Dim>& table = model.particles;
  if (entries == 0 || !table.loads.empty()) return;
  table.loads.assign(table.x.size(), 0);
  std::size_t k = 0;
  const auto mark = [&](auto& loads) {
    for (auto& load : loads) {
      // Both lists ascend.
      auto row = table.id.begin();
      for (const Index p : std::exchange(load.particles, {})) {
        if (!table.id.empty()) row = std::lower_bound(row, table.id.end(), p);
        const auto at = table.id.empty() ? p : row - table.id.begin();
        table.loads[static_cast<std::size_t>(at)] |= std::uint64_t{1} << k;
      }
      ++k;
    }
  };
  mark(model.tractions);
  mark(model.particle_velocities);
}

template <int Dim>
void keep_share(ParticleTable<Dim>& particles, const Communicator& ranks) {
  const auto boundary = [&](int rank) {
    return static_cast<std::ptrdiff_t>(particles.size() * rank / ranks.size());
  };
  const std::ptrdiff_t first = boundary(ranks.rank()), last = boundary(ranks.rank() + 1);
  const auto cut = [&](auto& column) {
    if (column.empty()) return;
    column.erase(column.begin() + last, column.end());
    column.erase(column.begin(), column.begin() + first);
    column.shrink_to_fit();
  };
  particles.id.resize(static_cast<std::size_t>(particles.size()));
  std::iota(particles.id.begin(), particles.id.end(), Index{0});
  cut(particles.id);
  particles.each_column(cut);
}

namespace {

/// What travels of a value.
template <class T>
T sendable(const T& value) {
  return value;
}
template <int Dim>
std::array<double, Dim> sendable(const Vec<Dim>& x) {
  std::array<double, Dim> out;
  std::copy_n(x.data(), Dim, out.begin());
  return out;
}
template <class T>
void take_sent(const T& from, T& to) {
  to = from;
}
template <int Dim>
void take_sent(const std::array<double, static_cast<std::size_t>(Dim)>& from, Vec<Dim>& to) {
  to = Vec<Dim>(from.data());
}

template <class T>
T zero_of() {
  if constexpr (requires { T::Zero(); })
    return T::Zero();
  else
    return T{};
}

/// Where each row goes, and where those that come are put.
class Delivery {
 public:
  Delivery(std::size_t rows, const std::function<int(std::size_t)>& owner,
           const Communicator& ranks)
      : ranks_(ranks), to_(rows) {
    for (std::size_t row = 0; row < rows; ++row) to_[row] = owner(row);
  }

  /// The ids go first.
  void send_ids(std::vector<Index>& ids) {
    std::vector<Index> arrived;
    send_rows(ids, [&](Index id) { arrived.push_back(id); });
    std::vector<std::uint32_t> order(arrived.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](auto a, auto b) { return arrived[a] < arrived[b]; });
    place_.resize(order.size());
    ids.resize(order.size());
    for (std::size_t row = 0; row < order.size(); ++row) {
      place_[order[row]] = static_cast<std::uint32_t>(row);
      ids[row] = arrived[order[row]];
    }
    ids.shrink_to_fit();
  }

  /// A column that is empty on all ranks stays so; where it is on some, it means zeros.
  template <class T>
  void send(std::vector<T>& column) {
    if (!ranks_.any(!column.empty())) return;
    const T zero = zero_of<T>();
    column.resize(to_.size(), zero);
    std::vector<T> arrived(place_.size(), zero);
    auto place = place_.begin();
    send_rows(column, [&](const auto& value) { take_sent(value, arrived[*place++]); });
    column = std::move(arrived);
  }

 private:
  /// Calls `arrive(value)` for what comes, in an order that is the same for all columns. The rows
  /// go in a few rounds: only so much of a column is in memory as copies on their way.
  template <class T>
  void send_rows(const std::vector<T>& column, auto&& arrive) const {
    using Sent = decltype(sendable(std::declval<const T&>()));
    constexpr std::size_t rounds = 8;
    for (std::size_t k = 0; k < rounds; ++k) {
      std::vector<std::vector<Sent>> parts(static_cast<std::size_t>(ranks_.size()));
      for (std::size_t row = to_.size() * k / rounds; row < to_.size() * (k + 1) / rounds; ++row)
        parts[static_cast<std::size_t>(to_[row])].push_back(sendable(column[row]));
      for (const auto& part : ranks_.exchange(parts))
        for (const Sent& value : part) arrive(value);
    }
  }

  const Communicator& ranks_;
  std::vector<int> to_;               ///< rank of each row
  std::vector<std::uint32_t> place_;  ///< of each row that comes
};

}  // namespace

template <int Dim>
void send_to_owners(ParticleTable<Dim>& particles, const std::function<int(std::size_t)>& owner,
                    const Communicator& ranks) {
  if (!ranks.several()) return;
  Delivery delivery(particles.x.size(), owner, ranks);
  delivery.send_ids(particles.id);
  particles.each_column([&](auto& column) { delivery.send(column); });
}

#define LAHAR_INSTANTIATE(Dim)                                                                  \
  template ParticleCensus take_census(const Model<Dim>&, const Communicator&);                  \
  template std::vector<Index> particles_of_patches(const ParticleTable<Dim>&,                   \
                                                   const Partition<Dim>&, const Communicator&); \
  template void set_loads(Model<Dim>&);                                                         \
  template void keep_share(ParticleTable<Dim>&, const Communicator&);                           \
  template void send_to_owners(ParticleTable<Dim>&, const std::function<int(std::size_t)>&,     \
                               const Communicator&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
