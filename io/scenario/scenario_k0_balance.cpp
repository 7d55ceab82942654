// Vertical stresses of level ground at rest: what brings the nodes along each column into balance.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <tuple>
#include <vector>

#include "io/scenario/column_balance.h"
#include "io/scenario/scenario_builder.h"

namespace lahar {

namespace {

/// A particle in its column of a grid, told to the member that looks after the column.
struct ColumnEntry {
  Index column;
  ColumnRow row;
  std::array<double, 2> off;  ///< in plan, from the middle of the column [cells]
  Index particle;             ///< of the member that told it
};

/// Rows of level ground lie around the middle of their column. Under a slope, where the upper ones
/// do not, a column is not in balance by itself.
constexpr double most_off = 1e-3;  // [cells]

/// Columns beside each other that have the same are in balance by themselves, too, wherever their
/// rows lie: samples of parts that level ground cuts are not quite symmetric. Slopes up to this
/// count as level.
constexpr double most_apart = 3e-3;  // [-] of a cell's volume and weight, [cells] of heights

/// Numbers of columns that lie behind each other along the second axis.
constexpr Index columns_apart = 2'000'003;

/// What a column has, to be compared with those beside it.
struct ColumnContent {
  Index column;
  double volume, weight;  ///< [m^3], [N]
  double height;          ///< of the centre [cells]
};

ColumnContent content_of(std::span<const ColumnEntry> entries) {
  ColumnContent all{entries.front().column, 0, 0, 0};
  for (const auto& [column, row, off, particle] : entries) {
    all.volume += row.volume;
    all.weight += row.weight;
    all.height += row.volume * row.height;
  }
  all.height /= all.volume;
  return all;
}

bool are_alike(const ColumnContent& a, const ColumnContent& b, double cell_volume) {
  const double volume = std::abs(a.volume - b.volume) / cell_volume,
               weight = std::abs(a.weight - b.weight) / (a.weight / a.volume * cell_volume),
               height = std::abs(a.height - b.height);
  return std::max({volume, weight, height}) <= most_apart;
}

std::size_t owner_of(Index column, const Team& team) {
  return static_cast<std::size_t>(column) % static_cast<std::size_t>(team.size());
}

/// Whether the columns beside each of these, as far as there are any, have the same. They ascend.
/// Collective.
std::vector<bool> are_even(const std::vector<ColumnContent>& own, int dim, double cell_volume,
                           const Team& team) {
  struct Neighbour {
    Index column;  ///< to which it is told
    ColumnContent content;
  };
  std::vector<std::vector<Neighbour>> to(static_cast<std::size_t>(team.size()));
  for (const ColumnContent& content : own)
    for (const Index step : {-columns_apart, Index{-1}, Index{1}, columns_apart})
      if (const Index beside = content.column + step; beside >= 0 && (dim == 3 || step * step == 1))
        to[owner_of(beside, team)].push_back({beside, content});
  std::vector<bool> even(own.size(), true);
  for (const auto& part : team.exchange(std::move(to)))
    for (const auto& [column, content] : part) {
      const auto at = std::ranges::lower_bound(own, column, {}, &ColumnContent::column);
      if (at != own.end() && at->column == column && !are_alike(*at, content, cell_volume))
        even[static_cast<std::size_t>(at - own.begin())] = false;
    }
  return even;
}

/// What is above a gap that is higher than a cell does not lie on what is below it.
bool is_gap(const ColumnRow& below, const ColumnRow& above) {
  return above.height - above.half - (below.height + below.half) > 1.0;
}

/// Changes of particles of one column, in the order of its entries. Particles that are a millionth
/// of a cell apart are at the same height.
std::vector<double> balance_entries(std::span<const ColumnEntry> entries, bool is_even, double cell,
                                    int cells, ShapeFunctions functions) {
  std::vector<ColumnRow> rows;
  std::vector<std::array<double, 2>> moments;
  std::vector<std::size_t> row_of;
  for (const ColumnEntry& entry : entries) {
    if (rows.empty() || entry.row.height - rows.back().height > 1e-6) {
      rows.push_back(entry.row);
      rows.back().stress *= entry.row.volume;
      moments.push_back({});
    } else {
      rows.back().volume += entry.row.volume;
      rows.back().weight += entry.row.weight;
      rows.back().stress += entry.row.volume * entry.row.stress;
    }
    for (std::size_t d = 0; d < 2; ++d) moments.back()[d] += entry.row.volume * entry.off[d];
    row_of.push_back(rows.size() - 1);
  }
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (!is_even && std::hypot(moments[k][0], moments[k][1]) > most_off * rows[k].volume)
      return std::vector<double>(entries.size(), 0.0);
  for (ColumnRow& row : rows) row.stress /= row.volume;
  std::vector<double> change;
  for (std::size_t begin = 0, k = 0; k < rows.size(); ++k)
    if (k + 1 == rows.size() || is_gap(rows[k], rows[k + 1])) {
      const auto part =
          balance_column(std::span(rows).subspan(begin, k + 1 - begin), cell, cells, functions);
      change.insert(change.end(), part.begin(), part.end());
      begin = k + 1;
    }
  std::vector<double> all;
  for (const std::size_t k : row_of) all.push_back(change[k]);
  return all;
}

}  // namespace

template <int Dim>
std::vector<double> ScenarioBuilder<Dim>::balance_of_columns(
    int up, const std::vector<double>& vertical, const std::vector<double>& weight) const {
  const ParticleTable<Dim>& p = model_.particles;
  const auto [low, high] = mesh_->bounds();
  const Vec<Dim> cell = outer_cell();
  const bool upwards = model_.gravity[up] < 0;
  std::vector<std::vector<ColumnEntry>> to(static_cast<std::size_t>(team_.size()));
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    Index column = 0;
    std::array<double, 2> off{};
    for (int d = 0, k = 0; d < Dim; ++d) {
      if (d == up) continue;
      const double at = (p.x[i][d] - low[d]) / cell[d];
      column = column * columns_apart + static_cast<Index>(at);
      off[static_cast<std::size_t>(k++)] = at - std::floor(at) - 0.5;
    }
    const double volume = p.volume[i] / depth_at(model_.analysis, p.x[i][0]);
    const double part = std::pow(volume / cell.prod(), 1.0 / Dim);
    const double height = (upwards ? p.x[i][up] - low[up] : high[up] - p.x[i][up]) / cell[up];
    to[owner_of(column, team_)].push_back({column,
                                           {.height = height,
                                            .half = 0.5 * part,
                                            .volume = volume,
                                            .weight = weight[i],
                                            .stress = vertical[i]},
                                           off,
                                           static_cast<Index>(i)});
  }
  struct Told {
    ColumnEntry entry;
    std::size_t member, place;
  };
  std::vector<Told> told;
  const auto from = team_.exchange(std::move(to));
  std::vector<std::vector<double>> answers(from.size());
  for (std::size_t m = 0; m < from.size(); ++m) {
    answers[m].resize(from[m].size());
    for (std::size_t k = 0; k < from[m].size(); ++k) told.push_back({from[m][k], m, k});
  }
  std::sort(told.begin(), told.end(), [](const Told& a, const Told& b) {
    const auto key = [](const ColumnEntry& e) {
      return std::tuple(e.column, e.row.height, e.row.weight, e.row.stress);
    };
    return key(a.entry) < key(b.entry);
  });
  const int cells = static_cast<int>(std::lround((high[up] - low[up]) / cell[up]));
  std::vector<ColumnEntry> entries;
  for (const Told& one : told) entries.push_back(one.entry);
  std::vector<std::span<const ColumnEntry>> columns;
  for (std::size_t begin = 0, k = 0; k < entries.size(); ++k)
    if (k + 1 == entries.size() || entries[k + 1].column != entries[begin].column) {
      columns.push_back(std::span(entries).subspan(begin, k + 1 - begin));
      begin = k + 1;
    }
  std::vector<ColumnContent> contents;
  for (const auto& column : columns) contents.push_back(content_of(column));
  const std::vector<bool> even = are_even(contents, Dim, cell.prod(), team_);
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const auto change =
        balance_entries(columns[c], even[c], cell[up], cells, model_.analysis.functions);
    const auto first = static_cast<std::size_t>(columns[c].data() - entries.data());
    for (std::size_t k = 0; k < change.size(); ++k)
      answers[told[first + k].member][told[first + k].place] = change[k];
  }
  // Answers come in the order in which this member told its particles.
  std::vector<double> all(p.x.size());
  std::vector<std::vector<Index>> asked(answers.size());
  for (std::size_t m = 0; m < from.size(); ++m)
    for (const ColumnEntry& entry : from[m]) asked[m].push_back(entry.particle);
  const auto particles = team_.exchange(std::move(asked));
  const auto changes = team_.exchange(std::move(answers));
  for (std::size_t m = 0; m < particles.size(); ++m)
    for (std::size_t k = 0; k < particles[m].size(); ++k)
      all[static_cast<std::size_t>(particles[m][k])] = changes[m][k];
  return all;
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
