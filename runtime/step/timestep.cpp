#include "runtime/step/timestep.h"

#include <algorithm>

#include "physics/model/transfer_options.h"

namespace lahar {

NodeSumCopies node_sum_copies(const Analysis& analysis) {
  // With one exchange per step nothing else keeps a patch from overtaking its neighbours' reading.
  const int copies = analysis.scheme == Scheme::usl ? 2 : 1;
  const bool implicit = analysis.scheme == Scheme::newmark;
  const bool more = analysis.scheme == Scheme::musl || analysis.pressure_smoothing;
  // Gradients, waves and prescribed velocities are read before the phase in which the next ones are
  // mapped is begun anywhere near.
  return {{copies, more ? 1 : 0, analysis.contact.bodies > 1 ? 1 : 0, analysis.takes_means ? 1 : 0,
           analysis.drives_nodes ? 1 : 0, has_filter(analysis.transfer) ? 1 : 0,
           analysis.two_phase ? copies : 0, analysis.two_phase ? copies : 0,
           !analysis.two_phase         ? 0
           : analysis.liquid_advection ? copies
                                       : 1,
           implicit ? 2 : 0, implicit ? 2 : 0}};
}

namespace {

/// The arrays that hold some kinds of sums, each once.
std::vector<std::size_t> arrays_of(const std::vector<NodeSum>& kinds) {
  std::vector<std::size_t> arrays;
  for (const NodeSum kind : kinds)
    if (std::find(arrays.begin(), arrays.end(), sum_array(kind)) == arrays.end())
      arrays.push_back(sum_array(kind));
  return arrays;
}

}  // namespace

bool keeps_nodal_state(const Analysis& analysis) {
  return analysis.scheme != Scheme::usl || analysis.pressure_smoothing ||
         has_filter(analysis.transfer) || maps_pore_pressure(analysis);
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
                          message_of[static_cast<std::size_t>(next.takes.front())].number,
                          arrays_of(next.takes)});
  }
  return messages;
}

template <int Dim>
SumMessages message_of_sums(const std::vector<TimestepStage<Dim>>& stages) {
  SumMessages message{};
  std::array<bool, n_node_sums> known{};
  int number = 0;
  for (const auto& stage : stages) {
    if (stage.takes.empty() || known[static_cast<std::size_t>(stage.takes.front())]) continue;
    const auto arrays = arrays_of(stage.takes);
    for (const NodeSum kind : stage.takes) {
      if (known[static_cast<std::size_t>(kind)]) continue;  // an earlier message has it
      const auto array = std::find(arrays.begin(), arrays.end(), sum_array(kind)) - arrays.begin();
      message[static_cast<std::size_t>(kind)] = {number, static_cast<int>(array)};
      known[static_cast<std::size_t>(kind)] = true;
    }
    ++number;
  }
  return message;
}

template <int Dim>
void map_first(Patch<Dim>& patch, const std::vector<TimestepStage<Dim>>& stages,
               const StepContext<Dim>& step) {
  if (patch.count == 0) return;  // its sums are zero
  for (const auto& stage : stages) {
    if (!stage.of_next_step) continue;
    if (stage.begin) stage.begin(patch, step);
    stage.bins(patch, step, patch.bins);
  }
}

template std::vector<RankMessage> rank_messages<2>(const std::vector<TimestepStage<2>>&,
                                                   const std::vector<Phase>&);
template std::vector<RankMessage> rank_messages<3>(const std::vector<TimestepStage<3>>&,
                                                   const std::vector<Phase>&);
template SumMessages message_of_sums<2>(const std::vector<TimestepStage<2>>&);
template SumMessages message_of_sums<3>(const std::vector<TimestepStage<3>>&);
template void map_first<2>(Patch<2>&, const std::vector<TimestepStage<2>>&, const StepContext<2>&);
template void map_first<3>(Patch<3>&, const std::vector<TimestepStage<3>>&, const StepContext<3>&);

}  // namespace lahar
