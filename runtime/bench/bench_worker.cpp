#include "runtime/bench/bench_worker.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "io/base/atomic_file.h"
#include "runtime/bench/bench_traffic.h"
#include "runtime/output/frame_output.h"
#include "runtime/trace/record/recorder.h"

namespace lahar {

using Message = nlohmann::json;

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
  FrameOutput& frames() { return *frames_; }

 private:
  std::filesystem::path folder_;
  std::optional<FrameOutput> frames_;
};

/// A trace as a run writes it, in a file that goes with the process.
class Trace {
 public:
  Trace()
      : file_(std::filesystem::temp_directory_path() /
              fmt::format("lahar-bench-{}.trace", getpid())),
        recorder_(file_, TraceWindow{}, "{}") {
    TraceRecorder::activate(&recorder_);
  }
  ~Trace() {
    TraceRecorder::activate(nullptr);
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
  }

 private:
  std::filesystem::path file_;
  TraceRecorder recorder_;
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

class Worker {
 public:
  explicit Worker(const BenchJob& job) : job_(job) {
    if (job.output) output_.emplace();
    if (job.traced) trace_.emplace();
    const auto begin = Clock::now();
    AnyModel any = job.model();
    ready_["read"] = seconds_since(begin);
    std::visit(
        [&]<int Dim>(const Model<Dim>& model) {
          ready_["bytes"] =
              bytes_per_particle_step<Dim>(model.analysis, model.mesh->is_cartesian());
          const auto [mean, spread] = occupation(model.particles.cell);
          ready_["per_cell"] = mean;
          ready_["per_cell_spread"] = spread;
        },
        any);
    construct(std::move(any));
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
      const Message asked = Message::parse(parent.receive());
      parent.send(answer_to(asked.at("do"), asked.at("steps")).dump());
    }
  }

 private:
  void construct(AnyModel any) {
    std::visit(
        [&]<int Dim>(Model<Dim>& model) {
          locate_ = [mesh = model.mesh](const Frame& frame, std::size_t p) {
            return mesh->locate(Eigen::Map<const Vec<Dim>>(&frame.coordinates[p * Dim])).cell;
          };
          if (!output_) return;
          model.output.history_steps = 1;
          model.output.frame_steps = 4;
        },
        any);
    Observer observer;
    if (output_) {
      observer.history = [](const HistoryRow&) {};
      observer.frame = [this](FramePieces&& frame) { output_->frames().add(std::move(frame)); };
      observer.large_frame = [this](const FrameSource& frame) { output_->frames().write(frame); };
    }
    const auto begin = Clock::now();
    simulation_.emplace(std::move(any), job_.execution, std::move(observer));
    ready_["construct"] = seconds_since(begin);
  }

  Message answer_to(const std::string& what, Index steps) {
    if (what == "warm up") return warm_up();
    if (what == "steps") {
      const BenchWorker::Times times = timed(steps);
      return {times.wall,     times.cpu,         times.iterations,   times.solving,
              times.products, times.multiplying, times.product_bytes};
    }
    if (what == "count crossings") return count_crossings();
    return end();
  }

  BenchWorker::Times timed(Index steps) {
    if (job_.life > 0 && simulation_->step() + steps > job_.life) {
      construct(job_.model());
      before_.clear();  // the new one's times are from its start
      timed_steps_ = 0;
    }
    const SolveCounts before = simulation_->solves();
    const double cpu = cpu_seconds();
    const auto begin = Clock::now();
    simulation_->advance(steps);
    timed_steps_ += steps;
    BenchWorker::Times times{seconds_since(begin), cpu_seconds() - cpu};
    const SolveCounts after = simulation_->solves();
    times.iterations = static_cast<double>(after.linear_iterations - before.linear_iterations);
    times.solving = after.linear - before.linear;
    times.products = static_cast<double>(after.products.count - before.products.count);
    times.multiplying = after.products.seconds - before.products.seconds;
    times.product_bytes = after.products.bytes - before.products.bytes;
    return times;
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
    for (std::size_t p = 0; p < all.size(); ++p) all[p] = locate_(frame, p);
    return all;
  }

  Message end() {
    Message stages = Message::array();
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
  std::function<Index(const Frame&, std::size_t p)> locate_;  ///< the cell of a particle
  std::optional<Output> output_;  // outlives the simulation, which writes to it
  std::optional<Trace> trace_;    // the same
  std::optional<Simulation> simulation_;
  Message ready_;
  std::vector<StageTiming> before_;
  Index timed_steps_ = 0;
  double particles_ = 0;
};

std::string command(const char* what, Index steps = 0) {
  return Message::object({{"do", what}, {"steps", steps}}).dump();
}

}  // namespace

BenchWorker::BenchWorker(const BenchJob& job)
    : process_([&job](ChildProcess& parent) { Worker(job).serve(parent); }) {}

BenchWorker::Ready BenchWorker::ready() {
  const Message said = Message::parse(process_.receive());
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
  return Message::parse(process_.receive()).get<double>();
}

void BenchWorker::begin_steps(Index steps) {
  process_.send(command("steps", steps));
}

BenchWorker::Times BenchWorker::wait_steps() {
  const Message said = Message::parse(process_.receive());
  const auto at = [&](std::size_t k) { return said.at(k).get<double>(); };
  return {at(0), at(1), at(2), at(3), at(4), at(5), at(6)};
}

double BenchWorker::count_crossings() {
  process_.send(command("count crossings"));
  return Message::parse(process_.receive()).get<double>();
}

BenchWorker::End BenchWorker::finish() {
  process_.send(command("end"));
  const Message said = Message::parse(process_.receive());
  End end;
  for (const Message& stage : said.at("stages"))
    end.stages.push_back({stage.at("name").get<std::string>(), stage.at("ns").get<double>()});
  said.at("resident").get_to(end.resident);
  said.at("peak").get_to(end.peak);
  return end;
}

}  // namespace lahar
