#include "runtime/program/timing_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/base/text.h"

namespace lahar {

std::string timing_table(const std::vector<StageTiming>& timings, double wall_seconds,
                         int threads) {
  const double all = wall_seconds * threads;
  std::string text = fmt::format("  {:<12} {:>12} {:>11} {:>11} {:>11} {:>11} {:>8}\n", "task",
                                 "calls", "total [s]", "avg [us]", "min [us]", "max [us]", "share");
  double busy = 0.0;
  for (const StageTiming& t : timings) {
    busy += t.total;
    const double average = t.calls > 0 ? t.total / static_cast<double>(t.calls) : 0.0;
    text += fmt::format("  {:<12} {:>12} {:>11.3f} {:>11.2f} {:>11.2f} {:>11.2f} {:>7.1f} %\n",
                        t.name, format_count(t.calls), t.total, average * 1e6, t.shortest * 1e6,
                        t.longest * 1e6, all > 0 ? 100 * t.total / all : 0.0);
  }
  text +=
      fmt::format("  {:<12} {:>12} {:>11.3f} {:>47.1f} %", "idle, graph", "",
                  std::max(0.0, all - busy), all > 0 ? 100 * std::max(0.0, all - busy) / all : 0.0);
  return text;
}

}  // namespace lahar
