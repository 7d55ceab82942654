/// \file A picture of a field of a frame: particles, axes, a colour bar, a title.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/frames/frame.h"
#include "runtime/picture/drawing.h"
#include "runtime/picture/frame_field.h"
#include "runtime/picture/particle_view.h"
#include "runtime/picture/view.h"

namespace lahar {

/// Colours of what is not data.
struct Ink {
  const char* text = "#222222";
  const char* soft = "#6a7280";
  const char* grid = "#d9dde2";
  const char* ground = "#f4f5f7";  ///< behind particles
};

struct FramePictureOptions {
  std::string field = "speed";
  Look look;
  std::optional<ColourScale> scale;  ///< default: scale_of() the field
  std::optional<Bounds> bounds;      ///< default: those of the frame and its bodies
  std::string title;
  bool axisymmetric = false;
  std::vector<PlacedBody> bodies = {};
  Ink ink;
  double largest_width = 860, largest_height = 640;  ///< [px] of the particles
  double pixel_scale = 2;  ///< pixels of particles for each of the drawing
};

/// The scale that fits most of the values of a field: a few outliers do not stretch it.
ColourScale scale_of(std::vector<double> values);
/// The scale that shows both.
ColourScale joined(const ColourScale& a, const ColourScale& b);

/// The columns that a picture of a field needs. An unknown field throws InputError.
std::vector<std::string> columns_of_picture(const FrameHeader& header, const std::string& field);

/// What a bar of colours says.
struct ColourBar {
  ColourScale scale;
  std::string label, unit;
  bool beyond_low = false, beyond_high = false;  ///< there are values beyond: its ends are pointed
};
inline constexpr double colour_bar_width = 108;  ///< [px] with its numbers
void draw_colour_bar(Drawing& drawing, const ColourBar& bar, double x, double top, double height,
                     const Ink& ink);

class FramePicture {
 public:
  /// Draws a frame that has particles. A section without particles throws InputError.
  FramePicture(const Frame& frame, const FramePictureOptions& options);

  double width() const { return width_; }
  double height() const { return height_; }
  /// "speed at 1.2 s, section at y = 3 m"
  std::string caption() const;
  void draw(Drawing& drawing) const;

 private:
  void place();
  void draw_box(Drawing& drawing) const;

  const Frame& frame_;
  FramePictureOptions options_;
  FrameField field_;
  ColourScale scale_;
  Bounds bounds_;
  View view_{};                    ///< of the particles
  double width_ = 0, height_ = 0;  ///< [px]
  bool beyond_low_ = false, beyond_high_ = false;
};

}  // namespace lahar
