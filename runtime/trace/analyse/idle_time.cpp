#include "runtime/trace/analyse/idle_time.h"

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

OtherWork::OtherWork(const TraceLog& log, const Workers& workers) : spans_(workers.list.size()) {
  for (const TraceInterval& i : log.intervals) {
    const std::size_t w = workers.place(i.rank, i.thread);
    const bool beside = i.kind == TraceKind::agreement || i.kind == TraceKind::rounds;
    if (w != Workers::none && !beside) spans_[w].push_back({i.begin, i.end});
  }
  for (auto& list : spans_) {  // some lie within others
    std::sort(list.begin(), list.end());
    std::size_t kept = 0;
    for (const auto& span : list) {
      if (kept > 0 && span.first <= list[kept - 1].second)
        list[kept - 1].second = std::max(list[kept - 1].second, span.second);
      else
        list[kept++] = span;
    }
    list.resize(kept);
  }
}

double OtherWork::within(std::size_t worker, double begin, double end) const {
  const auto& list = spans_[worker];
  auto i = std::partition_point(list.begin(), list.end(),
                                [&](const auto& span) { return span.second <= begin; });
  double sum = 0;
  for (; i != list.end() && i->first < end; ++i)
    sum += std::min(end, i->second) - std::max(begin, i->first);
  return sum;
}

}  // namespace lahar
