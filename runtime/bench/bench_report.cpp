// Results of `lahar bench` as Markdown, and beside earlier ones.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "runtime/bench/bench_result.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

/// A Markdown table whose columns are as wide as their cells; the first `texts` are left-aligned.
class Table {
 public:
  using Row = std::vector<std::string>;
  Table(std::size_t texts, Row head) : texts_(texts), rows_{std::move(head)} {}
  void add(Row row) { rows_.push_back(std::move(row)); }
  bool empty() const { return rows_.size() == 1; }

  std::string text() const {
    std::vector<std::size_t> width(rows_[0].size(), 3);
    for (const Row& row : rows_)
      for (std::size_t k = 0; k < row.size(); ++k) width[k] = std::max(width[k], row[k].size());
    std::string text = line(rows_[0], width);
    for (std::size_t k = 0; k < width.size(); ++k)
      text += k < texts_ ? fmt::format("|{:-<{}}", "", width[k] + 2)
                         : fmt::format("|{:-<{}}:", "", width[k] + 1);
    text += "|\n";
    for (std::size_t r = 1; r < rows_.size(); ++r) text += line(rows_[r], width);
    return text;
  }

 private:
  std::string line(const Row& row, const std::vector<std::size_t>& width) const {
    std::string text;
    for (std::size_t k = 0; k < row.size(); ++k)
      text += k < texts_ ? fmt::format("| {:<{}} ", row[k], width[k])
                         : fmt::format("| {:>{}} ", row[k], width[k]);
    return text + "|\n";
  }
  std::size_t texts_;
  std::vector<Row> rows_;
};

std::string section(const std::string& title, const Table& table) {
  return table.empty() ? std::string() : fmt::format("\n## {}\n\n{}", title, table.text());
}

/// Three significant digits without exponent.
std::string number(double value) {
  const double size = std::abs(value);
  return fmt::format("{:.{}f}", value, size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3);
}

std::string range(const BenchSamples& samples) {
  return number(samples.min()) + " - " + number(samples.max());
}

std::string goal(double at_most, double at_least) {
  if (at_most > 0) return fmt::format("<= {:g}", at_most);
  if (at_least > 0) return fmt::format(">= {:g}", at_least);
  return "";
}

std::string plural(int n, const char* what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

std::string machine_section(const BenchMachine& machine) {
  Table what(2, {"machine", ""});
  what.add({"processor", machine.cpu});
  what.add({"cores used", std::to_string(machine.cores)});
  what.add({"caches", machine.caches});
  what.add({"memory", format_bytes(machine.memory)});
  what.add({"frequency governor", machine.governor});
  what.add({"transparent huge pages", machine.huge_pages});
  what.add({"system", machine.kernel});
  what.add({"load before", fmt::format("{:.2f} processes", machine.load)});
  std::string text = "\n## Machine\n\n" + what.text();
  Table rates(1, {"measured (fastest of its passes)", "threads", "GB/s", "GFLOP/s"});
  for (const BenchRates& r : machine.rates) {
    const std::string threads = std::to_string(r.threads);
    rates.add({"triad a = b + s c, 32 bytes each", threads, number(r.triad.max() / 1e9), ""});
    rates.add({"update a = s a + b, 24 bytes each", threads, number(r.update.max() / 1e9), ""});
    rates.add({"multiply-add in registers", threads, "", number(r.multiply.max() / 1e9)});
  }
  return rates.empty() ? text : text + "\n" + rates.text();
}

std::string times_section(const BenchResult& result) {
  Table table(2, {"case", "run", "particles", "threads", "ns", "min - max", "goal", "CPU ns", "M/s",
                  "bytes", "bound ns", "of bound"});
  for (const BenchCase& c : result.cases)
    for (const BenchVariant& v : c.variants) {
      const double ns = v.ns.median();
      table.add(
          {c.name, v.name, format_count(v.particles),
           v.copies == 1 ? std::to_string(v.threads) : fmt::format("{} x {}", v.copies, v.threads),
           number(ns), range(v.ns), goal(v.goal, 0), number(v.cpu_ns.median()), number(1e3 / ns),
           fmt::format("{:.0f}", v.bytes), v.bound > 0 ? number(v.bound) : "",
           v.bound > 0 ? fmt::format("{:.0f} %", 100 * v.bound / ns) : ""});
    }
  return section("Time per particle and step", table);
}

std::string stages_section(const BenchResult& result) {
  Table table(3, {"case", "run", "stage", "ns", "share"});
  for (const BenchCase& c : result.cases)
    for (const BenchVariant& v : c.variants) {
      double sum = 0;
      for (const BenchStage& stage : v.stages) sum += stage.ns;
      for (const BenchStage& stage : v.stages)
        table.add({c.name, v.name, stage.name, number(stage.ns),
                   fmt::format("{:.0f} %", 100 * stage.ns / sum)});
    }
  return section("Each stage alone, per particle and step", table);
}

std::string figures_section(const BenchResult& result) {
  Table table(2, {"case", "figure", "median", "min - max", "of medians", "goal", "unit"});
  for (const BenchCase& c : result.cases)
    for (const BenchFigure& f : c.figures)
      table.add({c.name, f.name, number(f.samples.median()),
                 f.samples.values.size() > 1 ? range(f.samples) : "",
                 f.of_medians > 0 ? number(f.of_medians) : "", goal(f.at_most, f.at_least),
                 f.unit});
  return section("Ratios, memory, start-up", table);
}

std::string particles_section(const BenchResult& result) {
  Table table(2, {"case", "run", "particles per cell", "deviation", "crossings", "cells", "patches",
                  "steps"});
  for (const BenchCase& c : result.cases)
    for (const BenchVariant& v : c.variants)
      table.add({c.name, v.name, number(v.per_cell), number(v.per_cell_spread),
                 v.crossings < 0 ? "not counted" : fmt::format("{:.2f} %", 100 * v.crossings),
                 format_count(v.cells), format_count(v.patches), format_count(v.steps)});
  return section("What ran", table);
}

std::string protocol_section(const BenchProtocol& protocol) {
  const std::string length =
      protocol.steps > 0 ? plural(static_cast<int>(protocol.steps), "step")
                         : fmt::format("about {:g} s, at least two steps", protocol.sample_seconds);
  return fmt::format(R"(
## Protocol

Medians of {}. A sample is {} (plate: 1000 steps,
unless --quick), of a run that is warm; "What ran" has their number. The runs of a case are
processes of their own and take their samples in turn; a ratio is the median of the ratios of
samples of the same round, beside it the ratio of the medians. Frames are off; only the plate has
history rows, every 10 steps.

    ns         wall-clock time of everything that a step does, per particle; of several runs
               together the time in which all of them do one particle-step
    CPU ns     processor time of all threads for it; on one thread less than ns where other programs
               took the core
    M/s        million particle-steps per second
    bytes      particle columns that a step has to move, each once per phase between two exchanges
               (modelled); nodal values, about a tenth, are not counted
    bound      these bytes at the bandwidth measured above, the faster of triad and update on as
               many threads; a written line of the triad counts twice, since it is read first.
               Particles that stay in the caches can be faster
    crossings  changes of cell per particle and step, counted in some steps after the samples
    goal       what Lahar aims at, on one core of a recent server processor
)",
                     plural(protocol.repeats, "sample"), length);
}

/// Nothing else running, samples agree to a few percent.
std::string warnings(const BenchResult& result) {
  constexpr double agree = 1.2, idle = 0.5, own = 0.95;
  std::string text, differing, disturbed;
  const auto add = [](std::string& list, const BenchCase& c, const BenchVariant& v) {
    list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", c.name, v.name);
  };
  for (const BenchCase& c : result.cases)
    for (const BenchVariant& v : c.variants) {
      if (v.ns.max() > agree * v.ns.min()) add(differing, c, v);
      const bool one_thread = v.threads == 1 && v.copies == 1;
      if (one_thread && v.cpu_ns.median() < own * v.ns.median()) add(disturbed, c, v);
    }
  if (result.machine.load > idle)
    text += fmt::format("\nThe machine was not idle before: {:.2f} processes ran.\n",
                        result.machine.load);
  if (!disturbed.empty())
    text += fmt::format("\nOther programs took the core for more than 5 % of the time: {}.\n",
                        disturbed);
  if (!differing.empty())
    text += fmt::format("\nSamples differ by more than 20 %: {}.\n", differing);
  return text;
}

}  // namespace

std::string bench_markdown(const BenchResult& result) {
  return fmt::format("# Lahar {}\n\nMeasured {} by `lahar bench`. Built with {}.\n", result.version,
                     result.date, result.build) +
         machine_section(result.machine) + times_section(result) + figures_section(result) +
         stages_section(result) + particles_section(result) +
         (result.cases.empty() ? std::string() : protocol_section(result.protocol)) +
         warnings(result);
}

namespace {

struct Value {
  std::string unit;
  double median;
};
using Key = std::pair<std::string, std::string>;

/// Every median by case and name, in the order of the report.
std::vector<std::pair<Key, Value>> medians(const BenchResult& result) {
  std::vector<std::pair<Key, Value>> all;
  for (const BenchRates& r : result.machine.rates) {
    const std::string name = "machine, " + plural(r.threads, "thread");
    all.push_back({{name, "triad"}, {"GB/s", r.triad.median() / 1e9}});
    all.push_back({{name, "update"}, {"GB/s", r.update.median() / 1e9}});
    all.push_back({{name, "multiply-add"}, {"GFLOP/s", r.multiply.median() / 1e9}});
  }
  for (const BenchCase& c : result.cases) {
    for (const BenchVariant& v : c.variants) {
      all.push_back({{c.name, v.name}, {"ns", v.ns.median()}});
      for (const BenchStage& s : v.stages)
        all.push_back({{c.name, fmt::format("{}, {}", v.name, s.name)}, {"ns", s.ns}});
    }
    for (const BenchFigure& f : c.figures)
      all.push_back({{c.name, f.name}, {f.unit, f.samples.median()}});
  }
  return all;
}

std::string differences(const BenchResult& a, const BenchResult& b) {
  std::string text;
  const auto compare = [&](const char* what, const std::string& present,
                           const std::string& earlier) {
    if (present != earlier) text += fmt::format("- {}: {} (earlier: {})\n", what, present, earlier);
  };
  compare("version", a.version, b.version);
  compare("build", a.build, b.build);
  compare("processor", a.machine.cpu, b.machine.cpu);
  compare("cores", std::to_string(a.machine.cores), std::to_string(b.machine.cores));
  compare("caches", a.machine.caches, b.machine.caches);
  compare("frequency governor", a.machine.governor, b.machine.governor);
  compare("transparent huge pages", a.machine.huge_pages, b.machine.huge_pages);
  compare("system", a.machine.kernel, b.machine.kernel);
  compare("repeats", std::to_string(a.protocol.repeats), std::to_string(b.protocol.repeats));
  compare("length of a sample", fmt::format("{:g} s", a.protocol.sample_seconds),
          fmt::format("{:g} s", b.protocol.sample_seconds));
  compare("steps of a sample", std::to_string(a.protocol.steps), std::to_string(b.protocol.steps));
  compare("threads", std::to_string(a.protocol.threads), std::to_string(b.protocol.threads));
  return text.empty() ? text : "\nThe two differ in more than their times:\n\n" + text;
}

}  // namespace

std::string bench_comparison(const BenchResult& present, const BenchResult& earlier,
                             const std::string& earlier_name) {
  std::map<Key, Value> before;
  for (const auto& [key, value] : medians(earlier)) before.emplace(key, value);
  Table table(2, {"case", "figure", "unit", "earlier", "now", "now / earlier"});
  std::size_t matched = 0;
  for (const auto& [key, value] : medians(present)) {
    const auto found = before.find(key);
    const bool both = found != before.end();
    matched += both;
    table.add({key.first, key.second, value.unit, both ? number(found->second.median) : "-",
               number(value.median),
               both && found->second.median != 0
                   ? fmt::format("{:.3f}", value.median / found->second.median)
                   : "-"});
  }
  std::string text = fmt::format("\n# Compared with {} of {}\n{}", earlier_name, earlier.date,
                                 differences(present, earlier));
  if (!table.empty()) text += "\n" + table.text();
  if (const std::size_t missing = before.size() - matched; missing > 0)
    text += fmt::format("\n{} of the earlier figures have not been measured now.\n", missing);
  return text;
}

}  // namespace lahar
