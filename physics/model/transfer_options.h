/// \file What follows from the options of a velocity transfer (VelocityTransfer, Affine).
#pragma once

#include "physics/model/model.h"

namespace lahar {

/// Orders above are refused: each costs as much as a mapping, and 1 - theta (1 - P)^order hardly
/// changes any more.
inline constexpr int most_transfer_order = 10;

inline bool has_filter(const VelocityTransfer& transfer) {
  return transfer.order > 1 && transfer.takes();
}

/// True if particles get FLIP's change from the nodes, and the transfer takes at most a share of
/// it. That share is counted at particles; walls and contact take what particles lose. Other
/// transfers are counted at nodes, by what nodes got and particles did not (integrate(),
/// advance()). There the affine velocities do work, too.
inline bool blends(const Analysis& analysis) {
  const VelocityTransfer& transfer = analysis.transfer;
  return transfer.order == 1 && !transfer.filters_change && analysis.affine == Affine::none &&
         (!transfer.rates.empty() || transfer.flip > 0.0);
}
/// Whether the transfer changes energy. Where FLIP takes nothing, affine velocities do: they are
/// part of the nodal velocities at which forces do their work.
inline bool counts(const Analysis& analysis) {
  return analysis.transfer.takes() || analysis.affine != Affine::none;
}
/// Whether the transfer's loss is counted at nodes.
inline bool counts_at_nodes(const Analysis& analysis) {
  return counts(analysis) && !blends(analysis);
}

/// Whether the affine part of particles is that of the velocities that nodes have before forces act
/// (Patch::transfer, by velocities_before_forces()), and not of those after. These change by
/// dt f_i / m_i, where with functions of elements f_i goes like grad N and m_i like N: near the
/// border of a cell, of a particle alone at a node, their gradient has no bound. The others are
/// means of velocities that particles have, and a step's change reaches the affine part in the next
/// one. Functions with continuous gradients, and means over domains, keep f_i grad N_i / m_i
/// bounded.
inline bool spreads_before_forces(const Analysis& analysis) {
  return analysis.affine != Affine::none && analysis.functions == ShapeFunctions::element;
}

/// Whether a projection keeps some of the pressure of a liquid in pores.
inline bool keeps_pore_pressure(const Analysis& analysis) {
  return is_projection(analysis) && analysis.two_phase && analysis.projection.kept > 0.0;
}
/// Whether it keeps all of it: what does not decay by itself must not grow.
inline bool keeps_all_pore_pressure(const Analysis& analysis) {
  return keeps_pore_pressure(analysis) && analysis.projection.kept == 1.0;
}
/// Whether nodes need the mean of the pressure that a projection keeps.
inline bool needs_kept_pressure(const Analysis& analysis) {
  return is_projection(analysis) && analysis.projection.kept > 0.0 &&
         (analysis.two_phase || analysis.prescribes_pore_pressure);
}

/// Whether strains are those of velocities that the updated particles give to nodes again. (With
/// those before, soil that a projection moves into new cells bursts: nodes with little mass.)
inline bool maps_velocities_again(const Analysis& analysis) {
  return analysis.scheme == Scheme::musl || (is_projection(analysis) && analysis.two_phase);
}

/// Whether forces on a liquid in pores, and its discharge, take the porosity of nodes. (With USF it
/// is not known when stresses are updated. CB-Geo MPM takes that of particles.)
inline bool has_nodal_porosity(const Analysis& analysis) {
  return analysis.two_phase && !analysis.volume_as_cbgeo && analysis.scheme != Scheme::usf &&
         !is_implicit(analysis);
}

/// Whether pressures that nodes prescribe press on mixture and liquid, as water outside does. (In
/// CB-Geo MPM they are pressures of nodes alone, which particles take. What a projection does not
/// keep its system has.)
inline bool given_pressures_press(const Analysis& analysis) {
  if (!analysis.prescribes_pore_pressure || !analysis.two_phase) return false;
  return is_projection(analysis) ? keeps_pore_pressure(analysis) : !analysis.as_cbgeo;
}

/// Whether particles take pore pressures from nodes.
inline bool maps_pore_pressure(const Analysis& analysis) {
  return analysis.two_phase && !is_projection(analysis) &&
         (analysis.pore_pressure_smoothing || analysis.prescribes_pore_pressure);
}

}  // namespace lahar
