#include "io/mesh/node_files.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <unordered_set>
#include <utility>

#include "io/base/file_part.h"
#include "physics/base/directory_rank.h"

namespace lahar {

namespace {

// Rows of a member that are on their way at a time.
constexpr int node_rows_at_a_time = 1 << 15;

// Reads a row, which is not the file's last word on whether the node may have it; false if
// reported.
template <class Row>
using Parse = std::function<bool(RowReader&, Row&)>;

template <class Row>
bool read_all(const SideFile& file, ProblemList& problems, const Parse<Row>& parse, auto&& take) {
  RowReader rows(file, problems);
  while (rows.next())
    if (Row row{}; parse(rows, row)) take(row);
  return !rows.failed();
}

// Each member reads a part of the file and sends the rows to who keeps their nodes. Nothing, on all
// members, if anything is wrong. `mended`: this member has something to warn of.
template <class Row>
std::optional<std::vector<Row>> read_together(const SideFile& file, const Team& team,
                                              const Parse<Row>& parse, bool& mended) {
  const auto size = static_cast<std::size_t>(team.size());
  std::optional<FilePart> part;
  all_or_none(team, [&] { part.emplace(file, 0, team); });
  ProblemList none;
  RowReader rows(file, none, part->begin, part->end);
  std::vector<std::vector<Row>> from(size);  // parts of the file follow each other
  bool more = true;
  while (team.any(more)) {
    std::vector<std::vector<Row>> to(size);
    all_or_none(team, [&] {
      for (int n = 0; more && n < node_rows_at_a_time; ++n) {
        more = rows.next();
        Row row{};
        if (more && parse(rows, row))
          to[static_cast<std::size_t>(directory_rank(row.node, team.size()))].push_back(row);
      }
    });
    if (team.any(rows.failed())) return std::nullopt;
    auto come = team.exchange(std::move(to));
    for (std::size_t m = 0; m < size; ++m)
      from[m].insert(from[m].end(), come[m].begin(), come[m].end());
  }
  mended = rows.mended();
  return joined(std::move(from));
}

// `parse` says what is wrong with a row, `fits` whether the rows of a member go together; where
// they do not, or where there is something to warn of, another reading finds it with `parse`, which
// begins with a new copy each time.
template <class Row>
std::optional<std::vector<Row>> read_rows(const SideFile& file, const Team& team,
                                          ProblemList& problems, const Parse<Row>& parse,
                                          auto&& fits) {
  std::optional<std::vector<Row>> rows;
  if (team.alone()) {
    rows.emplace();
    if (!read_all<Row>(file, problems, Parse<Row>(parse),
                       [&](const Row& r) { rows->push_back(r); }))
      return std::nullopt;
    return rows;
  }
  bool mended = false;
  rows = read_together<Row>(file, team, Parse<Row>(parse), mended);
  const auto read_again = [&](ProblemList& found) {
    read_all<Row>(file, found, Parse<Row>(parse), [](const Row&) {});
  };
  if (team.any(!rows || !fits(*rows))) {
    explain(file, team, problems, read_again);
    return std::nullopt;
  }
  if (team.any(mended)) by_the_first(team, problems, read_again);
  return rows;
}

const auto always = [](const auto&) { return true; };

}  // namespace

namespace {

// False if reported. The last column of a row may be missing where RowReader::value() says so.
bool read_column(RowReader& rows, const NodeColumn& column, bool is_last, double& value) {
  if (column.is_sign) {
    Index sign = 0;
    if (!rows.integer(sign, column.what, -1, 1)) return false;
    value = static_cast<double>(sign);
    if (sign == 0) rows.complain(column.what + " must be 1 or -1, found 0", column.hint);
    return sign != 0;
  }
  const bool read = is_last ? rows.value(value, column.what) : rows.real(value, column.what);
  if (!read) return false;
  const bool positive = column.bound == Bound::positive;
  if (column.bound == Bound::none || value > 0 || (value == 0 && !positive)) return true;
  rows.complain(fmt::format("{} must be {} 0, found {}", column.what,
                            positive ? "greater than" : "at least", value));
  return false;
}

}  // namespace

std::optional<std::vector<NodeRow>> read_node_rows(const SideFile& file,
                                                   const std::vector<NodeColumn>& columns,
                                                   const NodeRowRange& range, const Team& team,
                                                   ProblemList& problems) {
  const Parse<NodeRow> parse = [&](RowReader& rows, NodeRow& row) {
    Index dir = 0;
    if (!rows.integer(row.node, "a node id", 0, last_id(range.n_nodes)) ||
        (range.dim > 0 && !rows.integer(dir, "the direction", 0, range.dim - 1)))
      return false;
    row.dir = static_cast<int>(dir);
    for (std::size_t k = 0; k < columns.size(); ++k)
      if (!read_column(rows, columns[k], k + 1 == columns.size(), row.values[k])) return false;
    return rows.end_of_row();
  };
  return read_rows(file, team, problems, parse, always);
}

namespace {

struct Angles {
  Index node;
  double alpha, beta, gamma;
};

// With what has been seen, which each copy counts for itself.
class ParseAngles {
 public:
  ParseAngles(int dim, Index n_nodes) : dim_(dim), n_nodes_(n_nodes) {}
  bool operator()(RowReader& rows, Angles& row) {
    if (!rows.integer(row.node, "a node id", 0, last_id(n_nodes_))) return false;
    if (!seen_.insert(row.node).second) {
      rows.complain(fmt::format("node {} occurs more than once", row.node));
      return false;
    }
    return rows.real(row.alpha, "alpha") &&
           (dim_ == 2 ? rows.value(row.beta, "beta")
                      : rows.real(row.beta, "beta") && rows.value(row.gamma, "gamma")) &&
           rows.end_of_row(dim_ == 2 ? 1 : 0);
  }

 private:
  int dim_;
  Index n_nodes_;
  std::unordered_set<Index> seen_;
};

bool all_different(const std::vector<Angles>& rows) {
  std::vector<Index> nodes;
  for (const Angles& row : rows) nodes.push_back(row.node);
  std::sort(nodes.begin(), nodes.end());
  return std::adjacent_find(nodes.begin(), nodes.end()) == nodes.end();
}

template <int Dim>
Eigen::Matrix<double, Dim, Dim> euler_axes(const Angles& at) {
  if constexpr (Dim == 2)
    return Eigen::Rotation2D<double>(at.alpha + at.beta).toRotationMatrix();
  else {
    using Turn = Eigen::AngleAxis<double>;
    return Turn(at.alpha, Vec<3>::UnitZ()).toRotationMatrix() *
           Turn(at.gamma, Vec<3>::UnitX()).toRotationMatrix() *
           Turn(at.beta, Vec<3>::UnitZ()).toRotationMatrix();
  }
}

}  // namespace

template <int Dim>
std::optional<std::vector<NodeFrame<Dim>>> read_angle_file(const SideFile& file, Index n_nodes,
                                                           const Team& team,
                                                           ProblemList& problems) {
  const Parse<Angles> parse = ParseAngles(Dim, n_nodes);
  const auto rows = read_rows(file, team, problems, parse, all_different);
  if (!rows) return std::nullopt;
  std::vector<NodeFrame<Dim>> frames;
  for (const Angles& row : *rows) frames.push_back({row.node, euler_axes<Dim>(row)});
  return frames;
}

template std::optional<std::vector<NodeFrame<2>>> read_angle_file<2>(const SideFile&, Index,
                                                                     const Team&, ProblemList&);
template std::optional<std::vector<NodeFrame<3>>> read_angle_file<3>(const SideFile&, Index,
                                                                     const Team&, ProblemList&);

}  // namespace lahar
