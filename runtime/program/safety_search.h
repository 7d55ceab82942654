/// \file A search for a factor of safety from its first line to its last: the run with full
/// strength, the trials, the mechanism, and the folder with all of them (io/run/safety_record.h).
#pragma once

#include "runtime/program/safety_run.h"
#include "runtime/program/stages_run.h"
#include "runtime/terminal/console.h"

namespace lahar {

/// `arguments` are those of a run: `restart` goes on with the search in the folder. Returns the
/// exit status. Throws InputError where the scenario is not one whose factor can be looked for, or
/// the folder holds results and is not to be overwritten. Collective.
int find_safety(const RunArguments& arguments, const SafetyBounds& bounds,
                const StagesRun::Read& read, Console& console);

}  // namespace lahar
