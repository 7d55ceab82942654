#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "runtime/trace/analyse/project.h"

namespace lahar {

namespace {

std::string table(const std::vector<ProjectionPoint>& points) {
  std::string text = fmt::format("{:>9} {:>13} {:>14} {:>6} {:>16} {:>6}\n", "cores",
                                 "patches/core", "task graph", "eff.", "bulk-synchronous", "eff.");
  for (const ProjectionPoint& p : points)
    text += fmt::format("{:>9} {:>13.4g} {:>14} {:>4.0f} % {:>16} {:>4.0f} %\n", p.cores, p.patches,
                        short_time(p.graph), 100 * p.graph_efficiency, short_time(p.bulk),
                        100 * p.bulk_efficiency);
  return text;
}

nlohmann::json list(const std::vector<ProjectionPoint>& points) {
  nlohmann::json all = nlohmann::json::array();
  for (const ProjectionPoint& p : points)
    all.push_back({{"cores", p.cores},
                   {"ranks", p.ranks},
                   {"simulated_ranks", p.simulated},
                   {"patches_per_core", p.patches},
                   {"graph", {{"time_per_step", p.graph}, {"efficiency", p.graph_efficiency}}},
                   {"bulk", {{"time_per_step", p.bulk}, {"efficiency", p.bulk_efficiency}}}});
  return all;
}

}  // namespace

std::string text_of(const ScalingProjection& p) {
  std::string text = fmt::format(
      "Projection from {} patches on {} core{}, to ranks of {} thread{}\nnetwork   {}\n", p.patches,
      p.cores, p.cores == 1 ? "" : "s", p.threads, p.threads == 1 ? "" : "s", text_of(p.network));
  if (p.steady) text += "tasks     take their median time\n";
  text += "\nWeak scaling: copies of the recorded patches, time per step\n" + table(p.weak);
  text += "\nStrong scaling of the recorded patches\n";
  text += p.strong.empty() ? "  none: a rank has more threads than there are patches\n"
                           : table(p.strong);
  text +=
      "\nStrong scaling of as many patches as the largest machine has cores\n" + table(p.largest);
  text += "Strong scaling ends with one patch per core: patches are not split.\n";
  for (const std::string& note : p.notes) text += "note      " + note + "\n";
  return text;
}

std::string json_of(const ScalingProjection& p) {
  // JSON has no infinity: a bandwidth without limit is null.
  const nlohmann::json bandwidth =
      std::isinf(*p.network.bandwidth) ? nlohmann::json() : nlohmann::json(*p.network.bandwidth);
  return nlohmann::json{{"threads", p.threads},
                        {"network",
                         {{"latency", *p.network.latency},
                          {"bandwidth", bandwidth},
                          {"overhead", *p.network.overhead},
                          {"ideal", !p.network.packing}}},
                        {"steady", p.steady},
                        {"recorded", {{"patches", p.patches}, {"cores", p.cores}}},
                        {"weak", list(p.weak)},
                        {"strong", list(p.strong)},
                        {"largest", list(p.largest)},
                        {"notes", p.notes}}
      .dump(2);
}

}  // namespace lahar
