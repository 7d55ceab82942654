#include "runtime/bench_worker.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "io/atomic_file.h"
#include "io/frame_writer.h"
#include "physics/error.h"
#include "runtime/bench_traffic.h"

namespace lahar {

using Json = nlohmann::json;

// --- processes
// ------------------------------------------------------------------------------------

namespace {

void write_all(int file, const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t n = write(file, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw IoError("the connection to a measuring process is lost");
    data += n;
    size -= static_cast<std::size_t>(n);
  }
}

/// False at the end of the pipe.
bool read_all(int file, char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t n = read(file, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    data += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

/// Close what a child has of other children's pipes: they wait for these to end.
void close_all_but(int a, int b) {
  const auto low = static_cast<unsigned>(std::min(a, b)),
             high = static_cast<unsigned>(std::max(a, b));
  constexpr unsigned first = STDERR_FILENO + 1;
  if (low > first) close_range(first, low - 1, 0);
  if (high > low + 1) close_range(low + 1, high - 1, 0);
  close_range(high + 1, ~0u, 0);
}

/// What a text from the child is.
enum Kind : char {
  answer = 'a',
  input_error = 'i',
  io_error = 'f',
  simulation_error = 's',
  other_error = 'o'
};

}  // namespace

ChildProcess::ChildProcess(const std::function<void(ChildProcess&)>& work) {
  int to_child[2], to_parent[2];
  if (pipe2(to_child, O_CLOEXEC) != 0 || pipe2(to_parent, O_CLOEXEC) != 0)
    throw IoError("cannot make a pipe");
  std::signal(SIGPIPE, SIG_IGN);  // a child that ended is reported by receive()
  std::fflush(nullptr);
  child_ = fork();
  if (child_ < 0) throw IoError("cannot start a process");
  if (child_ == 0) {
    in_ = to_child[0];
    out_ = to_parent[1];
    close_all_but(in_, out_);
    run_child(work);
  }
  close(to_child[0]);
  close(to_parent[1]);
  in_ = to_parent[0];
  out_ = to_child[1];
}

void ChildProcess::run_child(const std::function<void(ChildProcess&)>& work) {
  const auto report = [&](Kind kind, const std::string& text) {
    const std::uint64_t size = text.size() + 1;
    write_all(out_, reinterpret_cast<const char*>(&size), sizeof size);
    write_all(out_, std::string(1, kind).append(text).data(), size);
  };
  try {
    try {
      work(*this);
    } catch (const InputError& error) {
      report(input_error, error.what());
    } catch (const IoError& error) {
      report(io_error, error.what());
    } catch (const SimulationError& error) {
      report(simulation_error, error.what());
    } catch (const std::bad_alloc&) {
      report(io_error, "not enough memory for this benchmark");
    } catch (const std::exception& error) {
      report(other_error, error.what());
    }
  } catch (...) {  // nobody listens any more
  }
  _exit(0);  // what belongs to the parent (its streams, its handlers) is not ours to end
}

ChildProcess::~ChildProcess() {
  close(in_);
  close(out_);  // a child that waits for a command tidies up and ends
  constexpr std::chrono::milliseconds patience(10'000), pause(1);
  for (auto waited = pause * 0; waited < patience; waited += pause) {
    if (waitpid(child_, nullptr, WNOHANG) != 0) return;
    std::this_thread::sleep_for(pause);
  }
  kill(child_, SIGKILL);
  waitpid(child_, nullptr, 0);
}

void ChildProcess::send(const std::string& text) {
  const std::uint64_t size = text.size() + 1;
  std::string message(reinterpret_cast<const char*>(&size), sizeof size);
  message += answer;
  message += text;
  try {
    write_all(out_, message.data(), message.size());
  } catch (const IoError&) {
    // A child that failed has said why; receive() finds it.
  }
}

std::string ChildProcess::receive() {
  std::uint64_t size = 0;
  if (!read_all(in_, reinterpret_cast<char*>(&size), sizeof size)) explain_end();
  std::string message(size, '\0');
  if (!read_all(in_, message.data(), size)) explain_end();
  const std::string text = message.substr(1);
  switch (message[0]) {
    case input_error:
      throw InputError(text);
    case io_error:
      throw IoError(text);
    case simulation_error:
      throw SimulationError(text);
    case other_error:
      throw std::runtime_error(text);
    default:
      return text;
  }
}

void ChildProcess::explain_end() {
  siginfo_t end{};
  if (child_ > 0 && waitid(P_PID, static_cast<id_t>(child_), &end, WEXITED | WNOWAIT) == 0 &&
      end.si_code != CLD_EXITED)
    throw IoError(fmt::format(
        "a measuring process was killed by signal {}; signal 9 usually means that memory ran out",
        end.si_status));
  throw IoError("a measuring process ended too early");
}

// --- the simulation in the child
// --------------------------------------------------------------------

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// [s] that the threads of this process have computed.
double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// [B] of this process: VmRSS or VmHWM.
double process_memory(const std::string& key) {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(key + ":")) return 1024 * std::stod(line.substr(key.size() + 1));
  return 0;
}

/// History and frames as a run writes them, in a folder that goes with the process.
class Output {
 public:
  Output()
      : folder_(std::filesystem::temp_directory_path() / fmt::format("lahar-bench-{}", getpid())) {
    std::signal(SIGINT, SIG_IGN);  // the end of the commanding process is ours: then we tidy up
    make_folder(folder_);
    frames_.emplace(folder_);
  }
  ~Output() {
    frames_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  void write(Frame&& frame) { frames_->write(std::move(frame)); }

 private:
  std::filesystem::path folder_;
  std::optional<FrameWriter> frames_;
};

/// Mean and standard deviation of the number of particles in a cell that has any.
std::pair<double, double> occupation(std::vector<Index> cells) {
  std::sort(cells.begin(), cells.end());
  double count = 0, squares = 0;
  for (std::size_t begin = 0, end = 0; begin < cells.size(); begin = end) {
    while (end < cells.size() && cells[end] == cells[begin]) ++end;
    const auto n = static_cast<double>(end - begin);
    ++count;
    squares += n * n;
  }
  if (count == 0) return {0, 0};
  const double mean = static_cast<double>(cells.size()) / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean))};
}

template <int Dim>
class Worker {
 public:
  explicit Worker(const BenchJob& job) : job_(job) {
    if (job.output) output_.emplace();
    const auto begin = Clock::now();
    Model<Dim> model = std::get<Model<Dim>>(job.model());
    ready_["read"] = seconds_since(begin);
    ready_["bytes"] =
        bytes_per_particle_step<Dim>(model.analysis.scheme, model.mesh->is_cartesian());
    const auto [mean, spread] = occupation(model.particles.cell);
    ready_["per_cell"] = mean;
    ready_["per_cell_spread"] = spread;
    construct(std::move(model));
  }

  void serve(ChildProcess& parent) {
    const SimulationInfo info = simulation_->info();
    particles_ = static_cast<double>(info.particles);
    ready_["particles"] = info.particles;
    ready_["cells"] = info.cells;
    ready_["patches"] = info.patches;
    ready_["threads"] = info.threads;
    parent.send(ready_.dump());
    for (;;) {
      const Json asked = Json::parse(parent.receive());
      parent.send(answer_to(asked.at("do"), asked.at("steps")).dump());
    }
  }

 private:
  void construct(Model<Dim> model) {
    mesh_ = model.mesh;
    Observer observer;
    if (output_) {
      constexpr Index steps_per_frame = 4;
      model.output.history_steps = 1;
      model.output.frame_steps = steps_per_frame;
      observer.history = [](const HistoryRow&) {};
      observer.frame = [this](Frame&& frame) { output_->write(std::move(frame)); };
    }
    const auto begin = Clock::now();
    simulation_.emplace(std::move(model), job_.execution, std::move(observer));
    ready_["construct"] = seconds_since(begin);
  }

  Json answer_to(const std::string& what, Index steps) {
    if (what == "warm up") return warm_up();
    if (what == "steps") {
      const BenchWorker::Times times = timed(steps);
      return {times.wall, times.cpu};
    }
    if (what == "count crossings") return count_crossings();
    return end();
  }

  BenchWorker::Times timed(Index steps) {
    if (job_.life > 0 && simulation_->step() + steps > job_.life) {
      construct(std::get<Model<Dim>>(job_.model()));
      before_.clear();  // the new one's times are from its start
      timed_steps_ = 0;
    }
    const double cpu = cpu_seconds();
    const auto begin = Clock::now();
    simulation_->advance(steps);
    timed_steps_ += steps;
    return {seconds_since(begin), cpu_seconds() - cpu};
  }

  double warm_up() {
    constexpr double enough = 0.15;  // [s]
    Index steps = 2;
    double seconds = timed(steps).wall;
    while (seconds < enough && (job_.life == 0 || 4 * steps <= job_.life))
      seconds = timed(steps *= 2).wall;
    before_ = simulation_->timings();
    timed_steps_ = 0;
    return seconds / static_cast<double>(steps);
  }

  double count_crossings() {
    // Enough for the mean of a small model, few of a big one, whose frames take their time.
    const auto steps = static_cast<Index>(std::clamp(2e6 / particles_, 4.0, 50.0));
    double count = 0;
    std::vector<Index> before = cells(simulation_->frame());
    for (Index step = 0; step < steps; ++step) {
      simulation_->advance(1);
      std::vector<Index> now = cells(simulation_->frame());
      for (std::size_t p = 0; p < now.size(); ++p) count += now[p] != before[p];
      before = std::move(now);
    }
    return count / (particles_ * static_cast<double>(steps));
  }

  std::vector<Index> cells(const Frame& frame) const {
    std::vector<Index> all(frame.id.size());
    for (std::size_t p = 0; p < all.size(); ++p)
      all[p] = mesh_->locate(Eigen::Map<const Vec<Dim>>(&frame.coordinates[p * Dim])).cell;
    return all;
  }

  Json end() {
    Json stages = Json::array();
    const double particle_steps = particles_ * static_cast<double>(timed_steps_);
    const std::vector<StageTiming> now = simulation_->timings();
    for (std::size_t s = 0; s < now.size() && particle_steps > 0; ++s) {
      const double earlier = s < before_.size() ? before_[s].total : 0;
      stages.push_back(
          {{"name", now[s].name}, {"ns", (now[s].total - earlier) * 1e9 / particle_steps}});
    }
    return {{"stages", stages},
            {"resident", process_memory("VmRSS")},
            {"peak", process_memory("VmHWM")}};
  }

  const BenchJob& job_;
  std::shared_ptr<const Mesh<Dim>> mesh_;
  std::optional<Output> output_;  // outlives the simulation, which writes to it
  std::optional<Simulation<Dim>> simulation_;
  Json ready_;
  std::vector<StageTiming> before_;
  Index timed_steps_ = 0;
  double particles_ = 0;
};

std::string command(const char* what, Index steps = 0) {
  return Json::object({{"do", what}, {"steps", steps}}).dump();
}

void work(const BenchJob& job, ChildProcess& parent) {
  if (job.dim == 2)
    Worker<2>(job).serve(parent);
  else
    Worker<3>(job).serve(parent);
}

}  // namespace

BenchWorker::BenchWorker(const BenchJob& job)
    : process_([&job](ChildProcess& parent) { work(job, parent); }) {}

BenchWorker::Ready BenchWorker::ready() {
  const Json said = Json::parse(process_.receive());
  Ready ready;
  said.at("read").get_to(ready.read_seconds);
  said.at("construct").get_to(ready.construct_seconds);
  BenchVariant& variant = ready.variant;
  said.at("threads").get_to(variant.threads);
  said.at("particles").get_to(variant.particles);
  said.at("cells").get_to(variant.cells);
  said.at("patches").get_to(variant.patches);
  said.at("bytes").get_to(variant.bytes);
  said.at("per_cell").get_to(variant.per_cell);
  said.at("per_cell_spread").get_to(variant.per_cell_spread);
  return ready;
}

void BenchWorker::begin_warm_up() {
  process_.send(command("warm up"));
}

double BenchWorker::wait_warm_up() {
  return Json::parse(process_.receive()).get<double>();
}

void BenchWorker::begin_steps(Index steps) {
  process_.send(command("steps", steps));
}

BenchWorker::Times BenchWorker::wait_steps() {
  const Json said = Json::parse(process_.receive());
  return {said.at(0).get<double>(), said.at(1).get<double>()};
}

double BenchWorker::count_crossings() {
  process_.send(command("count crossings"));
  return Json::parse(process_.receive()).get<double>();
}

BenchWorker::End BenchWorker::finish() {
  process_.send(command("end"));
  const Json said = Json::parse(process_.receive());
  End end;
  for (const Json& stage : said.at("stages"))
    end.stages.push_back({stage.at("name").get<std::string>(), stage.at("ns").get<double>()});
  said.at("resident").get_to(end.resident);
  said.at("peak").get_to(end.peak);
  return end;
}

}  // namespace lahar
