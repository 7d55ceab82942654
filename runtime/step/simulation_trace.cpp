/// \file What a simulation tells a trace.
#include "runtime/step/simulation_trace.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>

#include "runtime/step/simulation_driver.h"

namespace lahar {

namespace {

/// When this thread began to look for messages; 0 = it does not.
thread_local std::uint64_t looking_since = 0;

}  // namespace

void trace_looking(bool over) {
  TraceRecorder* recorder = TraceRecorder::active();
  if (!recorder || !recorder->has(recorder->present())) {
    looking_since = 0;
    return;
  }
  if (over && looking_since > 0)
    recorder->add({.begin = looking_since,
                   .end = ticks(),
                   .step = recorder->present(),
                   .kind = TraceKind::poll});
  looking_since = over ? 0 : ticks();
}

TraceFound::TraceFound() : while_looking_(looking_since > 0) {
  if (while_looking_) trace_looking(true);
}

TraceFound::~TraceFound() {
  if (while_looking_) trace_looking(false);
}

std::uint64_t trace_clock() {
  return TraceRecorder::active() ? ticks() : 0;
}

void waste_time(double seconds, Step step) {
  const TraceSpan trace(TraceKind::delay, step);
  const std::uint64_t end = ticks() + static_cast<std::uint64_t>(seconds / seconds_per_tick());
  while (ticks() < end) {
  }
}

double resident_memory() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (!file) return 0;
  long long pages = 0, resident = 0;
  const bool read = std::fscanf(file, "%lld %lld", &pages, &resident) == 2;
  std::fclose(file);
  return read ? static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) : 0;
}

template <int Dim>
std::string SimulationDriver<Dim>::trace_graph() const {
  nlohmann::json list = nlohmann::json::array();
  for (int i = 0; i < patches.size(); ++i) {
    const Patch<Dim>& patch = patches[i];
    list.push_back({{"number", patch.topology.patch},
                    {"cells", patch.topology.cells.size()},
                    {"particles", patch.count},
                    {"neighbours", patch.topology.neighbours}});
  }
  return nlohmann::json{{"first", step}, {"patches", std::move(list)}}.dump();
}

template <int Dim>
void SimulationDriver<Dim>::record_graph() const {
  if (TraceRecorder* recorder = TraceRecorder::active()) recorder->add_graph(trace_graph());
}

template <int Dim>
void SimulationDriver<Dim>::record_unpacked(TraceRecorder& recorder, TraceRecord record, int phase,
                                            int p) const {
  record.end = ticks();
  record.kind = TraceKind::unpack;
  record.phase = static_cast<std::uint8_t>(phase);
  record.patch = static_cast<std::int32_t>(
      patches.elsewhere()[static_cast<std::size_t>(p - patches.size())].patch);
  record.detail.missed = executor->missed_at(executor->graph().task(phase, p));
  recorder.add(record);
}

template <int Dim>
void SimulationDriver<Dim>::record_own_task(TraceRecorder& recorder, TraceRecord record, int phase,
                                            int p, bool with_rest, const StageClock& clock) {
  const std::uint64_t end = ticks();
  if (phase == 0)  // in their patches again, having arrived
    active_particles[record.step].fetch_add(patches[p].count, std::memory_order_relaxed);
  record.patch = static_cast<std::int32_t>(patches[p].topology.patch);
  const auto add = [&](int part, std::uint64_t until) {
    const Phase& stages_of = phases[static_cast<std::size_t>(part)];
    record.phase = static_cast<std::uint8_t>(part);
    clock.read(stages_of.first, stages_of.last, record.detail.stage.data());
    record.end = until;
    recorder.add(record);
  };
  if (!with_rest) return add(phase, end);
  // Both were done piece by piece in turn; the records say so as if one came after the other.
  std::array<std::uint32_t, trace_stages> spent{};
  const Phase& first = phases[static_cast<std::size_t>(phase)];
  clock.read(first.first, first.last, spent.data());
  const std::uint64_t of_first = std::accumulate(spent.begin(), spent.end(), std::uint64_t{0});
  add(phase, std::min(end, record.begin + of_first));
  record.detail.stage = {};
  record.begin = record.ready = record.end;
  add(phase + 1, end);
}

template <int Dim>
void SimulationDriver<Dim>::record_progress(Step done) {
  if (TraceRecorder* recorder = TraceRecorder::active()) recorder->set_present(done + 1);
  TraceRecorder* recorder = TraceRecorder::active(done);
  if (!recorder) return;
  const std::uint64_t now = ticks();
  const auto add = [&](TraceCounter counter, double value) {
    recorder->add({.begin = now,
                   .end = now,
                   .step = done,
                   .kind = TraceKind::counter,
                   .phase = static_cast<std::uint8_t>(counter),
                   .detail = {.value = value}});
  };
  const Index particles = active_particles[done].exchange(0, std::memory_order_relaxed);
  const bool due = now >= next_counters;
  if (due || particles != counted_particles)
    add(TraceCounter::particles, static_cast<double>(particles));
  counted_particles = particles;
  if (!due) return;
  // Reading memory costs a system call; fifty times a second are enough.
  add(TraceCounter::memory, resident_memory());
  next_counters = now + static_cast<std::uint64_t>(0.02 / seconds_per_tick());
}

template class SimulationDriver<2>;
template class SimulationDriver<3>;

}  // namespace lahar
