/// \file The checkpoint that a run goes on from: which one, and whether it may.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "io/run/checkpoint.h"
#include "io/scenario/scenario.h"
#include "runtime/comm/communicator.h"
#include "runtime/patches/simulation_state.h"

namespace lahar {

/// Open the checkpoint `which`: a file, or "latest" of the run in `folder`. Every byte of it is
/// verified, by each rank a part. A damaged latest is told to `warn` and the one before is taken.
/// Throws IoError for a damaged file, InputError where there is no checkpoint to go on from.
/// Collective.
std::unique_ptr<CheckpointReader> open_checkpoint(
    const std::string& which, const std::filesystem::path& folder, const Communicator& ranks,
    const std::function<void(const std::string&)>& warn);

/// Compare a scenario, and its side files as in `now`, with those of the checkpoint. Returns what
/// differs and may, as lines for the terminal. Throws InputError with all that must not
/// (allowed_differences()).
std::vector<std::string> check_same_scenario(const CheckpointReader& checkpoint,
                                             const CheckpointHeader& now, const Scenario& scenario);

/// The state in a checkpoint, of which only what is asked for is read. It must not outlive the
/// reader.
SimulationState state_in(const CheckpointReader& checkpoint);

/// The same, for the first step of another run of the same particles. `alike`: it does to them what
/// the run of the checkpoint did (goes_on_alike()).
SimulationState state_at_start(const CheckpointReader& checkpoint, bool alike);
/// The same from the state at the end of the other run.
SimulationState state_at_start(SimulationState end, bool alike);

}  // namespace lahar
