#include "runtime/step/timestep.h"

#include "physics/model/transfer_options.h"

namespace lahar {

NodeSumCopies node_sum_copies(const Analysis& analysis) {
  // With one exchange per step nothing else keeps a patch from overtaking its neighbours' reading.
  const int copies = analysis.scheme == Scheme::usl || analysis.scheme == Scheme::newmark ? 2 : 1;
  // With usf the one of forces does not, where integration reads momentum (timed_velocities.h).
  const int of_skeleton = analysis.scheme == Scheme::usf && analysis.sudden_velocities ? 2 : copies;
  const bool meets = analysis.contact.bodies > 1;
  // Rounds of a solver have one exchange as well.
  const int solver = begins_with_solve(analysis) ? 2 : 0;
  const bool more = maps_velocities_again(analysis) || analysis.pressure_smoothing;
  // Waves and prescribed velocities are read, and gradients and surfaces of bodies mapped and read,
  // before the exchange that integration waits for, or those of meeting bodies: the phase in which
  // the next ones are mapped has not begun anywhere near.
  return {{of_skeleton, more ? 1 : 0, meets ? 1 : 0, analysis.takes_means ? 1 : 0,
           analysis.drives_nodes ? 1 : 0, has_filter(analysis.transfer) ? 1 : 0,
           analysis.two_phase ? copies : 0, analysis.two_phase ? copies : 0,
           !analysis.two_phase         ? 0
           : analysis.liquid_advection ? copies
                                       : 1,
           meets ? 1 : solver, solver}};
}

bool keeps_nodal_state(const Analysis& analysis) {
  return analysis.scheme != Scheme::usl || analysis.pressure_smoothing ||
         has_filter(analysis.transfer) || maps_pore_pressure(analysis);
}

}  // namespace lahar
