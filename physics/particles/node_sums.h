/// \file Sums of nodes over the patches that share them, for nodal kernels.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

#include "physics/base/nodal_limits.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Two kinds of node sums that lie beside each other: a line.
using SumLine = PackOf<sum_stride>;
LAHAR_INLINE NodeVector first_of(const SumLine& line) {
  return NodeVector::of(__builtin_shufflevector(line.v, line.v, 0, 1, 2, 3));
}
LAHAR_INLINE NodeVector second_of(const SumLine& line) {
  return NodeVector::of(__builtin_shufflevector(line.v, line.v, 4, 5, 6, 7));
}

/// Node sums over all patches that share a node, in ascending patch id: of one kind (a NodeVector),
/// or of `which` and the kind beside it (a SumLine).
template <int Dim, class Sum = NodeVector>
class SumOverPatches {
 public:
  SumOverPatches(Patch<Dim>& patch, NodeSum which, Index step)
      : shared_node_(patch.topology.shared_node.data()),
        shares_(patch.topology.shares.data()),
        first_(patch.topology.first.data()),
        n_shared_(patch.topology.shared_node.size()),
        own_(patch.own_sums(which, step)),
        sums_(patch.all_sums(which, step)),
        offset_(sum_offset(which)) {
    assert(offset_ + lanes<Sum> <= sum_stride);
  }

  /// What this patch alone contributes.
  LAHAR_INLINE Sum own(Local node) const {
    return load<Sum>(own_ + static_cast<std::ptrdiff_t>(node) * sum_stride);
  }
  /// The node of shared(s); beyond all nodes after the last.
  LAHAR_INLINE Local shared_node(std::size_t s) const {
    return s < n_shared_ ? shared_node_[s] : std::numeric_limits<Local>::max();
  }
  /// The sum at shared_node(s). Sums that are zero may be left out: it begins at zero.
  LAHAR_INLINE Sum shared(std::size_t s) const {
    Sum sum(0.0);
    for (Local e = first_[s]; e < first_[s + 1]; ++e)
      if (const double* from = sums_of(e)) sum += load<Sum>(from + place(e));
    return sum;
  }
  /// The same with the largest of each component in place of their sum. It begins at zero.
  LAHAR_INLINE Sum shared_most(std::size_t s) const {
    Sum most(0.0);
    for (Local e = first_[s]; e < first_[s + 1]; ++e)
      if (const double* from = sums_of(e)) most = max(most, load<Sum>(from + place(e)));
    return most;
  }
  /// shared() and shared_most() of any node, which is looked for.
  Sum at(Local node) const {
    const std::size_t s = find(node);
    return s < n_shared_ ? shared(s) : own(node);
  }
  Sum most_at(Local node) const {
    const std::size_t s = find(node);
    return s < n_shared_ ? shared_most(s) : own(node);
  }
  /// Others wrote their sums long ago and elsewhere: fetch them before they are needed.
  LAHAR_INLINE void prefetch(std::size_t s) const {
    constexpr std::size_t ahead = 8;
    if (s + ahead >= n_shared_) return;
    for (Local e = first_[s + ahead]; e < first_[s + ahead + 1]; ++e)
      if (const double* from = sums_of(e)) __builtin_prefetch(from + place(e));
  }

 private:
  /// Number of a shared node; n_shared_ of others.
  std::size_t find(Local node) const {
    const Local* found = std::lower_bound(shared_node_, shared_node_ + n_shared_, node);
    const auto s = static_cast<std::size_t>(found - shared_node_);
    return shared_node(s) == node ? s : n_shared_;
  }
  LAHAR_INLINE const double* sums_of(Local e) const { return sums_[shares_[e].neighbour + 1]; }
  LAHAR_INLINE std::ptrdiff_t place(Local e) const {
    return static_cast<std::ptrdiff_t>(shares_[e].node) * sum_stride + offset_;
  }

  const Local* shared_node_;
  const typename PatchTopology<Dim>::Share* shares_;
  const Local* first_;
  std::size_t n_shared_;
  const double* own_;
  const double* const* sums_;  ///< of this patch and the neighbours
  int offset_;
};

/// Call node(i, this patch's own sum, sum) for every active node, in order.
template <int Dim, class Sum, class Node>
void for_each_node(const Patch<Dim>& patch, const SumOverPatches<Dim, Sum>& sums, Node node) {
  for (const NodeRange& range : patch.active_nodes) {
    std::size_t s = range.first_shared;
    Local next_shared = sums.shared_node(s);
    for (Local i = range.begin; i < range.end; ++i) {
      const Sum own = sums.own(i);
      Sum sum = own;
      if (i == next_shared) {
        sums.prefetch(s);
        sum = sums.shared(s);
        next_shared = sums.shared_node(++s);
      }
      node(i, own, sum);
    }
  }
}

/// The entry of a node in a list of ascending nodes, or null.
template <class Entry>
const Entry* find_node(const std::vector<Entry>& entries, Local node) {
  const auto found = std::lower_bound(entries.begin(), entries.end(), node,
                                      [](const Entry& e, Local n) { return e.node < n; });
  return found == entries.end() || found->node != node ? nullptr : &*found;
}
/// Call `each(entry)` for the entries of a node in a list by node.
template <class Entry, class Each>
void for_entries(const std::vector<Entry>& all, Local node, Each each) {
  for (const Entry* one = find_node(all, node);
       one && one != all.data() + all.size() && one->node == node; ++one)
    each(*one);
}

LAHAR_INLINE double* at(NodeArray& values, Local node) {
  return values.data() + static_cast<std::ptrdiff_t>(node) * node_width;
}
LAHAR_INLINE const double* at(const NodeArray& values, Local node) {
  return values.data() + static_cast<std::ptrdiff_t>(node) * node_width;
}

/// {v, m} from a velocity and a vector with the mass.
LAHAR_INLINE NodeVector with_mass(const NodeVector& v, const NodeVector& m) {
  return NodeVector::of(__builtin_shufflevector(v.v, m.v, 0, 1, 2, 4 + mass_lane));
}

/// Where an element's functions are negative in places, so may be the mass of a node: what is
/// divided by it still moves with the body, as linear and angular momentum demand.
LAHAR_INLINE bool more_than(double m, double least) {
  return std::abs(m) > least;
}

/// A node of functions that are nowhere negative moves as its particles do, however small its mass
/// is: a particle at the edge of its cell gives a node across it hardly any mass, but takes
/// gradients from it. At rest such a node would strain a particle that moves rigidly, and its
/// force, for which it has not enough mass, would be lost. The least mass is beyond all products of
/// roundings [kg].
inline constexpr double least_moving_mass = 1e-200;

/// Whether a node of mass m has a velocity. Of functions that are negative in places, masses may
/// cancel: a quotient of what then remains is rounding (a tenth of Patch::least_mass, as in the
/// reference code).
template <int Dim>
LAHAR_INLINE bool has_velocity(const Patch<Dim>& patch, double m) {
  return more_than(m,
                   patch.basis == BasisKind::element ? 0.1 * patch.least_mass : least_moving_mass);
}

/// {v, m} of a node from the sums {m v} and the mass {., m}.
template <int Dim>
LAHAR_INLINE NodeVector velocity_of(const Patch<Dim>& patch, const NodeVector& momentum,
                                    const NodeVector& mass) {
  const double m = mass[mass_lane];
  if (!has_velocity(patch, m)) return with_mass(NodeVector(0.0), mass);
  const NodeVector velocity = momentum * NodeVector(1.0 / m);
  return with_mass(flushed(velocity, least_nodal_velocity), mass);
}

}  // namespace lahar
