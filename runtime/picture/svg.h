/// \file A drawing as SVG text.
#pragma once

#include <string>

#include "runtime/picture/drawing.h"

namespace lahar {

class Svg : public Drawing {
 public:
  /// `background`: a colour, or none. Colours may be anything that CSS knows.
  Svg(double width, double height, const std::string& background = "#ffffff");

  void rectangle(double x, double y, double width, double height, const Style& style) override;
  void line(double x1, double y1, double x2, double y2, const Style& style) override;
  void polyline(const Points& points, const Style& style) override;
  void circle(double x, double y, double radius, const Style& style) override;
  void image(double x, double y, double width, double height, const Image& image) override;

  std::string finish() const;

 protected:
  void write(double x, double y, const std::string& words, const TextStyle& style) override;

 private:
  std::string head_, body_;
};

}  // namespace lahar
