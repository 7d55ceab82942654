#include "tests/properties/random_cases.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <thread>

namespace fs = std::filesystem;

namespace lahar::test {

namespace {

constexpr int most_tries = 150;        ///< to make one case smaller
constexpr std::size_t most_shown = 3;  ///< failures

std::optional<std::string> environment(const char* name) {
  const char* value = std::getenv(name);
  return value && *value ? std::optional<std::string>(value) : std::nullopt;
}

Seeds chosen(Seeds seeds) {
  const auto given = environment("LAHAR_SCENARIOS");
  if (!given) return seeds;
  const auto colon = given->find(':');
  seeds.first = std::stoull(given->substr(0, colon));
  seeds.count = colon == std::string::npos ? 1 : std::stoi(given->substr(colon + 1));
  return seeds;
}

/// Says which case hangs: the test program is killed then, and says nothing itself.
class HangWatch {
 public:
  explicit HangWatch(bool speaks) {
    if (speaks) thread_ = std::jthread([this](std::stop_token stop) { watch(stop); });
  }
  void begin(std::uint64_t seed) {
    seed_ = seed;
    ++cases_;
  }

 private:
  void watch(const std::stop_token& stop) {
    constexpr auto moment = std::chrono::milliseconds(100);
    constexpr int patience = 1200;  // moments
    int seen = 0, moments = 0;
    while (!stop.stop_requested()) {
      std::this_thread::sleep_for(moment);
      const int now = cases_;
      moments = now == seen ? moments + 1 : 0;
      seen = now;
      if (moments == patience)
        std::fprintf(stderr, "random scenarios: seed %llu takes two minutes\n",
                     static_cast<unsigned long long>(seed_.load()));
    }
  }
  std::atomic<std::uint64_t> seed_{0};
  std::atomic<int> cases_{0};
  std::jthread thread_;
};

Choices choices_of(std::uint64_t seed) {
  return Choices(seed, values_in(environment("LAHAR_CHOICES").value_or("")));
}

class Trial {
 public:
  Trial(const Property& property, const Speaker& speaker)
      : property_(property), speaker_(speaker) {}

  Verdict verdict(Choices& choices) {
    const GeneratedCase made = generate_case(choices);
    const fs::path folder = speaker_.folder / fmt::format("case{}", number_++);
    if (speaker_.speaks) {
      fs::create_directories(folder);
      write_case(made, folder);
    }
    speaker_.wait_for_all();
    const Verdict verdict = property_(made, folder, choices);
    speaker_.wait_for_all();
    if (speaker_.speaks) fs::remove_all(folder);
    return verdict;
  }

  std::string report(std::uint64_t seed, const Choices::Values& values, const Verdict& first) {
    Verdict last = first;
    const auto fails = [&](Choices::Values& simpler) {
      Choices choices(simpler);
      const Verdict now = verdict(choices);
      simpler = choices.values();
      if (!now.refused.empty() || now.difference.empty()) return false;
      last = now;
      return true;
    };
    const Choices::Values smallest = shrink(values, fails, most_tries);
    Choices choices(smallest);
    const GeneratedCase made = generate_case(choices);
    std::string kept = "";
    if (speaker_.speaks) {
      const fs::path folder = fs::temp_directory_path() / fmt::format("lahar-scenario-{}", seed);
      fs::create_directories(folder);
      write_case(made, folder);
      kept = folder.string();
    }
    return fmt::format(
        "seed {}: {}\n\nthe smallest scenario that still fails: {}\nchoices: {}\n{}\n{}\n"
        "kept in {}\nagain: LAHAR_SCENARIOS={} {}\n",
        seed, first.difference, last.difference, text_of(smallest),
        last.error.empty() ? "" : "runs end with: " + last.error, made.text, kept, seed,
        speaker_.command);
  }

 private:
  const Property& property_;
  const Speaker& speaker_;
  int number_ = 0;
};

/// The part of a message that tells one kind of error from others: words in front of numbers.
std::string kind_of(std::string message, bool of_run) {
  // Of what a task found, where it was in the mesh does not matter.
  if (const auto stage = of_run ? message.find("stage ") : message.npos;
      stage != std::string::npos) {
    const auto words = message.find("/s ", stage), place = message.find(" m ", stage);
    const auto end = words != std::string::npos ? words + 2 : place;
    message = message.substr(0, message.find(':', stage)) + ":" +
              (end == std::string::npos ? "" : message.substr(end));
    message = message.substr(message.find("stage "));
  }
  std::string kind;
  for (const char c : message)
    if (c < '0' || c > '9') kind += c;
  return kind.substr(0, 160);
}

}  // namespace

Tally try_cases(Seeds seeds, const Property& property, const Speaker& speaker) {
  seeds = chosen(seeds);
  Tally tally;
  Trial trial(property, speaker);
  HangWatch watch(speaker.speaks);
  for (std::uint64_t seed = seeds.first; tally.cases < seeds.count; ++seed, ++tally.cases) {
    watch.begin(seed);
    Choices choices = choices_of(seed);
    const Verdict verdict = trial.verdict(choices);
    if (!verdict.refused.empty()) {
      ++tally.refused;
      ++tally.reasons["refused: " + kind_of(verdict.refused, false)];
    }
    if (!verdict.error.empty()) {
      ++tally.ended_early;
      ++tally.reasons["ended: " + kind_of(verdict.error, true)];
    }
    if (verdict.difference.empty()) continue;
    if (speaker.speaks)  // making it smaller takes a while
      std::fprintf(stderr, "random scenarios: seed %llu fails: %.200s\n",
                   static_cast<unsigned long long>(seed), verdict.difference.c_str());
    tally.failures.push_back(tally.failures.size() < most_shown
                                 ? trial.report(seed, choices.values(), verdict)
                                 : fmt::format("seed {}: {}", seed, verdict.difference));
  }
  return tally;
}

std::string summary(const Tally& tally) {
  std::string text =
      fmt::format("{} scenarios, {} refused ({:.1f} %), {} ended early", tally.cases, tally.refused,
                  100.0 * tally.refused / std::max(tally.cases, 1), tally.ended_early);
  if (environment("LAHAR_SCENARIOS"))
    for (const auto& [reason, count] : tally.reasons)
      text += fmt::format("\n{:6} {}", count, reason);
  return text;
}

}  // namespace lahar::test
