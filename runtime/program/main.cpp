/// \file The program: command line, and one place that turns errors into messages and exit codes.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <map>
#include <new>
#include <string_view>
#include <system_error>

#include "io/base/memory_limit.h"
#include "io/base/text.h"
#include "io/results/compare.h"
#include "io/results/export.h"
#include "io/schema/keys.h"
#include "runtime/bench/bench_command.h"
#include "runtime/bench/bench_locate.h"
#include "runtime/bench/bench_ranks.h"
#include "runtime/program/command_errors.h"
#include "runtime/program/commands.h"
#include "runtime/program/material_command.h"
#include "runtime/program/signals.h"
#include "runtime/program/study_options.h"
#include "runtime/terminal/console.h"
#include "runtime/terminal/version.h"
#include "runtime/trace/analyse/command.h"
#include "runtime/verify/verify_command.h"

namespace lahar {

namespace {

/// Options that run, check and graph share.
void add_scenario(CLI::App& command, std::string& scenario, ScenarioOptions& options) {
  command.add_option("SCENARIO", scenario, "Scenario file (JSON)")->required();
  command
      .add_option("--set", options.overrides,
                  "Replace a value: analysis.nsteps=100 or /analysis/nsteps=100 (repeatable)")
      ->type_name("KEY=VALUE");
  command
      .add_option("--folder,-f", options.folder,
                  "Folder for relative file names in the scenario (default: the scenario's folder)")
      ->type_name("FOLDER");
  command.add_flag("--as-cbgeo", options.as_cbgeo,
                   "Run what CB-Geo MPM would run (it ignores \"stress_update\", for example)");
}

/// Refuse rather than do the same several times.
void refuse_several_ranks(const char* command) {
  if (const Communicator ranks = Communicator::world(); ranks.several())
    throw InputError(
        fmt::format("`lahar {}` is not for several ranks, found {}; only `lahar run` is. Start it "
                    "without mpirun.",
                    command, ranks.size()));
}

/// --partition, of run and check.
CLI::Option* add_partition(CLI::App& command, Partitioner& chosen, const std::string& text) {
  const auto choose = [&chosen](const std::string& name) {
    chosen = name == "scotch" ? Partitioner::scotch : Partitioner::curve;
  };
  return command.add_option_function<std::string>("--partition", choose, text)
      ->check(CLI::IsMember({"curve", "scotch"}))
      ->type_name("NAME");
}

const std::map<std::string, std::uint64_t> size_units{
    {"KiB", 1ULL << 10}, {"MiB", 1ULL << 20}, {"GiB", 1ULL << 30}, {"TiB", 1ULL << 40}};

/// --memory, of run and check.
void add_memory(CLI::App& command, double& bytes) {
  command
      .add_option_function<std::string>(
          "--memory", [&bytes](const std::string& text) { bytes = bytes_of(text); },
          "Memory of the machine that the case may use, such as 64G or 500M (default: all of it, "
          "or the limit of its control group). A case that needs more is refused")
      ->type_name("SIZE");
}

/// What --balance says.
BalanceOptions balance_options(const std::string& text, Partitioner partitioner) {
  using When = BalanceOptions::When;
  if (text == "auto") return {.partitioner = partitioner};
  if (text == "off") return {.when = When::never, .partitioner = partitioner};
  const bool digits = !text.empty() && text.size() < 10 &&
                      text.find_first_not_of("0123456789") == std::string::npos;
  const Step every = digits ? std::stoll(text) : 0;
  if (every <= 0)
    throw InputError("--balance must be auto, off or a number of steps, found '" + text + "'.");
  return {.when = When::forced, .every = every, .partitioner = partitioner};
}

int export_command(const std::string& run, const std::string& format, const std::string& step,
                   const std::string& output) {
  FrameChoice choice;
  if (step == "all")
    choice.kind = FrameChoice::Kind::all;
  else if (step != "last")
    choice = {FrameChoice::Kind::step, std::stoll(step)};
  for (const auto& file : export_run(run, export_format(format), choice, output))
    fmt::print("{}\n", printable(file.string()));
  return exit_ok;
}

int compare_command(const std::string& a, const std::string& b, const Tolerances& tolerances,
                    std::optional<Index> step) {
  const Comparison comparison =
      compare(std::filesystem::path(a), std::filesystem::path(b), tolerances, step);
  fmt::print("{}", printable_lines(comparison.text()));
  return comparison.passed ? exit_ok : exit_internal;
}

int run_program(int argc, char** argv) {
  CLI::App app{
      "Material Point Method engine: large deformations of soils, fluids and solids.\n"
      "A time step is a graph of tasks over patches of the mesh. Results are bitwise identical\n"
      "for any number of threads and MPI ranks (mpirun lahar run ...).",
      "lahar"};
  app.set_version_flag("--version", "lahar " + version_line());
  app.require_subcommand(1);
  app.footer(
      "Start with:  lahar run examples/plate-with-hole.json\n"
      "Exit codes: 0 finished, 1 internal error or comparison failed, 2 invalid input,\n"
      "3 simulation failed, 4 file not read or written, 5 MPI ranks are incompatible or one was\n"
      "lost, 75 stopped on request.");
  int code = exit_ok;

  RunArguments run;
  run.command.assign(argv, argv + argc);
  bool serial = false, bulk = false;
  std::string balance = "auto";
  auto* run_app = app.add_subcommand("run", "Run a case");
  add_scenario(*run_app, run.scenario, run.options);
  run_app->add_option("--threads,-t", run.execution.threads, "Threads (default: all cores)")
      ->check(CLI::Range(1, 4096));
  run_app->add_flag("--serial", serial,
                    "Use a serial loop instead of the task graph; same results");
  run_app
      ->add_option("--balance", balance,
                   "Move patches between ranks: auto (where it pays by measured work), off, or for "
                   "tests a number of steps after which patches move at random")
      ->default_str("auto");
  add_partition(*run_app, run.execution.balance.partitioner,
                "Distribute patches among ranks by curve (space-filling curve, default) or scotch");
  run_app
      ->add_option("--writers", run.writers,
                   "Number of MPI ranks that write frames (default: all). The others send them "
                   "their particles. For file systems that slow down with many writers")
      ->check(CLI::Range(1, 1'000'000));
  run_app
      ->add_option("--staging", run.execution.staging_bytes,
                   "Largest frame or checkpoint per rank that is copied and written in the "
                   "background, with at most three copies of frames and two of checkpoints at a "
                   "time. Steps wait while a larger one is written")
      ->transform(CLI::AsNumberWithUnit(size_units, CLI::AsNumberWithUnit::UNIT_REQUIRED))
      ->type_name("SIZE")
      ->default_str("64MiB");
  run_app->add_flag("--bulk-synchronous", bulk,
                    "For comparison: all wait for all after each phase; same results");
  StudyOptions study;
  study.add_to(*run_app, run);
  run_app->add_option("--output,-o", run.output, "Run folder (default: from the scenario)");
  run_app->add_flag("--overwrite", run.overwrite, "Replace earlier results in the run folder");
  run_app
      ->add_option(
          "--wall-time", run.wall_time,
          "Write a checkpoint and stop before this many seconds of wall time; exit code 75")
      ->check(CLI::PositiveNumber);
  auto* restart = run_app->add_option(
      "--restart", run.restart,
      "Continue the run in its folder, from its latest checkpoint or from a file");
  restart->type_name("latest|FILE")->excludes("--overwrite");
  run_app
      ->add_option("--checkpoint-steps", run.checkpoint_steps,
                   "Steps between checkpoints; 0: none (default: from the scenario)")
      ->check(CLI::NonNegativeNumber);
  run_app
      ->add_option("--checkpoint-minutes", run.checkpoint_minutes,
                   "Minutes between checkpoints; 0: none (default: from the scenario)")
      ->check(CLI::NonNegativeNumber);
  add_memory(*run_app, run.memory);
  run_app->add_flag("--quiet,-q", run.quiet, "Print only warnings and errors");
  run_app->callback([&] {
    run.execution.ranks = Communicator::world();
    study.give(run);
    if (serial && run.execution.ranks.several())
      throw InputError("--serial is for one rank: on several, only the task graph runs.");
    if (serial && bulk)
      throw InputError("--serial and --bulk-synchronous exclude each other; give one of them.");
    if (serial) run.execution.mode = ExecutionOptions::Mode::serial;
    if (bulk) run.execution.mode = ExecutionOptions::Mode::bulk;
    run.execution.balance = balance_options(balance, run.execution.balance.partitioner);
    code = run_command(run);
  });

  RunArguments check;
  auto* check_app =
      app.add_subcommand("check", "Validate a case and print sizes and limits, without a run");
  add_scenario(*check_app, check.scenario, check.options);
  auto* ranks_option =
      check_app
          ->add_option("--ranks", check.ranks,
                       "Show how patches would be distributed among this many MPI ranks")
          ->check(CLI::Range(1, 1'000'000));
  add_memory(*check_app, check.memory);
  add_partition(*check_app, check.partitioner,
                "Distribute them by curve (space-filling curve, default) or scotch")
      ->needs(ranks_option);
  check_app->callback([&] {
    refuse_several_ranks("check");
    code = check_command(check);
  });

  std::string source, format, step = "last", output;
  auto* export_app =
      app.add_subcommand("export", "Write particles as CSV, for ParaView or for CB-Geo MPM");
  export_app->add_option("RUN", source, "Run folder or frame")->required();
  export_app->add_option("--to", format, "csv, vtu or cbgeo")->required();
  export_app->add_option("--step", step, "Step number, last (default) or all")
      ->check([](const std::string& text) -> std::string {
        const bool number = !text.empty() && text.size() < 19 &&
                            text.find_first_not_of("0123456789") == std::string::npos;
        return number || text == "all" || text == "last" ? "" : "must be a step, last or all";
      });
  export_app->add_option("--output,-o", output, "File or folder to write (default: RUN/export)");
  export_app->callback([&] {
    refuse_several_ranks("export");
    code = export_command(source, format, step, output);
  });

  std::string a, b;
  Tolerances tolerances;
  std::optional<Index> compare_step;
  auto* compare_app = app.add_subcommand("compare", "Compare two outputs, field by field");
  compare_app->add_option("A", a, "Run folder, frame or CSV table")->required();
  compare_app->add_option("B", b, "The reference: run folder, frame or CSV table")->required();
  compare_app
      ->add_option("--rtol", tolerances.rtol,
                   "Relative tolerance, to the field's largest magnitude in B")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  compare_app->add_option("--atol", tolerances.atol, "Absolute tolerance, in the field's unit")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  compare_app
      ->add_option("--floor", tolerances.floor,
                   "A field counts as zero if all its values are below this")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  compare_app->add_option("--step", compare_step,
                          "Step to compare in run folders (default: the last)");
  compare_app->callback([&] {
    refuse_several_ranks("compare");
    // No tolerance asked for, none given: only equal values are equal.
    if (tolerances.rtol == 0 && compare_app->count("--floor") == 0) tolerances.floor = 0;
    code = compare_command(a, b, tolerances, compare_step);
  });

  GraphArguments graph;
  auto* graph_app =
      app.add_subcommand("graph", "Draw the task graph of one time step as DOT, SVG, PNG or PDF");
  add_scenario(*graph_app, graph.scenario, graph.options);
  graph_app->add_option("--output,-o", graph.output,
                        "File to write: .dot, .svg, .png or .pdf (default: print DOT)");
  graph_app->add_flag("--all", graph.all, "Draw all patches, not only one and its neighbours");
  graph_app
      ->add_option("--ranks", graph.ranks,
                   "Frame the patches of each rank, with this many MPI ranks")
      ->check(CLI::Range(1, 1'000'000));
  graph_app->callback([&] {
    refuse_several_ranks("graph");
    code = graph_command(graph);
  });

  TraceArguments trace;
  auto* trace_app = app.add_subcommand("trace", "Analyse a trace that lahar run --trace recorded");
  trace_app->add_option("RUN", trace.run, "Run folder")->required();
  trace_app->add_flag("--json", trace.json, "Print all figures as JSON");
  trace_app
      ->add_option("--chrome", trace.chrome,
                   "Write trace events for ui.perfetto.dev, as .json or .json.gz")
      ->type_name("FILE");
  trace_app->add_option("--otf2", trace.otf2, "Write an OTF2 archive, for Vampir (if built so)")
      ->type_name("FOLDER");
  trace_app->add_option("--html", trace.html, "Write a page for a browser, with a timeline")
      ->type_name("FILE");
  trace_app->add_flag("--check", trace.check, "Only check whether the trace is sound");
  auto* replay_option =
      trace_app->add_option("--replay", trace.replay,
                            "Simulate the run with another network: ideal, measured, or a JSON "
                            "file with latency, bandwidth and overhead");
  replay_option->type_name("NETWORK");
  trace_app->add_option("--ranks", trace.ranks, "Ranks of the replay (default: as recorded)")
      ->needs(replay_option)
      ->check(CLI::Range(1, 100'000));
  trace_app
      ->add_option("--threads,-t", trace.threads,
                   "Threads per rank of the replay or projection (default: as recorded)")
      ->check(CLI::Range(1, 4096));
  trace_app->add_flag("--bulk-synchronous", trace.bulk, "Replay with a barrier after each phase")
      ->needs(replay_option);
  auto* project_option = trace_app->add_flag(
      "--project", trace.project,
      "Project weak and strong scaling to 100,000 cores, with the task graph and with barriers");
  trace_app
      ->add_flag("--steady", trace.steady,
                 "Project with the median time of each task, without noise of this machine")
      ->needs(project_option);
  trace_app->callback([&] {
    refuse_several_ranks("trace");
    code = trace_command(trace);
  });

  MaterialArguments material;
  auto* material_app =
      app.add_subcommand("material", "Drive one material point along a strain or stress path");
  material_app->add_option("DRIVER", material.driver, "Input (JSON): material and path")
      ->required();
  material_app
      ->add_option("--set", material.options.overrides,
                   "Replace a value: material.friction=30 (repeatable)")
      ->type_name("KEY=VALUE");
  material_app->add_flag("--as-cbgeo", material.options.as_cbgeo,
                         "Use return mappings and laws as in CB-Geo MPM");
  material_app->add_option("--output,-o", material.output,
                           "Write OUTPUT.csv and OUTPUT.svg (default: beside the driver)");
  material_app->add_flag("--no-plot", material.no_plot, "Write only the table");
  material_app->callback([&] {
    refuse_several_ranks("material");
    code = material_command(material);
  });

  VerifyArguments verify;
  auto* verify_app =
      app.add_subcommand("verify", "Compare a case with its solution in the literature");
  verify_app->add_option("CASE", verify.name, "Name of the case (default: list the cases)");
  verify_app
      ->add_option("--threads,-t", verify.threads, "Largest number of threads (default: all cores)")
      ->check(CLI::Range(1, 4096));
  verify_app->add_option("--output,-o", verify.output,
                         "Folder for pictures and tables (default: verify/CASE)");
  verify_app->add_flag("--published", verify.published,
                       "Use the published time step and duration: minutes instead of seconds");
  verify_app->callback([&] {
    refuse_several_ranks("verify");
    code = verify_command(verify);
  });

  BenchArguments bench;
  auto* bench_app = app.add_subcommand(
      "bench", "Measure time per particle and step, scaling, memory and start-up");
  bench_app->add_option("--cases", bench.cases, "Cases to measure (default: all but large ones)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("NAME,...");
  bench_app->add_flag("--list", bench.list, "List the cases and the memory they need");
  bench_app->add_flag("--large", bench.large, "Also run cases that need gigabytes and minutes");
  bench_app->add_flag("--quick", bench.quick,
                      "Take short samples: for a quick look, not a measurement");
  bench_app->add_option("--repeat", bench.repeats, "Samples of each run (default: 5)")
      ->check(CLI::Range(1, 1000));
  bench_app->add_option("--steps", bench.steps, "Steps per sample (default: as many as take 0.6 s)")
      ->check(CLI::Range(1, 1'000'000'000));
  bench_app
      ->add_option("--threads,-t", bench.threads, "Largest number of threads (default: all cores)")
      ->check(CLI::Range(1, 4096));
  bench_app->add_option("--json", bench.json, "Write all measurements to a JSON file");
  bench_app->add_option("--markdown", bench.markdown, "Also write the report to a file");
  bench_app->add_option("--compare", bench.compare, "Earlier result (JSON) to compare with");
  bench_app->add_option("--from", bench.from, "Report this result (JSON) instead of measuring");
  std::string of_ranks;
  bench_app
      ->add_option("WHAT", of_ranks,
                   "ranks, overlap or balance: measure MPI ranks instead (lahar starts itself "
                   "under mpirun); locate: measure the search for cells of particles; trace: "
                   "measure the cost of recording")
      ->check(CLI::IsMember({"ranks", "overlap", "balance", "locate", "trace"}));
  bench_app->callback([&] {
    if (of_ranks == "locate") {
      refuse_several_ranks("bench");
      code = bench_locate({bench.quick, bench.repeats > 0 ? bench.repeats : 5});
      return;
    }
    if (of_ranks == "trace") bench.cases = {"trace-plate", "trace-h8-125k"};
    if (!of_ranks.empty() && of_ranks != "trace") {
      const RankBenchArguments arguments{std::filesystem::read_symlink("/proc/self/exe").string(),
                                         bench.quick, bench.repeats > 0 ? bench.repeats : 5};
      code = of_ranks == "ranks"     ? bench_ranks(arguments)
             : of_ranks == "overlap" ? bench_overlap(arguments)
                                     : bench_balance(arguments);
      return;
    }
    refuse_several_ranks("bench");
    code = bench_command(bench);
  });

  bool schema = false, reference = false;
  auto* info_app = app.add_subcommand(
      "info", "Print version, build and features, or the reference of the input");
  info_app->add_flag("--schema", schema, "Print the JSON Schema of scenario files");
  info_app->add_flag("--reference", reference, "Print every key of scenario files, as Markdown");
  info_app->callback([&] {
    if (schema) fmt::print("{}\n", scenario_schema());
    if (reference) fmt::print("{}\n", scenario_reference());
    if (!schema && !reference) code = info_command();
  });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) throw InputError(argument_problems(app, error));
    if (Communicator::world().rank() == 0) app.exit(error);  // help, version
  }
  return code;
}

}  // namespace

}  // namespace lahar

namespace lahar {

namespace {

/// Says what went wrong, on all ranks that know; returns the exit code.
int leave(int code, const std::string& message) {
  MpiSession::leave(code, message);
  return code;
}

constexpr const char* no_memory =
    "lahar: error: not enough memory. Use fewer cells or particles; `lahar check` prints the sizes "
    "of a case.\n";

/// Libraries ask for memory where they may not throw: in destructors, for instance.
[[noreturn]] void end_at_once() {
  if (const auto exception = std::current_exception()) try {
      std::rethrow_exception(exception);
    } catch (const std::bad_alloc&) {
      std::fputs(no_memory, stderr);
      std::_Exit(exit_file);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "lahar: internal error: %s\n", error.what());
    } catch (...) {
    }
  std::abort();
}

int leave_without_thread() {
  return leave(exit_file,
               "lahar: error: the system starts no more threads. Use fewer (--threads), or raise "
               "the limit of processes (ulimit -u).\n");
}

int guarded(int argc, char** argv) {
  try {
    const int code = run_program(argc, argv);
    if (std::fflush(stdout) != 0 || std::ferror(stdout))
      throw IoError("standard output could not be written");
    return code;
  } catch (const InputError& error) {
    return leave(exit_input, format_problems(error.problems(), "error", use_colour(STDERR_FILENO)));
  } catch (const IoError& error) {
    return leave(exit_file, fmt::format("lahar: error: {}\n", printable_lines(error.what())));
  } catch (const SimulationError& error) {
    return leave(exit_simulation, fmt::format("lahar: error: {}\n", printable_lines(error.what())));
  } catch (const RankError& error) {
    return leave(exit_rank, fmt::format("lahar: error: {}\n", printable_lines(error.what())));
  } catch (const std::bad_alloc&) {
    return leave(exit_file, no_memory);
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) return leave_without_thread();
    return leave(exit_file, fmt::format("lahar: error: {}\n", printable_lines(error.what())));
  } catch (const std::exception& error) {
    if (std::string_view(error.what()).starts_with("pthread_create")) return leave_without_thread();
    return leave(exit_internal,
                 fmt::format("lahar: internal error: {}\n", printable_lines(error.what())));
  }
}

}  // namespace

}  // namespace lahar

int main(int argc, char** argv) {
  std::set_terminate(lahar::end_at_once);
  lahar::ignore_file_size_signal();  // before MPI makes files of its own
  try {
    const lahar::MpiSession session(argc, argv);
    return lahar::guarded(argc, argv);
  } catch (const lahar::RankError& error) {
    fmt::print(stderr, "lahar: error: {}\n", error.what());
    return lahar::exit_rank;
  }
}
