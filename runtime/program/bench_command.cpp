// Options of `lahar bench`.
#include "runtime/bench/bench_command.h"

#include <filesystem>

#include "runtime/bench/bench_locate.h"
#include "runtime/bench/bench_ranks.h"
#include "runtime/program/commands.h"

namespace lahar {

namespace {

int measure(BenchArguments arguments, const std::string& what) {
  const int repeats = arguments.repeats > 0 ? arguments.repeats : 5;
  if (what == "ranks" || what == "overlap" || what == "balance") {
    const RankBenchArguments ranks{std::filesystem::read_symlink("/proc/self/exe").string(),
                                   arguments.quick, repeats};
    return what == "ranks"     ? bench_ranks(ranks)
           : what == "overlap" ? bench_overlap(ranks)
                               : bench_balance(ranks);
  }
  refuse_several_ranks("bench");
  if (what == "locate") return bench_locate({arguments.quick, repeats});
  if (what == "trace") arguments.cases = {"trace-plate", "trace-h8-125k"};
  return bench_command(arguments);
}

}  // namespace

Action add_bench(CLI::App& command) {
  const auto arguments = std::make_shared<BenchArguments>();
  const auto what = std::make_shared<std::string>();
  command.add_option("--cases", arguments->cases, "Cases to measure (default: all but large ones)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("NAME,...");
  command.add_flag("--list", arguments->list, "List the cases and the memory they need");
  command.add_flag("--large", arguments->large, "Also run cases that need gigabytes and minutes");
  command.add_flag("--quick", arguments->quick,
                   "Take short samples: for a quick look, not a measurement");
  command.add_option("--repeat", arguments->repeats, "Samples of each run (default: 5)")
      ->check(CLI::Range(1, 1000));
  command
      .add_option("--steps", arguments->steps, "Steps per sample (default: as many as take 0.6 s)")
      ->check(CLI::Range(1, 1'000'000'000));
  command
      .add_option("--threads,-t", arguments->threads,
                  "Largest number of threads (default: all cores)")
      ->check(CLI::Range(1, 4096));
  command.add_option("--json", arguments->json, "Write all measurements to a JSON file");
  command.add_option("--markdown", arguments->markdown, "Also write the report to a file");
  command.add_option("--compare", arguments->compare, "Earlier result (JSON) to compare with");
  command.add_option("--from", arguments->from, "Report this result (JSON) instead of measuring");
  command
      .add_option("WHAT", *what,
                  "ranks, overlap or balance: measure MPI ranks instead (lahar starts itself "
                  "under mpirun); locate: measure the search for cells of particles; trace: "
                  "measure the cost of recording")
      ->check(CLI::IsMember({"ranks", "overlap", "balance", "locate", "trace"}));
  return [arguments, what](const Words&) { return measure(*arguments, *what); };
}

}  // namespace lahar
