// The time step of each scheme: its stages in order. Options add stages of their own (stages.h); an
// exchange of node sums, of particles or of the time step is part of a stage.
#include "runtime/step/schemes.h"

#include "physics/model/transfer_options.h"
#include "runtime/solve/global_solve.h"

namespace lahar {

namespace {

template <int Dim>
Stages<Dim> in_order(std::initializer_list<Stages<Dim>> parts) {
  Stages<Dim> all;
  for (const Stages<Dim>& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

template <int Dim>
Stages<Dim> arrivals_and_injection(const Analysis& a, bool injects) {
  return injects ? in_order<Dim>({arrivals<Dim>(a), injection<Dim>(a)}) : arrivals<Dim>(a);
}

/// Forces, and what conditions of nodes take of particles.
template <int Dim>
Stages<Dim> all_forces(const Analysis& a) {
  return in_order<Dim>({forces<Dim>(a), liquid_forces<Dim>(a), mapped_means<Dim>(a)});
}

/// Where they cannot be mapped at the end of the step before.
template <int Dim>
Stages<Dim> forces_after_arrivals(const Analysis& a) {
  return maps_force_with_momentum(a) ? Stages<Dim>{} : all_forces<Dim>(a);
}

template <int Dim>
Stages<Dim> forces_of_next_step(const Analysis& a) {
  return maps_force_with_momentum(a) ? all_forces<Dim>(a) : Stages<Dim>{};
}

/// Update stress first: strain from the velocities at the beginning of the step.
template <int Dim>
Stages<Dim> usf(const Analysis& a, bool injects) {
  return in_order<Dim>({
      arrivals_and_injection<Dim>(a, injects),
      driven_nodes<Dim>(a),
      meeting_bodies<Dim>(a),
      nodal_velocities<Dim>(a),
      strain_and_stress<Dim>(a),
      pore_pressure<Dim>(a),
      all_forces<Dim>(a),
      node_means<Dim>(a),
      integration<Dim>(a),
      unbalanced_forces<Dim>(a),
      velocity_transfer<Dim>(a),
      rigid_contact<Dim>(a),
      liquid_g2p<Dim>(a),
      g2p<Dim>(a),
      outside_of_bodies<Dim>(a),
      location<Dim>(a),
      p2g<Dim>(a),
      liquid_p2g<Dim>(a),
      prescribed_velocities<Dim>(a),
      output<Dim>(a),
  });
}

/// Update stress last: strain from the velocities that move particles, and one exchange for mass,
/// momentum and force. Stress comes before particles move, or takes the gradients that G2P found.
template <int Dim>
Stages<Dim> usl(const Analysis& a, bool injects) {
  const bool after = stress_follows_g2p(a);
  return in_order<Dim>({
      arrivals_and_injection<Dim>(a, injects),
      forces_after_arrivals<Dim>(a),
      driven_nodes<Dim>(a),
      node_means<Dim>(a),
      meeting_bodies<Dim>(a),
      integration<Dim>(a),
      unbalanced_forces<Dim>(a),
      velocity_transfer<Dim>(a),
      rigid_contact<Dim>(a),
      after ? g2p<Dim>(a) : strain_and_stress<Dim>(a),
      pore_pressure<Dim>(a),
      liquid_g2p<Dim>(a),
      after ? strain_and_stress<Dim>(a) : g2p<Dim>(a),
      location<Dim>(a),
      p2g<Dim>(a),
      liquid_p2g<Dim>(a),
      forces_of_next_step<Dim>(a),
      prescribed_velocities<Dim>(a),
      output<Dim>(a),
  });
}

/// Modified update stress last: strain from nodal velocities that the updated particles give again.
template <int Dim>
Stages<Dim> musl(const Analysis& a, bool injects) {
  return in_order<Dim>({
      arrivals_and_injection<Dim>(a, injects),
      forces_after_arrivals<Dim>(a),
      driven_nodes<Dim>(a),
      node_means<Dim>(a),
      meeting_bodies<Dim>(a),
      integration<Dim>(a),
      unbalanced_forces<Dim>(a),
      velocity_transfer<Dim>(a),
      rigid_contact<Dim>(a),
      liquid_g2p<Dim>(a),
      g2p<Dim>(a),
      outside_of_bodies<Dim>(a),
      remapped_velocities<Dim>(a),
      strain_and_stress<Dim>(a),
      pore_pressure<Dim>(a),
      location<Dim>(a),
      p2g<Dim>(a),
      liquid_p2g<Dim>(a),
      forces_of_next_step<Dim>(a),
      prescribed_velocities<Dim>(a),
      output<Dim>(a),
  });
}

/// Newmark's method: what a step does when its displacement is known (implicit_stages()).
template <int Dim>
Stages<Dim> newmark(const Analysis& a, bool injects) {
  return in_order<Dim>({
      arrivals_and_injection<Dim>(a, injects),
      solved_motion<Dim>(a),
      rigid_contact<Dim>(a),
      strain_and_stress<Dim>(a),
      g2p<Dim>(a),
      outside_of_bodies<Dim>(a),
      location<Dim>(a),
      output<Dim>(a),
  });
}

/// G2P and stresses after a projection. Soil moves first: its strains are those of velocities that
/// particles give to nodes again.
template <int Dim>
Stages<Dim> motion_and_stress(const Analysis& a) {
  const Stages<Dim> motion = in_order<Dim>({liquid_g2p<Dim>(a), g2p<Dim>(a)});
  if (!maps_velocities_again(a)) return in_order<Dim>({projected_stress<Dim>(a), motion});
  return in_order<Dim>({motion, remapped_velocities<Dim>(a), projected_stress<Dim>(a)});
}

/// Projection: what a step does when the change of the pressure is known (projection_stages()).
template <int Dim>
Stages<Dim> projection(const Analysis& a, bool injects) {
  return in_order<Dim>({
      arrivals_and_injection<Dim>(a, injects),
      pressure_forces<Dim>(a),
      integration<Dim>(a),
      velocity_transfer<Dim>(a),
      motion_and_stress<Dim>(a),
      location<Dim>(a),
      output<Dim>(a),
  });
}

}  // namespace

/// Before it: velocities without the pressure's change, and the system that has it as solution.
template <int Dim>
Stages<Dim> projection_stages(const Analysis& a) {
  return in_order<Dim>({motion_before_projection<Dim>(a), pressure_system<Dim>(a)});
}

/// Before it: a displacement for which nothing is out of balance at the end of the step.
template <int Dim>
ImplicitStages<Dim> implicit_stages(const Analysis& a) {
  return {.begin = motion_before_solve<Dim>(a), .linearize = linear_system<Dim>(a)};
}

template <int Dim>
void append_solver_stages(const Analysis& analysis, Stages<Dim>& all) {
  const auto append = [&](const Stages<Dim>& list) {
    all.insert(all.end(), list.begin(), list.end());
  };
  if (is_implicit(analysis)) {
    const ImplicitStages<Dim> own = implicit_stages<Dim>(analysis);
    append(own.begin);
    append(own.linearize);
  } else {
    append(projection_stages<Dim>(analysis));
  }
  append(solver_stages<Dim>());
}
template void append_solver_stages<2>(const Analysis&, Stages<2>&);
template void append_solver_stages<3>(const Analysis&, Stages<3>&);

template Stages<2> projection_stages<2>(const Analysis&);
template Stages<3> projection_stages<3>(const Analysis&);
template ImplicitStages<2> implicit_stages<2>(const Analysis&);
template ImplicitStages<3> implicit_stages<3>(const Analysis&);

template <int Dim>
std::vector<TimestepStage<Dim>> timestep(const Analysis& analysis, bool injects) {
  switch (analysis.scheme) {
    case Scheme::usf:
      return usf<Dim>(analysis, injects);
    case Scheme::usl:
      return usl<Dim>(analysis, injects);
    case Scheme::musl:
      return musl<Dim>(analysis, injects);
    case Scheme::newmark:
      return newmark<Dim>(analysis, injects);
    case Scheme::projection:
      return projection<Dim>(analysis, injects);
  }
  return {};
}

template std::vector<TimestepStage<2>> timestep<2>(const Analysis&, bool);
template std::vector<TimestepStage<3>> timestep<3>(const Analysis&, bool);

}  // namespace lahar
