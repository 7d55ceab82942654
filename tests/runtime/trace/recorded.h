/// \file A run with a trace, read back.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>
#include <utility>

#include "runtime/program/trace_session.h"
#include "tests/runtime/step/models.h"

namespace lahar::test {

struct Recorded {
  TraceLog log;
  SolveCounts solves;
};

inline Recorded recorded(Model<2> model, const ExecutionOptions& way, TraceWindow window = {}) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("lahar-recorded-test-" + std::to_string(getpid()));
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  Simulation simulation(std::move(model), way);
  {
    TraceAbout about;
    about.threads = way.threads;
    TraceSession session(folder, window, Communicator{}, about, simulation.loops(),
                         simulation.trace_graph());
    simulation.run();
    session.finish();
  }
  Recorded all{read_trace(folder), simulation.solves()};
  std::filesystem::remove_all(folder);
  return all;
}

}  // namespace lahar::test
