/// \file The particle state at one step, as written to and read from files.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "physics/base/types.h"

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

/// Particle state, ascending particle id; a piece of one in the order in which its patch holds it.
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

/// What a frame says of itself, whichever particles it has.
struct FrameHeader {
  Index step = 0;   ///< updates done
  double time = 0;  ///< [s]
  int dim = 3;
  bool material = true;              ///< material ids are known
  bool single = false;               ///< files have numbers of 32 bits
  std::vector<FrameColumn> columns;  ///< without values
};
FrameHeader header_of(const Frame& frame);

/// Pieces of frames that are done with: the next ones are made in their memory, because what comes
/// fresh from the system takes longer to get than to fill. Any thread.
class SparePieces {
 public:
  /// Piece i of some frame, or a new one: without particles, but with its columns.
  Frame take(std::size_t i);
  /// All of a frame.
  void give(std::vector<Frame>&& pieces);

 private:
  std::mutex mutex_;
  /// By the piece's place, so that sizes fit.
  std::vector<std::vector<Frame>> pieces_;
};

/// A frame as the patches give it: its particles are those of all pieces, one after the other.
struct FramePieces {
  FrameHeader header;
  std::vector<Frame> pieces;  ///< with the header's columns
  /// Who made the pieces wants their memory back; may be null.
  std::shared_ptr<SparePieces> spare = nullptr;

  Index size() const;
  /// Nobody needs the pieces any more.
  void release();
};

/// A frame whose pieces are copied only while they are written, because there is no memory for a
/// copy of all of them.
struct FrameSource {
  FrameHeader header;
  std::vector<Index> sizes;                 ///< particles of each piece
  std::function<Frame(std::size_t)> piece;  ///< may be called by several threads at a time
  int threads = 1;                          ///< that may call it

  Index size() const;
};

/// One frame of all pieces, ascending particle id.
Frame join(const FramePieces& frame);
Frame join(const FrameSource& frame);

/// Bring the particles into ascending order of their ids.
void sort_by_id(Frame& frame);

/// x y z for vectors of 2 or 3, xx yy zz xy yz xz for 6 components; empty for scalars.
std::span<const char* const> component_names(int components);

/// State variables of materials: scalars named svars_k, or scalars whose unit is known ("-"
/// included) and that are neither columns of particles nor derived fields.
bool is_state_variable(const FrameColumn& column);

/// Names of the state variables in tables, one per column, "" for other columns: svars_0, svars_1,
/// ... in the frame's order.
std::vector<std::string> state_variable_names(const Frame& frame);

/// Throws std::logic_error unless every array has the length that the number of particles implies.
void check_consistent(const Frame& frame);

}  // namespace lahar
