#include "runtime/trace/analyse/chrome.h"

#include <fmt/format.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "physics/base/error.h"
#include "runtime/trace/analyse/counters.h"
#include "runtime/trace/analyse/idle_time.h"

namespace lahar {

namespace {

/// A file of trace events; zlib writes plain bytes in mode T.
class EventFile {
 public:
  explicit EventFile(const std::filesystem::path& path) : path_(path) {
    file_ = gzopen(path.c_str(), path.extension() == ".gz" ? "wb6" : "wbT");
    if (!file_) fail();
    put("{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n");
  }
  ~EventFile() {
    if (file_) gzclose(file_);
  }
  EventFile(const EventFile&) = delete;
  EventFile& operator=(const EventFile&) = delete;

  void add(const std::string& event) {
    put(first_ ? event : ",\n" + event);
    first_ = false;
  }
  void close() {
    put("\n]}\n");
    if (gzclose(std::exchange(file_, nullptr)) != Z_OK) fail();
  }

 private:
  void put(const std::string& text) {
    buffer_ = text;
    if (gzwrite(file_, buffer_.data(), static_cast<unsigned>(buffer_.size())) <= 0) fail();
  }
  [[noreturn]] void fail() const {
    throw IoError("cannot write " + path_.string() + ": " + std::strerror(errno));
  }

  std::filesystem::path path_;
  gzFile file_ = nullptr;
  std::string buffer_;
  bool first_ = true;
};

std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump();
}

double microseconds(double seconds) {
  return seconds * 1e6;
}

class ChromeWriter {
 public:
  ChromeWriter(const TraceLog& log, const std::filesystem::path& path) : log_(log), file_(path) {}

  void write() {
    name_rows();
    for (std::size_t t = 0; t < log_.tasks.size(); ++t) add_task(log_.tasks[t]);
    for (const TraceInterval& i : log_.intervals) add_interval(i);
    for (const TraceMessage& m : log_.messages) add_message(m);
    for (const TraceTask& task : log_.tasks) add_dependency(task);
    for (const TraceValue& value : log_.counters)
      file_.add(
          fmt::format(R"({{"ph":"C","name":"{}","pid":{},"ts":{:.3f},"args":{{"{}":{:.17g}}}}})",
                      name_of(value.counter), value.rank, microseconds(value.time),
                      unit_of(value.counter), value.value));
    file_.close();
  }

 private:
  void name_rows() {
    const Workers workers = workers_of(log_);
    std::set<std::pair<int, int>> rows(workers.list.begin(), workers.list.end());
    for (const TraceInterval& i : log_.intervals) rows.insert({i.rank, i.thread});
    for (int r = 0; r < log_.run.ranks; ++r)
      file_.add(fmt::format(
          R"({{"ph":"M","name":"process_name","pid":{},"args":{{"name":{}}}}})", r,
          quoted(fmt::format("rank {} ({})", r, log_.run.hosts[static_cast<std::size_t>(r)]))));
    for (const auto& [rank, thread] : rows) {
      const bool works = workers.place(rank, thread) != Workers::none;
      file_.add(fmt::format(
          R"({{"ph":"M","name":"thread_name","pid":{},"tid":{},"args":{{"name":"{} {}"}}}})", rank,
          thread, works ? "worker" : "output", thread));
    }
  }

  std::string phase_name(const TraceTask& task) const {
    if (task.kind == TraceKind::dt) return task.round < 0 ? "dt" : loop_name(task) + ": sums";
    const std::string& name = log_.run.phases[static_cast<std::size_t>(task.phase)].name;
    return task.kind == TraceKind::unpack ? "unpack " + name : name;
  }

  const std::string& loop_name(const TraceTask& task) const {
    return log_.run.loops[static_cast<std::size_t>(log_.run.loop_of(task.phase))].name;
  }
  /// A member of arguments, where something is of a round.
  static std::string round_of(Step round) {
    return round >= 0 ? fmt::format(R"(,"round":{})", round) : "";
  }

  void add_task(const TraceTask& task) {
    std::string stages;
    if (task.kind == TraceKind::task) {
      const auto& names = log_.run.phases[static_cast<std::size_t>(task.phase)].stages;
      for (std::size_t s = 0; s < names.size(); ++s)
        stages += fmt::format(R"(,{}:{:.3f})", quoted(names[s] + " [us]"),
                              microseconds(static_cast<double>(task.stage[s])));
    }
    file_.add(fmt::format(
        R"({{"ph":"X","name":{},"cat":"{}","pid":{},"tid":{},"ts":{:.3f},"dur":{:.3f},"args":{{"patch":{},"step":{}{},"ready [us]":{:.3f}{}}}}})",
        quoted(phase_name(task)), name_of(task.kind), task.rank, task.thread,
        microseconds(task.begin), microseconds(task.end - task.begin), task.patch, task.step,
        round_of(task.round), microseconds(task.ready), stages));
  }

  void add_interval(const TraceInterval& i) {
    if (i.kind == TraceKind::agreement) {  // they overlap with everything: rows of their own
      const char* name = i.which == static_cast<int>(TraceAgreement::step) ? "agreement on step"
                         : i.round >= 0                                    ? "sums of a round"
                                                                           : "agreement on dt";
      for (const char* ph : {"b", "e"})
        file_.add(fmt::format(
            R"({{"ph":"{}","cat":"agreement","name":"{}","id":"{}-{}-{}-{}","pid":{},"tid":0,"ts":{:.3f}}})",
            ph, name, i.rank, i.loop, i.which, i.round >= 0 ? i.round : i.step, i.rank,
            microseconds(*ph == 'b' ? i.begin : i.end)));
      return;
    }
    const std::string name = i.kind == TraceKind::rounds
                                 ? log_.run.loops[static_cast<std::size_t>(i.loop)].name
                             : i.kind == TraceKind::direct ? "direct solve"
                                                           : std::string(name_of(i.kind));
    file_.add(fmt::format(
        R"({{"ph":"X","name":{},"cat":"{}","pid":{},"tid":{},"ts":{:.3f},"dur":{:.3f},"args":{{"step":{}{}}}}})",
        quoted(name), name_of(i.kind), i.rank, i.thread, microseconds(i.begin),
        microseconds(i.end - i.begin), i.step, round_of(i.round)));
  }

  /// An arrow begins in a slice of its row and ends where one begins.
  void add_arrow(const char* kind, int from_rank, int from_thread, double from,
                 const TraceTask& to) {
    ++arrows_;
    file_.add(
        fmt::format(R"({{"ph":"s","id":{},"name":"{}","cat":"{}","pid":{},"tid":{},"ts":{:.3f}}})",
                    arrows_, kind, kind, from_rank, from_thread, microseconds(from)));
    file_.add(fmt::format(
        R"({{"ph":"f","bp":"e","id":{},"name":"{}","cat":"{}","pid":{},"tid":{},"ts":{:.3f}}})",
        arrows_, kind, kind, to.rank, to.thread, microseconds(to.begin)));
  }

  void add_message(const TraceMessage& m) {
    if (m.sender < 0 || m.unpack < 0) return;
    const TraceTask& sender = log_.tasks[static_cast<std::size_t>(m.sender)];
    file_.add(fmt::format(
        R"({{"ph":"X","name":"send","cat":"message","pid":{},"tid":{},"ts":{:.3f},"dur":{:.3f},"args":{{"patch":{},"step":{}{},"to":{},"bytes":{}}}}})",
        m.from, sender.thread, microseconds(m.packed), microseconds(m.sent - m.packed), m.patch,
        m.step, round_of(m.round), m.to, m.bytes));
    add_arrow("message", m.from, sender.thread, m.packed,
              log_.tasks[static_cast<std::size_t>(m.unpack)]);
  }

  void add_dependency(const TraceTask& task) {
    if (task.last_input < 0 || task.last_message >= 0) return;
    const TraceTask& input = log_.tasks[static_cast<std::size_t>(task.last_input)];
    add_arrow("dependency", input.rank, input.thread, input.begin, task);
  }

  const TraceLog& log_;
  EventFile file_;
  std::int64_t arrows_ = 0;
};

}  // namespace

void write_chrome(const TraceLog& log, const std::filesystem::path& file) {
  ChromeWriter(log, file).write();
}

}  // namespace lahar
