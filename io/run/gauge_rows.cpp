#include "io/run/gauge_rows.h"

#include "io/base/numbers.h"

namespace lahar {

std::filesystem::path gauges_folder(const std::filesystem::path& run) {
  return run / "gauges";
}

std::filesystem::path gauge_file(const std::filesystem::path& run, const std::string& name) {
  return gauges_folder(run) / (name + ".csv");
}

std::string gauge_header(const GaugeTable& table) {
  std::string line = "step [-],time [s]";
  for (const GaugeColumn& column : table.columns)
    line += "," + column.name + " [" + column.unit + "]";
  return line + '\n';
}

std::string gauge_lines(const GaugeTable& table, const GaugeRows& rows, std::size_t k) {
  std::string lines;
  const std::vector<double>& values = rows.values[k];
  const std::size_t width = table.columns.size();
  for (std::size_t first = 0; first + width <= values.size(); first += width) {
    append_number(lines, rows.step);
    lines += ',';
    append_number(lines, rows.time);
    for (std::size_t c = 0; c < width; ++c) {
      lines += ',';
      append_number(lines, values[first + c]);
    }
    lines += '\n';
  }
  return lines;
}

}  // namespace lahar
