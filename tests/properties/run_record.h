/// \file All that a run gives, from one or several simulations, and what differs between two.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "io/run/gauge_rows.h"
#include "io/run/removed.h"
#include "physics/base/error.h"
#include "runtime/step/simulation.h"
#include "runtime/step/watchdog.h"
#include "tests/runtime/step/restart_checks.h"

namespace lahar::test {

struct RunRecord {
  std::vector<Frame> frames;
  std::vector<HistoryRow> rows;
  std::vector<RemovedParticle> removed;
  std::vector<GaugeTable> tables;  ///< of gauges
  bool measures = false;           ///< with gauges or maps
  std::vector<GaugeRows> gauges;   ///< from the first step to the last that was due
  Index measured = -1;             ///< the step of the last of them, here or in an earlier part
  std::optional<GaugeRows> last_gauges;  ///< at the end, unless they were due
  std::vector<double> maps;              ///< at the end
  std::vector<std::string> warnings;
  std::string error;               ///< of a run that failed, without the number of the rank
  std::string end_file;            ///< bytes of the last checkpoint, where files are written
  std::optional<StoredState> end;  ///< unless patches ended at different steps
  std::optional<Frame> last_frame;
  std::optional<HistoryRow> last_row;

  void add(const GaugeRows& rows) {
    gauges.push_back(rows);
    measured = rows.step;
  }
  /// What a run gives that goes on from `step`.
  void forget_until(Index step) {
    std::erase_if(frames, [&](const Frame& frame) { return frame.step <= step; });
    std::erase_if(rows, [&](const HistoryRow& row) { return row.step <= step; });
    std::erase_if(removed, [&](const RemovedParticle& one) { return one.step <= step; });
    std::erase_if(gauges, [&](const GaugeRows& one) { return one.step <= step; });
  }
  /// What an interrupted run gave after `step` is not part of it.
  void forget_after(Index step) {
    std::erase_if(frames, [&](const Frame& frame) { return frame.step > step; });
    std::erase_if(rows, [&](const HistoryRow& row) { return row.step > step; });
    std::erase_if(removed, [&](const RemovedParticle& one) { return one.step > step; });
    std::erase_if(gauges, [&](const GaugeRows& one) { return one.step > step; });
    measured = gauges.empty() ? -1 : gauges.back().step;
    forget_end();
  }
  void forget_end() {
    error.clear();
    end.reset();
    last_frame.reset();
    last_row.reset();
    last_gauges.reset();
    maps.clear();
  }
};

/// An observer that adds to a record, which has to outlive it.
inline Observer observer_of(RunRecord& record) {
  Observer observer;
  observer.frame = [&](FramePieces&& frame) { record.frames.push_back(join(frame)); };
  observer.history = [&](const HistoryRow& row) { record.rows.push_back(row); };
  observer.removed = [&](std::span<const RemovedParticle> particles) {
    record.removed.insert(record.removed.end(), particles.begin(), particles.end());
  };
  observer.warning = [&](const std::string& text) { record.warnings.push_back(text); };
  observer.gauges = [&](const GaugeRows& rows) { record.add(rows); };
  return observer;
}

/// Before the first step. `goes_on`: an earlier part of the run has measured this state.
inline void begin_gauges(Simulation& simulation, RunRecord& record, bool goes_on) {
  record.tables = simulation.gauge_tables();
  record.measures = !record.tables.empty() || !simulation.maps().empty();
  if (record.measures && !goes_on) record.add(simulation.gauges());
}

/// At the end of a run, of which all patches have done the last step. Collective.
inline void end_of(Simulation& simulation, RunRecord& record) {
  record.last_frame = simulation.frame();
  record.last_row = simulation.history();
  if (record.measures && record.measured != simulation.step())
    record.last_gauges = simulation.gauges();
  record.maps = simulation.maps();
}

/// Which rank a patch is on does not matter.
inline std::string without_rank(std::string text) {
  const auto at = text.find(", rank ");
  if (at != std::string::npos) text.erase(at, text.find(',', at + 1) - at);
  return text;
}

/// Call `steps`, which takes steps of `simulation`; false: the run failed, and that is noted.
bool take(Simulation& simulation, RunRecord& record, const auto& steps) {
  bool whole = true;
  try {
    steps();
  } catch (const WatchdogError& error) {
    record.error = error.what();
  } catch (const SimulationError& error) {
    record.error = without_rank(error.what());
    whole = false;
  }
  const bool ended = !record.error.empty() || simulation.finished();
  if (whole && ended) {
    record.end.emplace(simulation.state());
    end_of(simulation, record);
  }
  return record.error.empty();
}

inline std::string difference(const Frame& a, const Frame& b) {
  if (same_bits(a, b)) return "";
  std::string at = "the frame of step " + std::to_string(a.step) + ": ";
  if (a.step != b.step || a.time != b.time) return at + "another step or time";
  if (a.id != b.id) return at + "other particles";
  if (a.material != b.material) return at + "other materials";
  const auto first = [&](const std::vector<double>& x, const std::vector<double>& y, int n) {
    std::size_t k = 0;
    while (k < std::min(x.size(), y.size()) && std::memcmp(&x[k], &y[k], sizeof x[k]) == 0) ++k;
    if (k == x.size() && k == y.size()) return std::string();
    if (k >= std::min(x.size(), y.size())) return std::string("other sizes");
    char text[160];
    std::snprintf(text, sizeof text, "particle %lld, component %d: %.17g against %.17g",
                  static_cast<long long>(a.id[k / static_cast<std::size_t>(n)]),
                  static_cast<int>(k % static_cast<std::size_t>(n)), x[k], y[k]);
    return std::string(text);
  };
  if (const auto text = first(a.coordinates, b.coordinates, a.dim); !text.empty())
    return at + "position of " + text;
  for (std::size_t c = 0; c < std::min(a.columns.size(), b.columns.size()); ++c)
    if (const auto text = first(a.columns[c].values, b.columns[c].values, a.columns[c].components);
        !text.empty())
      return at + a.columns[c].name + " of " + text;
  return at + "other columns";
}

inline std::string difference(const HistoryRow& a, const HistoryRow& b) {
  if (same_bits(a, b)) return "";
  std::string x = history_line(a), y = history_line(b);
  return "rows of history:\n  " + x + "  " + y;
}

/// Rows of all gauges as their tables have them.
inline std::string difference_of_gauges(const RunRecord& a, const RunRecord& b) {
  const auto lines = [](const RunRecord& record, std::size_t k) {
    std::string text = gauge_header(record.tables[k]);
    for (const GaugeRows& rows : record.gauges) text += gauge_lines(record.tables[k], rows, k);
    if (record.last_gauges) text += gauge_lines(record.tables[k], *record.last_gauges, k);
    return text;
  };
  if (a.tables.size() != b.tables.size()) return "other gauges";
  for (std::size_t k = 0; k < a.tables.size(); ++k) {
    std::istringstream x(lines(a, k)), y(lines(b, k));
    for (std::string one, other; x || y;) {
      one.clear(), other.clear();
      std::getline(x, one), std::getline(y, other);
      if (one != other)
        return "rows of the gauge " + a.tables[k].name + ":\n  " + one + "\n  " + other;
    }
  }
  const bool same = a.maps.size() == b.maps.size() &&
                    (a.maps.empty() || std::memcmp(a.maps.data(), b.maps.data(),
                                                   a.maps.size() * sizeof(double)) == 0);
  return same ? "" : "maps differ";
}

/// The first column of a frame with a number that is none; "" = there is none.
inline std::string not_finite(const Frame& frame) {
  const auto has = [](const std::vector<double>& values) {
    return !std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
  };
  if (has(frame.coordinates)) return "coordinates";
  for (const FrameColumn& column : frame.columns)
    if (has(column.values)) return column.name;
  return "";
}

/// What differs first between two records; "" = nothing. `other` may leave out warnings: those of
/// an interrupted run may come twice.
inline std::string difference(const RunRecord& record, const RunRecord& other,
                              bool compare_warnings = true) {
  if (record.error != other.error)
    return "errors:\n  " + (record.error.empty() ? "none" : record.error) + "\n  " +
           (other.error.empty() ? "none" : other.error);
  const auto numbers = [](const char* what, std::size_t a, std::size_t b) {
    return std::to_string(a) + " " + what + " against " + std::to_string(b);
  };
  for (std::size_t k = 0; k < std::min(record.frames.size(), other.frames.size()); ++k)
    if (const auto text = difference(record.frames[k], other.frames[k]); !text.empty()) return text;
  for (std::size_t k = 0; k < std::min(record.rows.size(), other.rows.size()); ++k)
    if (const auto text = difference(record.rows[k], other.rows[k]); !text.empty()) return text;
  std::string lines, other_lines;
  for (const RemovedParticle& one : record.removed) lines += removed_line(one);
  for (const RemovedParticle& one : other.removed) other_lines += removed_line(one);
  if (lines != other_lines) return "removed particles:\n" + lines + "against\n" + other_lines;
  if (record.frames.size() != other.frames.size())
    return numbers("frames", record.frames.size(), other.frames.size());
  if (record.rows.size() != other.rows.size())
    return numbers("rows of history", record.rows.size(), other.rows.size());
  if (record.last_frame.has_value() != other.last_frame.has_value()) return "one has no end";
  if (record.last_frame)
    if (const auto text = difference(*record.last_frame, *other.last_frame); !text.empty())
      return "at the end, " + text;
  if (record.last_row)
    if (const auto text = difference(*record.last_row, *other.last_row); !text.empty())
      return "at the end, " + text;
  if (record.end && other.end)
    if (const auto text = difference(*record.end, *other.end); !text.empty())
      return "checkpoints: " + text;
  if (const auto text = difference_of_gauges(record, other); !text.empty()) return text;
  if (record.end_file != other.end_file) return "checkpoint files of the end differ";
  if (compare_warnings && record.warnings != other.warnings) return "other warnings";
  return "";
}

}  // namespace lahar::test
