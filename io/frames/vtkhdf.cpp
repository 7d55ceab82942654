#include "io/frames/vtkhdf.h"

#include <fmt/format.h>
#include <hdf5.h>

#include "io/base/atomic_file.h"
#include "io/frames/frame_slabs.h"

namespace lahar {

void write_frame(const Frame& frame, const std::filesystem::path& file) {
  check_consistent(frame);
  AtomicFile atomic(file);
  const FrameLayout layout =
      lay_out_frame(header_of(frame), frame.size(), atomic.temporary(), file);
  SlabFile(atomic.temporary(), file).write(layout, 0, {&frame, 1});
  atomic.commit();
}

std::string hdf5_version() {
  // Not H5get_libversion(): it would initialise the library before hdf_handle.cpp can say how.
  return fmt::format("{}.{}.{}", H5_VERS_MAJOR, H5_VERS_MINOR, H5_VERS_RELEASE);
}

}  // namespace lahar
