/// \file The search for a factor of safety, with its folder: the run with full strength in
/// equilibrium/, trials in safety.csv, and the mechanism by which the body fails in mechanism/.
#pragma once

#include "runtime/program/safety_run.h"
#include "runtime/program/stages_run.h"
#include "runtime/terminal/console.h"

namespace lahar {

/// Returns the exit status. Throws InputError where the scenario is not one whose factor can be
/// looked for, or the folder holds results and is not to be overwritten. Collective.
int find_safety(const RunArguments& arguments, const SafetyBounds& bounds,
                const StagesRun::Read& read, Console& console);

}  // namespace lahar
