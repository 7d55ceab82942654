// Fuzzing without a fuzzer's library: random changes of the corpus and of what was read without an
// error before, from a seed. Deterministic but for the time.
//
//     fuzz TARGET [--runs N] [--seconds S] [--seed K] [--accepted FOLDER]    look for failures
//     fuzz TARGET FILE...               run these inputs, and say what is wrong in them
//     fuzz TARGET --corpus FOLDER       write the inputs to begin with
//     fuzz --list
//
// An input that fails is written to ./fuzz-TARGET-failure; the exit status is then 1. --accepted:
// the first file of inputs that were accepted goes to that folder, of at most 5000.
#include <dlfcn.h>
#include <execinfo.h>
#include <malloc.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/mutation.h"
#include "tests/fuzz/targets.h"

namespace {

using namespace lahar::fuzz;
namespace fs = std::filesystem;

constexpr int most_seconds = 20;  // of processor time: others may want the processor, too
rlim_t most_memory = 0;           // of the target
constexpr std::size_t most_bytes = std::size_t{1} << 20;  // of an input

std::string failure_file;
const std::string* current = nullptr;

/// What is left to do where HDF5 crashes or takes too long: a defect of the library ends the
/// process, which begins anew with another seed.
struct Rest {
  std::string target;
  std::uint64_t seed = 1;
  long runs = 0, crashes = 0;
  double seconds = 0;
};
Rest rest;

/// Whether HDF5 was in what a file says of itself. Where it moves values, the fault may be who
/// called it.
bool is_of_hdf5() {
  std::array<void*, 64> frames{};
  const int n = ::backtrace(frames.data(), static_cast<int>(frames.size()));
  bool within = false;
  for (int k = 0; k < n; ++k) {
    Dl_info info{};
    if (::dladdr(frames[static_cast<std::size_t>(k)], &info) == 0 || !info.dli_fname) continue;
    if (!std::strstr(info.dli_fname, "libhdf5")) continue;
    within = true;
    const std::string_view name = info.dli_sname ? info.dli_sname : "";
    if (name == "H5Dread" || name == "H5Aread") return false;
  }
  return within;
}

/// What C++ has taken, and had when it got no more [bytes]. HDF5 is C.
std::atomic<std::size_t> taken_by_cpp{0}, taken_at_failure{0};

/// Whether others than C++ have what there is: HDF5 takes all for a damaged file, such as one in
/// which the free blocks of a heap are a ring.
bool is_taken_by_hdf5() {
  return taken_at_failure > 0 && taken_at_failure < most_memory / 4;
}

void go_on() {
  std::cerr << rest.target
            << ": HDF5 crashes, or takes too long or too much, which is not counted; on with seed "
            << rest.seed + 1 << "\n";
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  const std::array<std::string, 10> words{"fuzz",      rest.target,
                                          "--seed",    std::to_string(rest.seed + 1),
                                          "--runs",    std::to_string(rest.runs),
                                          "--seconds", std::to_string(rest.seconds),
                                          "--crashes", std::to_string(rest.crashes + 1)};
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  ::execv("/proc/self/exe", arguments.data());
}

extern "C" void on_signal(int signal) {
  // (More than may be called here; but what failed was HDF5, none of these.)
  const bool may_be_its =
      signal == SIGSEGV || signal == SIGFPE || signal == SIGBUS || signal == SIGPROF;
  if (may_be_its && !rest.target.empty() && is_of_hdf5()) go_on();
  // Only what may be called here.
  const char* words = signal == SIGPROF ? "an input takes too long\n" : "an input crashes\n";
  [[maybe_unused]] auto ignored = ::write(STDERR_FILENO, words, std::strlen(words));
  if (FILE* out = current ? std::fopen(failure_file.c_str(), "wb") : nullptr) {
    std::fwrite(current->data(), 1, current->size(), out);
    std::fclose(out);
  }
  std::_Exit(1);
}

/// on_signal() comes after so many seconds of processor time; 0 = never.
void limit_time(int seconds) {
  const itimerval limit{.it_interval = {}, .it_value = {.tv_sec = seconds, .tv_usec = 0}};
  ::setitimer(ITIMER_PROF, &limit, nullptr);
}

/// What came of an input: `failed`, or what was wrong in it, if anything.
struct Answer {
  bool failed = false;
  std::string refused = {};
  bool accepted() const { return !failed && refused.empty(); }
};

Answer answer(const Target& target, const std::string& input) {
  current = &input;
  taken_at_failure = 0;
  limit_time(most_seconds);
  std::string why;
  Answer result;
  try {
    result.refused =
        run(target, {reinterpret_cast<const std::uint8_t*>(input.data()), input.size()});
  } catch (const std::bad_alloc&) {
    if (!rest.target.empty() && is_taken_by_hdf5()) go_on();
    why = "asks for too much memory";
  } catch (const std::exception& error) {
    why = std::string("internal error: ") + error.what();
  } catch (...) {
    why = "throws something";
  }
  limit_time(0);
  current = nullptr;
  if (why.empty()) return result;
  std::cerr << target.name << ": " << why << "\n";
  write(failure_file, input);
  result.failed = true;
  return result;
}

/// The inputs to begin with, which have to be what their names say; false if one is not.
bool begin_with(const Target& target, std::vector<std::string>& pool) {
  bool good = true;
  for (const Seed& seed : corpus(target)) {
    const Answer got = answer(target, seed.text);
    if (got.failed || got.accepted() != seed.valid) {
      std::cerr << target.name << ": seed " << seed.name << " is "
                << (got.failed   ? "a failure"
                    : seed.valid ? "refused: " + got.refused
                                 : "accepted")
                << "\n";
      good = false;
    }
    pool.push_back(seed.text);
  }
  if (pool.empty()) std::cerr << target.name << ": there are no inputs to begin with\n";
  return good && !pool.empty();
}

struct Plan {
  long runs = 0;
  double seconds = 0;
  std::uint64_t seed = 1;
  std::string accepted = {};  ///< folder
  long crashes = 0;           ///< of HDF5, before
};

int fuzz(const Target& target, const Plan& plan) {
  Random random(plan.seed);
  const Mutator mutator;
  std::vector<std::string> pool;
  if (!begin_with(target, pool)) return 1;
  const auto begin = std::chrono::steady_clock::now();
  const auto passed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  constexpr long most_accepted = 5000;
  long done = 0, accepted = 0;
  const std::size_t first = pool.size(), most = first + 500;
  std::size_t largest_seed = 0;
  for (const std::string& input : pool) largest_seed = std::max(largest_seed, input.size());
  rest = {std::string(target.name), plan.seed, plan.runs, plan.crashes};
  for (; (plan.runs <= 0 || done < plan.runs) && (plan.seconds <= 0 || passed() < plan.seconds);
       ++done) {
    if (plan.runs > 0) rest.runs = plan.runs - done;
    if (plan.seconds > 0) rest.seconds = std::max(0.1, plan.seconds - passed());
    const std::string input =
        mutator.mutate(pool[random() % pool.size()], target.form, pool, random);
    if (input.size() > most_bytes) continue;
    const Answer got = answer(target, input);
    if (got.failed) {
      std::cerr << "after " << done << " inputs, seed " << plan.seed << "; it is in "
                << failure_file << "\n";
      return 1;
    }
    if (!got.accepted()) continue;
    if (!plan.accepted.empty() && accepted < most_accepted)
      write(fs::path(plan.accepted) / (std::to_string(accepted) + ".json"),
            unbundle(input).front().text);
    ++accepted;
    // What is valid goes on changing, far from all that was written by hand; small ones are fast.
    if (input.size() > 4 * largest_seed) continue;
    if (pool.size() < most)
      pool.push_back(input);
    else
      pool[first + random() % (most - first)] = input;
  }
  std::cout << target.name << ": " << done << " inputs in " << passed() << " s, " << accepted
            << " without an error";
  if (plan.crashes > 0) std::cout << "; before, HDF5 crashed " << plan.crashes << " times";
  std::cout << "\n";
  return 0;
}

int run_files(const Target& target, const std::vector<std::string>& files) {
  int status = 0;
  for (const std::string& file : files) {
    const Answer got = answer(target, contents(file));
    if (got.failed) status = 1;
    std::cout << file << ": "
              << (got.failed       ? "a failure"
                  : got.accepted() ? "accepted"
                                   : "refused: " + got.refused)
              << "\n";
  }
  return status;
}

}  // namespace

#if !defined(__SANITIZE_ADDRESS__)
void* operator new(std::size_t size) {
  void* const memory = std::malloc(std::max<std::size_t>(size, 1));
  if (!memory) {
    taken_at_failure = std::max<std::size_t>(taken_by_cpp, 1);
    throw std::bad_alloc();
  }
  taken_by_cpp += ::malloc_usable_size(memory);
  return memory;
}
void operator delete(void* memory) noexcept {
  taken_by_cpp -= ::malloc_usable_size(memory);
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  operator delete(memory);
}
#endif

int main(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty() || words[0] == "--list") {
    for (const Target& one : targets()) std::cout << one.name << "  " << one.what << "\n";
    return 0;
  }
  const Target& chosen = target(words[0]);
  most_memory = chosen.memory;
  failure_file = "fuzz-" + std::string(chosen.name) + "-failure";
#if !defined(__SANITIZE_ADDRESS__)
  const rlimit memory{most_memory, most_memory};
  ::setrlimit(RLIMIT_AS, &memory);
#endif
  for (const int signal : {SIGPROF, SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL})
    std::signal(signal, on_signal);
  Plan plan;
  std::vector<std::string> files;
  for (std::size_t k = 1; k < words.size(); ++k) {
    const bool has_value = k + 1 < words.size();
    if (words[k] == "--runs" && has_value) {
      plan.runs = std::atol(words[++k].c_str());
    } else if (words[k] == "--seconds" && has_value) {
      plan.seconds = std::atof(words[++k].c_str());
    } else if (words[k] == "--seed" && has_value) {
      plan.seed = std::strtoull(words[++k].c_str(), nullptr, 10);
    } else if (words[k] == "--accepted" && has_value) {
      plan.accepted = words[++k];
      fs::create_directories(plan.accepted);
    } else if (words[k] == "--crashes" && has_value) {
      plan.crashes = std::atol(words[++k].c_str());
    } else if (words[k] == "--corpus" && has_value) {
      const fs::path folder = words[++k];
      fs::create_directories(folder);
      for (const Seed& seed : corpus(chosen)) write(folder / seed.name, seed.text);
      return 0;
    } else {
      files.push_back(words[k]);
    }
  }
  if (!files.empty()) return run_files(chosen, files);
  if (plan.runs <= 0 && plan.seconds <= 0) plan.seconds = 10;
  return fuzz(chosen, plan);
}
