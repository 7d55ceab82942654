#include "runtime/terminal/version.h"

#include <fmt/format.h>
#include <oneapi/tbb/version.h>

#include <Eigen/Core>

#include "io/frames/vtkhdf.h"
#include "lahar_version.h"
#include "physics/base/simd.h"

namespace lahar {

std::string version_line() {
  return fmt::format("{} (commit {})", LAHAR_VERSION, LAHAR_COMMIT);
}

std::string compiler_line() {
  return fmt::format("{}, {}, {}, vectors of {} doubles", LAHAR_COMPILER, LAHAR_BUILD_TYPE,
                     LAHAR_FLAGS, lanes<Pack>);
}

std::vector<std::pair<std::string, std::string>> library_versions() {
  return {{"Eigen",
           fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
          {"oneTBB", TBB_runtime_version()},
          {"HDF5", hdf5_version()},
          {"fmt", fmt::format("{}.{}.{}", FMT_VERSION / 10000, FMT_VERSION / 100 % 100,
                              FMT_VERSION % 100)}};
}

}  // namespace lahar
