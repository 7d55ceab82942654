/// \file What an analysis says, for programs; runtime/trace/analyse/schema/report.schema.json
/// describes it.
#include <nlohmann/json.hpp>

#include "runtime/trace/analyse/analysis.h"
#include "runtime/trace/analyse/counters.h"

namespace lahar {

namespace {

using nlohmann::json;

json task_json(const TraceLog& log, int t) {
  const TraceTask& task = log.tasks[static_cast<std::size_t>(t)];
  const std::string dt = task.round >= 0 ? "sums" : "dt";
  return {
      {"phase",
       task.kind == TraceKind::dt ? dt : log.run.phases[static_cast<std::size_t>(task.phase)].name},
      {"patch", task.patch},
      {"step", task.step},
      {"round", task.round},
      {"rank", task.rank},
      {"thread", task.thread},
      {"ready", task.ready},
      {"begin", task.begin},
      {"end", task.end}};
}

json stages_json(const TraceReport& report) {
  json list = json::array();
  for (const StageUse& s : report.stages)
    list.push_back({{"loop", s.loop},
                    {"phase", s.phase},
                    {"stage", s.stage},
                    {"count", s.count},
                    {"total", s.total},
                    {"mean", s.mean},
                    {"p50", s.p50},
                    {"p95", s.p95},
                    {"max", s.longest},
                    {"share", s.share},
                    {"imbalance_ranks", s.by_ranks},
                    {"imbalance_threads", s.by_threads},
                    {"per_particle", s.per_particle},
                    {"on_path", s.on_path}});
  return list;
}

/// The values of each counter of each rank, and the times [s] from which on they hold.
json counters_json(const TraceLog& log) {
  json list = json::array();
  for (int r = 0; r < log.run.ranks; ++r)
    for (int c = 0; c < trace_counters; ++c) {
      const auto counter = static_cast<TraceCounter>(c);
      json times = json::array(), values = json::array();
      for (const TraceValue& value : values_of(log, counter, r)) {
        times.push_back(value.time);
        values.push_back(value.value);
      }
      list.push_back({{"counter", name_of(counter)},
                      {"unit", unit_of(counter)},
                      {"rank", r},
                      {"times", std::move(times)},
                      {"values", std::move(values)}});
    }
  return list;
}

json path_json(const TraceReport& report) {
  json kinds = json::object();
  for (std::size_t k = 0; k < report.path.by_kind.size(); ++k)
    kinds[std::string(name_of(static_cast<PathPart::Kind>(k)))] = report.path.by_kind[k];
  return {{"by_kind", kinds},
          {"work", report.path.work},
          {"longest_chain", report.path.longest_chain},
          {"speedup_left", report.path.speedup_left}};
}

}  // namespace

std::string json_of(const TraceLog& log, const TraceReport& report) {
  const Efficiencies& e = report.efficiencies;
  json out{{"title", log.run.title},
           {"version", log.run.version},
           {"executor", log.run.executor},
           {"ranks", log.run.ranks},
           {"threads", log.run.threads},
           {"first_step", log.run.first},
           {"last_step", log.run.last},
           {"wall", log.run.wall},
           {"clock_bound", log.run.clock_bound},
           {"tasks", log.tasks.size()},
           {"ideal_time", report.ideal_time},
           {"disturbance", report.disturbance},
           {"findings", json::array()},
           {"workers", json::array()},
           {"slowest_patches", json::array()},
           {"longest_waits", json::array()},
           {"counters", counters_json(log)},
           {"loops", json::array()},
           {"stages", stages_json(report)},
           {"critical_path", path_json(report)},
           {"steps_apart", {{"mean", report.spread.mean}, {"max", report.spread.largest}}},
           {"exchange",
            {{"messages", report.exchange.messages},
             {"bytes", report.exchange.bytes},
             {"in_flight", report.exchange.in_flight},
             {"not_looked_for", report.exchange.unseen},
             {"exposed", report.exchange.exposed}}},
           {"efficiencies",
            {{"parallel", e.parallel},
             {"load_balance", e.load_balance},
             {"load_balance_ranks", e.by_ranks},
             {"communication", e.communication}}}};
  if (e.replayed) {
    out["efficiencies"]["serialisation"] = e.serialisation;
    out["efficiencies"]["transfer"] = e.transfer;
  }
  for (const LoopUse& loop : report.loops)
    out["loops"].push_back({{"name", loop.name}, {"turns", loop.turns}, {"wall", loop.wall}});
  for (const Finding& f : report.findings)
    out["findings"].push_back({{"name", f.name}, {"loss", f.loss}, {"text", f.text}});
  for (const WorkerUse& w : report.workers)
    out["workers"].push_back({{"rank", w.rank},
                              {"thread", w.thread},
                              {"useful", w.useful},
                              {"messages", w.messages},
                              {"polling", w.polling},
                              {"runtime", w.runtime},
                              {"other", w.other},
                              {"idle", w.idle}});
  for (const PatchUse& p : report.patches)
    out["slowest_patches"].push_back({{"patch", p.number},
                                      {"rank", p.rank},
                                      {"particles", p.particles},
                                      {"cells", p.cells},
                                      {"total", p.total},
                                      {"over_mean", p.over_mean},
                                      {"per_particle", p.per_particle},
                                      {"why", p.why}});
  for (const Wait& w : report.waits)
    out["longest_waits"].push_back(
        {{"task", task_json(log, w.task)}, {"time", w.time}, {"for", w.for_what}});
  return out.dump(1);
}

}  // namespace lahar
