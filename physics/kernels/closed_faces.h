/// \file Faces of cells that particles do not pass: all of their nodes are held along the normal.
///
/// Near such a face the velocity along its normal is v = g s at the distance s, so that a path
/// s(t) = s_0 exp(g t) never reaches it. The explicit step s += dt g s does where g dt < -1: nodes
/// next to a wall that few particles near the wall give their mass are light, and fast. Such a
/// particle is put back, as far from the face as it is beyond it, and what its own velocity has
/// towards the face is taken, as in a plastic impact: nodes that are held give particles no
/// impulse.
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// Put particle i of `particles`, which has left the local cell `old`, back if it has passed closed
/// faces of the cell. In the mesh: for functions of elements on boxes only; others are not zero on
/// faces inside of the mesh. Returns whether it has moved.
template <int Dim>
bool return_through_faces(Patch<Dim>& patch, Particles<Dim>& particles, Local i, Local old);

/// The same for the edge or corner of an obstacle that a particle has passed on its way to the
/// global cell `found`, which lies diagonally to `old`.
template <int Dim>
bool return_through_edge(Patch<Dim>& patch, Particles<Dim>& particles, Local i, Local old,
                         Index found);

/// The same for a particle that has left the mesh, and faces of any cell and functions.
template <int Dim>
bool return_to_mesh(Patch<Dim>& patch, const Mesh<Dim>& mesh, Particles<Dim>& particles, Local i,
                    Local old);

}  // namespace lahar
