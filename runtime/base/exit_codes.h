/// \file Exit status of the program.
#pragma once

namespace lahar {

/// Exit codes.
inline constexpr int exit_ok = 0, exit_internal = 1, exit_input = 2, exit_simulation = 3,
                     exit_file = 4, exit_rank = 5, exit_stopped = 75;

}  // namespace lahar
