/// \file What `lahar run` and `lahar check` are asked for.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/scenario/scenario.h"
#include "runtime/patches/balance.h"
#include "runtime/step/simulation.h"
#include "runtime/terminal/console.h"
#include "runtime/trace/record/record.h"

namespace lahar {

struct RunArguments {
  std::string scenario;
  ScenarioOptions options;
  ExecutionOptions execution;
  std::string output;  ///< run folder; empty = the scenario's
  bool overwrite = false;
  bool quiet = false;
  double memory = 0;        ///< [bytes] of the machine that ranks on it may take; 0 = all it has
  double wall_time = 0;     ///< [s] stop before; 0 = no limit
  std::string restart;      ///< go on from: a checkpoint, or "latest"; empty = from the beginning
  bool can_restart = true;  ///< the command has --restart
  std::optional<Index> checkpoint_steps;     ///< instead of the scenario's
  std::optional<double> checkpoint_minutes;  ///< the same
  std::string picture;                       ///< check: SVG file of the model; empty = none
  int ranks = 0;                             ///< check: show the partition over so many; 0 = none
  Partitioner partitioner = Partitioner::curve;  ///< check: of that partition
  int writers = 0;                               ///< ranks that write frames; 0 = all
  std::optional<TraceWindow> trace;              ///< record these steps
  std::vector<std::string> command;
  ConsoleListener listener = {};  ///< of another program that runs the case
  /// After every step, with the share of the run that is done; false: stop soon. May be empty.
  std::function<bool(Index step, double time, double share)> on_step = {};
};

}  // namespace lahar
