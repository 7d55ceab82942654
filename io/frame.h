/// \file The particle state at one step, as written to and read from files.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "physics/types.h"

namespace lahar {

/// One column of a frame: `components` values per particle, particle-major.
/// Components: 1 scalar; Dim a vector; 6 a symmetric tensor in Voigt order (2D too; yz = xz = 0).
struct FrameColumn {
  std::string
      name;  ///< "mass", "volume", "displacement", "velocity", "stress", "strain", "pressure"
  std::string unit;  ///< "-" dimensionless; empty = unknown (foreign columns of tables)
  int components = 1;
  std::vector<double> values;
};

/// Particle state, ascending particle id.
struct Frame {
  Index step = 0;   ///< updates done
  double time = 0;  ///< [s]
  int dim = 3;
  std::vector<Index> id;
  std::vector<double> coordinates;     ///< [m] Dim per particle
  std::vector<std::int32_t> material;  ///< material ids of the scenario; empty = unknown
  std::vector<FrameColumn> columns;
  Index size() const { return static_cast<Index>(id.size()); }
  const FrameColumn* find(std::string_view name) const;
};

/// A frame that is made block by block while it is written, so that it is never in memory as a
/// whole.
struct FrameStream {
  Frame header;  ///< step, time, dim, and the columns without their values
  Index size = 0;
  // Values of particles [first, first + count), as in Frame; valid until the next call of anything.
  std::function<const Index*(Index first, Index count)> id;
  std::function<const std::int32_t*(Index first, Index count)> material;  ///< none = unknown
  std::function<const double*(Index first, Index count)> coordinates;
  std::function<const double*(std::size_t column, Index first, Index count)> values;
};

/// The values of a frame, which must outlive the stream.
FrameStream stream_of(const Frame& frame);

/// x y z for vectors of 2 or 3, xx yy zz xy yz xz for 6 components; empty for scalars.
std::span<const char* const> component_names(int components);

/// State variables of materials: scalars named svars_k, or scalars other than mass and volume whose
/// unit is known ("-" included).
bool is_state_variable(const FrameColumn& column);

/// Names of the state variables in tables, one per column, "" for other columns: svars_0, svars_1,
/// ... in the frame's order.
std::vector<std::string> state_variable_names(const Frame& frame);

/// Throws std::logic_error unless every array has the length that the number of particles implies.
void check_consistent(const Frame& frame);

}  // namespace lahar
