#include "io/frames/csv.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "io/base/atomic_file.h"
#include "io/base/numbers.h"
#include "io/base/text.h"
#include "io/frames/csv_columns.h"

namespace lahar {

namespace {

constexpr std::size_t flush_bytes = 1 << 20;

/// A column of the table, and where its numbers are.
struct Source {
  std::string name;
  const double* first;
  int stride;
};

/// Columns of a frame, and what has no numbers there.
struct Table {
  std::vector<Source> columns;
  std::vector<double> material;
};

/// Strains of sheets and bodies of revolution have a component across the plane.
bool has_strain_across(const Frame& frame) {
  const FrameColumn* strain = frame.find("strain");
  if (frame.dim != 2 || !strain) return false;
  for (std::size_t at = 2; at < strain->values.size(); at += 6)
    if (strain->values[at] != 0) return true;
  return false;
}

/// All components of columns whose names are not there yet: state variables by their own names,
/// vectors and what else a frame has.
void add_others(const Frame& frame, std::vector<Source>& list) {
  std::set<std::string> names{"id"};
  for (const Source& source : list) names.insert(source.name);
  for (const FrameColumn& column : frame.columns) {
    const bool in_table = std::any_of(table_fields().begin(), table_fields().end(),
                                      [&](const auto& f) { return f.frame_name == column.name; });
    if (in_table) continue;
    const auto suffixes = component_names(column.components);
    for (int c = 0; c < column.components; ++c) {
      std::string name = column.name;
      if (column.components > 1)
        name += '_' + (suffixes.empty() ? std::to_string(c)
                                        : std::string(suffixes[static_cast<std::size_t>(c)]));
      if (names.insert(name).second)
        list.push_back({std::move(name), column.values.data() + c, column.components});
    }
  }
}

Table table_of(const Frame& frame) {
  Table table;
  std::vector<Source>& list = table.columns;
  for (const TableField& field : table_fields()) {
    const bool coordinates = field.frame_name == "coordinates";
    const FrameColumn* column = coordinates ? nullptr : frame.find(field.frame_name);
    if (!coordinates && !column) continue;
    const std::vector<double>& values = coordinates ? frame.coordinates : column->values;
    for (const TableComponent& component : table_components(field.kind, frame.dim))
      list.push_back({std::string(field.prefix) + component.suffix,
                      values.data() + component.position, frame_components(field.kind, frame.dim)});
  }
  const std::vector<std::string> state = state_variable_names(frame);
  for (std::size_t k = 0; k < state.size(); ++k)
    if (!state[k].empty()) list.push_back({state[k], frame.columns[k].values.data(), 1});
  if (!frame.material.empty()) {
    table.material.assign(frame.material.begin(), frame.material.end());
    list.push_back({"material", table.material.data(), 1});
  }
  if (has_strain_across(frame))
    list.push_back({"strain_zz", frame.find("strain")->values.data() + 2, 6});
  add_others(frame, list);
  return table;
}

/// The name of a column, which may come from any file, in the header (RFC 4180).
std::string csv_name(const std::string& name) {
  const std::string text = printable(name);
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

/// Pass the table to `sink` piece by piece: a large one does not fit into memory twice.
template <class Sink>
void emit(const Frame& frame, Sink&& sink) {
  check_consistent(frame);
  const Table table = table_of(frame);
  const std::vector<Source>& columns = table.columns;
  std::string text = "id";
  for (const Source& column : columns) text += ',' + csv_name(column.name);
  text += '\n';
  for (Index i = 0; i < frame.size(); ++i) {
    append_number(text, frame.id[i]);
    for (const Source& column : columns) {
      text += ',';
      append_number(text, column.first[i * column.stride]);
    }
    text += '\n';
    if (text.size() >= flush_bytes) {
      sink(text);
      text.clear();
    }
  }
  sink(text);
}

}  // namespace

std::string csv_text(const Frame& frame) {
  std::string whole;
  emit(frame, [&](const std::string& text) { whole += text; });
  return whole;
}

void write_csv(const Frame& frame, const std::filesystem::path& file) {
  AtomicFile atomic(file);
  OutputFile out(atomic.temporary(), OutputFile::Mode::truncate, file);
  emit(frame, [&](const std::string& text) { out.write(text); });
  out.close();
  atomic.commit();
}

}  // namespace lahar
