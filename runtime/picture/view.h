/// \file One view of a picture: a rectangle of it, and the pixels where it is drawn.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/picture/drawing.h"

namespace lahar {

/// A view along an axis: of all of the model from above, or of a section through it.
struct View {
  std::string name;
  std::array<int, 2> axes;          ///< of the model, that are horizontal and vertical in it
  int normal = -1;                  ///< axis along which it looks; -1 = of two dimensions
  double at = 0;                    ///< [m] where a section is, along `normal`
  bool from_above = false;          ///< no section: what is in front hides the rest
  std::array<double, 2> low, high;  ///< [m] what it shows
  double left = 0, top = 0;         ///< [px]
  std::array<double, 2> size{};     ///< [px]

  /// The place of a point of the model [px].
  std::pair<double, double> place(double a, double b) const {
    return {left + (a - low[0]) / (high[0] - low[0]) * size[0],
            top + size[1] - (b - low[1]) / (high[1] - low[1]) * size[1]};
  }
  /// How many times its vertical is drawn larger than its horizontal.
  double stretch() const { return size[1] / (high[1] - low[1]) / (size[0] / (high[0] - low[0])); }
  /// "y is drawn 2 times larger"; "" where lengths are equal.
  std::string stretch_note() const;
  /// Set the size [px] within `most`. One side is at least the share `thinnest` of the other: thin
  /// models are stretched.
  void fit(const std::array<double, 2>& most, double thinnest = 0.2);
  /// A frame with metres, and the name if there is one.
  void draw_axes(Drawing& drawing, const char* ink = "#222222") const;
};

/// Boxes of a view as squares of a few pixels: pictures of any number of them have a bounded size.
class ViewRaster {
 public:
  explicit ViewRaster(const View& view);
  /// A box [m] has a value from 0 on. In a square the box with the largest `height` wins; among
  /// equals the first.
  void fill(const std::array<double, 2>& low, const std::array<double, 2>& high, int value,
            double height = 0);
  /// As few rectangles as rows and columns of equal values allow.
  void draw(Drawing& drawing, const std::function<std::string(int)>& colour) const;
  /// Middles [m] of the squares that have a value.
  std::vector<std::array<double, 2>> filled() const;

 private:
  static constexpr double square = 3;  ///< [px]
  std::size_t at(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(count_[0]) +
           static_cast<std::size_t>(i);
  }
  const View& view_;
  std::array<int, 2> count_;
  std::array<double, 2> size_;  ///< [m] of a square
  std::vector<int> value_;      ///< -1 = none
  std::vector<double> height_;
};

}  // namespace lahar
