/// \file What is fuzzed: functions that read what a user or another program wrote.
///
/// A target takes bytes and does with them what the program does with a file of these bytes. Errors
/// of the kinds in physics/base/error.h are right answers; whatever else it throws is a failure, as
/// are a crash, more than 20 s, memory beyond what the input asks for, and a value that was
/// accepted though it cannot be (tests/fuzz/accepted.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lahar::fuzz {

using Bytes = std::span<const std::uint8_t>;

/// How inputs are changed (mutation.h).
enum class Form {
  bundle,    ///< several files, of which the first is JSON
  bytes,     ///< one file of any kind
  sections,  ///< sections.h
  formats,   ///< several files; each is changed as its ending says
};

struct Seed {
  std::string name, text;
  bool valid = true;  ///< the target has to accept it
};

struct Target {
  std::string_view name;
  std::string_view what;
  Form form;
  void (*run)(Bytes input);
  std::vector<Seed> (*seeds)();  ///< besides those in corpus/NAME
  /// [bytes] of address space, more than any of these inputs asks for.
  std::uint64_t memory = std::uint64_t{6} << 30;
};

std::span<const Target> targets();
/// Throws std::invalid_argument for a name that is none.
const Target& target(std::string_view name);

/// Inputs to begin with: seeds and the files in corpus/NAME, in the order of their names. Those
/// named refused-* once were failures, and have to be refused.
std::vector<Seed> corpus(const Target& target);

/// Runs a target; empty if nothing was wrong with the input, else what. Throws what is not allowed
/// to come out.
std::string run(const Target& target, Bytes input);

/// A text with several files, which follow a line "=== NAME"; what is before the first of these is
/// the scenario.
struct BundledFile {
  std::string name, text;
};
std::vector<BundledFile> unbundle(std::string_view text);
std::string bundle(const std::vector<BundledFile>& files);

// --- for targets ------------------------------------------------------------------------------

/// A folder of this process, in memory where that is possible; gone when it ends.
const std::filesystem::path& work_folder();
std::string_view text_of(Bytes input);
void write(const std::filesystem::path& file, std::string_view text);
std::string contents(const std::filesystem::path& file);
/// Throws std::logic_error where a terminal would get control characters.
void check_shown(std::string_view text);
/// A file of corpus/scenario.
std::string example(std::string_view name);

void run_scenario(Bytes input);
void run_dialect(Bytes input);  ///< as CB-Geo MPM would run it
void run_material(Bytes input);
std::vector<Seed> scenario_seeds();
std::vector<Seed> dialect_seeds();
void run_csv(Bytes input);
void run_frame(Bytes input);
void run_checkpoint(Bytes input);
void run_cbgeo(Bytes input);
std::vector<Seed> csv_seeds();
std::vector<Seed> frame_seeds();
std::vector<Seed> checkpoint_seeds();
std::vector<Seed> cbgeo_seeds();
void run_trace(Bytes input);
std::vector<Seed> trace_seeds();
void run_restart(Bytes input);
std::vector<Seed> restart_seeds();
void run_folder(Bytes input);
std::vector<Seed> folder_seeds();
void run_geometry(Bytes input);
void run_mesh(Bytes input);
std::vector<Seed> mesh_seeds();
void run_network(Bytes input);
void run_bench(Bytes input);
std::vector<Seed> bench_seeds();

}  // namespace lahar::fuzz
