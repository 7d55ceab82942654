#include "runtime/picture/frame_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/base/text.h"
#include "physics/base/error.h"
#include "runtime/picture/glyphs.h"
#include "runtime/picture/quantity.h"
#include "runtime/picture/view.h"

namespace lahar {

namespace {

constexpr double view_left = 66, view_top = 52, view_bottom = 44, bar_distance = 24, bar_width = 16;
constexpr double share_outside = 0.002;  ///< of values, at each end of a scale
constexpr double thinnest = 0.07;        ///< before a view is stretched, of the longer side
constexpr double room = 0.03;            ///< around particles, of the longer side

}  // namespace

ColourScale scale_of(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return {};
  const auto at = [&](double share) {
    const auto k =
        static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
    std::nth_element(values.begin(), values.begin() + k, values.end());
    return values[static_cast<std::size_t>(k)];
  };
  ColourScale scale{.low = at(share_outside), .high = at(1 - share_outside)};
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  if (scale.low >= scale.high) scale.low = *least, scale.high = *most;
  return joined(scale, scale);
}

ColourScale joined(const ColourScale& a, const ColourScale& b) {
  constexpr double near_zero = 0.1, least_share = 1e-12;
  ColourScale scale{.low = std::min(a.low, b.low), .high = std::max(a.high, b.high)};
  const double largest = std::max(std::abs(scale.low), std::abs(scale.high));
  if (scale.low < -near_zero * largest && scale.high > near_zero * largest)
    return {.low = -largest, .high = largest, .is_signed = true};
  if (scale.low >= 0 && scale.low < 0.5 * scale.high) scale.low = 0;
  if (scale.high <= 0 && scale.high > 0.5 * scale.low) scale.high = 0;
  if (scale.high - scale.low <= least_share * largest) {  // one value everywhere
    const double half = largest > 0 ? 0.01 * largest : 1;
    scale.low -= half, scale.high += half;
  }
  return scale;
}

std::vector<std::string> columns_of_picture(const FrameHeader& header, const std::string& field) {
  std::vector<std::string> columns = columns_of_field(header, field);
  columns.emplace_back("volume");
  return columns;
}

FramePicture::FramePicture(const Frame& frame, const FramePictureOptions& options)
    : frame_(frame), options_(options), field_(field_of(frame, options.field)) {
  if (frame.id.empty()) throw InputError(fmt::format("step {} has no particles", frame.step));
  scale_ = options.scale ? *options.scale : scale_of(field_.values);
  bounds_ = options.bounds ? *options.bounds : bounds_of(frame, options.bodies);
  const Look& look = options.look;
  if (look.kind == Look::Kind::section) {
    const auto n = static_cast<std::size_t>(look.normal);
    const Bounds particles = options.bounds ? *options.bounds : bounds_of(frame);
    if (look.at < particles.low[n] || look.at > particles.high[n])
      throw InputError(
          fmt::format("there are no particles at {0} = {1:.6g} m; they lie between {2:.6g} "
                      "and {3:.6g} m",
                      "xyz"[n], look.at, particles.low[n], particles.high[n]));
  }
  for (const double value : field_.values) {
    beyond_low_ |= value < scale_.low;
    beyond_high_ |= value > scale_.high;
  }
  place();
}

void FramePicture::place() {
  const Bounds seen = ViewProjection(options_.look).of(bounds_);
  const double longer = std::max({seen.high[0] - seen.low[0], seen.high[1] - seen.low[1], 1e-300});
  const int normal = options_.look.kind == Look::Kind::section ? options_.look.normal : 2;
  view_.axes = {normal == 0 ? 1 : 0, normal == 2 ? 1 : 2};
  for (std::size_t d = 0; d < 2; ++d) {
    view_.low[d] = seen.low[d] - room * longer;
    view_.high[d] = seen.high[d] + room * longer;
  }
  view_.left = view_left;
  view_.top = view_top;
  view_.fit({options_.largest_width, options_.largest_height},
            options_.look.kind == Look::Kind::space ? 0 : thinnest);
  width_ = view_.left + view_.size[0] + bar_distance + colour_bar_width;
  height_ = view_.top + std::max(view_.size[1], 130.0) + view_bottom;
}

std::string FramePicture::caption() const {
  std::string text = fmt::format("{} at {} (step {})", field_.label, quantity(frame_.time, "s"),
                                 format_count(frame_.step));
  if (const std::string look = name_of(options_.look); !look.empty() && look != "3D")
    text += ", " + look;
  if (const std::string note = view_.stretch_note(); !note.empty()) text += "; " + note;
  return text;
}

void FramePicture::draw(Drawing& drawing) const {
  const Ink& ink = options_.ink;
  const bool space = options_.look.kind == Look::Kind::space;
  const auto pixels = [&](double length) {
    return std::max(1, static_cast<int>(std::lround(length * options_.pixel_scale)));
  };
  ParticleView particles(pixels(view_.size[0]), pixels(view_.size[1]), view_.low, view_.high);
  particles.add(frame_, edges_of(frame_, options_.axisymmetric), field_.values, options_.look);
  for (const PlacedBody& body : options_.bodies) particles.add(body, options_.look, bounds_);

  double title = 22;
  if (!options_.title.empty())
    drawing.text(view_.left, title, options_.title, 15, "start", ink.text);
  drawing.text(view_.left, options_.title.empty() ? title : title + 19, caption(), 12.5, "start",
               ink.soft);
  if (space) {
    draw_box(drawing);
  } else {
    drawing.rectangle(view_.left, view_.top, view_.size[0], view_.size[1], {.fill = ink.ground});
  }
  drawing.image(view_.left, view_.top, view_.size[0], view_.size[1],
                particles.image(scale_, space));
  if (!space) view_.draw_axes(drawing, ink.text);
  draw_colour_bar(drawing,
                  {.scale = scale_,
                   .label = field_.label,
                   .unit = field_.unit,
                   .beyond_low = beyond_low_,
                   .beyond_high = beyond_high_},
                  view_.left + view_.size[0] + bar_distance, view_.top,
                  std::max(130.0, view_.size[1]), ink);
}

/// The edges of the box around particles that lie behind them, and lengths along the lower ones in
/// front.
void FramePicture::draw_box(Drawing& drawing) const {
  const ViewProjection project(options_.look);
  const auto place = [&](const Point& x) {
    const Point seen = project(x);
    return view_.place(seen[0], seen[1]);
  };
  const Point &a = bounds_.low, &b = bounds_.high;
  const Drawing::Style grid{.stroke = options_.ink.grid, .width = 1};
  const auto edge = [&](const Point& from, const Point& to) {
    drawing.polyline({place(from), place(to)}, grid);
  };
  // The eye is at small y and large x.
  edge({a[0], b[1], a[2]}, {b[0], b[1], a[2]});
  edge({a[0], a[1], a[2]}, {a[0], b[1], a[2]});
  edge({a[0], b[1], a[2]}, {a[0], b[1], b[2]});
  edge({a[0], b[1], b[2]}, {b[0], b[1], b[2]});
  edge({a[0], a[1], b[2]}, {a[0], b[1], b[2]});
  edge({a[0], a[1], a[2]}, {a[0], a[1], b[2]});
  edge({b[0], b[1], a[2]}, {b[0], b[1], b[2]});
  edge({a[0], a[1], a[2]}, {b[0], a[1], a[2]});
  edge({b[0], a[1], a[2]}, {b[0], b[1], a[2]});
  const auto ticks = [&](std::size_t axis, Point from, double dx, double dy, const char* anchor) {
    const auto p = place(from);
    Point end = from;
    end[axis] = b[axis];
    const auto q = place(end);
    const double length = std::hypot(q.first - p.first, q.second - p.second);
    if (length < 24) return;
    const double step = grid_step(b[axis] - a[axis], std::max(1.0, length / 70));
    for_grid_lines(a[axis], b[axis], step, [&](double value) {
      from[axis] = value;
      const auto [x, y] = place(from);
      drawing.line(x, y, x + 0.4 * dx, y + 0.4 * dy, {.stroke = options_.ink.soft, .width = 1});
      drawing.text(x + dx, y + dy + 4, tick_label(value, step), 10.5, anchor, options_.ink.soft);
    });
    drawing.text(0.5 * (p.first + q.first) + 3.0 * dx, 0.5 * (p.second + q.second) + 3.0 * dy + 4,
                 fmt::format("{} [m]", "xyz"[axis]), 11.5, anchor, options_.ink.text);
  };
  ticks(0, {a[0], a[1], a[2]}, -6, 9, "end");
  ticks(1, {b[0], a[1], a[2]}, 6, 9, "start");
  ticks(2, {a[0], a[1], a[2]}, -11, 0, "end");
}

void draw_colour_bar(Drawing& drawing, const ColourBar& bar, double x, double top, double space,
                     const Ink& ink) {
  constexpr double below_label = 34, most_height = 320;
  constexpr int colours = 256;
  const ColourScale& scale = bar.scale;
  const double height = std::min(space - below_label - 6, most_height), y = top + below_label,
               bottom = y + height;
  Image image(1, colours);
  for (int k = 0; k < colours; ++k)
    image.at(0, k) = scale.colour(scale.high - (k + 0.5) / colours * (scale.high - scale.low));
  drawing.image(x, y, bar_width, height, image);
  const auto end = [&](double from, double to, const Rgba& colour) {
    drawing.polyline({{x, from}, {x + bar_width, from}, {x + 0.5 * bar_width, to}},
                     {.fill = hex_of(colour)});
  };
  if (bar.beyond_high) end(y, y - 9, scale.colour(scale.high));
  if (bar.beyond_low) end(bottom, bottom + 9, scale.colour(scale.low));
  const UnitScale unit = unit_scale(std::max(std::abs(scale.low), std::abs(scale.high)), bar.unit);
  const double low = scale.low * unit.factor, high = scale.high * unit.factor;
  const double step = grid_step(high - low, std::max(2.0, height / 50));
  for_grid_lines(low, high, step, [&](double value) {
    const double at = bottom - (value - low) / (high - low) * height;
    drawing.line(x + bar_width, at, x + bar_width + 4, at, {.stroke = ink.text, .width = 1});
    drawing.text(x + bar_width + 8, at + 4, tick_label(value, step), 11, "start", ink.text);
  });
  constexpr double label_size = 12.5;
  const double length = text_length(bar.label, label_size);
  drawing.text(x, top + 4, bar.label, label_size * std::min(1.0, (colour_bar_width - 4) / length),
               "start", ink.text);
  if (!unit.unit.empty()) drawing.text(x, top + 19, "[" + unit.unit + "]", 12, "start", ink.text);
}

}  // namespace lahar
