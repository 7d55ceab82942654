// What depends on the particles of all members of a team: those of a cell, and those at one place.
#include <tsl/robin_map.h>

#include <algorithm>
#include <bit>

#include "io/scenario/particles_generator.h"

namespace lahar {

namespace {

using CountOfCell = tsl::robin_map<Index, Index>;

// Make the numbers of particles in cells those of all members. Each cell has a member that adds up.
void add_those_of_others(CountOfCell& count, const Team& team) {
  const auto members = static_cast<std::size_t>(team.size());
  std::vector<std::vector<Index>> cells(members), numbers(members);
  for (const auto& [cell, n] : count) {
    if (cell < 0) continue;
    cells[static_cast<std::size_t>(cell) % members].push_back(cell);
    numbers[static_cast<std::size_t>(cell) % members].push_back(n);
  }
  const auto asked = team.exchange(cells);
  numbers = team.exchange(std::move(numbers));
  CountOfCell total;
  for (std::size_t m = 0; m < members; ++m)
    for (std::size_t i = 0; i < asked[m].size(); ++i) total[asked[m][i]] += numbers[m][i];
  for (std::size_t m = 0; m < members; ++m)
    for (std::size_t i = 0; i < asked[m].size(); ++i) numbers[m][i] = total[asked[m][i]];
  numbers = team.exchange(std::move(numbers));
  for (std::size_t m = 0; m < members; ++m)
    for (std::size_t i = 0; i < cells[m].size(); ++i) count[cells[m][i]] = numbers[m][i];
}

}  // namespace

template <int Dim>
void share_volumes(const Mesh<Dim>& mesh, const Team& team, ParticleTable<Dim>& particles) {
  auto& volume = particles.volume;
  if (!team.any(std::find(volume.begin(), volume.end(), 0.0) != volume.end())) return;
  CountOfCell count;
  // Particles of a cell usually follow each other, so it is looked up once.
  const auto& cells = particles.cell;
  for (std::size_t begin = 0, end; begin < cells.size(); begin = end) {
    end = begin + 1;
    while (end < cells.size() && cells[end] == cells[begin]) ++end;
    count[cells[begin]] += static_cast<Index>(end - begin);
  }
  if (!team.alone()) add_those_of_others(count, team);
  const auto for_missing = [&](auto&& begin_cell, auto&& fill) {
    Index last = -1;
    for (std::size_t p = 0; p < cells.size(); ++p) {
      if (volume[p] != 0 || cells[p] < 0) continue;
      if (cells[p] != last) begin_cell(cells[p]);
      last = cells[p];
      fill(volume[p]);
    }
  };
  std::vector<double> asked;  // volumes of the cells of a share, in the order of the particles
  if (mesh.is_share()) {
    std::vector<Index> wanted;
    for_missing([&](Index cell) { wanted.push_back(cell); }, [](double) {});
    asked = ask<double>(
        team, wanted, [&](Index cell) { return team.member(cell, mesh.n_cells()); },
        [&](Index cell) { return mesh.cell_volume(cell); });
  }
  std::size_t next = 0;
  double share = 0;
  for_missing(
      [&](Index cell) {
        const double all = mesh.is_share() ? asked[next++] : mesh.cell_volume(cell);
        share = all / static_cast<double>(count[cell]);
      },
      [&](double& v) { v = share; });
}

namespace {

// By the bits of the coordinates; the upper ones depend on all others.
template <class Point>
std::uint64_t hash(const Point& x, int dim) {
  std::uint64_t h = 0;
  for (int d = 0; d < dim; ++d) {
    h ^= std::bit_cast<std::uint64_t>(x[d] + 0.0);  // + 0.0: -0 and 0 are the same place
    h *= 0x9E3779B97F4A7C15u;
    h ^= h >> 29;
  }
  return h;
}

// The first two that are equal among n points; point(i) is the i-th.
std::pair<Index, Index> first_pair(std::size_t n, int dim, auto&& point) {
  // First point of each place, by hash; -1 = free.
  std::vector<Index> first(std::bit_ceil(n + n / 2 + 2), -1);
  const std::size_t mask = first.size() - 1;
  std::pair<Index, Index> found{-1, -1};
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t slot = hash(point(i), dim) >> std::countl_zero(mask);
    const auto at = [&] { return static_cast<std::size_t>(first[slot]); };
    while (first[slot] >= 0 && point(at()) != point(i)) slot = (slot + 1) & mask;
    if (first[slot] < 0)
      first[slot] = static_cast<Index>(i);
    else if (found.first < 0 || first[slot] < found.first)
      found = {first[slot], static_cast<Index>(i)};
  }
  return found;
}

// A point that another member looks at.
template <int Dim>
struct SentPoint {
  Index row;
  std::array<double, Dim> x;
};

}  // namespace

template <int Dim>
std::pair<Index, Index> find_coincident(const std::vector<Vec<Dim>>& points) {
  return first_pair(points.size(), Dim,
                    [&](std::size_t i) -> const Vec<Dim>& { return points[i]; });
}

template <int Dim>
std::pair<Index, Index> find_coincident(const std::vector<Vec<Dim>>& points,
                                        const RowShares& shares, const Team& team) {
  if (team.alone()) return find_coincident<Dim>(points);
  // Points at one place have one hash, which says who looks at them, and in which round: only so
  // many copies are in memory at a time.
  constexpr std::uint64_t rounds = 8;
  const auto members = static_cast<std::uint64_t>(team.size());
  std::pair<Index, Index> found{-1, -1};
  for (std::uint64_t round = 0; round < rounds; ++round) {
    std::vector<std::vector<SentPoint<Dim>>> to(members);
    for (const auto& range : shares.own_ranges())
      for (Index row = range.first; row < range.end; ++row) {
        const Vec<Dim>& x = points[static_cast<std::size_t>(range.local + row - range.first)];
        const std::uint64_t h = hash(x, Dim);
        if (h / members % rounds != round) continue;
        auto& sent = to[h % members].emplace_back(SentPoint<Dim>{row, {}});
        for (std::size_t d = 0; d < Dim; ++d) sent.x[d] = x[static_cast<int>(d)] + 0.0;
      }
    std::vector<SentPoint<Dim>> all;
    for (const auto& part : team.exchange(std::move(to)))
      all.insert(all.end(), part.begin(), part.end());
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.row < b.row; });
    const auto [a, b] = first_pair(
        all.size(), Dim, [&](std::size_t i) -> const auto& { return all[i].x; });
    if (a < 0) continue;
    const std::pair rows(all[static_cast<std::size_t>(a)].row,
                         all[static_cast<std::size_t>(b)].row);
    if (found.first < 0 || rows < found) found = rows;
  }
  for (const auto& pair : team.gather(std::vector{found.first, found.second}))
    if (pair[0] >= 0 && (found.first < 0 || pair[0] < found.first)) found = {pair[0], pair[1]};
  return found;
}

#define LAHAR_INSTANTIATE(Dim)                                                          \
  template void share_volumes<Dim>(const Mesh<Dim>&, const Team&, ParticleTable<Dim>&); \
  template std::pair<Index, Index> find_coincident<Dim>(const std::vector<Vec<Dim>>&);  \
  template std::pair<Index, Index> find_coincident<Dim>(const std::vector<Vec<Dim>>&,   \
                                                        const RowShares&, const Team&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
