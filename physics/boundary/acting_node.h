/// \file Conditions that act on nodes of a patch with forces (NodeAction).
#pragma once

#include <algorithm>
#include <limits>
#include <span>
#include <tuple>
#include <vector>

#include "physics/boundary/conditions.h"

namespace lahar {

/// One entry, and what it does in the present step.
template <int Dim, ActsOnNode T>
struct ActingNode {
  Local node = -1;
  T condition;
  NodeMeans<Dim> means = {};  ///< with takes_means<T>
  NodeAction<Dim> action = {};
  NodeComponents<Dim> drag = NodeComponents<Dim>::Zero();  ///< [N] of the dashpot, against velocity
};

template <int Dim, class T>
struct ActingListsOf;
template <int Dim, class... T>
struct ActingListsOf<Dim, std::tuple<T...>> {
  template <class C>
  static auto list() {
    if constexpr (ActsOnNode<C>)
      return std::tuple<std::vector<ActingNode<Dim, C>>>();
    else
      return std::tuple<>();
  }
  using type = decltype(std::tuple_cat(list<T>()...));
};
/// One list for each condition that acts, by ascending nodes.
template <int Dim>
using ActingLists = typename ActingListsOf<Dim, Conditions>::type;

/// Call visit(list) for each list.
template <class... Lists>
void for_each_acting_list(std::tuple<Lists...>& lists, auto&& visit) {
  std::apply([&](auto&... list) { (visit(list), ...); }, lists);
}
template <class... Lists>
void for_each_acting_list(const std::tuple<Lists...>& lists, auto&& visit) {
  std::apply([&](const auto&... list) { (visit(list), ...); }, lists);
}

/// The entries of a node, a span of each list.
template <class... Entry>
std::tuple<std::span<Entry>...> acting_at(std::tuple<std::vector<Entry>...>& lists, Local node) {
  const auto at_node = [&](auto& list) {
    const auto first = std::lower_bound(list.begin(), list.end(), node,
                                        [](const auto& e, Local n) { return e.node < n; });
    auto last = first;
    while (last != list.end() && last->node == node) ++last;
    return std::span(first, last);
  };
  return std::apply([&](auto&... list) { return std::tuple(at_node(list)...); }, lists);
}

/// The first node from `node` on that has an entry; beyond all nodes if there is none.
template <class... Lists>
Local next_acting(const std::tuple<Lists...>& lists, Local node) {
  Local next = std::numeric_limits<Local>::max();
  for_each_acting_list(lists, [&](const auto& list) {
    const auto at = std::lower_bound(list.begin(), list.end(), node,
                                     [](const auto& e, Local n) { return e.node < n; });
    if (at != list.end()) next = std::min(next, at->node);
  });
  return next;
}

}  // namespace lahar
