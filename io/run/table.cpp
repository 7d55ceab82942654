#include "io/run/table.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "io/base/atomic_file.h"

namespace lahar {

namespace {

/// Of rigid_bodies.csv: names.
constexpr std::string_view body_column = "body";

/// Texts may be quoted, with two quotes for one.
std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells;
  for (;;) {
    std::string& cell = cells.emplace_back();
    if (line.starts_with('"')) {
      std::size_t k = 1;
      for (; k < line.size(); ++k) {
        if (line[k] == '"' && (k + 1 == line.size() || line[k + 1] != '"')) break;
        if (line[k] == '"') ++k;
        cell += line[k];
      }
      line.remove_prefix(std::min(k + 1, line.size()));
    }
    const std::size_t comma = line.find(',');
    cell += line.substr(0, comma);
    if (comma == line.npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

TableColumn column_named(const std::string& head) {
  const std::size_t open = head.rfind(" [");
  if (open == head.npos || head.back() != ']')
    return {.name = head, .unit = {}, .values = {}, .texts = {}};
  return {.name = head.substr(0, open),
          .unit = head.substr(open + 2, head.size() - open - 3),
          .values = {},
          .texts = {}};
}

}  // namespace

const TableColumn* Table::find(std::string_view name) const {
  const auto found = std::find_if(columns.begin(), columns.end(),
                                  [&](const TableColumn& c) { return c.name == name; });
  return found == columns.end() ? nullptr : &*found;
}

std::vector<double> Table::values(std::string_view name) const {
  const TableColumn* column = find(name);
  return column ? column->values : std::vector<double>(rows());
}

Table table_of_text(std::string_view rest) {
  Table table;
  for (std::size_t end; (end = rest.find('\n')) != rest.npos; rest.remove_prefix(end + 1)) {
    std::string_view line = rest.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    const std::vector<std::string> cells = cells_of(line);
    if (table.columns.empty()) {
      for (const std::string& head : cells) table.columns.push_back(column_named(head));
      continue;
    }
    if (cells.size() != table.columns.size()) continue;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      TableColumn& column = table.columns[c];
      char* stop = nullptr;
      const double value = std::strtod(cells[c].c_str(), &stop);
      const bool number = !cells[c].empty() && *stop == '\0';
      const bool name = column.name == body_column;  // which may be a number
      if (!number && !cells[c].empty()) column.texts.resize(column.values.size());
      if (!number || name || !column.texts.empty()) column.texts.push_back(cells[c]);
      column.values.push_back(number ? value : std::numeric_limits<double>::quiet_NaN());
    }
  }
  return table;
}

Table read_table(const std::filesystem::path& file) {
  return table_of_text(read_text_file(file));
}

Table read_last_row(const std::filesystem::path& file) {
  std::string text = read_text_file(file);
  text.resize(text.rfind('\n') + 1);  // without a row that is not complete
  const std::size_t head = text.find('\n') + 1;
  if (head < text.size()) {
    const std::size_t before = text.rfind('\n', text.size() - 2);
    text.erase(head, before + 1 - head);
  }
  return table_of_text(text);
}

}  // namespace lahar
