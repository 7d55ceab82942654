/// \file Outlines of texts, in the font DejaVu Sans (font/LICENSE).
#pragma once

#include <string_view>
#include <vector>

#include "runtime/picture/drawing.h"

namespace lahar {

/// Width of a text whose letters have this size; both in pixels.
double text_length(std::string_view words, double size);

/// Closed outlines, the text begins at (0, 0), y downward. Characters that the font file does not
/// have are boxes.
std::vector<Drawing::Points> text_outline(std::string_view words, double size);

}  // namespace lahar
