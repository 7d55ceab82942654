#include "runtime/trace/idle_time.h"

#include <algorithm>

namespace lahar {

Workers workers_of(const TraceLog& log) {
  Workers workers;
  std::vector<int> seen(static_cast<std::size_t>(log.run.ranks), 0);
  for (const TraceTask& task : log.tasks)
    if (workers.places.emplace(std::pair(task.rank, task.thread), 0).second)
      ++seen[static_cast<std::size_t>(task.rank)];
  // Workers that got no task have no records: they are there all the same.
  constexpr int never_ran = 1 << 20;
  for (int r = 0; r < log.run.ranks; ++r)
    for (int k = seen[static_cast<std::size_t>(r)];
         k < log.run.threads[static_cast<std::size_t>(r)]; ++k)
      workers.places.emplace(std::pair(r, never_ran + k), 0);
  for (auto& [worker, place] : workers.places) {
    place = workers.list.size();
    workers.list.push_back(worker);
  }
  return workers;
}

IdleTime::IdleTime(const TraceLog& log, const Workers& workers) {
  struct Event {
    double time;
    int change;
  };
  std::vector<std::vector<Event>> events(static_cast<std::size_t>(log.run.ranks));
  for (const TraceTask& task : log.tasks) {
    auto& list = events[static_cast<std::size_t>(task.rank)];
    list.push_back({task.begin, -1});
    list.push_back({task.end, 1});
  }
  changes_.resize(events.size());
  for (std::size_t r = 0; r < events.size(); ++r) {
    std::stable_sort(events[r].begin(), events[r].end(),
                     [](const Event& a, const Event& b) { return a.time < b.time; });
    int idle = 0;
    for (const auto& [rank, thread] : workers.list) idle += rank == static_cast<int>(r);
    double sum = 0, before = events[r].empty() ? 0 : events[r].front().time;
    changes_[r].push_back({before, 0.0, idle});
    for (const Event& event : events[r]) {
      sum += idle * (event.time - before);
      before = event.time;
      idle += event.change;
      changes_[r].push_back({event.time, sum, idle});
    }
  }
}

double IdleTime::until(int rank, double time) const {
  const auto& list = changes_[static_cast<std::size_t>(rank)];
  const auto after = std::upper_bound(list.begin(), list.end(), time,
                                      [](double t, const Change& c) { return t < c.time; });
  if (after == list.begin()) return 0;
  const Change& last = *(after - 1);
  return last.idle + last.workers * (time - last.time);
}

}  // namespace lahar
