/// \file Whether this process is one of several that a launcher started.
#pragma once

namespace lahar {

/// True if the environment is that of a launcher of MPI, for a process of its own.
bool is_launched();

}  // namespace lahar
