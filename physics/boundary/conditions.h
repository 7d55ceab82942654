/// \file The boundary conditions of nodes that there are. A new condition is one file of
/// physics/boundary/ and one line here; CONTRIBUTING.md has an example.
#pragma once

#include <algorithm>
#include <concepts>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "physics/boundary/node_absorption.h"
#include "physics/boundary/node_acceleration.h"
#include "physics/boundary/node_displacement.h"
#include "physics/boundary/node_force.h"
#include "physics/boundary/node_friction.h"
#include "physics/boundary/node_pressure.h"
#include "physics/boundary/node_spring.h"
#include "physics/boundary/node_velocity.h"

namespace lahar {

/// In the order in which the scenario's are read.
using Conditions = std::tuple<  //
    NodeVelocity,               //
    NodeFriction,               //
    NodeAbsorption,             //
    NodeSpring,                 //
    NodeAcceleration,           //
    NodeDisplacement,           //
    NodeForce,                  //
    NodePressure>;

/// What every condition has, beside `direction` where it has one. Optional: `from_file`, lines
/// `node dir` and all numbers that are required may stand in place of a set; `int function`, a
/// factor over time; `Excludes`, a condition that the same node and direction may not have;
/// `problems(dim)`, values that exclude each other; `derive(dim)`, members that follow from others;
/// `phases`, it is one of the liquid in pores, too; `liquid`, it is of that liquid alone;
/// `takes_means`, NodeMeans are needed; and `act<Dim>(const NodeView<Dim>&)`, the NodeAction. A
/// condition without it has its own place in the step: ConstrainedNode, Patch::fixed_displacement
/// or Patch::forces.
template <class T>
concept NodeCondition = std::is_trivially_copyable_v<T> && requires(T at) {
  { at.node } -> std::convertible_to<Index>;
  { T::key } -> std::convertible_to<std::string_view>;
  { T::name } -> std::convertible_to<std::string_view>;
  { T::summary } -> std::convertible_to<std::string_view>;
  { T::help } -> std::convertible_to<std::string_view>;
  { T::native } -> std::convertible_to<bool>;
  { T::combine } -> std::convertible_to<Combine>;
  T::parameters.size();
};

template <class T>
concept ActsOnNode = NodeCondition<T> && requires(const T at, const NodeView<2>& view) {
  { at.template act<2>(view) } -> std::same_as<NodeAction<2>>;
};
template <class T>
inline constexpr bool takes_means = false;
template <class T>
requires T::takes_means inline constexpr bool takes_means<T> = true;
template <class T>
inline constexpr bool is_load = false;
template <class T>
requires T::is_load inline constexpr bool is_load<T> = true;
template <class T>
inline constexpr bool is_of_liquid = false;
template <class T>
requires T::liquid inline constexpr bool is_of_liquid<T> = true;
template <class T>
inline constexpr bool is_from_file = false;
template <class T>
requires T::from_file inline constexpr bool is_from_file<T> = true;
template <class T>
concept HasDirection = requires {
  T::direction;
};
template <class T>
concept HasFunction = requires(T at) {
  at.function;
};

template <class T>
inline constexpr bool all_are_conditions = false;
template <class... T>
inline constexpr bool all_are_conditions<std::tuple<T...>> = (NodeCondition<T> && ...);
static_assert(all_are_conditions<Conditions>, "a condition lacks what NodeCondition lists");

/// Call visit.operator()<T>() for each condition.
template <class... T>
void for_each_condition_of(std::tuple<T...>*, auto&& visit) {
  (visit.template operator()<T>(), ...);
}
void for_each_condition(auto&& visit) {
  for_each_condition_of(static_cast<Conditions*>(nullptr), visit);
}

template <class T>
struct ListsOf;
template <class... T>
struct ListsOf<std::tuple<T...>> {
  using type = std::tuple<std::vector<T>...>;
};
/// Entries of a scenario, of each condition.
using ConditionLists = ListsOf<Conditions>::type;

/// The node and, if the condition has one, the direction of an entry.
template <NodeCondition T>
std::pair<Index, int> place_of(const T& entry) {
  if constexpr (HasDirection<T>) return {entry.node, entry.*T::direction.member};
  return {entry.node, 0};
}

/// Sort entries by node and direction and drop those that do not act, as T::combine says.
template <NodeCondition T>
void combine(std::vector<T>& entries) {
  if (T::combine == Combine::all) return;
  if (T::combine == Combine::last) std::reverse(entries.begin(), entries.end());
  std::stable_sort(entries.begin(), entries.end(),
                   [](const T& a, const T& b) { return place_of(a) < place_of(b); });
  entries.erase(std::unique(entries.begin(), entries.end(),
                            [](const T& a, const T& b) { return place_of(a) == place_of(b); }),
                entries.end());
}

}  // namespace lahar
