#include "runtime/step/timestep.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "physics/basis/support.h"
#include "physics/contact/contact_surface.h"
#include "physics/kernels/driven_nodes.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/separation.h"
#include "physics/kernels/velocity_transfer.h"

namespace lahar {

namespace {

/// The part of the mapping for this step that could not be done at the end of the one before.
template <int Dim, bool WithForce>
void map_late(Patch<Dim>& patch, const StepContext<Dim>& step) {
  activate_nodes(patch);
  if (!patch.late.empty()) {
    map_mass_momentum(patch, step, patch.late);
    if (WithForce) map_force(patch, step, patch.late);
    if (patch.bodies() > 1) map_gradient(patch, step, patch.late);
    if (step.model->analysis.drives_nodes) map_prescribed(patch, step, patch.late);
    if (WithForce) map_waves(patch, step, patch.late);
    patch.late.clear();
    patch.contributes[static_cast<std::size_t>(step.step % 2)] = 1;
    patch.idle = false;
    patch.clear_sums = 0;
  }
  sort_if_scattered(patch);
}

/// Particles that neighbours sent.
template <int Dim, bool WithForce>
void take_arrivals(Patch<Dim>& patch, const StepContext<Dim>& step) {
  receive(patch);
  map_late<Dim, WithForce>(patch, step);
}

/// Particles that come from nowhere.
template <int Dim, bool WithForce>
void take_injected(Patch<Dim>& patch, const StepContext<Dim>& step) {
  inject(patch, step);
  if (!patch.late.empty()) map_late<Dim, WithForce>(patch, step);
}

/// Sums for the next step begin at zero. A patch without particles is idle once all of its sums
/// are. Forces that are mapped in the same phase lie in the same lines and are cleared with them.
template <int Dim, bool WithForce>
void begin_mapping(Patch<Dim>& patch, const StepContext<Dim>& step) {
  (WithForce ? clear_sums_with<Dim> : clear_sums<Dim>)(patch, step, NodeSum::mass_momentum);
  patch.contributes[static_cast<std::size_t>(step.step % 2)] = patch.count > 0;
  patch.clear_sums = patch.count > 0 ? 0 : std::min(2, patch.clear_sums + 1);
  patch.idle = patch.clear_sums == 2;
}

/// Whether stress takes what G2P finds of velocity gradients: with USL both take the same nodal
/// velocities at the same places.
bool joins_gradients(const Analysis& analysis) {
  return analysis.scheme == Scheme::usl && !analysis.pressure_smoothing &&
         gives_gradients(analysis);
}

/// Velocity gradients of a chunk from G2P, for its stress. A buffer that all patches of a thread
/// share stays in its cache.
template <int Dim>
VelocityGradients<Dim>& gradients_of_chunk() {
  static thread_local VelocityGradients<Dim> gradients;
  return gradients;
}

/// The filter of the velocity transfer, of orders from Order on: of each, a stage that gives nodes
/// what they gave to particles, and an exchange.
template <int Dim, int Order>
void add_filter(std::vector<TimestepStage<Dim>>& list, int order) {
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
  stage.runs = [](P& p, S& s, Runs runs) { map_smoothed(p, s, runs, Order); };
  list.push_back(stage);
  if constexpr (Order <= most_transfer_order) add_filter<Dim, Order + 1>(list, order);
}

}  // namespace

NodeSumCopies node_sum_copies(const Analysis& analysis) {
  // With one exchange per step nothing else keeps a patch from overtaking its neighbours' reading.
  const int copies = analysis.scheme == Scheme::usl ? 2 : 1;
  const bool more = analysis.scheme == Scheme::musl || analysis.pressure_smoothing;
  // Gradients, waves and prescribed velocities are read before the phase in which the next ones are
  // mapped is begun anywhere near.
  return {{copies, more ? 1 : 0, analysis.contact.bodies > 1 ? 1 : 0, analysis.absorbs ? 1 : 0,
           analysis.drives_nodes ? 1 : 0, has_filter(analysis.transfer) ? 1 : 0}};
}

bool keeps_nodal_state(const Analysis& analysis) {
  return analysis.scheme != Scheme::usl || analysis.pressure_smoothing ||
         has_filter(analysis.transfer);
}

template <int Dim>
std::vector<TimestepStage<Dim>> timestep(const Analysis& analysis, bool injects) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  using List = std::vector<TimestepStage<Dim>>;
  const bool usf = analysis.scheme == Scheme::usf, musl = analysis.scheme == Scheme::musl;

  const TimestepStage<Dim> arrivals{
      .stage = {.name = "arrivals", .exchange = "particles"},
      .begin = usf ? take_arrivals<Dim, false> : take_arrivals<Dim, true>};
  const TimestepStage<Dim> injection{
      .stage = {.name = "inject"},
      .begin = usf ? take_injected<Dim, false> : take_injected<Dim, true>};
  const bool joined = joins_gradients(analysis);
  TimestepStage<Dim> g2p{.stage = {.name = "G2P"},
                         .begin = [](P& p, S&) { p.max_speed = 0; },
                         .runs = [](P& p, S& s, Runs runs) { update_particles(p, s, runs); }};
  if (joined)
    g2p.runs = [](P& p, S& s, Runs runs) {
      add_work_of_tractions(p, s, runs);
      update_particles(p, s, runs, &gradients_of_chunk<Dim>());
    };
  else if (usf || musl)
    g2p.runs = [](P& p, S& s, Runs runs) {
      add_work_of_tractions(p, s, runs);
      update_particles(p, s, runs);
    };
  const TimestepStage<Dim> locate{
      .stage = {.name = locate_stage, .gives_dt = analysis.step.adaptive},
      .begin =
          [](P& p, S&) {
            clear_outboxes(p);
            p.time_step_limit = std::numeric_limits<double>::infinity();
          },
      .runs =
          [](P& p, S& s, Runs runs) {
            if (s.model->analysis.step.adaptive)  // before particles leave, so that none is missed
              p.time_step_limit = std::min(p.time_step_limit, time_step_limit(p, *s.model, runs));
            lahar::locate(p, s, runs);
          },
      .end = [](P& p, S& s) { place_movers(p, s); }};
  const TimestepStage<Dim> p2g{.stage = {.name = "P2G"},
                               .begin = usf ? begin_mapping<Dim, false> : begin_mapping<Dim, true>,
                               .runs = [](P& p, S& s, Runs runs) { map_mass_momentum(p, s, runs); },
                               .of_next_step = true};
  const TimestepStage<Dim> surface{.stage = {.name = "surface"},
                                   .begin = [](P& p, S& s) { clear_sums(p, s, NodeSum::gradient); },
                                   .runs = [](P& p, S& s, Runs runs) { map_gradient(p, s, runs); },
                                   .of_next_step = true};
  const TimestepStage<Dim> normals{.stage = {.name = "normals", .exchange = "gradient"},
                                   .takes = {NodeSum::gradient},
                                   .begin =
                                       [](P& p, S& s) {
                                         nodal_gradient(p, s);
                                         clear_sums(p, s, NodeSum::surface);
                                       },
                                   .runs = [](P& p, S& s, Runs runs) { map_surface(p, s, runs); }};
  const TimestepStage<Dim> gaps{.stage = {.name = "gaps", .exchange = "surface"},
                                .takes = {NodeSum::surface},
                                .begin = [](P& p, S& s) { meet_bodies(p, s); }};
  const TimestepStage<Dim> prescribed{
      .stage = {.name = "prescribed"},
      .begin = [](P& p, S& s) { clear_prescribed(p, s); },
      .runs = [](P& p, S& s, Runs runs) { map_prescribed(p, s, runs); },
      .of_next_step = true};
  const TimestepStage<Dim> drive{.stage = {.name = "drive", .exchange = "prescribed velocities"},
                                 .takes = {NodeSum::prescribed_mass, NodeSum::prescribed_momentum},
                                 .begin = [](P& p, S& s) { find_driven_nodes(p, s); }};
  const TimestepStage<Dim> force{
      .stage = {.name = "force"},
      .begin = usf ? +[](P& p, S& s) { clear_sums(p, s, NodeSum::force); } : nullptr,
      .runs = [](P& p, S& s, Runs runs) { map_force(p, s, runs); },
      .of_next_step = !usf};
  const TimestepStage<Dim> waves{.stage = {.name = "waves"},
                                 .begin = [](P& p, S& s) { clear_waves(p, s); },
                                 .runs = [](P& p, S& s, Runs runs) { map_waves(p, s, runs); },
                                 .of_next_step = !usf};
  const TimestepStage<Dim> absorb{.stage = {.name = "absorb", .exchange = "displacement, waves"},
                                  .takes = {NodeSum::displacement, NodeSum::waves},
                                  .begin = [](P& p, S& s) { set_absorbing_nodes(p, s); }};
  const TimestepStage<Dim> output{.stage = {.name = output_stage}};

  // Strain and stress: one stage, or two with the exchange of nodal pressure between them.
  List stress;
  if (analysis.pressure_smoothing) {
    stress = {{.stage = {.name = "strain", .needs_dt = usf},
               .begin = [](P& p, S& s) { clear_sums(p, s, NodeSum::pressure); },
               .runs =
                   [](P& p, S& s, Runs runs) {
                     if (s.model->analysis.scheme == Scheme::usl) add_work_of_tractions(p, s, runs);
                     update_stress(p, s, runs, StressPart::strain);
                     map_pressure(p, s, runs);
                   }},
              {.stage = {.name = "stress", .exchange = "pressure"},
               .takes = {NodeSum::pressure},
               .begin = [](P& p, S& s) { nodal_pressure(p, s); },
               .runs =
                   [](P& p, S& s, Runs runs) {
                     smooth_pressure(p, s, runs);
                     update_stress(p, s, runs, StressPart::law);
                   }}};
  } else if (joined) {
    stress = {{.stage = {.name = "stress"}, .runs = [](P& p, S& s, Runs runs) {
                 update_stress(p, s, runs, StressPart::both, &gradients_of_chunk<Dim>());
               }}};
  } else {
    stress = {{.stage = {.name = "stress", .needs_dt = usf}, .runs = [](P& p, S& s, Runs runs) {
                 if (s.model->analysis.scheme == Scheme::usl) add_work_of_tractions(p, s, runs);
                 update_stress(p, s, runs, StressPart::both);
               }}};
  }

  List list;
  const auto add = [&](const TimestepStage<Dim>& stage) { list.push_back(stage); };
  const auto add_stress = [&] { list.insert(list.end(), stress.begin(), stress.end()); };

  const auto add_transfer = [&] {
    if (spreads_before_forces(analysis))
      add({.stage = {.name = "affine"},
           .begin = [](P& p, S& s) { velocities_before_forces(p, s); }});
    if (separates(analysis))
      add({.stage = {.name = "held"}, .begin = [](P& p, S& s) { find_held_nodes(p, s); }});
    if (has_filter(analysis.transfer)) add_filter<Dim, 2>(list, analysis.transfer.order);
  };
  const bool contact = analysis.contact.bodies > 1;

  add(arrivals);
  if (injects) add(injection);  // into cells that are empty when everybody has arrived
  if (contact) {
    add(normals);
    add(gaps);
  }
  if (analysis.drives_nodes) add(drive);
  if (usf) {  // update stress first: strain from the velocities at the beginning of the step
    add({.stage = {.name = "velocity", .exchange = "mass, momentum"},
         .takes = {NodeSum::mass_momentum},
         .begin = [](P& p, S& s) { nodal_velocity(p, s); }});
    add_stress();
    add(force);
    if (analysis.absorbs) {
      add(waves);
      add(absorb);
    }
    add({.stage = {.name = "integrate", .exchange = "force"},
         .takes = {NodeSum::force},
         .begin = [](P& p, S& s) { integrate(p, s); }});
    add_transfer();
    add(g2p);
    add(locate);
    add(p2g);
  } else {  // update stress last: one exchange carries mass, momentum and force
    if (analysis.absorbs) add(absorb);
    add({.stage = {.name = "integrate", .exchange = "mass, momentum, force", .needs_dt = true},
         .takes = {NodeSum::mass_momentum, NodeSum::force},
         .begin = [](P& p, S& s) { velocity_and_integrate(p, s); }});
    add_transfer();
    if (musl) {  // nodal velocities again, from the updated particles
      add(g2p);
      add({.stage = {.name = "P2G again"},
           .begin = [](P& p, S& s) { clear_sums(p, s, NodeSum::momentum); },
           .runs = [](P& p, S& s, Runs runs) { map_momentum(p, s, runs); }});
      add({.stage = {.name = "velocity", .exchange = "momentum"},
           .takes = {NodeSum::momentum},
           .begin = [](P& p, S& s) { nodal_velocity_again(p, s); }});
      add_stress();
    } else if (joined) {  // G2P leaves velocity gradients for stress
      add(g2p);
      add_stress();
    } else {  // stress and G2P take the same nodal velocities: stress comes before particles move
      add_stress();
      add(g2p);
    }
    add(locate);
    add(p2g);
    add(force);
    if (analysis.absorbs) add(waves);
  }
  if (contact) add(surface);
  if (analysis.drives_nodes) add(prescribed);
  add(output);
  return list;
}

template <int Dim>
std::vector<RankMessage> rank_messages(const std::vector<TimestepStage<Dim>>& stages,
                                       const std::vector<Phase>& phases) {
  std::vector<RankMessage> messages;
  const auto message_of = message_of_sums(stages);
  for (std::size_t f = 0; f < phases.size(); ++f) {
    const bool last = f + 1 == phases.size();
    const auto& next = stages[last ? 0 : phases[f + 1].first];
    if (next.stage.exchange.empty())
      messages.push_back({});
    else if (next.takes.empty())
      messages.push_back({.kind = RankMessage::Kind::particles});
    else
      messages.push_back({RankMessage::Kind::sums,
                          message_of[static_cast<std::size_t>(next.takes.front())],
                          sum_array(next.takes.front())});
  }
  return messages;
}

template <int Dim>
std::array<int, n_node_sums> message_of_sums(const std::vector<TimestepStage<Dim>>& stages) {
  constexpr int none = -1;
  std::array<int, n_node_sums> message{};
  message.fill(none);
  int number = 0;
  for (const auto& stage : stages) {
    if (stage.takes.empty() || message[static_cast<std::size_t>(stage.takes.front())] != none)
      continue;
    for (const NodeSum kind : stage.takes) message[static_cast<std::size_t>(kind)] = number;
    ++number;
  }
  for (int& kind : message) kind = std::max(kind, 0);
  return message;
}

template <int Dim>
void map_first(Patch<Dim>& patch, const std::vector<TimestepStage<Dim>>& stages,
               const StepContext<Dim>& step) {
  if (patch.count == 0) return;  // its sums are zero
  for (const auto& stage : stages) {
    if (!stage.of_next_step) continue;
    if (stage.begin) stage.begin(patch, step);
    stage.runs(patch, step, patch.runs);
  }
}

template std::vector<TimestepStage<2>> timestep<2>(const Analysis&, bool);
template std::vector<TimestepStage<3>> timestep<3>(const Analysis&, bool);
template std::vector<RankMessage> rank_messages<2>(const std::vector<TimestepStage<2>>&,
                                                   const std::vector<Phase>&);
template std::vector<RankMessage> rank_messages<3>(const std::vector<TimestepStage<3>>&,
                                                   const std::vector<Phase>&);
template std::array<int, n_node_sums> message_of_sums<2>(const std::vector<TimestepStage<2>>&);
template std::array<int, n_node_sums> message_of_sums<3>(const std::vector<TimestepStage<3>>&);
template void map_first<2>(Patch<2>&, const std::vector<TimestepStage<2>>&, const StepContext<2>&);
template void map_first<3>(Patch<3>&, const std::vector<TimestepStage<3>>&, const StepContext<3>&);

}  // namespace lahar
