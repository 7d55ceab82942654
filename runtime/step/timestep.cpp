#include "runtime/step/timestep.h"

#include <algorithm>

#include "physics/model/transfer_options.h"

namespace lahar {

NodeSumCopies node_sum_copies(const Analysis& analysis) {
  // With one exchange per step nothing else keeps a patch from overtaking its neighbours' reading.
  const int copies = analysis.scheme == Scheme::usl ? 2 : 1;
  const bool more = analysis.scheme == Scheme::musl || analysis.pressure_smoothing;
  // Gradients, waves and prescribed velocities are read before the phase in which the next ones are
  // mapped is begun anywhere near.
  return {{copies, more ? 1 : 0, analysis.contact.bodies > 1 ? 1 : 0, analysis.takes_means ? 1 : 0,
           analysis.drives_nodes ? 1 : 0, has_filter(analysis.transfer) ? 1 : 0}};
}

bool keeps_nodal_state(const Analysis& analysis) {
  return analysis.scheme != Scheme::usl || analysis.pressure_smoothing ||
         has_filter(analysis.transfer);
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
    stage.bins(patch, step, patch.bins);
  }
}

template std::vector<RankMessage> rank_messages<2>(const std::vector<TimestepStage<2>>&,
                                                   const std::vector<Phase>&);
template std::vector<RankMessage> rank_messages<3>(const std::vector<TimestepStage<3>>&,
                                                   const std::vector<Phase>&);
template std::array<int, n_node_sums> message_of_sums<2>(const std::vector<TimestepStage<2>>&);
template std::array<int, n_node_sums> message_of_sums<3>(const std::vector<TimestepStage<3>>&);
template void map_first<2>(Patch<2>&, const std::vector<TimestepStage<2>>&, const StepContext<2>&);
template void map_first<3>(Patch<3>&, const std::vector<TimestepStage<3>>&, const StepContext<3>&);

}  // namespace lahar
