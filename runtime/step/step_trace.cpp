#include "runtime/step/step_trace.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>

namespace lahar {

namespace {

/// [bytes] of memory that this process has at present; 0 = not known.
double resident_memory() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (!file) return 0;
  long long pages = 0, resident = 0;
  const bool read = std::fscanf(file, "%lld %lld", &pages, &resident) == 2;
  std::fclose(file);
  return read ? static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) : 0;
}

}  // namespace

void waste_time(double seconds, Step step) {
  const TraceSpan trace(TraceKind::delay, step);
  const std::uint64_t end = ticks() + static_cast<std::uint64_t>(seconds / seconds_per_tick());
  while (ticks() < end) {
  }
}

template <int Dim>
std::string trace_graph(const PatchSet<Dim>& patches, Step first) {
  nlohmann::json list = nlohmann::json::array();
  for (int i = 0; i < patches.size(); ++i) {
    const Patch<Dim>& patch = patches[i];
    list.push_back({{"number", patch.topology.patch},
                    {"cells", patch.topology.cells.size()},
                    {"particles", patch.count},
                    {"neighbours", patch.topology.neighbours}});
  }
  return nlohmann::json{{"first", first}, {"patches", std::move(list)}}.dump();
}

template std::string trace_graph(const PatchSet<2>&, Step);
template std::string trace_graph(const PatchSet<3>&, Step);

void StepTrace::add_unpacked(TraceRecorder& recorder, TraceRecord record, int phase, Index patch,
                             std::uint64_t missed) const {
  record.end = ticks();
  record.kind = TraceKind::unpack;
  record.phase = static_cast<std::uint8_t>(phase);
  record.patch = static_cast<std::int32_t>(patch);
  record.detail.missed = missed;
  recorder.add(record);
}

void StepTrace::add_task(TraceRecorder& recorder, TraceRecord record, int phase, bool with_rest,
                         Index patch, Index particles, const StageClock& clock) {
  const std::uint64_t end = ticks();
  if (phase == 0)  // in their patches again, having arrived
    particles_[record.step].fetch_add(particles, std::memory_order_relaxed);
  record.patch = static_cast<std::int32_t>(patch);
  const auto add = [&](int part, std::uint64_t until) {
    const Phase& stages_of = phases_[static_cast<std::size_t>(part)];
    record.phase = static_cast<std::uint8_t>(part);
    clock.read(stages_of.first, stages_of.last, record.detail.stage.data());
    record.end = until;
    recorder.add(record);
  };
  if (!with_rest) return add(phase, end);
  // Both were done piece by piece in turn; the records say so as if one came after the other.
  std::array<std::uint32_t, trace_stages> spent{};
  const Phase& first = phases_[static_cast<std::size_t>(phase)];
  clock.read(first.first, first.last, spent.data());
  const std::uint64_t of_first = std::accumulate(spent.begin(), spent.end(), std::uint64_t{0});
  add(phase, std::min(end, record.begin + of_first));
  record.detail.stage = {};
  record.begin = record.ready = record.end;
  add(phase + 1, end);
}

void StepTrace::add_progress(Step done) {
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
  const Index particles = particles_[done].exchange(0, std::memory_order_relaxed);
  const bool due = now >= next_counters_;
  if (due || particles != counted_particles_)
    add(TraceCounter::particles, static_cast<double>(particles));
  counted_particles_ = particles;
  if (!due) return;
  // Reading memory costs a system call; fifty times a second are enough.
  add(TraceCounter::memory, resident_memory());
  next_counters_ = now + static_cast<std::uint64_t>(0.02 / seconds_per_tick());
}

}  // namespace lahar
