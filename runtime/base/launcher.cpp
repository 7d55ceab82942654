#include "runtime/base/launcher.h"

#include <algorithm>
#include <array>
#include <cstdlib>

namespace lahar {

bool is_launched() {
  // Set by the launchers of Open MPI, MPICH and Slurm's PMIx or PMI plugins for their processes.
  const std::array names{"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_SIZE", "PMI_RANK"};
  return std::any_of(names.begin(), names.end(),
                     [](const char* name) { return std::getenv(name) != nullptr; });
}

}  // namespace lahar
