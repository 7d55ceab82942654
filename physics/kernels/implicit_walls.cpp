#include "physics/kernels/implicit_walls.h"

#include <cmath>

#include "physics/kernels/matrix_pattern.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

/// Changes between sticking and sliding after which a node goes on sliding.
constexpr int most_changes = 6;

template <int Dim>
Eigen::Map<Vec<Dim>> vector_at(NodeArray& values, Local node) {
  return Eigen::Map<Vec<Dim>>(at(values, node));
}

template <int Dim>
bool is_touched(const Patch<Dim>& patch, const ConstrainedNode<Dim>& wall) {
  const auto i = static_cast<std::size_t>(wall.node);
  return patch.system.first.size() > i && !patch.velocity.empty() && patch.node_is_active[i] &&
         has_velocity(patch, at(patch.velocity, wall.node)[mass_lane]);
}

/// Call body(wall, state) for each node at a wall that particles touch.
template <int Dim, class Body>
void for_each_wall(Patch<Dim>& patch, Body body) {
  for (std::size_t k = 0; k < patch.implicit.walls.size(); ++k)
    if (is_touched(patch, patch.walls[k])) body(patch.walls[k], patch.implicit.walls[k]);
}

/// Bits of the axes along which nothing but friction can hold a node.
template <int Dim>
std::uint8_t along_walls(const ConstrainedNode<Dim>& wall, const ImplicitWall<Dim>& state) {
  unsigned along = 0;
  for (std::size_t d = 0; d < Dim; ++d)
    if (!(state.fixed >> d & 1) && wall.pushes[d] == 0) along |= 1u << d;
  return state.closed == 0 ? 0 : static_cast<std::uint8_t>(along);
}

template <int Dim>
bool rubs(const ConstrainedNode<Dim>& wall) {
  for (std::size_t d = 0; d < Dim; ++d)
    if (wall.pushes[d] != 0 && wall.rubs[d] > 0) return true;
  return false;
}

template <int Dim>
std::uint8_t held_axes(const ConstrainedNode<Dim>& wall, const ImplicitWall<Dim>& state) {
  unsigned held = state.closed | state.fixed;
  if (rubs(wall) && !state.slips) held |= along_walls(wall, state);
  return static_cast<std::uint8_t>(held);
}

/// The displacement in the step [m] that is prescribed along local axis d.
template <int Dim>
double displacement_along(const ConstrainedNode<Dim>& wall, std::size_t d, double dt) {
  return wall.fixed[d] || wall.pushes[d] != 0 ? dt * wall.velocity[d] : 0.0;
}

/// The largest friction that walls give at present, from the unbalanced force along local axes.
template <int Dim>
double friction_limit(const ConstrainedNode<Dim>& wall, const ImplicitWall<Dim>& state,
                      const Vec<Dim>& force) {
  double limit = 0;
  for (std::size_t d = 0; d < Dim; ++d)
    if (state.closed >> d & 1)
      limit += wall.rubs[d] * std::max(0.0, wall.pushes[d] * force[static_cast<int>(d)]);
  return limit;
}

template <int Dim>
Vec<Dim> part_along(std::uint8_t axes, Vec<Dim> vector) {
  for (int d = 0; d < Dim; ++d)
    if (!(axes >> d & 1)) vector[d] = 0.0;
  return vector;
}

/// Sticking or sliding, from the force and the motion along the wall; true where that is new.
template <int Dim>
bool choose_slip(const ConstrainedNode<Dim>& wall, ImplicitWall<Dim>& state, const Vec<Dim>& force,
                 const Vec<Dim>& moved) {
  const std::uint8_t along = along_walls(wall, state);
  const Vec<Dim> pull = part_along<Dim>(along, force), slid = part_along<Dim>(along, moved);
  const double limit = friction_limit(wall, state, force);
  if (!state.slips) {
    if (!(pull.norm() > limit) || pull.norm() == 0.0) return false;
    state.slips = true;
    state.slip = pull.normalized();
    return true;
  }
  if (state.changes < most_changes && slid.dot(state.slip) < 0.0) {  // it would be pushed back
    ++state.changes;
    state.slips = false;
    state.slip.setZero();
    state.closing |= along;
    return true;
  }
  return false;
}

}  // namespace

template <int Dim>
void begin_walls(Patch<Dim>& patch, const StepContext<Dim>& step) {
  patch.implicit.walls.assign(patch.walls.size(), {});
  patch.implicit.walls_changed = false;
  for_each_wall(patch, [&](const ConstrainedNode<Dim>& wall, ImplicitWall<Dim>& state) {
    std::uint8_t& held = patch.system.held[static_cast<std::size_t>(wall.node)];
    auto global = vector_at<Dim>(patch.implicit.prescribed, wall.node);
    Vec<Dim> prescribed = wall.axes.transpose() * global;
    state.fixed = wall.axes.isIdentity(0.0) ? held : 0;  // displacement constraints
    for (std::size_t d = 0; d < Dim; ++d) {
      const auto bit = static_cast<std::uint8_t>(1u << d);
      if (state.fixed & bit) continue;
      prescribed[static_cast<int>(d)] = displacement_along(wall, d, step.dt);
      if (wall.fixed[d]) state.fixed |= bit;
      if (wall.pushes[d] != 0) state.closed |= bit;
    }
    held = held_axes(wall, state);
    global = wall.axes * prescribed;
  });
}

template <int Dim>
void give_at_walls(Patch<Dim>& patch) {
  for_each_wall(patch, [&](const ConstrainedNode<Dim>& wall, const ImplicitWall<Dim>& state) {
    auto given = vector_at<Dim>(patch.implicit.given, wall.node);
    const Vec<Dim> along = wall.axes.transpose() * given;
    given = wall.axes * part_along<Dim>(held_axes(wall, state), along);
  });
}

template <int Dim>
void close_walls(Patch<Dim>& patch, const StepContext<Dim>& step) {
  for_each_wall(patch, [&](const ConstrainedNode<Dim>& wall, ImplicitWall<Dim>& state) {
    if (state.closing == 0) return;
    const Vec<Dim> moved =
        wall.axes.transpose() * vector_at<Dim>(patch.implicit.increment, wall.node);
    Vec<Dim> given = Vec<Dim>::Zero();
    for (std::size_t d = 0; d < Dim; ++d)
      if (const auto c = static_cast<int>(d); state.closing >> d & 1) {
        given[c] = displacement_along(wall, d, step.dt) - moved[c];
        if (wall.pushes[d] != 0) state.closed |= static_cast<std::uint8_t>(1u << d);
      }
    state.closing = 0;
    patch.system.held[static_cast<std::size_t>(wall.node)] = held_axes(wall, state);
    vector_at<Dim>(patch.implicit.given, wall.node) += wall.axes * given;
    patch.implicit.has_given = true;
  });
}

template <int Dim>
void turn_matrix(Patch<Dim>& patch) {
  using Block = Eigen::Matrix<double, Dim, Dim, Eigen::RowMajor>;
  NodalSystem<Dim>& system = patch.system;
  const auto block_at = [&](std::size_t k) {
    return Eigen::Map<Block>(&system.blocks[static_cast<std::size_t>(system.block_size) * k]);
  };
  system.turned.clear();
  for_each_wall(patch, [&](const ConstrainedNode<Dim>& wall, const ImplicitWall<Dim>&) {
    if (wall.axes.isIdentity(0.0)) return;
    system.turned.push_back({wall.node, wall.axes});
    const auto row = static_cast<std::size_t>(wall.node);
    for (std::size_t k = system.first[row]; k < system.first[row + 1]; ++k) {
      block_at(k) = wall.axes.transpose() * block_at(k);
      const Local other = system.column[k];  // the pattern is symmetric
      auto column = block_at(find_block(system, other, wall.node));
      column = column * wall.axes;
    }
  });
  for_each_wall(patch, [&](const ConstrainedNode<Dim>& wall, const ImplicitWall<Dim>& state) {
    if (!state.slips) return;
    system.symmetric = false;
    const auto row = static_cast<std::size_t>(wall.node);
    for (std::size_t k = system.first[row]; k < system.first[row + 1]; ++k) {
      auto block = block_at(k);
      for (std::size_t d = 0; d < Dim; ++d)
        if (state.closed >> d & 1)
          block -=
              (wall.rubs[d] * wall.pushes[d]) * state.slip * block.row(static_cast<int>(d)).eval();
    }
  });
}

template <int Dim>
void settle_walls(Patch<Dim>& patch, const StepContext<Dim>& step) {
  patch.implicit.walls_changed = false;
  for_each_wall(patch, [&](const ConstrainedNode<Dim>& wall, ImplicitWall<Dim>& state) {
    auto right_side = vector_at<Dim>(patch.system.right_side, wall.node);
    Vec<Dim> force = wall.axes.transpose() * right_side;
    const Vec<Dim> moved =
        wall.axes.transpose() * vector_at<Dim>(patch.implicit.increment, wall.node);
    bool changed = false;
    for (std::size_t d = 0; d < Dim; ++d) {
      if (wall.pushes[d] == 0) continue;
      const int c = static_cast<int>(d);
      const auto bit = static_cast<std::uint8_t>(1u << d);
      if ((state.closed & bit) && wall.pushes[d] * force[c] < 0) {
        state.closed &= static_cast<std::uint8_t>(~bit);
        changed = true;
      } else if (!(state.closed & bit) &&
                 wall.pushes[d] * (moved[c] - step.dt * wall.velocity[d]) > 0) {
        state.closing |= bit;
        changed = true;
      }
    }
    if (state.closed == 0) {
      state.slips = false;
      state.slip.setZero();
    }
    if (state.closed != 0 && rubs(wall)) changed |= choose_slip(wall, state, force, moved);
    state.friction.setZero();
    if (state.slips) state.friction = -friction_limit(wall, state, force) * state.slip;
    force += state.friction;
    right_side = force;
    patch.system.held[static_cast<std::size_t>(wall.node)] = held_axes(wall, state);
    patch.implicit.walls_changed |= changed;
  });
}

template <int Dim>
bool turn_slips(Patch<Dim>& patch) {
  constexpr double least = 0.01;  // [rad]
  bool turned = false;
  for_each_wall(patch, [&](const ConstrainedNode<Dim>& wall, ImplicitWall<Dim>& state) {
    if (!state.slips) return;
    const Vec<Dim> moved =
        wall.axes.transpose() * vector_at<Dim>(patch.implicit.increment, wall.node);
    const Vec<Dim> slid = part_along<Dim>(along_walls(wall, state), moved);
    if (slid.norm() == 0.0 || (slid.normalized() - state.slip).norm() <= least) return;
    state.slip = slid.normalized();
    turned = true;
  });
  return turned;
}

template <int Dim>
Vec<Dim> in_axes_of_node(const Patch<Dim>& patch, Local node, const Vec<Dim>& global) {
  const ConstrainedNode<Dim>* const wall = find_node(patch.walls, node);
  return wall ? Vec<Dim>(wall->axes.transpose() * global) : global;
}

template <int Dim>
Vec<Dim> in_axes_of_mesh(const Patch<Dim>& patch, Local node, const Vec<Dim>& along) {
  const ConstrainedNode<Dim>* const wall = find_node(patch.walls, node);
  return wall ? Vec<Dim>(wall->axes * along) : along;
}

template <int Dim>
Vec<Dim> force_on_support(const Patch<Dim>& patch, Local node) {
  const ConstrainedNode<Dim>* const wall = find_node(patch.walls, node);
  const double* r = at(patch.system.right_side, node);
  Vec<Dim> force = Vec<Dim>::Zero();
  for (int d = 0; d < Dim; ++d)
    if (patch.system.held[static_cast<std::size_t>(node)] >> d & 1) force[d] = r[d];
  if (!wall) return force;
  const auto k = static_cast<std::size_t>(wall - patch.walls.data());
  return wall->axes * (force - patch.implicit.walls[k].friction);
}

template <int Dim>
void turn_solution(Patch<Dim>& patch) {
  for_each_wall(patch, [&](const ConstrainedNode<Dim>& wall, const ImplicitWall<Dim>&) {
    auto x = vector_at<Dim>(patch.system.solution, wall.node);
    x = (wall.axes * x).eval();
  });
}

template <int Dim>
bool is_at_wall(const Patch<Dim>& patch, Local node) {
  return find_node(patch.walls, node) != nullptr;
}

template <int Dim>
void stop_at_walls(Patch<Dim>& patch, const StepContext<Dim>& step) {
  for_each_wall(patch, [&](const ConstrainedNode<Dim>& wall, const ImplicitWall<Dim>&) {
    const std::uint8_t held = patch.system.held[static_cast<std::size_t>(wall.node)];
    const auto turned = [&](NodeArray& values) -> Vec<Dim> {
      return wall.axes.transpose() * vector_at<Dim>(values, wall.node);
    };
    Vec<Dim> change = turned(patch.acceleration), end = turned(patch.system.solution);
    const Vec<Dim> before = turned(patch.velocity), moved = turned(patch.implicit.increment);
    for (int d = 0; d < Dim; ++d)
      if (held >> d & 1) {
        change[d] = (moved[d] / step.dt - before[d]) / step.dt;
        end[d] = 0.0;
      }
    vector_at<Dim>(patch.acceleration, wall.node) = wall.axes * change;
    vector_at<Dim>(patch.system.solution, wall.node) = wall.axes * end;
  });
}

template <int Dim>
void count_work_at_walls(Patch<Dim>& patch) {
  for_each_wall(patch, [&](const ConstrainedNode<Dim>& wall, const ImplicitWall<Dim>& state) {
    const auto i = static_cast<std::size_t>(wall.node);
    const double own = patch.implicit.own_mass[i];
    if (own == 0.0) return;
    const double share = own / at(patch.velocity, wall.node)[mass_lane];
    const Vec<Dim> moved =
        wall.axes.transpose() * vector_at<Dim>(patch.implicit.increment, wall.node);
    const double taken = -share * state.friction.dot(moved);
    patch.work.friction += taken;
    patch.work.damping += taken;
    const auto right_side = vector_at<Dim>(patch.system.right_side, wall.node);
    for (int d = 0; d < Dim; ++d)
      if (patch.system.held[i] >> d & 1) patch.work.external -= share * right_side[d] * moved[d];
  });
}

#define LAHAR_INSTANTIATE(Dim)                                                       \
  template void begin_walls<Dim>(Patch<Dim>&, const StepContext<Dim>&);              \
  template void give_at_walls<Dim>(Patch<Dim>&);                                     \
  template void close_walls<Dim>(Patch<Dim>&, const StepContext<Dim>&);              \
  template bool is_at_wall<Dim>(const Patch<Dim>&, Local);                           \
  template void stop_at_walls<Dim>(Patch<Dim>&, const StepContext<Dim>&);            \
  template void turn_matrix<Dim>(Patch<Dim>&);                                       \
  template void settle_walls<Dim>(Patch<Dim>&, const StepContext<Dim>&);             \
  template bool turn_slips<Dim>(Patch<Dim>&);                                        \
  template Vec<Dim> in_axes_of_node<Dim>(const Patch<Dim>&, Local, const Vec<Dim>&); \
  template Vec<Dim> in_axes_of_mesh<Dim>(const Patch<Dim>&, Local, const Vec<Dim>&); \
  template Vec<Dim> force_on_support<Dim>(const Patch<Dim>&, Local);                 \
  template void turn_solution<Dim>(Patch<Dim>&);                                     \
  template void count_work_at_walls<Dim>(Patch<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
