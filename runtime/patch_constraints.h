/// \file Constraints and loads of the nodes of one patch.
#pragma once

#include "physics/patch.h"

namespace lahar {

/// Sort what the model has for nodes in the order in which set_constraints() looks for it.
template <int Dim>
void sort_constraints(Model<Dim>& model);

/// Say which cells are those of each body, where nodes and cells are repeated for bodies.
template <int Dim>
void set_bodies(Patch<Dim>& patch, const Model<Dim>& model);

/// Fill Patch::fixed, walls and forces for the nodes of the patch, of every body alike.
template <int Dim>
void set_constraints(Patch<Dim>& patch, const Model<Dim>& model);

extern template void sort_constraints(Model<2>&);
extern template void sort_constraints(Model<3>&);
extern template void set_bodies(Patch<2>&, const Model<2>&);
extern template void set_bodies(Patch<3>&, const Model<3>&);
extern template void set_constraints(Patch<2>&, const Model<2>&);
extern template void set_constraints(Patch<3>&, const Model<3>&);

}  // namespace lahar
