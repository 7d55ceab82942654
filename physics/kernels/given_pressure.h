/// \file What water outside does, whose pressures are prescribed at nodes. Forces of the pore
/// pressure p, sum_p V p grad N, are those of a surface without pressure. Where p_g presses on it,
/// along the normal n, the integral of N p_g n over the surface is to be taken from them. That is
/// the volume integral of p_g grad N + N grad p_g (Gauss), with any p_g inside that is continuous:
/// here that of the functions of elements, from the prescribed pressures and zero at other nodes.
#pragma once

#include <functional>
#include <vector>

#include "physics/particles/patch.h"

namespace lahar {

/// Gets the forces on the nodes of a bin.
template <int Dim>
using TakeForces = std::function<void(const ParticleBin&, const Local* nodes,
                                      const std::vector<Vec<Dim>>& forces)>;

/// Call take(bin, nodes, f) for the bins that have such pressures, with
/// f = sum_p V (p_g grad N + N grad p_g) [N]. Where the pore pressure acts at the centre of a cell
/// (map_liquid_forces()), so does p_g. Else the mean of p_g over the particles of a cell is made
/// that at its centre: with the ground that settles within its cells, they would leave the pressure
/// behind.
template <int Dim>
void for_given_pressures(const Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                         const TakeForces<Dim>& take);

}  // namespace lahar
