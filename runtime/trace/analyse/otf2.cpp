#include "runtime/trace/analyse/otf2.h"

#include "physics/base/error.h"

#ifdef LAHAR_HAS_OTF2

#include <fmt/format.h>
#include <otf2/otf2.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "runtime/trace/analyse/counters.h"

namespace lahar {

namespace {

void check(OTF2_ErrorCode code) {
  if (code != OTF2_SUCCESS) throw IoError(fmt::format("OTF2: {}", OTF2_Error_GetDescription(code)));
}

OTF2_FlushType flush_always(void*, OTF2_FileType, OTF2_LocationRef, void*, bool) {
  return OTF2_FLUSH;
}
/// Times are in nanoseconds from the first task on, moved so that none is negative.
OTF2_TimeStamp flush_time(void*, OTF2_FileType, OTF2_LocationRef) {
  return 0;
}

class Otf2Writer {
 public:
  Otf2Writer(const TraceLog& log, const std::filesystem::path& folder) : log_(log) {
    if (std::filesystem::exists(folder))
      throw IoError(folder.string() + " exists already; name a folder that does not");
    archive_ = OTF2_Archive_Open(folder.c_str(), "trace", OTF2_FILEMODE_WRITE, 1 << 20, 4 << 20,
                                 OTF2_SUBSTRATE_POSIX, OTF2_COMPRESSION_NONE);
    if (!archive_) throw IoError("cannot write " + folder.string());
    check(OTF2_Archive_SetFlushCallbacks(archive_, &flush_, nullptr));
    check(OTF2_Archive_SetSerialCollectiveCallbacks(archive_));
    collect();
  }
  ~Otf2Writer() {
    if (archive_) OTF2_Archive_Close(archive_);
  }
  Otf2Writer(const Otf2Writer&) = delete;
  Otf2Writer& operator=(const Otf2Writer&) = delete;

  void write() {
    write_events();
    write_definitions();
    check(OTF2_Archive_Close(std::exchange(archive_, nullptr)));
  }

 private:
  using Place = std::pair<int, int>;  // rank, thread
  struct Event {
    double time;
    enum class Kind { leave, receive, enter, send, counter } kind;
    int what;  // region, message or counter's value
  };
  struct Slice {
    double begin, end;
    int region;
  };

  int region(const std::string& name) {
    return regions_.emplace(name, static_cast<int>(regions_.size())).first->second;
  }

  void collect() {
    std::map<Place, std::vector<Slice>> slices;
    for (const TraceTask& t : log_.tasks) {
      const std::string dt = t.round < 0 ? "dt" : "sums of a round";
      std::string name =
          t.kind == TraceKind::dt ? dt : log_.run.phases[static_cast<std::size_t>(t.phase)].name;
      if (t.kind == TraceKind::unpack) name = "unpack " + name;
      slices[{t.rank, t.thread}].push_back({t.begin, t.end, region(name)});
    }
    for (const TraceInterval& i : log_.intervals)
      if (i.kind != TraceKind::agreement)
        slices[{i.rank, i.thread}].push_back(
            {i.begin, i.end, region(std::string(name_of(i.kind)))});
    for (auto& [place, list] : slices) nest(list, events_[place]);
    for (std::size_t k = 0; k < log_.messages.size(); ++k) {
      const TraceMessage& m = log_.messages[k];
      if (m.sender < 0 || m.unpack < 0) continue;
      const TraceTask& from = log_.tasks[static_cast<std::size_t>(m.sender)];
      const TraceTask& to = log_.tasks[static_cast<std::size_t>(m.unpack)];
      events_[{from.rank, from.thread}].push_back({m.sent, Event::Kind::send, static_cast<int>(k)});
      events_[{to.rank, to.thread}].push_back(
          {to.begin, Event::Kind::receive, static_cast<int>(k)});
    }
    // A rank's counters are on its first row.
    for (std::size_t k = 0; k < log_.counters.size(); ++k) {
      const auto row = events_.lower_bound({log_.counters[k].rank, 0});
      if (row != events_.end() && row->first.first == log_.counters[k].rank)
        row->second.push_back({log_.counters[k].time, Event::Kind::counter, static_cast<int>(k)});
    }
    for (auto& [place, list] : events_) {
      std::stable_sort(list.begin(), list.end(),
                       [](const Event& a, const Event& b) { return a.time < b.time; });
      if (!list.empty()) earliest_ = std::min(earliest_, list.front().time);
    }
  }

  /// Slices of a thread as enters and leaves, one within the other.
  static void nest(std::vector<Slice>& slices, std::vector<Event>& events) {
    std::sort(slices.begin(), slices.end(), [](const Slice& a, const Slice& b) {
      return std::tuple(a.begin, -a.end) < std::tuple(b.begin, -b.end);
    });
    std::vector<Slice> open;
    const auto close_until = [&](double time) {
      while (!open.empty() && open.back().end <= time) {
        events.push_back({open.back().end, Event::Kind::leave, open.back().region});
        open.pop_back();
      }
    };
    for (Slice slice : slices) {
      close_until(slice.begin);
      if (!open.empty()) slice.end = std::min(slice.end, open.back().end);
      events.push_back({slice.begin, Event::Kind::enter, slice.region});
      open.push_back(slice);
    }
    close_until(std::numeric_limits<double>::max());
  }

  OTF2_TimeStamp stamp(double time) const {
    return static_cast<OTF2_TimeStamp>((time - earliest_) * 1e9);
  }

  void write_events() {
    check(OTF2_Archive_OpenEvtFiles(archive_));
    OTF2_LocationRef location = 0;
    for (const auto& [place, list] : events_) {
      OTF2_EvtWriter* writer = OTF2_Archive_GetEvtWriter(archive_, location++);
      for (const Event& event : list) write_event(writer, event);
      check(OTF2_Archive_CloseEvtWriter(archive_, writer));
    }
    check(OTF2_Archive_CloseEvtFiles(archive_));
  }

  void write_event(OTF2_EvtWriter* writer, const Event& event) const {
    const OTF2_TimeStamp time = stamp(event.time);
    const auto what = static_cast<std::uint32_t>(event.what);
    if (event.kind == Event::Kind::enter)
      return check(OTF2_EvtWriter_Enter(writer, nullptr, time, what));
    if (event.kind == Event::Kind::leave)
      return check(OTF2_EvtWriter_Leave(writer, nullptr, time, what));
    if (event.kind == Event::Kind::counter) {
      const TraceValue& value = log_.counters[what];
      const OTF2_Type type = OTF2_TYPE_DOUBLE;
      OTF2_MetricValue metric;
      metric.floating_point = value.value;
      return check(OTF2_EvtWriter_Metric(
          writer, nullptr, time, static_cast<OTF2_MetricRef>(value.counter), 1, &type, &metric));
    }
    const TraceMessage& m = log_.messages[what];
    const auto tag = static_cast<std::uint32_t>(m.patch) * 16 + static_cast<std::uint32_t>(m.phase);
    const auto bytes = static_cast<std::uint64_t>(m.bytes);
    if (event.kind == Event::Kind::send)
      check(OTF2_EvtWriter_MpiSend(writer, nullptr, time, static_cast<std::uint32_t>(m.to), 0, tag,
                                   bytes));
    else
      check(OTF2_EvtWriter_MpiRecv(writer, nullptr, time, static_cast<std::uint32_t>(m.from), 0,
                                   tag, bytes));
  }

  OTF2_StringRef text(const std::string& value) {
    const auto [at, is_new] = strings_.emplace(value, static_cast<OTF2_StringRef>(strings_.size()));
    if (is_new) check(OTF2_GlobalDefWriter_WriteString(writer_, at->second, value.c_str()));
    return at->second;
  }

  void write_definitions() {
    check(OTF2_Archive_OpenDefFiles(archive_));
    for (OTF2_LocationRef l = 0; l < events_.size(); ++l)
      check(OTF2_Archive_CloseDefWriter(archive_, OTF2_Archive_GetDefWriter(archive_, l)));
    check(OTF2_Archive_CloseDefFiles(archive_));
    writer_ = OTF2_Archive_GetGlobalDefWriter(archive_);
    check(OTF2_GlobalDefWriter_WriteClockProperties(writer_, 1'000'000'000, 0,
                                                    stamp(log_.run.wall) + 1, 0));
    const OTF2_StringRef none = text("");
    std::vector<std::string> names(regions_.size());
    for (const auto& [name, number] : regions_) names[static_cast<std::size_t>(number)] = name;
    for (std::size_t number = 0; number < names.size(); ++number) {
      const OTF2_StringRef ref = text(names[number]);
      check(OTF2_GlobalDefWriter_WriteRegion(writer_, static_cast<OTF2_RegionRef>(number), ref, ref,
                                             none, OTF2_REGION_ROLE_TASK, OTF2_PARADIGM_USER,
                                             OTF2_REGION_FLAG_NONE, none, 0, 0));
    }
    const OTF2_StringRef machine = text("machine");
    check(OTF2_GlobalDefWriter_WriteSystemTreeNode(writer_, 0, text(log_.run.title), machine,
                                                   OTF2_UNDEFINED_SYSTEM_TREE_NODE));
    write_metrics();
    write_locations();
  }

  /// Each counter is a metric class of its own, as they have values at different times.
  void write_metrics() {
    for (int c = 0; c < trace_counters; ++c) {
      const auto counter = static_cast<TraceCounter>(c);
      const auto member = static_cast<OTF2_MetricMemberRef>(c);
      const OTF2_StringRef name = text(std::string(name_of(counter)));
      // The load is that of the time that follows, others are values at a time.
      const OTF2_MetricMode mode =
          counter == TraceCounter::load ? OTF2_METRIC_ABSOLUTE_NEXT : OTF2_METRIC_ABSOLUTE_POINT;
      check(OTF2_GlobalDefWriter_WriteMetricMember(
          writer_, member, name, name, OTF2_METRIC_TYPE_USER, mode, OTF2_TYPE_DOUBLE,
          OTF2_BASE_DECIMAL, 0, text(std::string(unit_of(counter)))));
      check(OTF2_GlobalDefWriter_WriteMetricClass(writer_, static_cast<OTF2_MetricRef>(c), 1,
                                                  &member, OTF2_METRIC_ASYNCHRONOUS,
                                                  OTF2_RECORDER_KIND_UNKNOWN));
    }
  }

  void write_locations() {
    for (int r = 0; r < log_.run.ranks; ++r)
      check(OTF2_GlobalDefWriter_WriteLocationGroup(
          writer_, static_cast<OTF2_LocationGroupRef>(r), text(fmt::format("rank {}", r)),
          OTF2_LOCATION_GROUP_TYPE_PROCESS, 0, OTF2_UNDEFINED_LOCATION_GROUP));
    std::vector<std::uint64_t> first, ranks;
    OTF2_LocationRef location = 0;
    for (const auto& [place, list] : events_) {
      if (static_cast<int>(first.size()) == place.first) first.push_back(location);
      check(OTF2_GlobalDefWriter_WriteLocation(writer_, location++,
                                               text(fmt::format("thread {}", place.second)),
                                               OTF2_LOCATION_TYPE_CPU_THREAD, list.size(),
                                               static_cast<OTF2_LocationGroupRef>(place.first)));
    }
    for (std::uint64_t r = 0; r < first.size(); ++r) ranks.push_back(r);
    const auto n = static_cast<std::uint32_t>(first.size());
    check(OTF2_GlobalDefWriter_WriteGroup(writer_, 0, text("locations"),
                                          OTF2_GROUP_TYPE_COMM_LOCATIONS, OTF2_PARADIGM_MPI,
                                          OTF2_GROUP_FLAG_NONE, n, first.data()));
    check(OTF2_GlobalDefWriter_WriteGroup(writer_, 1, text("ranks"), OTF2_GROUP_TYPE_COMM_GROUP,
                                          OTF2_PARADIGM_MPI, OTF2_GROUP_FLAG_NONE, n,
                                          ranks.data()));
    check(OTF2_GlobalDefWriter_WriteComm(writer_, 0, text("patches"), 1, OTF2_UNDEFINED_COMM,
                                         OTF2_COMM_FLAG_NONE));
  }

  const TraceLog& log_;
  OTF2_Archive* archive_ = nullptr;
  OTF2_FlushCallbacks flush_{flush_always, flush_time};  // OTF2 keeps its address
  OTF2_GlobalDefWriter* writer_ = nullptr;
  std::map<Place, std::vector<Event>> events_;
  std::map<std::string, int> regions_;
  std::map<std::string, OTF2_StringRef> strings_;
  double earliest_ = 0;
};

}  // namespace

void write_otf2(const TraceLog& log, const std::filesystem::path& folder) {
  Otf2Writer(log, folder).write();
}

}  // namespace lahar

#else

namespace lahar {

void write_otf2(const TraceLog&, const std::filesystem::path&) {
  throw InputError({Problem{.message = "this build writes no OTF2",
                            .hint = "install libotf2-trace-dev and build with cmake "
                                    "-D LAHAR_OTF2=ON; or use --chrome"}});
}

}  // namespace lahar

#endif
