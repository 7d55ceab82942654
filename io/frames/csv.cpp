#include "io/frames/csv.h"

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

std::vector<Source> sources(const Frame& frame) {
  std::vector<Source> list;
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
  return list;
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
  const std::vector<Source> columns = sources(frame);
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
