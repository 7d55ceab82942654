/// \file The commands of the program; each returns its exit code.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/scenario/scenario.h"
#include "runtime/base/exit_codes.h"
#include "runtime/patches/balance.h"
#include "runtime/step/simulation.h"
#include "runtime/trace/record/record.h"

namespace lahar {

struct RunArguments {
  std::string scenario;
  ScenarioOptions options;
  ExecutionOptions execution;
  std::string output;  ///< run folder; empty = the scenario's
  bool overwrite = false;
  bool quiet = false;
  double memory = 0;     ///< [bytes] of the machine that ranks on it may take; 0 = all it has
  double wall_time = 0;  ///< [s] stop before; 0 = no limit
  std::string restart;   ///< go on from: a checkpoint, or "latest"; empty = from the beginning
  std::optional<Index> checkpoint_steps;     ///< instead of the scenario's
  std::optional<double> checkpoint_minutes;  ///< the same
  int ranks = 0;                             ///< check: show the partition over so many; 0 = none
  Partitioner partitioner = Partitioner::curve;  ///< check: of that partition
  int writers = 0;                               ///< ranks that write frames; 0 = all
  std::optional<TraceWindow> trace;              ///< record these steps
  std::vector<std::string> command;
};

int run_command(const RunArguments& arguments);
int check_command(const RunArguments& arguments);

struct GraphArguments {
  std::string scenario;
  ScenarioOptions options;
  std::string output;  ///< .dot, .svg, .png, .pdf; empty = DOT on standard output
  bool all = false;    ///< every patch instead of one and its neighbours
  int ranks = 0;       ///< frame the patches of each of so many ranks; 0 = do not
  Partitioner partitioner = Partitioner::curve;  ///< of that partition
};
int graph_command(const GraphArguments& arguments);

int info_command();

}  // namespace lahar
