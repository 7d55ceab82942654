#include "runtime/patches/directory_lists.h"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>

#include "physics/base/directory_rank.h"
#include "runtime/patches/patch_constraints.h"

namespace lahar {

namespace {

/// What is asked for at a time.
constexpr std::size_t at_a_time = std::size_t{1} << 15;

/// Call visit(list) for each list.
template <class Conditions>
void for_each_list(Conditions& of, auto&& visit) {
  visit(of.node_velocities);
  visit(of.node_frictions);
  visit(of.node_frames);
  visit(of.node_forces);
  visit(of.node_absorptions);
  visit(of.node_accelerations);
  visit(of.liquid_velocities);
  visit(of.pore_pressures);
}

/// Let each rank that keeps some of the ids (ascending) answer for them: calls `answer(asked)`,
/// which is collective, with what each rank asked of this one, some at a time. Collective.
void ask_directory_ranks(
    const std::vector<Index>& ids, const Communicator& ranks,
    const std::function<void(const std::vector<std::vector<Index>>&)>& answer) {
  std::size_t next = 0;
  while (ranks.any(next < ids.size())) {
    std::vector<std::vector<Index>> to(static_cast<std::size_t>(ranks.size()));
    const std::size_t end = std::min(ids.size(), next + at_a_time);
    for (; next < end; ++next)
      to[static_cast<std::size_t>(directory_rank(ids[next], ranks.size()))].push_back(ids[next]);
    answer(ranks.exchange(to));
  }
}

/// What travels of an entry.
template <class Entry>
Entry plain(const Entry& entry) {
  return entry;
}
template <int Dim>
struct SentFrame {
  Index node;
  std::array<double, static_cast<std::size_t>(Dim* Dim)> axes;
};
template <int Dim>
SentFrame<Dim> plain(const NodeFrame<Dim>& frame) {
  SentFrame<Dim> sent{frame.node, {}};
  std::copy_n(frame.axes.data(), Dim * Dim, sent.axes.begin());
  return sent;
}
template <class Entry>
void restore(const Entry& sent, Entry& entry) {
  entry = sent;
}
template <int Dim>
void restore(const SentFrame<Dim>& sent, NodeFrame<Dim>& frame) {
  frame.node = sent.node;
  std::copy(sent.axes.begin(), sent.axes.end(), frame.axes.data());
}

/// The entries of one list for the nodes that each rank asked for. Collective.
template <class Entry>
void send_entries(const std::vector<std::vector<Index>>& asked, const std::vector<Entry>& kept,
                  std::vector<Entry>& found, const Communicator& ranks) {
  using Sent = decltype(plain(std::declval<const Entry&>()));
  std::vector<std::vector<Sent>> replies(asked.size());
  for (std::size_t r = 0; r < asked.size(); ++r)
    for (const Index node : asked[r])
      for (const Entry& entry : entries_of(kept, node)) replies[r].push_back(plain(entry));
  for (const auto& part : ranks.exchange(replies))
    for (const Sent& sent : part) restore(sent, found.emplace_back());
}

}  // namespace

template <int Dim>
void keep_directory_lists(Model<Dim>& model, const Communicator& ranks) {
  const auto elsewhere = [&](Index id) { return directory_rank(id, ranks.size()) != ranks.rank(); };
  if (ranks.several()) {
    for_each_list(model, [&](auto& list) {
      if (std::erase_if(list, [&](const auto& entry) { return elsewhere(entry.node); }) > 0)
        list.shrink_to_fit();
    });
    for (Injection<Dim>& injection : model.injections) {
      injection.all_cells = injection.n_cells();
      if (std::none_of(injection.cells.begin(), injection.cells.end(), elsewhere)) continue;
      Injection<Dim> kept = injection;
      kept.cells = kept.position = {};
      kept.x = {};
      kept.volume = {};
      const auto points = static_cast<std::ptrdiff_t>(injection.per_cell);
      for (std::size_t i = 0; i < injection.cells.size(); ++i) {
        if (elsewhere(injection.cells[i])) continue;
        kept.cells.push_back(injection.cells[i]);
        kept.position.push_back(injection.position_of(i));
        kept.volume.push_back(injection.volume[i]);
        const auto first = injection.x.begin() + static_cast<std::ptrdiff_t>(i) * points;
        kept.x.insert(kept.x.end(), first, first + points);
      }
      injection = std::move(kept);
    }
  }
  sort_constraints(model);
}

template <int Dim>
NodeConditions<Dim> conditions_at(const std::vector<Index>& nodes, const NodeConditions<Dim>& kept,
                                  const Communicator& ranks) {
  std::vector<Index> present{static_cast<Index>(nodes.size())};
  for_each_list(kept,
                [&](const auto& list) { present.push_back(static_cast<Index>(list.size())); });
  ranks.sum(present);
  NodeConditions<Dim> found;
  if (present[0] == 0 || std::all_of(present.begin() + 1, present.end(), std::logical_not<>()))
    return found;
  ask_directory_ranks(nodes, ranks, [&](const std::vector<std::vector<Index>>& asked) {
    auto n = present.begin();
    const auto send = [&](const auto& from, auto& to) {
      if (*++n > 0) send_entries(asked, from, to, ranks);
    };
    send(kept.node_velocities, found.node_velocities);
    send(kept.node_frictions, found.node_frictions);
    send(kept.node_frames, found.node_frames);
    send(kept.node_forces, found.node_forces);
    send(kept.node_absorptions, found.node_absorptions);
    send(kept.node_accelerations, found.node_accelerations);
    send(kept.liquid_velocities, found.liquid_velocities);
    send(kept.pore_pressures, found.pore_pressures);
  });
  sort_constraints(found);
  return found;
}

namespace {

template <int Dim>
void sort_by_cell(InjectedCells<Dim>& injected) {
  std::sort(injected.cells.begin(), injected.cells.end(), [](const auto& a, const auto& b) {
    return std::pair(a.cell, a.event) < std::pair(b.cell, b.event);
  });
}

}  // namespace

template <int Dim>
InjectedCells<Dim> kept_injections(const std::vector<Injection<Dim>>& injections) {
  InjectedCells<Dim> kept;
  Index first_event = 0;
  for (std::size_t g = 0; g < injections.size(); ++g) {
    const Injection<Dim>& injection = injections[g];
    for (std::size_t i = 0; i < injection.cells.size(); ++i)
      kept.cells.push_back({injection.cells[i], g, first_event + injection.position_of(i),
                            injection.volume[i],
                            kept.x.size() + i * static_cast<std::size_t>(injection.per_cell)});
    kept.x.insert(kept.x.end(), injection.x.begin(), injection.x.end());
    first_event += injection.n_cells();
  }
  sort_by_cell(kept);
  return kept;
}

template <int Dim>
InjectedCells<Dim> injections_at(const std::vector<Index>& cells, const InjectedCells<Dim>& kept,
                                 const std::vector<Injection<Dim>>& injections,
                                 const Communicator& ranks) {
  using Entry = typename InjectedCells<Dim>::Entry;
  using Point = std::array<double, static_cast<std::size_t>(Dim)>;
  InjectedCells<Dim> found;
  if (injections.empty()) return found;
  const auto points_of = [&](const Entry& entry) {
    return static_cast<std::size_t>(injections[entry.generator].per_cell);
  };
  ask_directory_ranks(cells, ranks, [&](const std::vector<std::vector<Index>>& asked) {
    std::vector<std::vector<Entry>> entries(asked.size());
    std::vector<std::vector<Point>> points(asked.size());
    for (std::size_t r = 0; r < asked.size(); ++r)
      for (const Index cell : asked[r]) {
        auto at = std::lower_bound(kept.cells.begin(), kept.cells.end(), cell,
                                   [](const Entry& entry, Index c) { return entry.cell < c; });
        for (; at != kept.cells.end() && at->cell == cell; ++at) {
          entries[r].push_back(*at);
          for (std::size_t k = 0; k < points_of(*at); ++k)
            std::copy_n(kept.x[at->first_point + k].data(), Dim, points[r].emplace_back().begin());
        }
      }
    for (const auto& part : ranks.exchange(entries))
      for (const Entry& entry : part) found.cells.push_back(entry);
    for (const auto& part : ranks.exchange(points))
      for (const Point& x : part) found.x.emplace_back(x.data());
  });
  std::size_t first = 0;
  for (Entry& entry : found.cells)
    entry.first_point = std::exchange(first, first + points_of(entry));
  sort_by_cell(found);
  return found;
}

#define LAHAR_INSTANTIATE(Dim)                                                                    \
  template void keep_directory_lists(Model<Dim>&, const Communicator&);                           \
  template NodeConditions<Dim> conditions_at(const std::vector<Index>&,                           \
                                             const NodeConditions<Dim>&, const Communicator&);    \
  template InjectedCells<Dim> kept_injections(const std::vector<Injection<Dim>>&);                \
  template InjectedCells<Dim> injections_at(const std::vector<Index>&, const InjectedCells<Dim>&, \
                                            const std::vector<Injection<Dim>>&,                   \
                                            const Communicator&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
