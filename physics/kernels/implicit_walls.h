/// \file Nodes at walls, and with axes of their own, in implicit steps. Their unknowns and rows of
/// the system are those of their axes.
///
/// A one-sided wall holds a node as long as it pushes, and lets it go when it would pull; it stops
/// what moves into it. Friction holds a node along the wall as long as the force along it is at
/// most the coefficient times the force on the wall, else it slides, and that force acts against
/// its motion. Which node does what is found by Newton's iterations (a primal-dual active set:
/// Hintermueller, Ito and Kunisch 2003).
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// The first guess: walls hold all nodes, and friction does.
template <int Dim>
void begin_walls(Patch<Dim>& patch, const StepContext<Dim>& step);
/// ImplicitNodes::given, along axes that are held alone.
template <int Dim>
void give_at_walls(Patch<Dim>& patch);
/// Nodes that are to be held are moved to their walls with the next solution.
template <int Dim>
void close_walls(Patch<Dim>& patch, const StepContext<Dim>& step);
/// Rows and columns of the matrix become those of the axes of nodes; sliding nodes take the change
/// of friction with the force on the wall.
template <int Dim>
void turn_matrix(Patch<Dim>& patch);
/// The same of the right side, with friction. Decides what holds each node;
/// ImplicitNodes::walls_changed where that is new.
template <int Dim>
void settle_walls(Patch<Dim>& patch, const StepContext<Dim>& step);
/// Friction keeps its direction while Newton's method converges. Then it turns against the sliding
/// that was found: true where some does so by more than a little.
template <int Dim>
bool turn_slips(Patch<Dim>& patch);
/// A vector at a node along the axes of its unknowns, and back.
template <int Dim>
Vec<Dim> in_axes_of_node(const Patch<Dim>& patch, Local node, const Vec<Dim>& global);
template <int Dim>
Vec<Dim> in_axes_of_mesh(const Patch<Dim>& patch, Local node, const Vec<Dim>& along);
/// Force on what holds a node [N], along the axes of the mesh: what is not in balance there, and
/// friction.
template <int Dim>
Vec<Dim> force_on_support(const Patch<Dim>& patch, Local node);
/// A solution that was found becomes one of global axes.
template <int Dim>
void turn_solution(Patch<Dim>& patch);
/// Held axes end the step with the velocity of what holds them: Newmark's rule would throw back
/// what is stopped. Patch::acceleration and system.solution become those of the stop.
template <int Dim>
void stop_at_walls(Patch<Dim>& patch, const StepContext<Dim>& step);
/// Whether a node has an entry in Patch::walls.
template <int Dim>
bool is_at_wall(const Patch<Dim>& patch, Local node);
/// Work of friction in the step, and of walls that move.
template <int Dim>
void count_work_at_walls(Patch<Dim>& patch);

}  // namespace lahar
