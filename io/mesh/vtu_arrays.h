/// \file The arrays of a VTU file: as text or binary, in place or appended, also compressed.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "io/base/binary_reader.h"

namespace lahar {

/// Where an array is in the file, and how it is written.
struct VtuArray {
  std::string name, type, format;
  Index components = 1;
  Index begin = 0, end = 0;  ///< [bytes] of its text in place
  Index offset = 0;          ///< [bytes] in the appended data
  bool integer() const { return type.find("Int") != type.npos; }
};

/// What a VTU file says before its data are read.
struct VtuHead {
  Index n_points = -1, n_cells = -1;
  bool wide = false;             ///< counts of bytes have 64 bits
  bool compressed = false;       ///< by zlib
  bool appended_base64 = false;  ///< else appended bytes are raw
  Index appended = -1;           ///< [bytes] where appended data begin
  std::map<std::string, VtuArray> cells;
  std::vector<VtuArray> points, point_data, cell_data;
};

/// Bytes that a byte of a file may hold if it is compressed: zlib makes 1032 of one at most.
inline constexpr Index best_compression = 1100;

/// Throws InputError.
VtuHead read_vtu_head(const SideFile& file);

/// All numbers of an array, `count` of them. Throws InputError.
std::vector<double> read_vtu_numbers(const SideFile& file, const VtuHead& head,
                                     const VtuArray& array, Index count);
std::vector<Index> read_vtu_integers(const SideFile& file, const VtuHead& head,
                                     const VtuArray& array, Index count);

[[noreturn]] void fail_vtu(const SideFile& file, std::string message, std::string hint = "");

}  // namespace lahar
