#include "runtime/report/report_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/base/text.h"
#include "io/json/json_text.h"
#include "runtime/picture/quantity.h"
#include "runtime/report/html.h"
#include "runtime/report/run_charts.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

using nlohmann::json;

std::string count_of(double n) {
  return format_count(static_cast<Index>(std::llround(n)));
}

double largest(const RunResults& run, const char* column) {
  double most = 0;
  for (const RunPart& part : run.parts)
    for (const double value : part.history.values(column))
      if (std::isfinite(value)) most = std::max(most, std::abs(value));
  return most;
}

double first_mass(const RunResults& run) {
  const std::vector<double> mass = run.parts.front().history.values("mass");
  return mass.empty() ? 0 : mass.front();
}

double last_mass(const RunResults& run) {
  const std::vector<double> mass = run.last().history.values("mass");
  return mass.empty() ? 0 : mass.back();
}

std::string percent(double share) {
  if (share == 0) return "0 %";
  return share < 1e-4 ? fmt::format("{:.1e} %", 100 * share) : short_number(100 * share, 2) + " %";
}

struct Figure {
  std::string name, value, note;
};

std::vector<Figure> figures_of(const RunResults& run) {
  const RunPart& last = run.last();
  const double wall = run.wall_seconds(), updates = run.particle_steps();
  std::size_t removed = 0;
  for (const RunPart& part : run.parts) removed += part.removed;
  const int workers = static_cast<int>(last.number("ranks") * last.number("threads"));
  const double change = first_mass(run) > 0 ? last_mass(run) / first_mass(run) - 1 : 0;
  std::vector<Figure> list;
  list.push_back({"simulated time", quantity(run.end_time(), "s"),
                  fmt::format("{} steps", count_of(run.steps()))});
  list.push_back({"particles", count_of(last.model("particles")),
                  fmt::format("{} cells, {} nodes, {} material{}", count_of(last.model("cells")),
                              count_of(last.model("nodes")), count_of(last.model("materials")),
                              last.model("materials") == 1 ? "" : "s")});
  list.push_back(
      {"largest speed", quantity(largest(run, "max_speed"), "m/s", 3), "of any particle"});
  list.push_back(
      {"drift of energy", percent(balance_share(run)), "largest balance, of the largest energy"});
  list.push_back({"change of mass", percent(std::abs(change)),
                  removed > 0
                      ? fmt::format("{} particle{} left the mesh", removed, removed == 1 ? "" : "s")
                      : "no particle left the mesh"});
  const bool restarted = std::any_of(run.parts.begin(), run.parts.end(),
                                     [](const RunPart& part) { return part.timed_from() > 0; });
  list.push_back(
      {"run time", wall > 0 ? format_seconds(wall) : "–",
       fmt::format("{}{} thread{} on {} rank{}", restarted ? "since the last restart, " : "",
                   workers, workers == 1 ? "" : "s", last.number("ranks"),
                   last.number("ranks") == 1 ? "" : "s")});
  list.push_back({"speed", wall > 0 ? short_number(updates / wall * 1e-6, 3) + " M/s" : "–",
                  updates > 0 && wall > 0 ? fmt::format("particle-steps; {:.0f} ns each per thread",
                                                        wall * workers / updates * 1e9)
                                          : "particle-steps"});
  return list;
}

/// Words of the command that began a run. A run from Python has `python` and the words of its
/// program.
std::vector<std::string> command_words(const RunPart& part) {
  std::vector<std::string> words;
  if (part.manifest.contains("command"))
    for (const json& word : part.manifest["command"])
      if (word.is_string()) words.push_back(word.get<std::string>());
  return words;
}

/// A word as a shell reads it.
std::string shown_word(const std::string& word) {
  if (word.find_first_of(" \t'\"\\$*?[]{}()<>|&;#~!") == word.npos && !word.empty()) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

/// How to have the run again.
std::string repetition(const RunPart& part) {
  const std::vector<std::string> words = command_words(part);
  std::string command;
  for (const std::string& word : words) command += (command.empty() ? "" : " ") + shown_word(word);
  const std::string_view how =
      !words.empty() && words.front() == "python"
          ? "A program in Python made this run. Below is what started that program. The scenario "
            "with all its values is <code>scenario.full.json</code> in the run folder"
          : "Repeat it with this command";
  return "<p>" + std::string(how) +
         "; results are equal bit by bit on any number of threads and ranks.</p>\n"
         "<pre class=\"keep\">" +
         xml_escaped(command) + "</pre>\n";
}

/// What stands above the scenario, which has nothing of `--set`.
std::string scenario_title(const RunPart& part) {
  const std::vector<std::string> words = command_words(part);
  const bool changed = std::any_of(words.begin(), words.end(), [](const std::string& word) {
    return word == "--set" || word.starts_with("--set=");
  });
  return changed ? "Scenario as it was, without the changes of --set; scenario.full.json has them"
                 : "Scenario as it was";
}

/// What is true of one part of a run, with its name where there are several.
std::string heading_of(const RunResults& run, const RunPart& part, bool several) {
  std::string name = several ? run.label : "";
  if (!part.name.empty()) name += (name.empty() ? "" : ", ") + part.heading();
  return name.empty() ? "" : "<h3>" + xml_escaped(name) + "</h3>\n";
}

std::string inputs_of(const RunPart& part) {
  std::vector<std::vector<std::string>> rows;
  if (part.manifest.contains("inputs"))
    for (const json& input : part.manifest["inputs"])
      rows.push_back({xml_escaped(text_in(input, "file")), xml_escaped(text_in(input, "sha256"))});
  return rows.empty() ? "" : html_table({"input", "SHA-256"}, rows);
}

std::string program_of(const RunPart& part) {
  std::vector<std::vector<std::string>> rows;
  if (part.manifest.contains("program")) {
    const json& program = part.manifest["program"];
    std::string libraries;
    if (program.contains("libraries"))
      for (const auto& [name, version] : program["libraries"].items())
        if (version.is_string())
          libraries += (libraries.empty() ? "" : ", ") + name + " " + version.get<std::string>();
    rows.push_back(
        {"program", xml_escaped(fmt::format("Lahar {} (commit {})", text_in(program, "version"),
                                            text_in(program, "commit")))});
    rows.push_back({"compiler", xml_escaped(text_in(program, "compiler"))});
    rows.push_back({"libraries", xml_escaped(libraries)});
  }
  rows.push_back({"host", xml_escaped(part.text("host"))});
  rows.push_back({"started, ended", xml_escaped(part.text("started") + ", " + part.text("ended"))});
  return html_table({"", ""}, rows);
}

}  // namespace

std::string verdict(const RunResults& run) {
  const RunPart& last = run.last();
  const std::string status = run.safety ? name_of(run.safety->record.status) : last.status(),
                    why = run.safety ? run.safety->record.message : last.text("message");
  std::string word = "still running, or killed", kind = "fair", text = why;
  if (status == "finished") {
    word = "finished", kind = "good";
    if (run.safety)
      text = "The search for the factor of safety has come to its end.";
    else if (why.empty())
      text = fmt::format("All {} steps were taken.", count_of(run.steps()));
  } else if (status == "stopped") {
    word = "stopped";
  } else if (status == "failed") {
    word = "failed", kind = "poor";
  } else if (run.safety) {
    text = fmt::format("The search has not recorded its end. It has made {} trials.",
                       run.safety->result.trials.size());
  } else {
    text = fmt::format("The run has not recorded its end. The last row of its history is step {}.",
                       count_of(run.steps()));
  }
  return fmt::format("<p><span class=\"verdict {}\">{}</span>{}</p>\n", kind, word,
                     xml_escaped(text));
}

std::string key_figures(const std::vector<RunResults>& runs) {
  if (runs.size() == 1) {
    std::string tiles = "<div class=\"tiles\">\n";
    for (const Figure& f : figures_of(runs[0]))
      tiles += fmt::format(
          "<div class=\"tile\"><div class=\"name\">{}</div><div "
          "class=\"value\">{}</div><p>{}</p></div>\n",
          f.name, f.value, f.note);
    return tiles + "</div>\n";
  }
  std::vector<std::string> head{""};
  std::vector<std::vector<std::string>> rows;
  for (const RunResults& run : runs) {
    head.push_back(xml_escaped(run.label));
    const std::vector<Figure> figures = figures_of(run);
    rows.resize(figures.size());
    for (std::size_t k = 0; k < figures.size(); ++k) {
      if (rows[k].empty()) rows[k].push_back(figures[k].name);
      rows[k].push_back(fmt::format("<b>{}</b><br><span class=\"soft\">{}</span>", figures[k].value,
                                    figures[k].note));
    }
  }
  return html_table(head, rows);
}

std::string warnings_text(const std::vector<RunResults>& runs) {
  std::string text;
  for (const RunResults& run : runs)
    for (const RunPart& part : run.parts) {
      if (part.warnings.empty()) continue;
      text += heading_of(run, part, runs.size() > 1) + "<ul class=\"plain\">\n";
      for (const std::string& warning : part.warnings)
        text += "<li class=\"keep\">" + xml_escaped(warning) + "</li>\n";
      text += "</ul>\n";
    }
  return text.empty() ? "<p class=\"soft\">There were no warnings.</p>\n" : text;
}

std::string efficiency(const std::vector<RunResults>& runs) {
  std::string text;
  for (const RunResults& run : runs)
    for (const RunPart& part : run.parts) {
      if (part.stages.empty()) continue;
      std::vector<std::vector<std::string>> rows;
      double most = 0;
      for (const StageShare& stage : part.stages) most = std::max(most, stage.share);
      for (const StageShare& stage : part.stages)
        rows.push_back({xml_escaped(stage.name), fmt::format("{:.3f}", stage.seconds),
                        fmt::format("{:.1f} %", 100 * stage.share),
                        fmt::format("<span class=\"share\" style=\"width:{:.1f}%\"></span>",
                                    most > 0 ? 100 * stage.share / most : 0.0)});
      text += heading_of(run, part, runs.size() > 1) +
              html_table({"task", "time of all threads [s]", "share", ""}, rows);
    }
  if (text.empty()) return "";
  return "<p class=\"soft\">Where the time of the threads went. <i>idle, graph</i> is what no task "
         "took. <code>lahar run --trace</code> and <code>lahar trace</code> say why.</p>\n" +
         text;
}

std::string provenance(const std::vector<RunResults>& runs) {
  std::string text;
  for (const RunResults& run : runs)
    for (const RunPart& part : run.parts) {
      text += heading_of(run, part, runs.size() > 1);
      text += repetition(part) + program_of(part) + inputs_of(part);
      std::string input;
      for (const char c : part.scenario) input += c == '\t' ? "  " : std::string(1, c);
      std::string escaped;
      for (std::size_t from = 0; from < input.size();) {
        const std::size_t end = std::min(input.find('\n', from), input.size());
        escaped += xml_escaped(std::string_view(input).substr(from, end - from)) + "\n";
        from = end + 1;
      }
      if (!input.empty())
        text += folded(scenario_title(part), "<pre class=\"keep\">" + escaped + "</pre>");
    }
  return text;
}

}  // namespace lahar
