/// \file A field of a frame, one number for each particle.
#pragma once

#include <string>
#include <vector>

#include "io/frames/frame.h"

namespace lahar {

struct FrameField {
  std::string label;  ///< as a person reads it: "stress xx"
  std::string unit;   ///< "-" and "": none
  std::vector<double> values;
};

/// Names of the fields that a frame gives: its columns, their components and magnitudes, and the
/// derived fields (physics/particles/derived_fields.h) that follow from them.
std::vector<std::string> field_names(const FrameHeader& header);

/// Columns of which a field is made. Throws InputError with the names there are.
std::vector<std::string> columns_of_field(const FrameHeader& header, const std::string& name);

/// A field of a frame that has these columns. Throws InputError likewise.
FrameField field_of(const Frame& frame, const std::string& name);

}  // namespace lahar
