#include "runtime/trace/analyse/counters.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lahar {

std::string_view name_of(TraceCounter counter) {
  constexpr std::array<std::string_view, trace_counters> names{"active particles", "memory",
                                                               "load"};
  return names[static_cast<std::size_t>(counter)];
}

std::string_view unit_of(TraceCounter counter) {
  constexpr std::array<std::string_view, trace_counters> units{"particles", "bytes", "share"};
  return units[static_cast<std::size_t>(counter)];
}

void add_load(TraceLog& log) {
  constexpr Step most = 500;  // as many as a chart has room for
  const auto n =
      static_cast<std::size_t>(std::clamp<Step>(log.run.last - log.run.first + 1, 1, most));
  const double origin = log.tasks.front().begin;
  const double interval = log.run.wall / static_cast<double>(n);
  if (!(interval > 0)) return;
  std::vector<std::vector<double>> busy(static_cast<std::size_t>(log.run.ranks));
  for (auto& of_rank : busy) of_rank.assign(n, 0);
  for (const TraceTask& task : log.tasks) {
    if (task.kind != TraceKind::task) continue;
    auto& of_rank = busy[static_cast<std::size_t>(task.rank)];
    const double begin = (task.begin - origin) / interval, end = (task.end - origin) / interval;
    const auto last = std::min(n, static_cast<std::size_t>(std::max(0.0, std::ceil(end))));
    for (auto k = static_cast<std::size_t>(std::max(0.0, begin)); k < last; ++k)
      of_rank[k] += std::max(
          0.0, std::min(end, static_cast<double>(k + 1)) - std::max(begin, static_cast<double>(k)));
  }
  for (std::size_t r = 0; r < busy.size(); ++r)
    for (std::size_t k = 0; k < n; ++k)
      log.counters.push_back({.counter = TraceCounter::load,
                              .rank = static_cast<int>(r),
                              .time = origin + interval * static_cast<double>(k),
                              .value = std::min(1.0, busy[r][k] / log.run.threads[r])});
}

std::vector<TraceValue> values_of(const TraceLog& log, TraceCounter counter, int rank) {
  std::vector<TraceValue> values;
  for (const TraceValue& value : log.counters)
    if (value.counter == counter && value.rank == rank) values.push_back(value);
  std::sort(values.begin(), values.end(),
            [](const TraceValue& a, const TraceValue& b) { return a.time < b.time; });
  return values;
}

}  // namespace lahar
