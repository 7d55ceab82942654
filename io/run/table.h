/// \file Tables of a run: history.csv, rigid_bodies.csv, gauges.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace lahar {

struct TableColumn {
  std::string name, unit;
  std::vector<double> values;      ///< NaN where a text is no number
  std::vector<std::string> texts;  ///< of columns with other texts, else empty
};

struct Table {
  std::vector<TableColumn> columns;
  std::size_t rows() const { return columns.empty() ? 0 : columns.front().values.size(); }
  const TableColumn* find(std::string_view name) const;
  /// The values of a column; zeros where there is none.
  std::vector<double> values(std::string_view name) const;
};

/// Comma-separated values below a line of names, perhaps as `name [unit]`. A last line that is not
/// complete, as of a run that goes on, is left out. Throws IoError.
Table read_table(const std::filesystem::path& file);
Table table_of_text(std::string_view text);

/// The head of such a table and its last row, without the work of reading all rows.
Table read_last_row(const std::filesystem::path& file);

}  // namespace lahar
