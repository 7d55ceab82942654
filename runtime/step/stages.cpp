// The stages that a time step consists of, one function each. What they do to a patch is in
// physics/kernels; which of them a scheme has, and in which order, in schemes.cpp. (Types of stages
// are written out: inside of braces alone GCC 12 fails.)
#include "runtime/step/stages.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "physics/basis/support.h"
#include "physics/contact/contact_surface.h"
#include "physics/kernels/driven_nodes.h"
#include "physics/kernels/general_kernels.h"
#include "physics/kernels/imbalance.h"
#include "physics/kernels/implicit.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/liquid_contact.h"
#include "physics/kernels/mean_volume.h"
#include "physics/kernels/node_supports.h"
#include "physics/kernels/projection.h"
#include "physics/kernels/rigid_contact.h"
#include "physics/kernels/separation.h"
#include "physics/kernels/stress_across.h"
#include "physics/kernels/two_phase.h"
#include "physics/kernels/velocity_transfer.h"

namespace lahar {

namespace {

/// Whether velocities that particles prescribe are mapped at the end of the step before. As
/// functions of time they are those in the middle of the step, whose length is not known there.
bool maps_prescribed_before(const Analysis& analysis) {
  return analysis.drives_nodes && !analysis.particles_follow_time;
}

/// The part of the mapping for this step that could not be done at the end of the one before.
template <int Dim, bool WithForce>
void map_unmapped(Patch<Dim>& patch, const StepContext<Dim>& step) {
  activate_nodes(patch);
  if (!patch.unmapped.empty()) {
    map_mass_momentum(patch, step, patch.unmapped);
    if (WithForce) map_force(patch, step, patch.unmapped);
    if (maps_prescribed_before(step.model->analysis)) map_prescribed(patch, step, patch.unmapped);
    if (WithForce) map_means(patch, step, patch.unmapped);
    if (step.model->analysis.two_phase) {
      map_liquid_mass_momentum(patch, step, patch.unmapped);
      if (WithForce) map_liquid_forces(patch, step, patch.unmapped);
    }
    patch.unmapped.clear();
    patch.contributes[static_cast<std::size_t>(step.step % 2)] = 1;
    patch.idle = false;
    patch.clear_sums = 0;
  }
  sort_if_scattered(patch);
  if (step.model->analysis.mean_volume) join_bins(patch);
}

/// Particles that neighbours sent.
template <int Dim, bool WithForce>
void take_arrivals(Patch<Dim>& patch, const StepContext<Dim>& step) {
  receive(patch);
  map_unmapped<Dim, WithForce>(patch, step);
}

/// Particles that come from nowhere.
template <int Dim, bool WithForce>
void take_injected(Patch<Dim>& patch, const StepContext<Dim>& step) {
  inject(patch, step);
  if (!patch.unmapped.empty()) map_unmapped<Dim, WithForce>(patch, step);
}

/// Sums for the next step begin at zero. A patch without particles is idle once all of its sums
/// are. Forces of the same exchange lie in the same lines and are cleared with them.
template <int Dim, bool WithForce>
void begin_mapping(Patch<Dim>& patch, const StepContext<Dim>& step) {
  (WithForce ? clear_sums_with<Dim> : clear_sums<Dim>)(patch, step, NodeSum::mass_momentum);
  patch.contributes[static_cast<std::size_t>(step.step % 2)] = patch.count > 0;
  patch.clear_sums = patch.count > 0 ? 0 : std::min(2, patch.clear_sums + 1);
  patch.idle = patch.clear_sums == 2;
}

/// Velocity gradients of a chunk, from one stage of a phase for the next: from G2P for stress, or
/// from stress for pore pressure. A buffer that all patches of a thread share stays in its cache.
template <int Dim>
VelocityGradients<Dim>& gradients_of_chunk() {
  static thread_local VelocityGradients<Dim> gradients;
  return gradients;
}

template <int Dim>
void find_across(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                 VelocityGradients<Dim>& gradients) {
  if constexpr (Dim == 2) find_gradients_across(patch, step, bins, gradients);
}

/// Work of tractions that goes with strains: of USL, which has the same velocities for both, all.
/// Projections count it with G2P.
template <int Dim>
void add_work_with_strains(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  if (is_projection(step.model->analysis)) return;
  const bool all = step.model->analysis.scheme == Scheme::usl;
  add_work_of_tractions(patch, step, bins, all ? WorkPart::all : WorkPart::sides);
}

/// update_stress() with gradients that are not those at particles alone, or are left for the pore
/// pressure. What forces do because they act at surfaces goes with strains.
template <int Dim>
void find_stress(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                 StressPart part) {
  const Analysis& analysis = step.model->analysis;
  const bool couples = analysis.rigid_bodies && part != StressPart::law;
  if (part != StressPart::law) add_work_with_strains(patch, step, bins);
  const bool special = analysis.mean_volume || deforms_across(analysis);
  VelocityGradients<Dim>* gradients = nullptr;
  if (!special && (analysis.two_phase || couples) && general::is(patch)) {
    gradients = &gradients_of_chunk<Dim>();
    general::find_gradients<Dim, Pack>(patch, step, bins, patch.velocity.data(), *gradients);
  }
  if (couples) count_couples(patch, step, bins, gradients);
  if (special) {
    gradients = &gradients_of_chunk<Dim>();
    if (analysis.mean_volume)
      find_mean_gradients(patch, step, bins, *gradients);
    else
      find_across(patch, step, bins, *gradients);
  }
  update_stress(patch, step, bins, part, gradients);
}

/// Of particles, and what presses on rigid bodies.
template <int Dim>
void find_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  if (step.model->analysis.rigid_bodies) press_liquid(patch, step, bins);
  update_pore_pressure(patch, step, bins, gradients_of_chunk<Dim>());
}

/// The filter of the velocity transfer, of orders from Order on: of each, a stage that gives nodes
/// what they gave to particles, and an exchange.
template <int Dim, int Order>
void add_filter(Stages<Dim>& list, int order) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  static constexpr bool first = Order == 2;
  TimestepStage<Dim> stage{.stage = {.name = fmt::format("filter {}", Order)}};
  if constexpr (!first) {
    stage.stage.exchange = "smoothed momentum";
    stage.takes = {sum_of_order(Order - 1)};
  }
  if (order < Order) {
    stage.stage.name = "filtered";
    stage.begin = [](P& p, S& s) {
      raise_filter(p, s, Order - 1);
      finish_filter(p, s);
    };
    list.push_back(stage);
    return;
  }
  stage.begin = [](P& p, S& s) {
    if constexpr (first)
      begin_filter(p, s);
    else
      raise_filter(p, s, Order - 1);
    clear_sums(p, s, sum_of_order(Order));
  };
  stage.bins = [](P& p, S& s, ParticleBins bins) { map_smoothed(p, s, bins, Order); };
  list.push_back(stage);
  if constexpr (Order <= most_transfer_order) add_filter<Dim, Order + 1>(list, order);
}

template <int Dim>
Stages<Dim> map_of_prescribed(bool of_next_step) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  TimestepStage<Dim> map{.stage = {.name = "prescribed"},
                         .begin = [](P& p, S& s) { clear_prescribed(p, s); },
                         .bins = [](P& p, S& s, ParticleBins bins) { map_prescribed(p, s, bins); },
                         .of_next_step = of_next_step};
  map.stage.needs_dt = !of_next_step;
  return {map};
}

/// With the stage that gives nodes their velocities: records of traces hold few stages of a phase.
template <int Dim>
void show_if_wanted(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (step.model->analysis.shows_nodes) show_nodes(patch, step);
}

/// With USF nodal velocities come before stresses, else the same exchange brings momentum and
/// force.
bool one_exchange(const Analysis& analysis) {
  return analysis.scheme != Scheme::usf;
}

bool bodies_meet(const Analysis& analysis) {
  return analysis.contact.bodies > 1;
}

/// Let a stage wait for the masses of nodes, the first exchange of sums in a step.
template <int Dim>
void take_masses(TimestepStage<Dim>& stage, const Analysis& analysis) {
  stage.stage.exchange = "mass, momentum";
  stage.takes = {NodeSum::mass_momentum};
  if (!one_exchange(analysis)) return;
  stage.stage.exchange += ", force";
  stage.takes.push_back(NodeSum::force);
}

}  // namespace

bool maps_force_with_momentum(const Analysis& analysis) {
  return one_exchange(analysis) && !analysis.mean_volume;
}

bool stress_follows_g2p(const Analysis& analysis) {
  return analysis.scheme == Scheme::usl && !analysis.pressure_smoothing && !analysis.two_phase &&
         !deforms_across(analysis) && gives_gradients(analysis);
}

template <int Dim>
Stages<Dim> arrivals(const Analysis& analysis) {
  const bool force = maps_force_with_momentum(analysis);
  if (begins_with_solve(analysis))  // they are delivered before it, at rest
    return {TimestepStage<Dim>{.stage = {.name = "arrivals", .exchange = "particles"}}};
  return {
      TimestepStage<Dim>{.stage = {.name = "arrivals", .exchange = "particles"},
                         .begin = force ? take_arrivals<Dim, true> : take_arrivals<Dim, false>}};
}

template <int Dim>
Stages<Dim> injection(const Analysis& analysis) {
  const bool force = maps_force_with_momentum(analysis);
  return {
      TimestepStage<Dim>{.stage = {.name = "inject"},
                         .begin = force ? take_injected<Dim, true> : take_injected<Dim, false>}};
}

template <int Dim>
Stages<Dim> meeting_bodies(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!bodies_meet(analysis)) return {};
  TimestepStage<Dim> surface{
      .stage = {.name = "surface"},
      .begin =
          [](P& p, S& s) {
            find_nodes_between(p, s);
            if (!p.contact.nodes_between.empty()) clear_sums(p, s, NodeSum::gradient);
          },
      .bins =
          [](P& p, S& s, ParticleBins bins) {
            for_bins_between(p, bins, [&](ParticleBins some) { map_gradient(p, s, some); });
          }};
  take_masses(surface, analysis);
  return {
      surface,
      TimestepStage<Dim>{.stage = {.name = "normals", .exchange = "gradient"},
                         .takes = {NodeSum::gradient},
                         .begin = [](P& p, S& s) { set_directions(p, s); },
                         .bins = [](P& p, S& s, ParticleBins bins) { map_surface(p, s, bins); }},
      TimestepStage<Dim>{.stage = {.name = "gaps", .exchange = "surface"},
                         .takes = {NodeSum::surface, NodeSum::surface_around},
                         .begin = [](P& p, S& s) { meet_bodies(p, s); }}};
}

template <int Dim>
Stages<Dim> driven_nodes(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!analysis.drives_nodes) return {};
  Stages<Dim> list;
  if (!maps_prescribed_before(analysis)) list = map_of_prescribed<Dim>(false);
  list.push_back(
      TimestepStage<Dim>{.stage = {.name = "drive", .exchange = "prescribed velocities"},
                         .takes = {NodeSum::prescribed_mass, NodeSum::prescribed_momentum},
                         .begin = [](P& p, S& s) { find_driven_nodes(p, s); }});
  return list;
}

template <int Dim>
Stages<Dim> nodal_velocities(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  TimestepStage<Dim> both{.stage = {.name = "velocity"},
                          .begin = [](P& p, S& s) { nodal_velocity(p, s); }};
  if (!bodies_meet(analysis)) take_masses(both, analysis);
  both.stage.needs_dt = analysis.nodes_follow_time;  // prescribed in the middle of the step
  if (!analysis.two_phase) return {both};
  both.takes.push_back(NodeSum::liquid_mass_momentum);
  return {both, TimestepStage<Dim>{.stage = {.name = "liquid velocity"},
                                   .begin = [](P& p, S& s) { liquid_velocity(p, s); }}};
}

template <int Dim>
Stages<Dim> remapped_velocities(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  const TimestepStage<Dim> remap{
      .stage = {.name = "P2G remap"},
      .begin = [](P& p, S& s) { clear_sums(p, s, NodeSum::momentum); },
      .bins = [](P& p, S& s, ParticleBins bins) { map_momentum(p, s, bins); }};
  TimestepStage<Dim> velocity{.stage = {.name = "velocity", .exchange = "momentum"},
                              .takes = {NodeSum::momentum},
                              .begin = [](P& p, S& s) { nodal_velocity_again(p, s); }};
  if (!analysis.two_phase || is_projection(analysis)) return {remap, velocity};
  velocity.takes.push_back(NodeSum::liquid_momentum);
  return {remap,
          TimestepStage<Dim>{
              .stage = {.name = "P2G remap of liquid"},
              .begin = [](P& p, S& s) { clear_sums(p, s, NodeSum::liquid_momentum); },
              .bins = [](P& p, S& s, ParticleBins bins) { map_liquid_momentum(p, s, bins); }},
          velocity,
          TimestepStage<Dim>{.stage = {.name = "liquid velocity"},
                             .begin = [](P& p, S& s) { liquid_velocity_again(p, s); }}};
}

template <int Dim>
Stages<Dim> strain_and_stress(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  const bool needs_dt = analysis.scheme == Scheme::usf;
  if (analysis.pressure_smoothing)  // nodal pressure is exchanged in between
    return {TimestepStage<Dim>{.stage = {.name = "strain", .needs_dt = needs_dt},
                               .begin = [](P& p, S& s) { clear_sums(p, s, NodeSum::pressure); },
                               .bins =
                                   [](P& p, S& s, ParticleBins bins) {
                                     add_work_with_strains(p, s, bins);
                                     if (s.model->analysis.rigid_bodies) count_couples(p, s, bins);
                                     update_stress(p, s, bins, StressPart::strain);
                                     map_pressure(p, s, bins);
                                   }},
            TimestepStage<Dim>{.stage = {.name = "stress", .exchange = "pressure"},
                               .takes = {NodeSum::pressure},
                               .begin = [](P& p, S& s) { nodal_pressure(p, s); },
                               .bins =
                                   [](P& p, S& s, ParticleBins bins) {
                                     smooth_pressure(p, s, bins);
                                     find_stress(p, s, bins, StressPart::law);
                                   }}};
  if (is_implicit(analysis))
    return {TimestepStage<Dim>{
        .stage = {.name = "stress"}, .bins = [](P& p, S& s, ParticleBins bins) {
          find_displacement_gradients(p, s, bins, gradients_of_chunk<Dim>());
          update_stress(p, s, bins, StressPart::both, &gradients_of_chunk<Dim>());
        }}};
  if (stress_follows_g2p(analysis))
    return {TimestepStage<Dim>{
        .stage = {.name = "stress"}, .bins = [](P& p, S& s, ParticleBins bins) {
          if (s.model->analysis.mean_volume)
            take_mean_volume(p, s, bins, gradients_of_chunk<Dim>());
          update_stress(p, s, bins, StressPart::both, &gradients_of_chunk<Dim>());
        }}};
  return {TimestepStage<Dim>{
      .stage = {.name = "stress", .needs_dt = needs_dt},
      .bins = [](P& p, S& s, ParticleBins bins) { find_stress(p, s, bins, StressPart::both); }}};
}

template <int Dim>
Stages<Dim> pore_pressure(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!analysis.two_phase) return {};
  TimestepStage<Dim> update{
      .stage = {.name = "pore pressure"},
      .bins = [](P& p, S& s, ParticleBins bins) { find_pore_pressure(p, s, bins); }};
  if (has_nodal_porosity(analysis)) update.begin = [](P& p, S&) { liquid_discharge(p); };
  if (!maps_pore_pressure(analysis)) return {update};
  update.begin = [](P& p, S& s) {
    liquid_discharge(p);
    clear_sums(p, s, NodeSum::pore_pressure);
  };
  update.bins = [](P& p, S& s, ParticleBins bins) {
    find_pore_pressure(p, s, bins);
    map_pore_pressure(p, s, bins);
  };
  return {update,
          TimestepStage<Dim>{
              .stage = {.name = "nodal pore pressure", .exchange = "pore pressure"},
              .takes = {NodeSum::pore_pressure},
              .begin = [](P& p, S& s) { nodal_pore_pressure(p, s); },
              .bins = [](P& p, S& s, ParticleBins bins) { take_pore_pressure(p, s, bins); }}};
}

template <int Dim>
Stages<Dim> mapped_means(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!analysis.takes_means) return {};
  return {TimestepStage<Dim>{.stage = {.name = "map means"},
                             .begin = [](P& p, S& s) { clear_means(p, s); },
                             .bins = [](P& p, S& s, ParticleBins bins) { map_means(p, s, bins); },
                             .of_next_step = maps_force_with_momentum(analysis)}};
}

template <int Dim>
Stages<Dim> node_means(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!analysis.takes_means) return {};
  return {TimestepStage<Dim>{.stage = {.name = "means", .exchange = "displacement, waves"},
                             .takes = {NodeSum::displacement, NodeSum::waves},
                             .begin = [](P& p, S& s) { set_node_means(p, s); }}};
}

template <int Dim>
Stages<Dim> integration(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  const bool with_velocity = one_exchange(analysis);
  TimestepStage<Dim> nodes{.stage = {.name = "integrate", .exchange = "force"},
                           .takes = {NodeSum::force},
                           .begin = [](P& p, S& s) {
                             integrate(p, s);
                             find_supports(p, s);
                             show_if_wanted(p, s);
                           }};
  if (with_velocity) {
    if (bodies_meet(analysis))  // the masses are there
      nodes.stage.exchange.clear(), nodes.takes.clear();
    else
      take_masses(nodes, analysis);
    nodes.stage.needs_dt = true;
    if (needs_kept_pressure(analysis)) nodes.takes.push_back(NodeSum::kept_pressure);
    nodes.begin = [](P& p, S& s) {
      velocity_and_integrate(p, s);
      find_supports(p, s);
      show_if_wanted(p, s);
    };
  }
  if (!analysis.two_phase) return {nodes};
  TimestepStage<Dim> liquid{.stage = nodes.stage, .takes = std::exchange(nodes.takes, {})};
  liquid.stage.name = "liquid forces";
  nodes.stage = {.name = "integrate"};
  if (with_velocity) liquid.takes.push_back(NodeSum::liquid_mass_momentum);
  for (const NodeSum kind : {NodeSum::liquid_force, NodeSum::drag}) liquid.takes.push_back(kind);
  if (analysis.liquid_advection) liquid.takes.push_back(NodeSum::advection);
  liquid.begin = [](P& p, S& s) { lahar::liquid_forces(p, s); };
  if (with_velocity)
    liquid.begin = [](P& p, S& s) {
      liquid_velocity(p, s);
      lahar::liquid_forces(p, s);
    };
  return {liquid, nodes,
          TimestepStage<Dim>{.stage = {.name = "integrate liquid"}, .begin = [](P& p, S& s) {
                               integrate_liquid(p, s);
                               add_supports_of_liquid(p, s);
                             }}};
}

template <int Dim>
Stages<Dim> unbalanced_forces(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!analysis.until.on()) return {};
  return {TimestepStage<Dim>{.stage = {.name = "imbalance"},
                             .begin = [](P& p, S& s) { find_unbalanced(p, s); }}};
}

template <int Dim>
Stages<Dim> velocity_transfer(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  Stages<Dim> list;
  if (spreads_before_forces(analysis))
    list.push_back(
        {.stage = {.name = "affine"}, .begin = [](P& p, S& s) { velocities_before_forces(p, s); }});
  if (separates(analysis))
    list.push_back({.stage = {.name = "held"}, .begin = [](P& p, S& s) { find_held_nodes(p, s); }});
  if (has_filter(analysis.transfer)) add_filter<Dim, 2>(list, analysis.transfer.order);
  return list;
}

template <int Dim>
Stages<Dim> rigid_contact(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!analysis.rigid_bodies) return {};
  return {
      TimestepStage<Dim>{.stage = {.name = "rigid bodies"},
                         .begin = [](P& p, S& s) { begin_contact(p, s); },
                         .bins = [](P& p, S& s, ParticleBins bins) { touch_bodies(p, s, bins); },
                         .end = [](P& p, S& s) { end_contact(p, s); }}};
}

template <int Dim>
Stages<Dim> outside_of_bodies(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!analysis.rigid_bodies) return {};
  return {
      TimestepStage<Dim>{.stage = {.name = "outside"},
                         .bins = [](P& p, S& s, ParticleBins bins) { keep_outside(p, s, bins); }}};
}

template <int Dim>
Stages<Dim> g2p(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  TimestepStage<Dim> stage{.stage = {.name = "G2P"}, .begin = [](P& p, S&) { p.max_speed = 0; }};
  if (is_implicit(analysis))
    stage.bins = [](P& p, S& s, ParticleBins bins) { move_particles(p, s, bins); };
  else if (stress_follows_g2p(analysis))
    stage.bins = [](P& p, S& s, ParticleBins bins) {
      add_work_of_tractions(p, s, bins, WorkPart::all);
      update_particles(p, s, bins, &gradients_of_chunk<Dim>());
    };
  else if (analysis.scheme == Scheme::usl)  // where stress comes first, it adds the work
    stage.bins = [](P& p, S& s, ParticleBins bins) { update_particles(p, s, bins); };
  else
    stage.bins = [](P& p, S& s, ParticleBins bins) {
      const bool all = is_projection(s.model->analysis);
      add_work_of_tractions(p, s, bins, all ? WorkPart::all : WorkPart::centres);
      update_particles(p, s, bins);
    };
  return {stage};
}

template <int Dim>
Stages<Dim> liquid_g2p(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!analysis.two_phase) return {};
  return {
      TimestepStage<Dim>{.stage = {.name = "G2P of liquid"},
                         .bins = [](P& p, S& s, ParticleBins bins) { update_liquid(p, s, bins); }}};
}

namespace {

/// Particles limit the steps.
bool finds_limits(const Analysis& analysis) {
  return analysis.step.adaptive && !is_implicit(analysis);
}

}  // namespace

template <int Dim>
Stages<Dim> location(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  return {TimestepStage<Dim>{
      .stage = {.name = locate_stage, .gives_dt = finds_limits(analysis) || analysis.free_bodies},
      .begin =
          [](P& p, S&) {
            clear_outboxes(p);
            p.time_step_limit = std::numeric_limits<double>::infinity();
          },
      .bins =
          [](P& p, S& s, ParticleBins bins) {
            if (finds_limits(s.model->analysis))  // before particles leave: none is missed
              p.time_step_limit = std::min(p.time_step_limit, time_step_limit(p, *s.model, bins));
            locate(p, s, bins);
          },
      .end = [](P& p, S& s) { place_movers(p, s); }}};
}

template <int Dim>
Stages<Dim> p2g(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  // Neighbours may still read forces of this step, unless the next ones are elsewhere.
  const bool force =
      one_exchange(analysis) || node_sum_copies(analysis).of[sum_array(NodeSum::force)] > 1;
  return {TimestepStage<Dim>{
      .stage = {.name = "P2G"},
      .begin = force ? begin_mapping<Dim, true> : begin_mapping<Dim, false>,
      .bins = [](P& p, S& s, ParticleBins bins) { map_mass_momentum(p, s, bins); },
      .of_next_step = true}};
}

template <int Dim>
Stages<Dim> forces(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  const bool next = maps_force_with_momentum(analysis);
  return {TimestepStage<Dim>{
      .stage = {.name = "force"},
      .begin = one_exchange(analysis)  // P2G has begun with these sums, too
                   ? nullptr
                   : +[](P& p, S& s) { clear_sums(p, s, NodeSum::force); },
      .bins = analysis.mean_volume
                  ? +[](P& p, S& s, ParticleBins bins) { map_mean_force(p, s, bins); }
                  : +[](P& p, S& s, ParticleBins bins) { map_force(p, s, bins); },
      .of_next_step = next}};
}

template <int Dim>
Stages<Dim> liquid_p2g(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!analysis.two_phase) return {};
  return {TimestepStage<Dim>{
      .stage = {.name = "P2G of liquid"},
      .begin = [](P& p, S& s) { clear_sums(p, s, NodeSum::liquid_mass_momentum); },
      .bins = [](P& p, S& s, ParticleBins bins) { map_liquid_mass_momentum(p, s, bins); },
      .of_next_step = true}};
}

template <int Dim>
Stages<Dim> liquid_forces(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!analysis.two_phase) return {};
  return {TimestepStage<Dim>{
      .stage = {.name = "pore pressure force"},
      .begin =
          [](P& p, S& s) {
            clear_sums(p, s, NodeSum::liquid_force);
            clear_sums(p, s, NodeSum::drag);
            if (s.model->analysis.liquid_advection) clear_sums(p, s, NodeSum::advection);
          },
      .bins = [](P& p, S& s, ParticleBins bins) { map_liquid_forces(p, s, bins); },
      .of_next_step = maps_force_with_momentum(analysis)}};
}

template <int Dim>
Stages<Dim> prescribed_velocities(const Analysis& analysis) {
  return maps_prescribed_before(analysis) ? map_of_prescribed<Dim>(true) : Stages<Dim>{};
}

template <int Dim>
Stages<Dim> solved_motion(const Analysis&) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  return {TimestepStage<Dim>{.stage = {.name = "solved motion"}, .begin = [](P& p, S& s) {
                               find_supports_of_implicit(p, s);
                               end_implicit_step(p, s);
                               show_if_wanted(p, s);
                             }}};
}

template <int Dim>
Stages<Dim> motion_before_solve(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  TimestepStage<Dim> map{.stage = {.name = "P2G"},
                         .begin =
                             [](P& p, S& s) {
                               p.contributes[static_cast<std::size_t>(s.step % 2)] = p.count > 0;
                               if (p.active_nodes.empty()) return;
                               clear_sums(p, s, NodeSum::mass_momentum);
                               if (!s.model->analysis.implicit.quasi_static)
                                 clear_sums(p, s, NodeSum::inertia);
                             },
                         .bins =
                             [](P& p, S& s, ParticleBins bins) {
                               map_mass_momentum(p, s, bins);
                               if (!s.model->analysis.implicit.quasi_static)
                                 map_inertia(p, s, bins);
                             }};
  TimestepStage<Dim> begin{.stage = {.name = "motion", .exchange = "mass, momentum, inertia"},
                           .takes = {NodeSum::mass_momentum},
                           .begin = [](P& p, S& s) {
                             begin_implicit_step(p, s);
                             if (!s.model->analysis.rigid_bodies) return;
                             StepContext<Dim> step = s;
                             step.time -= s.dt;  // solves have the end of the step
                             begin_contact(p, step);
                           }};
  if (!analysis.implicit.quasi_static) begin.takes.push_back(NodeSum::inertia);
  return {map, begin};
}

template <int Dim>
Stages<Dim> linear_system(const Analysis&) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  return {TimestepStage<Dim>{.stage = {.name = "linearize"},
                             .begin = [](P& p, S& s) { clear_system(p, s); },
                             .bins = [](P& p, S& s, ParticleBins bins) { linearize(p, s, bins); },
                             .end = [](P& p, S& s) { complete_matrix(p, s); }},
          TimestepStage<Dim>{.stage = {.name = "balance",
                                       .exchange = "unbalanced force",
                                       .gives_dt = true,
                                       .needs_dt = true},
                             .takes = {NodeSum::residual},
                             .begin = [](P& p, S& s) { close_system(p, s); }}};
}

namespace {

/// Forces of particles, for velocities to which the pressure's change is missing.
template <int Dim>
void map_forces_before_projection(Patch<Dim>& patch, const StepContext<Dim>& step,
                                  ParticleBins bins) {
  const Analysis& analysis = step.model->analysis;
  if (!analysis.two_phase) update_shear_stress(patch, step, bins);
  map_force(patch, step, bins);
  if (analysis.two_phase)
    map_liquid_forces(patch, step, bins);
  else if (analysis.projection.kept < 1.0)
    leave_out_pressure(patch, step, bins);
}

template <int Dim>
void clear_before_projection(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const Analysis& analysis = step.model->analysis;
  patch.contributes[static_cast<std::size_t>(step.step % 2)] = patch.count > 0;
  patch.idle = false;
  patch.projection.work = patch.work;
  if (patch.active_nodes.empty()) return;
  clear_sums_with(patch, step, NodeSum::mass_momentum);
  if (needs_kept_pressure(analysis)) clear_sums(patch, step, NodeSum::kept_pressure);
  if (!analysis.two_phase) return;
  clear_sums_with(patch, step, NodeSum::liquid_mass_momentum);
  clear_sums(patch, step, NodeSum::drag);
}

template <int Dim>
void map_masses_before_projection(Patch<Dim>& patch, const StepContext<Dim>& step,
                                  ParticleBins bins) {
  const Analysis& analysis = step.model->analysis;
  map_mass_momentum(patch, step, bins);
  if (analysis.two_phase) map_liquid_mass_momentum(patch, step, bins);
  if (needs_kept_pressure(analysis)) map_kept_pressure(patch, step, bins);
}

}  // namespace

template <int Dim>
Stages<Dim> motion_before_projection(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  Stages<Dim> list{TimestepStage<Dim>{
      .stage = {.name = "P2G"},
      .begin = [](P& p, S& s) { clear_before_projection(p, s); },
      .bins = [](P& p, S& s, ParticleBins bins) { map_masses_before_projection(p, s, bins); }}};
  TimestepStage<Dim> forces{.stage = {.name = "force"}, .bins = [](P& p, S& s, ParticleBins bins) {
                              map_forces_before_projection(p, s, bins);
                            }};
  const Stages<Dim> nodes = integration<Dim>(analysis);
  if (!analysis.two_phase) {  // shear stress follows from the velocities
    forces.stage.exchange = nodes.front().stage.exchange;
    forces.takes = nodes.front().takes;
    forces.begin = [](P& p, S& s) { nodal_velocity(p, s); };
  }
  list.push_back(forces);
  list.insert(list.end(), nodes.begin(), nodes.end());
  return list;
}

template <int Dim>
Stages<Dim> pressure_system(const Analysis&) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  return {TimestepStage<Dim>{
              .stage = {.name = "divergence"},
              .begin =
                  [](P& p, S& s) {
                    // Nodes are integrated once more, with the pressure; stress has done its work.
                    p.projection.work.internal = p.work.internal;
                    p.work = p.projection.work;
                    begin_pressure_system(p, s);
                  },
              .bins = [](P& p, S& s, ParticleBins bins) { add_to_pressure_system(p, s, bins); },
              .end = [](P& p, S& s) { end_pressure_system(p, s); }},
          TimestepStage<Dim>{
              .stage = {.name = "pressure system", .exchange = "divergence", .gives_dt = true},
              .takes = {NodeSum::divergence},
              .begin = [](P& p, S& s) { close_pressure_system(p, s); }}};
}

template <int Dim>
Stages<Dim> pressure_forces(const Analysis&) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  return {TimestepStage<Dim>{
      .stage = {.name = "pressure force"},
      .begin = [](P& p, S& s) { begin_pressure_forces(p, s); },
      .bins = [](P& p, S& s, ParticleBins bins) { add_pressure_forces(p, s, bins); }}};
}

template <int Dim>
Stages<Dim> projected_stress(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  if (!analysis.two_phase)
    return {TimestepStage<Dim>{
        .stage = {.name = "pressure"},
        .bins = [](P& p, S& s, ParticleBins bins) { change_pressure(p, s, bins); }}};
  Stages<Dim> list = strain_and_stress<Dim>(analysis);
  list.push_back(TimestepStage<Dim>{
      .stage = {.name = "pore pressure"},
      .bins = [](P& p, S& s, ParticleBins bins) { change_pore_pressure(p, s, bins); }});
  return list;
}

template <int Dim>
Stages<Dim> output(const Analysis&) {
  return {TimestepStage<Dim>{.stage = {.name = output_stage}}};
}

#define LAHAR_INSTANTIATE(Dim)                                         \
  template Stages<Dim> arrivals<Dim>(const Analysis&);                 \
  template Stages<Dim> injection<Dim>(const Analysis&);                \
  template Stages<Dim> meeting_bodies<Dim>(const Analysis&);           \
  template Stages<Dim> driven_nodes<Dim>(const Analysis&);             \
  template Stages<Dim> nodal_velocities<Dim>(const Analysis&);         \
  template Stages<Dim> remapped_velocities<Dim>(const Analysis&);      \
  template Stages<Dim> strain_and_stress<Dim>(const Analysis&);        \
  template Stages<Dim> pore_pressure<Dim>(const Analysis&);            \
  template Stages<Dim> mapped_means<Dim>(const Analysis&);             \
  template Stages<Dim> node_means<Dim>(const Analysis&);               \
  template Stages<Dim> integration<Dim>(const Analysis&);              \
  template Stages<Dim> unbalanced_forces<Dim>(const Analysis&);        \
  template Stages<Dim> velocity_transfer<Dim>(const Analysis&);        \
  template Stages<Dim> rigid_contact<Dim>(const Analysis&);            \
  template Stages<Dim> outside_of_bodies<Dim>(const Analysis&);        \
  template Stages<Dim> g2p<Dim>(const Analysis&);                      \
  template Stages<Dim> liquid_g2p<Dim>(const Analysis&);               \
  template Stages<Dim> location<Dim>(const Analysis&);                 \
  template Stages<Dim> p2g<Dim>(const Analysis&);                      \
  template Stages<Dim> liquid_p2g<Dim>(const Analysis&);               \
  template Stages<Dim> forces<Dim>(const Analysis&);                   \
  template Stages<Dim> liquid_forces<Dim>(const Analysis&);            \
  template Stages<Dim> prescribed_velocities<Dim>(const Analysis&);    \
  template Stages<Dim> solved_motion<Dim>(const Analysis&);            \
  template Stages<Dim> motion_before_solve<Dim>(const Analysis&);      \
  template Stages<Dim> linear_system<Dim>(const Analysis&);            \
  template Stages<Dim> motion_before_projection<Dim>(const Analysis&); \
  template Stages<Dim> pressure_system<Dim>(const Analysis&);          \
  template Stages<Dim> pressure_forces<Dim>(const Analysis&);          \
  template Stages<Dim> projected_stress<Dim>(const Analysis&);         \
  template Stages<Dim> output<Dim>(const Analysis&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
