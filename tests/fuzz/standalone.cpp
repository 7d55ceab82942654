// Fuzzing without a fuzzer's library: random changes of the corpus and of what was read without an
// error before, from a seed. Deterministic but for the time.
//
//     fuzz TARGET [--runs N] [--seconds S] [--seed K]     look for failures
//     fuzz TARGET FILE...                                 run these inputs
//     fuzz --list
//
// An input that fails is written to ./fuzz-TARGET-failure; the exit status is then 1.
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <iostream>
#include <new>
#include <sstream>
#include <string>

#include "physics/error.h"
#include "tests/fuzz/mutation.h"
#include "tests/fuzz/targets.h"

namespace {

using namespace lahar::fuzz;

constexpr unsigned most_seconds = 20;
/// Of the address space: more than any of these inputs asks for.
constexpr rlim_t most_memory = rlim_t{6} << 30;

std::string failure_file;
const std::string* current = nullptr;
long accepted = 0;

extern "C" void on_signal(int signal) {
  // Only what may be called here.
  const char* words = signal == SIGALRM ? "an input takes too long\n" : "an input crashes\n";
  [[maybe_unused]] auto ignored = ::write(STDERR_FILENO, words, std::strlen(words));
  if (FILE* out = current ? std::fopen(failure_file.c_str(), "wb") : nullptr) {
    std::fwrite(current->data(), 1, current->size(), out);
    std::fclose(out);
  }
  std::_Exit(1);
}

/// True if it was an answer.
bool answers(const Target& target, const std::string& input) {
  current = &input;
  ::alarm(most_seconds);
  std::string why;
  try {
    accepted += run(target, {reinterpret_cast<const std::uint8_t*>(input.data()), input.size()});
  } catch (const std::bad_alloc&) {
    why = "asks for too much memory";
  } catch (const std::exception& error) {
    why = std::string("internal error: ") + error.what();
  } catch (...) {
    why = "throws something";
  }
  ::alarm(0);
  current = nullptr;
  if (why.empty()) return true;
  std::cerr << target.name << ": " << why << "\n";
  std::ofstream(failure_file, std::ios::binary) << input;
  return false;
}

int fuzz(const Target& target, long runs, double seconds, std::uint64_t seed) {
  Random random(seed);
  const Mutator mutator;
  std::vector<std::string> pool = corpus(target);
  for (const std::string& input : pool)
    if (!answers(target, input)) return 1;
  if (pool.empty()) pool.emplace_back();
  const auto begin = std::chrono::steady_clock::now();
  const auto passed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  accepted = 0;
  const std::size_t first = pool.size(), most = first + 500;
  long done = 0;
  for (; (runs <= 0 || done < runs) && (seconds <= 0 || passed() < seconds); ++done) {
    const std::string input =
        mutator.mutate(pool[random() % pool.size()], target.json, pool, random);
    if (input.size() > (1 << 20)) continue;
    const long before = accepted;
    if (!answers(target, input)) {
      std::cerr << "after " << done << " inputs, seed " << seed << "; it is in " << failure_file
                << "\n";
      return 1;
    }
    if (accepted == before) continue;
    // What is valid goes on changing, far from all that was written by hand.
    if (pool.size() < most)
      pool.push_back(input);
    else
      pool[first + random() % (most - first)] = input;
  }
  std::cout << target.name << ": " << done << " inputs in " << passed() << " s, " << accepted
            << " without an error\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty() || words[0] == "--list") {
    for (const Target& one : targets()) std::cout << one.name << "  " << one.what << "\n";
    return 0;
  }
  const Target& chosen = target(words[0]);
  failure_file = "fuzz-" + std::string(chosen.name) + "-failure";
#if !defined(__SANITIZE_ADDRESS__)
  const rlimit memory{most_memory, most_memory};
  ::setrlimit(RLIMIT_AS, &memory);
#endif
  for (const int signal : {SIGALRM, SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL})
    std::signal(signal, on_signal);
  long runs = 0;
  double seconds = 0;
  std::uint64_t seed = 1;
  std::vector<std::string> files;
  for (std::size_t k = 1; k < words.size(); ++k) {
    const bool has_value = k + 1 < words.size();
    if (words[k] == "--runs" && has_value) {
      runs = std::atol(words[++k].c_str());
    } else if (words[k] == "--seconds" && has_value) {
      seconds = std::atof(words[++k].c_str());
    } else if (words[k] == "--seed" && has_value) {
      seed = std::strtoull(words[++k].c_str(), nullptr, 10);
    } else {
      files.push_back(words[k]);
    }
  }
  if (files.empty()) return fuzz(chosen, runs, seconds > 0 || runs > 0 ? seconds : 10, seed);
  int status = 0;
  for (const std::string& file : files) {
    std::ifstream in(file, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    if (!answers(chosen, text.str())) status = 1;
  }
  return status;
}
