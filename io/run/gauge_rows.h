/// \file Tables of gauges: RUN/gauges/NAME.csv.
///
/// The header has `name [unit]` of each column, the first two are `step [-]` and `time [s]`.
/// Numbers are the shortest that read back to the same bits; what there is nothing to measure of is
/// nan.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

struct GaugeColumn {
  std::string name, unit, meaning;
};

/// What a gauge measures, but for step and time.
struct GaugeTable {
  std::string name;
  std::vector<GaugeColumn> columns;
};

/// What all gauges measured after `step` updates.
struct GaugeRows {
  Index step = 0;
  double time = 0;                          ///< [s]
  std::vector<std::vector<double>> values;  ///< by gauge: row after row, all columns
};

std::filesystem::path gauges_folder(const std::filesystem::path& run);
/// Where the table of a gauge is.
std::filesystem::path gauge_file(const std::filesystem::path& run, const std::string& name);

std::string gauge_header(const GaugeTable& table);  ///< with newline
/// The rows of gauge `k`, with newlines.
std::string gauge_lines(const GaugeTable& table, const GaugeRows& rows, std::size_t k);

}  // namespace lahar
