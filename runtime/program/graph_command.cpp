// `lahar graph`.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numeric>

#include "graph/executor.h"
#include "graph/picture.h"
#include "io/base/atomic_file.h"
#include "io/base/text.h"
#include "runtime/patches/balance.h"
#include "runtime/program/commands.h"
#include "runtime/program/run_description.h"
#include "runtime/program/shell_word.h"
#include "runtime/step/simulation.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

/// The busiest patch and those it exchanges with.
std::vector<int> patch_and_neighbours(const TaskGraph& graph) {
  std::vector<std::vector<int>> neighbours(static_cast<std::size_t>(graph.patches));
  for (const Edge& edge : graph.edges)
    if (edge.exchange && !graph.is_dt(edge.from) && !graph.is_dt(edge.to))
      neighbours[static_cast<std::size_t>(graph.patch_of(edge.to))].push_back(
          graph.patch_of(edge.from));
  int best = 0;
  for (int p = 0; p < graph.patches; ++p)
    if (neighbours[static_cast<std::size_t>(p)].size() >
        neighbours[static_cast<std::size_t>(best)].size())
      best = p;
  std::vector<int> chosen =
      neighbours.empty() ? std::vector<int>{} : neighbours[static_cast<std::size_t>(best)];
  chosen.push_back(best);
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

/// The chosen patches only, with other tasks.
TaskGraph part_of(const TaskGraph& graph, const std::vector<int>& chosen,
                  std::vector<Stage> tasks) {
  std::vector<std::vector<int>> neighbours(chosen.size());
  const auto position = [&](int patch) {
    const auto at = std::lower_bound(chosen.begin(), chosen.end(), patch);
    return at != chosen.end() && *at == patch ? static_cast<int>(at - chosen.begin()) : -1;
  };
  for (const Edge& edge : graph.edges) {
    if (!edge.exchange || graph.is_dt(edge.from) || graph.is_dt(edge.to)) continue;
    const int to = position(graph.patch_of(edge.to)), from = position(graph.patch_of(edge.from));
    if (to < 0 || from < 0) continue;
    auto& list = neighbours[static_cast<std::size_t>(to)];
    if (std::find(list.begin(), list.end(), from) == list.end()) list.push_back(from);
  }
  return make_task_graph(std::move(tasks), neighbours);
}

/// In the order in which a step takes them, each with the chosen patches. As the simulation cuts
/// phases on one rank, or on several.
std::vector<PictureLoop> loops_of(const Simulation& simulation, const std::vector<int>& chosen,
                                  bool several_ranks) {
  std::vector<PictureLoop> loops;
  for (const StageLoop& loop : simulation.loops())
    loops.push_back(
        {loop.name, loop.taken,
         part_of(simulation.graph(), chosen, tasks_of(phases_of(loop.stages, several_ranks)))});
  std::rotate(loops.begin(), loops.begin() + 1, loops.end());  // the time step comes last
  return loops;
}

/// Draw with Graphviz's dot.
void draw(const std::string& file, const std::string& format, const std::string& text) {
  const std::string dot_file = file + ".dot";
  write_text_file(dot_file, text);
  const std::string command =
      fmt::format("dot -T{} -o {} {}", format, shell_word(file), shell_word(dot_file));
  if (std::system(command.c_str()) != 0)
    throw IoError(
        fmt::format("{}: could not be drawn with Graphviz's dot (Debian package graphviz). "
                    "The graph as text is in {}.",
                    file, dot_file));
  std::remove(dot_file.c_str());
}

/// By the end of the file's name, without its dot.
std::string format_of(const std::string& file) {
  if (file.empty()) return "";
  const std::string end = std::filesystem::path(file).extension().string();
  for (const char* format : {"dot", "svg", "png", "pdf"})
    if (end == std::string(".") + format) return format;
  throw InputError("--output must end in .dot, .svg, .png or .pdf, found '" + file + "'.");
}

struct GraphArguments {
  std::string scenario;
  ScenarioOptions options;
  std::string output;  ///< .dot, .svg, .png, .pdf; empty = DOT on standard output
  bool all = false;    ///< every patch instead of one and its neighbours
  int ranks = 0;       ///< frame the patches of each of so many ranks; 0 = do not
};

int graph_command(const GraphArguments& arguments) {
  const std::string format = format_of(arguments.output);
  Scenario scenario = read_scenario(arguments.scenario, arguments.options);
  const std::string title = printable(outline_of(scenario.model).title);
  const Simulation simulation(std::move(scenario.model), {.mode = ExecutionOptions::Mode::serial});
  const TaskGraph& graph = simulation.graph();
  const std::vector<std::string> names = simulation.patch_names();
  std::vector<int> chosen = patch_and_neighbours(graph);
  std::string caption = fmt::format("{}: one patch and its neighbours, {} of {} patches", title,
                                    chosen.size(), graph.patches);
  if (arguments.all || static_cast<int>(chosen.size()) == graph.patches) {
    chosen.resize(static_cast<std::size_t>(graph.patches));
    std::iota(chosen.begin(), chosen.end(), 0);
    caption = title;
  }
  std::vector<int> ranks, chosen_ranks;
  if (arguments.ranks > 0)
    ranks = partition(Partitioner::curve, simulation.patch_graph(), arguments.ranks);
  std::vector<std::string> chosen_names;
  for (const int p : chosen) {
    chosen_names.push_back(names[static_cast<std::size_t>(p)]);
    if (!ranks.empty()) chosen_ranks.push_back(ranks[static_cast<std::size_t>(p)]);
  }
  const PicturePatches patches{chosen_names, chosen_ranks};
  const std::vector<PictureLoop> loops = loops_of(simulation, chosen, arguments.ranks > 1);
  const std::string text = loops.size() == 1 ? to_dot(loops[0].graph, patches, caption)
                                             : to_dot(loops, patches, caption);
  if (arguments.output.empty())
    fmt::print("{}", text);
  else if (format == "dot")
    write_text_file(arguments.output, text);
  else
    draw(arguments.output, format, text);
  return exit_ok;
}

}  // namespace

Action add_graph(CLI::App& command) {
  const auto arguments = std::make_shared<GraphArguments>();
  add_scenario(command, arguments->scenario, arguments->options);
  command.add_option("--output,-o", arguments->output,
                     "File to write: .dot, .svg, .png or .pdf (default: print DOT)");
  command.add_flag("--all", arguments->all, "Draw all patches, not only one and its neighbours");
  command
      .add_option("--ranks", arguments->ranks,
                  "Frame the patches of each rank, with this many MPI ranks")
      ->check(CLI::Range(1, 1'000'000));
  return [arguments](const Words&) {
    refuse_several_ranks("graph");
    return graph_command(*arguments);
  };
}

}  // namespace lahar
