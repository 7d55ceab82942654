// Reading tables of particles.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <numeric>
#include <optional>

#include "io/base/atomic_file.h"
#include "io/frames/csv.h"
#include "io/frames/csv_columns.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

constexpr std::size_t max_problems = 20;

std::string_view trim(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

template <class T>
std::optional<T> parse(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size()) return {};
  // Numbers too small for a double are read as 0 by everyone, and so here.
  if (error == std::errc::result_out_of_range && std::is_floating_point_v<T> &&
      text.find("e-") != text.npos)
    return T{};
  if (error != std::errc{}) return {};
  return value;
}

/// Where the cells of one column of the file go.
struct Target {
  enum class Kind { skip, id, material, value } kind = Kind::skip;
  std::vector<double>* values = nullptr;
  int position = 0, stride = 1;
};

class TableReader {
 public:
  TableReader(std::string_view text, std::string name) : rest_(text), name_(std::move(name)) {}

  Frame read() {
    std::string_view line;
    if (!next_line(line)) problem(1, 0, "the table is empty; expected a header line", "");
    if (problems_.empty()) read_header(line);
    if (problems_.empty()) read_rows();
    if (problems_.empty()) sort_rows();
    if (!problems_.empty()) throw InputError(std::move(problems_));
    return std::move(frame_);
  }

 private:
  /// The next line that is not blank.
  bool next_line(std::string_view& line) {
    while (!rest_.empty()) {
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      line = trim(rest_.substr(0, end));
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++line_;
      if (!line.empty()) return true;
    }
    return false;
  }

  /// Call `use(number, cell, column of its first character)` for each cell of a line.
  template <class Use>
  static int split(std::string_view line, Use&& use) {
    int count = 0;
    std::size_t from = 0;
    while (true) {
      const std::size_t end = std::min(line.find(',', from), line.size());
      use(count++, trim(line.substr(from, end - from)), static_cast<int>(from) + 1);
      if (end == line.size()) return count;
      from = end + 1;
    }
  }

  void problem(int line, int column, std::string message, std::string_view source) {
    ++count_;
    if (problems_.size() == max_problems) {
      problems_.push_back(problems_.back());
      problems_.back().line = problems_.back().column = 0;
      problems_.back().source.clear();
    }
    if (problems_.size() > max_problems) {
      problems_.back().message = fmt::format("and {} more", count_ - max_problems);
      return;
    }
    Problem p;
    p.file = name_;
    p.line = line;
    p.column = column;
    p.message = std::move(message);
    p.source = source;
    problems_.push_back(std::move(p));
  }

  void read_header(std::string_view line) {
    std::map<std::string, int, std::less<>> position;
    split(line, [&](int k, std::string_view cell, int column) {
      if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"')
        cell = cell.substr(1, cell.size() - 2);
      if (!position.emplace(cell, k).second && !cell.empty())
        problem(line_, column, fmt::format("column '{}' occurs twice", cell), line);
    });
    columns_ = static_cast<int>(std::count(line.begin(), line.end(), ',')) + 1;
    targets_.resize(columns_);
    if (const auto id = position.find("id"); id == position.end())
      problem(line_, 0, "there is no column 'id'", line);
    else
      targets_[id->second].kind = Target::Kind::id;
    for (const char* name : {"coord_z", "displacement_z", "velocity_z", "stress_yz", "strain_yz"})
      if (position.contains(name)) three_dimensional_ = true;
    frame_.dim = three_dimensional_ ? 3 : 2;
    frame_.columns.reserve(table_fields().size() + columns_);  // targets point into it
    for (const TableField& field : table_fields()) add_field(field, position, line);
    for (const auto& [name, k] : position) add_other(name, targets_[k]);
  }

  void add_field(const TableField& field, const std::map<std::string, int, std::less<>>& position,
                 std::string_view line) {
    const auto components = table_components(field.kind, frame_.dim);
    std::vector<int> found;
    std::string missing;
    for (const TableComponent& component : components) {
      const std::string name = std::string(field.prefix) + component.suffix;
      if (const auto it = position.find(name); it != position.end())
        found.push_back(it->second);
      else
        missing += (missing.empty() ? "" : ", ") + name;
    }
    if (found.empty()) return;
    if (!missing.empty()) {
      problem(line_, 0,
              fmt::format("a {}D table needs all of {}: {} missing", frame_.dim, field.frame_name,
                          missing),
              line);
      return;
    }
    std::vector<double>* values = &frame_.coordinates;
    if (field.frame_name != "coordinates") {
      frame_.columns.push_back({std::string(field.frame_name),
                                std::string(field.unit),
                                frame_components(field.kind, frame_.dim),
                                {}});
      values = &frame_.columns.back().values;
    }
    for (std::size_t c = 0; c < components.size(); ++c)
      targets_[found[c]] = {Target::Kind::value, values, components[c].position,
                            frame_components(field.kind, frame_.dim)};
    const auto across = position.find("strain_zz");
    if (field.kind == TableField::Kind::strain && frame_.dim == 2 && across != position.end())
      targets_[across->second] = {Target::Kind::value, values, 2, 6};
  }

  /// Columns that belong to no field.
  void add_other(const std::string& name, Target& target) {
    if (target.kind != Target::Kind::skip || name.empty()) return;
    if (name == "material" || name == "material_id") {
      target.kind = Target::Kind::material;
      return;
    }
    frame_.columns.push_back({name, "", 1, {}});
    target = {Target::Kind::value, &frame_.columns.back().values, 0, 1};
  }

  void read_rows() {
    std::string_view line;
    while (next_line(line)) {
      const std::size_t row = frame_.id.size();
      frame_.id.push_back(-1);
      for (const Target& target : targets_) {
        if (target.kind == Target::Kind::material) frame_.material.resize(row + 1);
        if (target.kind == Target::Kind::value) target.values->resize((row + 1) * target.stride);
      }
      const int count = split(line, [&](int k, std::string_view cell, int column) {
        if (k < columns_) read_cell(targets_[k], row, cell, column, line);
      });
      if (count != columns_)
        problem(line_, 0, fmt::format("{} values, but the header has {} columns", count, columns_),
                line);
    }
  }

  void read_cell(const Target& target, std::size_t row, std::string_view cell, int column,
                 std::string_view line) {
    if (target.kind == Target::Kind::skip) return;
    if (target.kind == Target::Kind::value) {
      if (const auto value = parse<double>(cell))
        (*target.values)[row * target.stride + target.position] = *value;
      else
        problem(line_, column, fmt::format("'{}' is not a number", cell), line);
      return;
    }
    const auto value = parse<Index>(cell);
    if (!value)
      problem(line_, column, fmt::format("'{}' is not an integer", cell), line);
    else if (target.kind == Target::Kind::id)
      frame_.id[row] = *value;
    else
      frame_.material[row] = static_cast<std::int32_t>(*value);
  }

  template <class T>
  static void permute(std::vector<T>& values, const std::vector<std::size_t>& order,
                      std::size_t stride) {
    if (values.empty()) return;
    std::vector<T> sorted(values.size());
    for (std::size_t i = 0; i < order.size(); ++i)
      std::copy_n(&values[order[i] * stride], stride, &sorted[i * stride]);
    values = std::move(sorted);
  }

  void sort_rows() {
    std::vector<std::size_t> order(frame_.id.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return frame_.id[a] < frame_.id[b]; });
    permute(frame_.id, order, 1);
    permute(frame_.material, order, 1);
    permute(frame_.coordinates, order, static_cast<std::size_t>(frame_.dim));
    for (FrameColumn& column : frame_.columns)
      permute(column.values, order, static_cast<std::size_t>(column.components));
    const auto twice = std::adjacent_find(frame_.id.begin(), frame_.id.end());
    if (twice != frame_.id.end())
      problem(0, 0, fmt::format("particle id {} occurs more than once", *twice), "");
  }

  std::string_view rest_;
  std::string name_;
  int line_ = 0;
  int columns_ = 0;
  bool three_dimensional_ = false;
  std::vector<Target> targets_;
  Frame frame_;
  std::vector<Problem> problems_;
  std::size_t count_ = 0;
};

}  // namespace

Frame parse_csv(std::string_view text, const std::string& name) {
  return TableReader(text, name).read();
}

Frame read_csv(const std::filesystem::path& file) {
  return parse_csv(read_text_file(file), file.string());
}

}  // namespace lahar
