#include "runtime/picture/view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lahar {

std::string View::stretch_note() const {
  static constexpr const char* names = "xyz";
  const double times = stretch();
  if (times > 1.01) return fmt::format("{} is drawn {:.3g} times larger", names[axes[1]], times);
  if (times < 0.99)
    return fmt::format("{} is drawn {:.3g} times larger", names[axes[0]], 1 / times);
  return "";
}

void View::fit(const std::array<double, 2>& most, double thinnest) {
  const double a = high[0] - low[0], b = high[1] - low[1];
  const double scale = std::min(most[0] / a, most[1] / b);
  size = {scale * a, scale * b};
  if (size[1] < thinnest * most[0] && size[1] < thinnest * size[0]) size[1] = thinnest * size[0];
  if (size[0] < thinnest * most[1] && size[0] < thinnest * size[1]) size[0] = thinnest * size[1];
}

void View::draw_axes(Drawing& drawing, const char* ink) const {
  static constexpr const char* names = "xyz";
  const double right = left + size[0], bottom = top + size[1];
  drawing.rectangle(left, top, size[0], size[1], {.stroke = ink, .width = 1});
  const double dx = grid_step(high[0] - low[0], std::max(1.0, size[0] / 110));
  for_grid_lines(low[0], high[0], dx, [&](double value) {
    const double x = place(value, low[1]).first;
    drawing.line(x, bottom, x, bottom + 5, {.stroke = ink, .width = 1});
    drawing.text(x, bottom + 18, fmt::format("{:.10g}", value + 0.0), 11, "middle", ink);
  });
  std::size_t longest = 0;  // label beside the axis
  const double dy = grid_step(high[1] - low[1], std::max(1.0, size[1] / 60));
  for_grid_lines(low[1], high[1], dy, [&](double value) {
    const double y = place(low[0], value).second;
    drawing.line(left - 5, y, left, y, {.stroke = ink, .width = 1});
    const std::string label = fmt::format("{:.10g}", value + 0.0);
    longest = std::max(longest, label.size());
    drawing.text(left - 8, y + 4, label, 11, "end", ink);
  });
  drawing.text((left + right) / 2, bottom + 34, fmt::format("{} [m]", names[axes[0]]), 12, "middle",
               ink);
  drawing.text(left - std::max(42.0, 20 + 6.4 * static_cast<double>(longest)), (top + bottom) / 2,
               fmt::format("{} [m]", names[axes[1]]), 12, "middle", ink, -90);
  if (name.empty()) return;
  const std::string note = stretch_note();
  drawing.text(left, top - 8, note.empty() ? name : fmt::format("{} ({})", name, note), 13, "start",
               ink);
}

ViewRaster::ViewRaster(const View& view) : view_(view) {
  for (std::size_t d = 0; d < 2; ++d) {
    count_[d] = std::max(1, static_cast<int>(std::lround(view.size[d] / square)));
    size_[d] = (view.high[d] - view.low[d]) / count_[d];
  }
  const auto all = static_cast<std::size_t>(count_[0]) * static_cast<std::size_t>(count_[1]);
  value_.assign(all, -1);
  height_.assign(all, -std::numeric_limits<double>::infinity());
}

void ViewRaster::fill(const std::array<double, 2>& low, const std::array<double, 2>& high,
                      int value, double height) {
  std::array<int, 2> first, last;  // squares whose middles are inside, or the nearest one
  for (std::size_t d = 0; d < 2; ++d) {
    const auto limited = [&](double square) {
      return static_cast<int>(std::clamp(square, 0.0, static_cast<double>(count_[d] - 1)));
    };
    const double a = (low[d] - view_.low[d]) / size_[d], b = (high[d] - view_.low[d]) / size_[d];
    if (!(b >= 0) || !(a <= count_[d])) return;
    first[d] = limited(std::ceil(a - 0.5));
    last[d] = limited(std::ceil(b - 0.5) - 1);
    if (last[d] < first[d]) first[d] = last[d] = limited(std::floor(0.5 * (a + b)));
  }
  for (int j = first[1]; j <= last[1]; ++j)
    for (int i = first[0]; i <= last[0]; ++i) {
      if (!(height > height_[at(i, j)])) continue;
      height_[at(i, j)] = height;
      value_[at(i, j)] = value;
    }
}

void ViewRaster::draw(Drawing& drawing, const std::function<std::string(int)>& colour) const {
  std::vector<char> done(value_.size(), 0);
  const double w = view_.size[0] / count_[0], h = view_.size[1] / count_[1];
  for (int j = 0; j < count_[1]; ++j)
    for (int i = 0; i < count_[0]; ++i) {
      const int value = value_[at(i, j)];
      if (value < 0 || done[at(i, j)]) continue;
      int right = i + 1, above = j + 1;
      while (right < count_[0] && value_[at(right, j)] == value && !done[at(right, j)]) ++right;
      const auto same = [&](int row) {
        for (int k = i; k < right; ++k)
          if (value_[at(k, row)] != value || done[at(k, row)]) return false;
        return true;
      };
      while (above < count_[1] && same(above)) ++above;
      for (int row = j; row < above; ++row)
        for (int k = i; k < right; ++k) done[at(k, row)] = 1;
      drawing.rectangle(view_.left + i * w, view_.top + view_.size[1] - above * h, (right - i) * w,
                        (above - j) * h, {.fill = colour(value)});
    }
}

std::vector<std::array<double, 2>> ViewRaster::filled() const {
  std::vector<std::array<double, 2>> all;
  for (int j = 0; j < count_[1]; ++j)
    for (int i = 0; i < count_[0]; ++i)
      if (value_[at(i, j)] >= 0)
        all.push_back({view_.low[0] + (i + 0.5) * size_[0], view_.low[1] + (j + 0.5) * size_[1]});
  return all;
}

}  // namespace lahar
