#include "runtime/bench/bench_machine.h"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <barrier>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <thread>

#include "graph/executor.h"
#include "physics/base/simd.h"

namespace lahar {

namespace {

using Clock = std::chrono::steady_clock;

/// First line of a file; empty if it cannot be read.
std::string first_line(const std::string& file) {
  std::string line;
  std::ifstream in(file);
  std::getline(in, line);
  return line;
}

/// The value of `key: value` in a file of such lines; empty if there is none.
std::string value_of(const std::string& file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with(key)) continue;
    const auto at = line.find(':');
    if (at == std::string::npos) continue;
    const auto begin = line.find_first_not_of(" \t", at + 1);
    return begin == std::string::npos ? std::string() : line.substr(begin);
  }
  return {};
}

std::string or_unknown(const std::string& text) {
  return text.empty() ? "unknown" : text;
}

double kilobytes(const std::string& text) {
  return 1024 * std::strtod(text.c_str(), nullptr);
}

struct Cache {
  std::string level, type, size;
};

std::vector<Cache> caches() {
  std::vector<Cache> all;
  for (int i = 0;; ++i) {
    const std::string folder = fmt::format("/sys/devices/system/cpu/cpu0/cache/index{}/", i);
    Cache cache{first_line(folder + "level"), first_line(folder + "type"),
                first_line(folder + "size")};
    if (cache.level.empty()) return all;
    if (cache.type != "Instruction") all.push_back(cache);
  }
}

std::string cache_line() {
  std::string text;
  for (const Cache& cache : caches())
    text += fmt::format("{}L{} {}", text.empty() ? "" : ", ", cache.level, cache.size);
  return or_unknown(text);
}

/// "always [madvise] never" -> "madvise"
std::string chosen_word(const std::string& line) {
  const auto open = line.find('['), close = line.find(']');
  return open == std::string::npos || close == std::string::npos
             ? std::string()
             : line.substr(open + 1, close - open - 1);
}

}  // namespace

BenchMachine describe_machine() {
  BenchMachine machine;
  machine.cpu = or_unknown(value_of("/proc/cpuinfo", "model name"));
  machine.caches = cache_line();
  utsname system{};
  machine.kernel =
      uname(&system) == 0 ? fmt::format("{} {}", system.sysname, system.release) : "unknown";
  machine.governor =
      or_unknown(first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"));
  machine.huge_pages =
      or_unknown(chosen_word(first_line("/sys/kernel/mm/transparent_hugepage/enabled")));
  machine.cores = available_threads();
  machine.memory = kilobytes(value_of("/proc/meminfo", "MemTotal"));
  machine.load = std::strtod(first_line("/proc/loadavg").c_str(), nullptr);
  return machine;
}

double available_memory() {
  const double free = kilobytes(value_of("/proc/meminfo", "MemAvailable"));
  const std::string limit = first_line("/sys/fs/cgroup/memory.max"),
                    used = first_line("/sys/fs/cgroup/memory.current");
  if (limit.empty() || limit == "max" || used.empty()) return free;
  return std::min(free, std::strtod(limit.c_str(), nullptr) - std::strtod(used.c_str(), nullptr));
}

std::size_t bench_array_bytes() {
  constexpr std::size_t least = 64u << 20, most = 256u << 20;
  double last_level = 0;
  for (const Cache& cache : caches()) last_level = std::max(last_level, kilobytes(cache.size));
  return std::clamp(static_cast<std::size_t>(4 * last_level), least, most);
}

namespace {

/// Three arrays of one thread, touched by it first.
class Arrays {
 public:
  explicit Arrays(std::size_t n) : n_(n) {
    for (auto& array : data_) {
      array = std::make_unique_for_overwrite<double[]>(n);
      std::fill_n(array.get(), n, 1.0);
    }
  }
  void triad() {
    double* __restrict a = data_[0].get();
    const double* __restrict b = data_[1].get();
    const double* __restrict c = data_[2].get();
    for (std::size_t i = 0; i < n_; ++i) a[i] = b[i] + 0.5 * c[i];
  }
  void update() {
    double* __restrict a = data_[0].get();
    const double* __restrict b = data_[1].get();
    for (std::size_t i = 0; i < n_; ++i) a[i] = 0.5 * a[i] + b[i];
  }

 private:
  std::size_t n_;
  std::unique_ptr<double[]> data_[3];
};

/// Independent chains of multiply-adds: more than two units of a latency of four can overlap, and
/// as many as fit into 16 registers with two constants.
constexpr int chains = 10;
constexpr int chain_length = 20'000'000 / chains;

double multiply_add(double factor, double term) {
  const Pack b(factor), c(term);
  Pack a[chains];
  for (int k = 0; k < chains; ++k) a[k] = Pack(static_cast<double>(k));
  for (int i = 0; i < chain_length; ++i)
    for (int k = 0; k < chains; ++k) a[k] = a[k] * b + c;
  Pack sum(0.0);
  for (const Pack& value : a) sum += value;
  return reduce(sum);
}

/// Threads that do the same at the same time, and the time from the first beginning to the last
/// end.
class TimedTeam {
 public:
  explicit TimedTeam(int threads) : begin_(size(threads)), end_(size(threads)), meet_(threads) {}

  void pass(int thread, const std::function<void()>& work) {
    const auto i = size(thread);
    meet_.arrive_and_wait();
    begin_[i] = Clock::now();
    work();
    end_[i] = Clock::now();
    meet_.arrive_and_wait();
    if (thread == 0)
      seconds_ = std::chrono::duration<double>(*std::max_element(end_.begin(), end_.end()) -
                                               *std::min_element(begin_.begin(), begin_.end()))
                     .count();
  }
  double seconds() const { return seconds_; }  ///< of the last pass, for thread 0

 private:
  static std::size_t size(int n) { return static_cast<std::size_t>(n); }
  std::vector<Clock::time_point> begin_, end_;
  std::barrier<> meet_;
  double seconds_ = 0;
};

}  // namespace

BenchRates measure_rates(int threads, int passes, std::size_t bytes) {
  const std::size_t n = bytes / sizeof(double);
  BenchRates rates;
  rates.threads = threads;
  TimedTeam team(threads);
  volatile double factor = 0.999, term = 1e-3, sink = 0;  // not known to the compiler
  const auto work = [&](int thread) {
    Arrays arrays(n);
    const auto repeat = [&](double amount, BenchSamples& samples, const auto& task) {
      for (int pass = 0; pass <= passes; ++pass) {  // the first one warms up
        team.pass(thread, task);
        if (thread == 0 && pass > 0) samples.values.push_back(amount * threads / team.seconds());
      }
    };
    const auto elements = static_cast<double>(n);
    repeat(32 * elements, rates.triad, [&] { arrays.triad(); });
    repeat(24 * elements, rates.update, [&] { arrays.update(); });
    repeat(2.0 * lanes<Pack> * chains * chain_length, rates.multiply, [&] {
      const double result = multiply_add(factor, term);
      if (result == 0.0) sink = result;  // never, but it has to be computed
    });
  };
  std::vector<std::jthread> others;
  for (int thread = 1; thread < threads; ++thread) others.emplace_back(work, thread);
  work(0);
  return rates;
}

}  // namespace lahar
