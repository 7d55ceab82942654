#include "physics/geometry/triangle_shells.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lahar {

namespace {

std::size_t at(Local i) {
  return static_cast<std::size_t>(i);
}

/// Where a line along z, through a triangle of one shell, meets triangles.
struct Meeting {
  Local line, shell;
  double z;  ///< [m]
};

/// Twice the area of a triangle, seen along z [m^2].
double width_of(const Triangles& triangles, Index t) {
  return std::abs(triangles.area_vector(t).z());
}

/// Lines along z, in strips of x that are sorted by y.
class Lines {
 public:
  explicit Lines(std::vector<Vec<2>> places) : places_(std::move(places)) {
    order_.resize(places_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<Local>(i);
    const auto by = [&](int axis) {
      return [this, axis](Local a, Local b) {
        const double p = places_[at(a)][axis], q = places_[at(b)][axis];
        return p != q ? p < q : a < b;
      };
    };
    std::sort(order_.begin(), order_.end(), by(0));
    in_strip_ = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(order_.size()))));
    for (std::size_t first = 0; first < order_.size(); first += in_strip_) {
      const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(first);
      const auto end = order_.begin() + static_cast<std::ptrdiff_t>(end_of(first));
      low_.push_back(places_[at(*begin)][0]);
      high_.push_back(places_[at(*(end - 1))][0]);
      std::sort(begin, end, by(1));
    }
  }

  /// visit(line) for all lines within a box.
  void within(const Vec<2>& low, const Vec<2>& high, const auto& visit) const {
    const auto first = std::lower_bound(high_.begin(), high_.end(), low[0]) - high_.begin();
    for (auto s = static_cast<std::size_t>(first); s < low_.size() && low_[s] <= high[0]; ++s) {
      const auto end = order_.begin() + static_cast<std::ptrdiff_t>(end_of(s * in_strip_));
      auto i =
          std::lower_bound(order_.begin() + static_cast<std::ptrdiff_t>(s * in_strip_), end, low[1],
                           [this](Local a, double y) { return places_[at(a)][1] < y; });
      for (; i != end && places_[at(*i)][1] <= high[1]; ++i)
        if (places_[at(*i)][0] >= low[0] && places_[at(*i)][0] <= high[0]) visit(*i);
    }
  }
  const Vec<2>& place(Local line) const { return places_[at(line)]; }

 private:
  std::size_t end_of(std::size_t first) const { return std::min(first + in_strip_, order_.size()); }
  std::vector<Vec<2>> places_;
  std::vector<Local> order_;
  std::vector<double> low_, high_;  ///< [m] x of each strip
  std::size_t in_strip_ = 1;
};

/// Whether an edge lies on the side of higher x of a line, at its y. The same for both triangles of
/// the edge, so that a line meets a closed surface an even number of times.
bool is_beyond(const Vec<3>& a, const Vec<3>& b, const Vec<2>& line) {
  if ((a[1] > line[1]) == (b[1] > line[1])) return false;
  const bool in_order = a[1] != b[1] ? a[1] < b[1] : a[0] < b[0];
  const Vec<3>&p = in_order ? a : b, &q = in_order ? b : a;
  return p[0] + (line[1] - p[1]) / (q[1] - p[1]) * (q[0] - p[0]) > line[0];
}

/// The height at which a line meets a triangle [m]; not a number where it passes by.
double height_at(const Triangles& triangles, Index t, const Vec<2>& line) {
  bool inside = false;
  for (int k = 0; k < 3; ++k)
    inside ^= is_beyond(triangles.point(t, k), triangles.point(t, (k + 1) % 3), line);
  if (!inside) return std::numeric_limits<double>::quiet_NaN();
  const Vec<3>&a = triangles.point(t, 0), &b = triangles.point(t, 1), &c = triangles.point(t, 2);
  const Vec<3> n = triangles.area_vector(t);
  const double low = std::min({a[2], b[2], c[2]}), high = std::max({a[2], b[2], c[2]});
  if (n.z() == 0) return 0.5 * (low + high);
  const double z = a[2] - (n.x() * (line[0] - a[0]) + n.y() * (line[1] - a[1])) / n.z();
  return std::clamp(z, low, high);
}

/// In how many shells that is which begins below the highest meeting with shell `own`, where
/// [first, end) are the meetings of its line, from below.
int depth_of(const Meeting* first, const Meeting* end, Local own, double rounding) {
  const Meeting* top = end;
  while (top != first && (top - 1)->shell != own) --top;
  if (top == first) return 0;
  const double z = (top - 1)->z;  // what touches it there lies above, or ends with it
  const Meeting* above = top - 1;
  while (above != first && (above - 1)->z > z - rounding) --above;
  std::vector<Local> met;
  for (const Meeting* m = above; m != end; ++m)
    if (m->shell != own) met.push_back(m->shell);
  std::sort(met.begin(), met.end());
  int depth = 0;
  for (std::size_t i = 0, next; i < met.size(); i = next) {
    for (next = i; next < met.size() && met[next] == met[i];) ++next;
    depth += (next - i) % 2 == 1 ? 1 : 0;
  }
  return depth;
}

}  // namespace

TriangleShells shells_of(const TriangleEdges& edges) {
  TriangleShells shells;
  shells.of.assign(edges.neighbour.size(), -1);
  std::vector<Local> waiting;
  for (std::size_t first = 0; first < shells.of.size(); ++first) {
    if (shells.of[first] >= 0) continue;
    shells.of[first] = shells.count;
    waiting.push_back(static_cast<Local>(first));
    while (!waiting.empty()) {
      const Local now = waiting.back();
      waiting.pop_back();
      for (const Local next : edges.neighbour[at(now)])
        if (next >= 0 && shells.of[at(next)] < 0) {
          shells.of[at(next)] = shells.count;
          waiting.push_back(next);
        }
    }
    ++shells.count;
  }
  return shells;
}

std::vector<double> shell_volumes(const Triangles& triangles, const TriangleShells& shells) {
  std::vector<double> volumes(at(shells.count), 0.0);
  std::vector<Index> first(at(shells.count), -1);  // sums of small numbers, from a point of it
  for (std::size_t i = 0; i < shells.of.size(); ++i) {
    const auto t = static_cast<Index>(i);
    Index& of = first[at(shells.of[i])];
    if (of < 0) of = t;
    volumes[at(shells.of[i])] +=
        (triangles.point(t, 0) - triangles.point(of, 0)).dot(triangles.area_vector(t)) / 6;
  }
  return volumes;
}

std::vector<int> nesting_depths(const Triangles& triangles, const TriangleShells& shells) {
  constexpr double same_height = 1e-9;  // of the height of all [-]
  const auto n = static_cast<Index>(triangles.corners.size());
  std::vector<Index> widest(at(shells.count), -1);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (Index t = 0; t < n; ++t) {
    Index& best = widest[at(shells.of[static_cast<std::size_t>(t)])];
    if (best < 0 || width_of(triangles, t) > width_of(triangles, best)) best = t;
    low = std::min(low, triangles.point(t, 0).z());
    high = std::max(high, triangles.point(t, 0).z());
  }
  std::vector<Vec<2>> places;
  for (const Index t : widest) places.emplace_back(triangles.centre(t).head<2>());
  const Lines lines(std::move(places));
  // Lines meet few triangles each unless shells lie within each other by thousands.
  const std::size_t most_meetings = std::max(std::size_t{1} << 24, 64 * triangles.corners.size());
  std::vector<Meeting> meetings;
  for (Index t = 0; t < n; ++t) {
    const Vec<3>&a = triangles.point(t, 0), &b = triangles.point(t, 1), &c = triangles.point(t, 2);
    const Vec<3> least = a.cwiseMin(b).cwiseMin(c), most = a.cwiseMax(b).cwiseMax(c);
    lines.within(least.head<2>(), most.head<2>(), [&](Local line) {
      const double z = height_at(triangles, t, lines.place(line));
      if (!std::isnan(z) && meetings.size() <= most_meetings)
        meetings.push_back({line, shells.of[static_cast<std::size_t>(t)], z});
    });
    if (meetings.size() > most_meetings) return {};
  }
  std::sort(meetings.begin(), meetings.end(), [](const Meeting& a, const Meeting& b) {
    if (a.line != b.line) return a.line < b.line;
    return a.z != b.z ? a.z < b.z : a.shell < b.shell;
  });
  std::vector<int> depths(at(shells.count), 0);
  for (std::size_t first = 0, end; first < meetings.size(); first = end) {
    const Local own = meetings[first].line;
    for (end = first; end < meetings.size() && meetings[end].line == own;) ++end;
    depths[at(own)] =
        depth_of(meetings.data() + first, meetings.data() + end, own, same_height * (high - low));
  }
  return depths;
}

void turn_over(Triangles& triangles, const TriangleShells& shells, const std::vector<bool>& which) {
  for (std::size_t i = 0; i < triangles.corners.size(); ++i)
    if (which[at(shells.of[i])]) std::swap(triangles.corners[i][1], triangles.corners[i][2]);
}

}  // namespace lahar
