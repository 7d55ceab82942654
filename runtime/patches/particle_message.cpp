#include "runtime/patches/particle_message.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace lahar {

namespace {

template <class T>
void put(std::byte*& to, const T& value) {
  std::memcpy(to, &value, sizeof value);
  to += sizeof value;
}
template <class T>
T get(const std::byte*& from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  from += sizeof value;
  return value;
}

}  // namespace

template <int Dim>
Index leaving_particles(const Patch<Dim>& from, const RemoteNeighbour& neighbour) {
  Index count = 0;
  if (from.filled_outboxes.empty()) return count;
  for (const Local k : neighbour.neighbours)
    count += from.outbox[static_cast<std::size_t>(k)].particles.size();
  return count;
}

template <int Dim>
void write_particles(const Patch<Dim>& from, const RemoteNeighbour& neighbour, std::byte* to) {
  std::vector<double> rows(static_cast<std::size_t>(from.particles.layout().rows()));
  for (const Local k : neighbour.neighbours) {
    const auto& out = from.outbox[static_cast<std::size_t>(k)];
    for (Local i = 0; i < out.particles.size(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      put(to, from.topology.neighbours[static_cast<std::size_t>(k)]);
      put(to, out.cell[at]);
      put(to, out.particles.id[at]);
      put(to, out.particles.loads.empty() ? std::uint64_t{0} : out.particles.loads[at]);
      put(to, static_cast<std::uint64_t>(out.particles.material[at]));
      out.particles.get(i, rows.data());
      std::memcpy(to, rows.data(), rows.size() * sizeof(double));
      to += rows.size() * sizeof(double);
    }
  }
}

template <int Dim>
void read_particles(const std::byte* bytes, Index count, RemotePatch<Dim>& from) {
  std::vector<double> rows;
  from.filled = count > 0;
  for (Index i = 0; i < count; ++i) {
    const auto target = get<Index>(bytes);
    const auto at = std::lower_bound(from.outbox_patch.begin(), from.outbox_patch.end(), target) -
                    from.outbox_patch.begin();
    auto& out = from.outbox[static_cast<std::size_t>(at)];
    out.cell.push_back(get<Index>(bytes));
    const auto id = get<Index>(bytes);
    const auto loads = get<std::uint64_t>(bytes);
    const auto material = static_cast<std::uint16_t>(get<std::uint64_t>(bytes));
    rows.resize(static_cast<std::size_t>(out.particles.layout().rows()));
    std::memcpy(rows.data(), bytes, rows.size() * sizeof(double));
    bytes += rows.size() * sizeof(double);
    out.particles.append(rows.data(), id, material, loads);
    *out.filled = 1;
  }
}

template <int Dim>
void clear(RemotePatch<Dim>& from) {
  if (!std::exchange(from.filled, false)) return;
  for (auto& out : from.outbox) {
    if (out.cell.empty()) continue;
    out.particles.clear();
    out.cell.clear();
    *out.filled = 0;
  }
}

#define LAHAR_INSTANTIATE(Dim)                                                          \
  template Index leaving_particles(const Patch<Dim>&, const RemoteNeighbour&);          \
  template void write_particles(const Patch<Dim>&, const RemoteNeighbour&, std::byte*); \
  template void read_particles(const std::byte*, Index, RemotePatch<Dim>&);             \
  template void clear(RemotePatch<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
