/// \file The bytes of a checkpoint, for tests that compare them.
#pragma once

#include <filesystem>
#include <string>

#include "io/base/atomic_file.h"
#include "runtime/output/checkpoint_writer.h"
#include "runtime/step/simulation.h"

namespace lahar {

/// Write the state of a simulation; every rank gets the file's bytes.
inline std::string checkpoint_of(const Simulation& simulation, const Communicator& ranks,
                                 const std::filesystem::path& folder) {
  CheckpointWriter writer({.folder = folder, .kept = 1000}, ranks);
  CheckpointHeader header;
  const SimulationState state = simulation.state();
  header.run = state.run;
  writer.write(header, state);
  writer.finish();
  ranks.wait_for_all();
  std::string text = read_text_file(folder / checkpoint_name(state.run.step));
  ranks.wait_for_all();
  return text;
}

}  // namespace lahar
