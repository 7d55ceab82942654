#include "io/mesh/shared_mesh.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <numeric>
#include <span>

#include "physics/mesh/partition_common.h"

namespace lahar {

namespace {

// What is on its way at a time, of a member.
constexpr std::size_t entries_at_a_time = std::size_t{1} << 14;

}  // namespace

template <int Dim>
void complete_shares(Mesh<Dim>& share, const Team& team) {
  // One after the other, as one process would: in this order sums are rounded.
  CellSums<Dim> sums;
  for (int member = 0; member < team.size(); ++member) {
    std::vector<CellSums<Dim>> own;
    if (member == team.index()) {
      share.add_to(sums);
      own.push_back(sums);
    }
    sums = team.gather(own)[static_cast<std::size_t>(member)].front();
  }
  share.complete(sums);
}

template <int Dim>
Mesh<Dim> share_of(const Mesh<Dim>& whole, const Team& team) {
  const auto [first, end] = own_cells(whole.n_cells(), team);
  std::vector<Index> cells(static_cast<std::size_t>(end - first));
  std::iota(cells.begin(), cells.end(), first);
  return whole.share(cells);
}

template <int Dim>
double smallest_cell(const Mesh<Dim>& mesh, const Team& team) {
  if (mesh.is_structured()) return mesh.cell_size(0);
  const bool shared = mesh.is_share();
  const auto [first, end] =
      shared ? own_cells(mesh.n_cells(), team) : std::pair(Index{0}, mesh.n_cells());
  double size = std::numeric_limits<double>::infinity();
  for (Index c = first; c < end; ++c) size = std::min(size, mesh.cell_size(c));
  if (shared)
    for (const auto& of_member : team.gather(std::vector{size}))
      size = std::min(size, of_member.front());
  return size;
}

template <int Dim>
std::vector<std::vector<std::byte>> fetch_cells(const Mesh<Dim>& share,
                                                const std::vector<Index>& cells, const Team& team) {
  const Index n = share.n_cells();
  std::vector<std::vector<std::byte>> pieces;
  std::size_t next = 0;
  while (team.any(next < cells.size())) {
    const std::size_t end = std::min(cells.size(), next + entries_at_a_time);
    std::vector<std::vector<Index>> to(static_cast<std::size_t>(team.size()));
    for (; next < end; ++next)
      to[static_cast<std::size_t>(team.member(cells[next], n))].push_back(cells[next]);
    std::vector<std::vector<std::byte>> packed;
    for (const auto& wanted : team.exchange(std::move(to)))
      packed.push_back(wanted.empty() ? std::vector<std::byte>() : share.pack(wanted));
    for (auto& piece : team.exchange_bytes(std::move(packed)))
      if (!piece.empty()) pieces.push_back(std::move(piece));
  }
  return pieces;
}

CellIndex::CellIndex(Index n_cells, const Team& team,
                     const std::function<void(Index cell, const Add& add)>& owners)
    : team_(team) {
  struct Entry {
    std::uint32_t row, cell;
  };
  const auto members = static_cast<Index>(team.size());
  auto [next, end] = own_cells(n_cells, team);
  Index own = 0;
  for (Index cell = next; cell < end; ++cell) owners(cell, [&](Index) { ++own; });
  constexpr double uneven = 1.05;  // what some have more than their share, without a new allocation
  entries_.reserve(static_cast<std::size_t>(uneven * static_cast<double>(team.sum(own)) /
                                            static_cast<double>(members)));
  while (team.any(next < end)) {
    std::vector<std::vector<Entry>> to(static_cast<std::size_t>(members));
    const Index stop = std::min(end, next + static_cast<Index>(entries_at_a_time));
    for (; next < stop; ++next)
      owners(next, [&](Index number) {
        to[static_cast<std::size_t>(number % members)].push_back(
            {static_cast<std::uint32_t>(number / members), static_cast<std::uint32_t>(next)});
      });
    for (const auto& part : team.exchange(std::move(to)))
      for (const Entry& e : part) entries_.push_back(std::uint64_t{e.row} << 32 | e.cell);
  }
  std::sort(entries_.begin(), entries_.end());
}

std::vector<Index> CellIndex::cells_of(const std::vector<Index>& owners) const {
  const auto members = static_cast<std::size_t>(team_.size());
  std::vector<Index> cells;
  std::size_t next = 0, kept = 0;
  while (team_.any(next < owners.size())) {
    const std::size_t end = std::min(owners.size(), next + entries_at_a_time);
    std::vector<std::vector<std::uint32_t>> to(members);
    for (; next < end; ++next) {
      const auto number = static_cast<std::size_t>(owners[next]);
      to[number % members].push_back(static_cast<std::uint32_t>(number / members));
    }
    std::vector<std::vector<Local>> replies(members);
    const auto asked = team_.exchange(std::move(to));
    for (std::size_t m = 0; m < members; ++m) {
      for (const std::uint32_t row : asked[m]) {
        const auto first =
            std::lower_bound(entries_.begin(), entries_.end(), std::uint64_t{row} << 32);
        for (auto at = first; at != entries_.end() && *at >> 32 == row; ++at)
          replies[m].push_back(static_cast<Local>(*at & 0xFFFFFFFFu));
      }
      std::sort(replies[m].begin(), replies[m].end());
      replies[m].erase(std::unique(replies[m].begin(), replies[m].end()), replies[m].end());
    }
    for (const auto& part : team_.exchange(std::move(replies)))
      cells.insert(cells.end(), part.begin(), part.end());
    if (cells.size() > 2 * kept + entries_at_a_time) {
      sort_unique(cells);
      kept = cells.size();
    }
  }
  sort_unique(cells);
  return cells;
}

template <int Dim>
CellIndex index_nodes(const Mesh<Dim>& share, const Team& team) {
  return CellIndex(share.n_cells(), team, [&](Index cell, const CellIndex::Add& add) {
    for (const Index node : share.element_nodes(cell)) add(node);
  });
}

template <int Dim>
CellIndex index_bins(const Mesh<Dim>& share, const Team& team) {
  return CellIndex(share.n_cells(), team, [&](Index cell, const CellIndex::Add& add) {
    for (const Index bin : share.bins_of(cell)) add(bin);
  });
}

namespace {

// Nodes of some cells, ascending, each once.
template <int Dim>
std::vector<Index> nodes_of(const Mesh<Dim>& share, const std::vector<Index>& cells,
                            const Team& team) {
  using Nodes = std::array<Local, static_cast<std::size_t>(most_nodes<Dim>)>;
  std::vector<Index> nodes;
  std::size_t next = 0, kept = 0;
  while (team.any(next < cells.size())) {
    const std::size_t end = std::min(cells.size(), next + entries_at_a_time);
    const std::vector<Index> some(cells.begin() + static_cast<std::ptrdiff_t>(next),
                                  cells.begin() + static_cast<std::ptrdiff_t>(end));
    next = end;
    const auto answers = ask<Nodes>(
        team, some, [&](Index cell) { return team.member(cell, share.n_cells()); },
        [&](Index cell) {
          Nodes of_cell;
          of_cell.fill(-1);
          const auto ids = share.element_nodes(cell);
          std::copy(ids.begin(), ids.end(), of_cell.begin());
          return of_cell;
        });
    for (const Nodes& of_cell : answers)
      for (const Local node : of_cell)
        if (node >= 0) nodes.push_back(node);
    if (nodes.size() > 2 * kept + entries_at_a_time) {
      sort_unique(nodes);
      kept = nodes.size();
    }
  }
  sort_unique(nodes);
  return nodes;
}

}  // namespace

template <int Dim>
std::vector<Index> widened(const Mesh<Dim>& share, const CellIndex& of_nodes,
                           std::vector<Index> cells, int layers, const Team& team) {
  std::vector<Index> last = cells;  // those whose nodes were not yet looked at
  for (int layer = 0; layer < layers; ++layer) {
    const std::vector<Index> around = of_nodes.cells_of(nodes_of<Dim>(share, last, team));
    last.clear();
    std::set_difference(around.begin(), around.end(), cells.begin(), cells.end(),
                        std::back_inserter(last));
    const auto middle = static_cast<std::ptrdiff_t>(cells.size());
    cells.insert(cells.end(), last.begin(), last.end());
    std::inplace_merge(cells.begin(), cells.begin() + middle, cells.end());
  }
  return cells;
}

#define LAHAR_INSTANTIATE(Dim)                                                                     \
  template void complete_shares(Mesh<Dim>&, const Team&);                                          \
  template Mesh<Dim> share_of(const Mesh<Dim>&, const Team&);                                      \
  template double smallest_cell(const Mesh<Dim>&, const Team&);                                    \
  template std::vector<std::vector<std::byte>> fetch_cells(                                        \
      const Mesh<Dim>&, const std::vector<Index>&, const Team&);                                   \
  template CellIndex index_nodes(const Mesh<Dim>&, const Team&);                                   \
  template CellIndex index_bins(const Mesh<Dim>&, const Team&);                                    \
  template std::vector<Index> widened(const Mesh<Dim>&, const CellIndex&, std::vector<Index>, int, \
                                      const Team&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
