/// \file A drawing as pixels, with smooth edges.
#pragma once

#include <string>
#include <vector>

#include "runtime/picture/drawing.h"

namespace lahar {

class Canvas : public Drawing {
 public:
  /// A white one; `scale` pixels of the image for each of the drawing.
  Canvas(double width, double height, double scale);

  void rectangle(double x, double y, double width, double height, const Style& style) override;
  void line(double x1, double y1, double x2, double y2, const Style& style) override;
  void polyline(const Points& points, const Style& style) override;
  void circle(double x, double y, double radius, const Style& style) override;
  void image(double x, double y, double width, double height, const Image& image) override;

  const Image& pixels() const { return image_; }

 protected:
  void write(double x, double y, const std::string& words, const TextStyle& style) override;

 private:
  using Outline = std::vector<Points>;  ///< closed, in pixels of the image
  /// Fills closed outlines. Outlines of the opposite direction cut holes.
  void fill(const Outline& outline, const std::string& colour, double opacity);
  void stroke(const Points& points, const Style& style);

  double scale_;
  Image image_;
};

}  // namespace lahar
