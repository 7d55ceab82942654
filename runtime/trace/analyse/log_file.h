/// \file The trace file of one rank, read and checked: whoever uses it need not doubt it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runtime/trace/analyse/log.h"
#include "runtime/trace/record/record.h"

namespace lahar {

/// What a trace may say at most; programs and tables that read it count on that.
inline constexpr std::int64_t most_trace_ranks = 1 << 20, most_trace_threads = 65535,
                              most_trace_phases = 127, most_trace_patches = (1 << 24) - 2,
                              most_trace_step = INT32_MAX;

/// Throws InputError: the file cannot be used, and what to do.
[[noreturn]] void refuse_trace(const std::string& file, const std::string& what,
                               const std::string& hint = "record it again: lahar run --trace");

/// An object of a trace's descriptions. All throw InputError where a value is missing, of another
/// type or beyond its bounds.
class TraceFields {
 public:
  TraceFields(const std::string& file, const nlohmann::json& json);

  std::int64_t whole(const char* key, std::int64_t low, std::int64_t high) const;
  std::uint64_t tick(const char* key) const;
  double real(const char* key, double low, double high) const;
  bool flag(const char* key) const;
  std::string text(const char* key) const;
  const nlohmann::json& list(const char* key) const;
  TraceFields operator[](const nlohmann::json& json) const { return {file_, json}; }
  [[noreturn]] void refuse(const char* key) const;

 private:
  const nlohmann::json& at(const char* key) const;
  const std::string& file_;
  const nlohmann::json& json_;
};

/// The sections of one rank's file.
struct TraceFile {
  std::string name;
  nlohmann::json head = {};
  std::vector<nlohmann::json> graphs = {};
  std::vector<TraceRecord> records = {};

  /// [s] of a tick on rank 0's clock, from `origin` on: a straight line through the two readings.
  double seconds(std::uint64_t tick, std::uint64_t origin, double seconds_per_tick) const {
    const auto since = static_cast<double>(static_cast<std::int64_t>(tick - first_tick));
    const double offset = first_offset + since * drift;
    return (static_cast<double>(static_cast<std::int64_t>(tick - origin)) + offset) *
           seconds_per_tick;
  }
  std::uint64_t first_tick = 0;
  double first_offset = 0, drift = 0, bound = 0, per_tick = 0;

  TraceFields fields() const { return {name, head}; }
};

/// Throws InputError where it is not a trace, incomplete, damaged or of another version. What
/// records say of phases, ranks and steps is within the bounds of the head.
TraceFile read_trace_file(const std::filesystem::path& path);

/// What the head of a file says of the run; without threads and hosts of the ranks.
TraceRun run_in(const TraceFile& file);

/// The patches of all ranks from `g`-th partition on; neighbours are so in both directions.
TraceGraph graph_in(const std::vector<TraceFile>& files, std::size_t g);

}  // namespace lahar
