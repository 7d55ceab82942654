#include "runtime/exchange/timestep_stage.h"

#include <algorithm>
#include <stdexcept>

namespace lahar {

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

template <int Dim>
std::vector<RankMessage> rank_messages(const std::vector<TimestepStage<Dim>>& stages,
                                       const std::vector<Phase>& phases, const SumMessages& sums) {
  std::vector<RankMessage> messages;
  for (std::size_t f = 0; f < phases.size(); ++f) {
    const bool last = f + 1 == phases.size();
    const auto& next = stages[last ? 0 : phases[f + 1].first];
    if (next.stage.exchange.empty())
      messages.push_back({});
    else if (next.takes.empty())
      messages.push_back({.kind = RankMessage::Kind::particles});
    else
      messages.push_back({RankMessage::Kind::sums,
                          sums[static_cast<std::size_t>(next.takes.front())].number,
                          arrays_of(next.takes)});
  }
  return messages;
}

namespace {

/// What a stage takes comes with one message, whose arrays are those that it takes.
template <int Dim>
void check_messages(const std::vector<TimestepStage<Dim>>& stages, const SumMessages& message) {
  for (const auto& stage : stages) {
    if (stage.takes.empty()) continue;
    const auto arrays = arrays_of(stage.takes);
    const int number = message[static_cast<std::size_t>(stage.takes.front())].number;
    for (const NodeSum kind : stage.takes) {
      const SumMessage& of_kind = message[static_cast<std::size_t>(kind)];
      if (of_kind.number != number ||
          arrays[static_cast<std::size_t>(of_kind.array)] != sum_array(kind))
        throw std::logic_error("stage " + stage.stage.name +
                               " takes sums that come with different messages");
    }
  }
}

}  // namespace

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
  check_messages(stages, message);
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
                                                   const std::vector<Phase>&, const SumMessages&);
template std::vector<RankMessage> rank_messages<3>(const std::vector<TimestepStage<3>>&,
                                                   const std::vector<Phase>&, const SumMessages&);
template SumMessages message_of_sums<2>(const std::vector<TimestepStage<2>>&);
template SumMessages message_of_sums<3>(const std::vector<TimestepStage<3>>&);
template void map_first<2>(Patch<2>&, const std::vector<TimestepStage<2>>&, const StepContext<2>&);
template void map_first<3>(Patch<3>&, const std::vector<TimestepStage<3>>&, const StepContext<3>&);

}  // namespace lahar
