#include "runtime/report/safety_text.h"

#include <fmt/format.h>

#include <limits>

#include "runtime/picture/quantity.h"
#include "runtime/report/html.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

const char* outcome(SafetyTrial::End end) {
  switch (end) {
    case SafetyTrial::End::rest:
      return "equilibrium";
    case SafetyTrial::End::settles:
      return "equilibrium: it settles";
    case SafetyTrial::End::moved:
      return "fails: it moves too far";
    case SafetyTrial::End::restless:
      return "fails: it does not come to rest";
    case SafetyTrial::End::broke:
      return "fails: a step could not be taken";
  }
  return "";
}

/// Trials of one kind as points that nothing joins.
ChartLine points_of(const SafetyResult& result, bool stable, const char* name, std::size_t colour) {
  ChartLine line{.name = name, .colour = line_colour(colour), .x = {}, .y = {}};
  for (const SafetyTrial& trial : result.trials) {
    if (trial.stable() != stable) continue;
    line.x.insert(line.x.end(), 2, trial.factor);
    line.y.insert(line.y.end(), {trial.displacement, std::numeric_limits<double>::quiet_NaN()});
  }
  return line;
}

std::string trials_chart(const SafetyResult& result, const std::string& label) {
  Chart chart{
      .title = label + "How far the body moved in each trial",
      .x_name = "factor by which strength is divided",
      .x_unit = "-",
      .y_name = "largest displacement",
      .y_unit = "m",
      .from_zero = true,
      .whole = false,
      .lines = {points_of(result, true, "equilibrium", 0), points_of(result, false, "fails", 1)},
      .marks = {}};
  if (result.fails) chart.marks.emplace_back(result.factor(), "factor of safety");
  return charts({chart});
}

std::string trials_table(const SafetyResult& result) {
  std::vector<std::vector<std::string>> rows;
  for (const SafetyTrial& trial : result.trials)
    rows.push_back({outcome(trial.end), fmt::format("{:.5g}", trial.factor),
                    format_count(trial.steps), fmt::format("{:.4g}", trial.displacement)});
  if (rows.empty()) return "";
  return html_table({"trial", "strength divided by", "steps", "largest displacement [m]"}, rows);
}

/// The factor, as far as it is known.
std::string factor_of(const SafetyResults& safety) {
  const SafetyResult& result = safety.result;
  if (safety.record.equilibrium.file.empty()) return "not known";
  return fmt::format("{}{:.4g}", result.fails ? "" : "above ", result.factor());
}

std::string fails_of(const SafetyResult& result) {
  return result.fails ? fmt::format("{:.4g}", *result.fails) : "–";
}

std::string stable_of(const SafetyResults& safety) {
  return safety.record.equilibrium.file.empty() ? "–" : fmt::format("{:.4g}", safety.result.stable);
}

/// How wide the bracket is, as a share of the factor.
std::string width_of(const SafetyResult& result) {
  if (!result.fails) return "no trial failed";
  return fmt::format("the middle of a bracket that is {:.2g} % wide",
                     100 * (*result.fails - result.stable) / result.factor());
}

std::string tile(const char* name, const std::string& value, const std::string& note) {
  return fmt::format(
      "<div class=\"tile\"><div class=\"name\">{}</div><div class=\"value\">{}</div>"
      "<p>{}</p></div>\n",
      name, value, xml_escaped(note));
}

std::string tiles_of(const SafetyResults& safety) {
  const SafetyResult& result = safety.result;
  return "<div class=\"tiles\">\n" + tile("factor of safety", factor_of(safety), width_of(result)) +
         tile("equilibrium", stable_of(safety), "the largest divisor of strength with one") +
         tile("failure", fails_of(result), "the least divisor of strength without equilibrium") +
         tile("trials", format_count(static_cast<Index>(result.trials.size())),
              "divided: " + safety.record.divided) +
         "</div>\n";
}

/// A row for each search.
std::string comparison(const std::vector<RunResults>& runs) {
  std::vector<std::vector<std::string>> rows;
  for (const RunResults& run : runs)
    if (run.safety)
      rows.push_back({xml_escaped(run.label), factor_of(*run.safety), stable_of(*run.safety),
                      fails_of(run.safety->result),
                      format_count(static_cast<Index>(run.safety->result.trials.size()))});
  return html_table({"search", "factor of safety", "equilibrium", "failure", "trials"}, rows);
}

}  // namespace

std::string safety_text(const std::vector<RunResults>& runs) {
  std::string text;
  bool any = false;
  for (const RunResults& run : runs) {
    if (!run.safety) continue;
    any = true;
    const SafetyResult& result = run.safety->result;
    if (runs.size() == 1) text += tiles_of(*run.safety);
    text += trials_chart(result, runs.size() > 1 ? run.label + ": " : "");
    const std::string table = trials_table(result);
    text += runs.size() > 1 && !table.empty() ? folded("Trials", table) : table;
  }
  if (!any) return "";
  return (runs.size() > 1 ? comparison(runs) : "") + text;
}

}  // namespace lahar
