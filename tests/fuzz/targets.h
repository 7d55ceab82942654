/// \file What is fuzzed: functions that read what a user or another program wrote.
///
/// A target takes bytes and does with them what the program does with a file of these bytes. Errors
/// of the kinds in physics/error.h are right answers; whatever else it throws is a failure, as are
/// a crash, more than 20 s, and memory beyond what the input asks for.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lahar::fuzz {

using Bytes = std::span<const std::uint8_t>;

struct Target {
  std::string_view name;
  std::string_view what;
  bool json;  ///< inputs are bundles whose first file is JSON (mutation.h)
  void (*run)(Bytes input);
  std::vector<std::string> (*seeds)();  ///< besides those in corpus/NAME
};

std::span<const Target> targets();
/// Throws std::invalid_argument for a name that is none.
const Target& target(std::string_view name);

/// Inputs to begin with: seeds and the files in corpus/NAME, in the order of their names.
std::vector<std::string> corpus(const Target& target);

/// Runs a target; true if nothing was wrong with the input. Throws what is not allowed to come out.
bool run(const Target& target, Bytes input);

/// A text with several files, which follow a line "=== NAME"; what is before the first of these is
/// the scenario.
struct BundledFile {
  std::string name, text;
};
std::vector<BundledFile> unbundle(std::string_view text);
std::string bundle(const std::vector<BundledFile>& files);

}  // namespace lahar::fuzz
