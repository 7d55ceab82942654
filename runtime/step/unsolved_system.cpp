#include "runtime/step/unsolved_system.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "runtime/step/worst_node.h"

namespace lahar {

namespace {

/// |b - A x| of the free unknowns of a node that have a row, or |b| of those that have none. -1 =
/// there are none of them.
template <int Dim>
double left_at(const Patch<Dim>& patch, std::size_t node, bool with_row) {
  const NodalSystem<Dim>& system = patch.system;
  const NodeArray &r = system.solver.r, &inverse = system.solver.inverse;
  const std::size_t first = node * node_width;
  if (patch.active_nodes.empty() || !patch.node_is_active[node]) return -1;
  if (first >= r.size() || first >= inverse.size()) return -1;
  bool any = false;
  double sum = 0;
  for (int d = 0; d < system.width(); ++d) {
    if (!system.held.empty() && (system.held[node] >> d & 1)) continue;
    const std::size_t lane = first + static_cast<std::size_t>(d);
    if ((inverse[lane] != 0) != with_row) continue;
    const double left = with_row ? r[lane] : system.right_side[lane];
    any |= with_row || left != 0;
    sum += left * left;
  }
  if (!any) return -1;
  return std::isfinite(sum) ? std::sqrt(sum) : std::numeric_limits<double>::infinity();
}

}  // namespace

template <int Dim>
std::string describe_unsolved(const SolveResult& result, const PatchSet<Dim>& patches,
                              const Mesh<Dim>& mesh, const Communicator& ranks,
                              std::string_view unit, const LeftOver<Dim>& in_unit) {
  const auto worst = [&](bool with_row) {
    return describe_worst_node<Dim>(patches, mesh, ranks,
                                    [&](const Patch<Dim>& patch, std::size_t node) {
                                      const double left = left_at(patch, node, with_row);
                                      return left < 0 ? -1.0 : in_unit(patch, node, left);
                                    });
  };
  std::string text = result.problem + " (";
  if (result.iterations > 0)
    text += fmt::format("{} iteration{}, ", result.iterations, result.iterations == 1 ? "" : "s");
  text += fmt::format("relative residual {:.3g})", result.residual);
  if (const std::string node = worst(false); !node.empty())
    return text +
           fmt::format("; the largest right side without an equation is at {} {}", node, unit);
  if (const std::string node = worst(true); !node.empty())
    text += fmt::format("; most is left at {} {}", node, unit);
  return text;
}

#define LAHAR_INSTANTIATE(Dim)                                                          \
  template std::string describe_unsolved<Dim>(const SolveResult&, const PatchSet<Dim>&, \
                                              const Mesh<Dim>&, const Communicator&,    \
                                              std::string_view, const LeftOver<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
