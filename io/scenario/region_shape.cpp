#include "io/scenario/region_shape.h"

#include <algorithm>
#include <cmath>

namespace lahar {

namespace {

/// A place in plan that rounding put beside the surface is moved onto its edge.
template <int Dim>
Vec<Dim> onto(const Surface<Dim>& surface, Vec<Dim> x, double tolerance) {
  const auto& [low, high] = surface.bounds();
  for (int d = 0; d < Dim - 1; ++d) {
    if (x[d] < low[d] && x[d] >= low[d] - tolerance) x[d] = low[d];
    if (x[d] > high[d] && x[d] <= high[d] + tolerance) x[d] = high[d];
  }
  return x;
}

Coverage opposite(Coverage coverage) {
  return coverage == Coverage::none  ? Coverage::all
         : coverage == Coverage::all ? Coverage::none
                                     : Coverage::part;
}

/// The coverage with all of some shapes.
template <class Each>
Coverage with_all(std::size_t n, Each&& each) {
  Coverage out = Coverage::all;
  for (std::size_t i = 0; i < n && out != Coverage::none; ++i) {
    const Coverage one = each(i);
    if (one != Coverage::all) out = one;
  }
  return out;
}

/// The test for points in all shapes from 0 to `end` and in none of those after, in a box: if it
/// leaves one shape open, the test of this one.
template <int Dim>
auto within_of(std::shared_ptr<const std::vector<RegionShape<Dim>>> shapes, std::size_t end,
               std::function<bool(const Vec<Dim>&)> contains) {
  using Test = std::function<bool(const Vec<Dim>&)>;
  return [shapes, end, contains](const Vec<Dim>& low, const Vec<Dim>& high) -> Test {
    std::size_t open = shapes->size();
    for (std::size_t i = 0; i < shapes->size(); ++i) {
      if ((*shapes)[i].coverage(low, high) == (i < end ? Coverage::all : Coverage::none)) continue;
      if (open < shapes->size()) return contains;
      open = i;
    }
    if (open == shapes->size()) return contains;
    Test one = (*shapes)[open].contains_within(low, high);
    if (open < end) return one;
    return [one](const Vec<Dim>& x) { return !one(x); };
  };
}

/// combine() of the solids of all parts; null where some part has none.
template <int Dim>
SolidPtr<Dim> combined(const std::vector<RegionShape<Dim>>& parts,
                       SolidPtr<Dim> (*combine)(std::vector<SolidPtr<Dim>>)) {
  std::vector<SolidPtr<Dim>> solids;
  if (parts.empty()) return nullptr;
  for (const auto& part : parts)
    if (solids.push_back(part.solid); !part.solid) return nullptr;
  return combine(std::move(solids));
}

template <int Dim>
bool any_exact(const std::vector<RegionShape<Dim>>& parts) {
  return std::any_of(parts.begin(), parts.end(), [](const auto& part) { return part.exact; });
}

}  // namespace

template <int Dim>
RegionShape<Dim> side_of_surface(std::shared_ptr<const Surface<Dim>> surface, int side,
                                 double tolerance) {
  RegionShape<Dim> out;
  out.exact = true;
  out.solid = side > 0 ? below(surface) : outside(below(surface));
  out.bounds = surface->bounds();
  out.bounds.first.array() -= tolerance;
  out.bounds.second.array() += tolerance;
  constexpr double inf = std::numeric_limits<double>::infinity();
  (side > 0 ? out.bounds.first : out.bounds.second)[Dim - 1] = -side * inf;
  out.contains = [=](const Vec<Dim>& x) {  // false where the height is not known
    const double above = x[Dim - 1] - surface->height(onto<Dim>(*surface, x, tolerance));
    return side * above <= tolerance;
  };
  out.coverage = [=](const Vec<Dim>& low, const Vec<Dim>& high) {
    const auto heights = surface->range(low, high);
    if (heights.low > heights.high) return heights.complete ? Coverage::part : Coverage::none;
    const bool beneath = high[Dim - 1] <= heights.low, over = low[Dim - 1] >= heights.high;
    if (side > 0 ? over : beneath) return Coverage::none;
    return (side > 0 ? beneath : over) && heights.complete ? Coverage::all : Coverage::part;
  };
  return out;
}

template <int Dim>
RegionShape<Dim> inside_solid(SolidPtr<Dim> solid, double tolerance) {
  RegionShape<Dim> out;
  out.exact = true;
  out.solid = solid;
  out.bounds = solid->bounds();
  out.bounds.first.array() -= tolerance;
  out.bounds.second.array() += tolerance;
  out.contains = [=](const Vec<Dim>& x) {
    return solid->contains(x) || solid->nearest(x).distance <= tolerance;
  };
  out.coverage = [=](const Vec<Dim>& low, const Vec<Dim>& high) {
    return coverage_of<Dim>(solid->nearest(0.5 * (low + high)).distance, low, high, tolerance);
  };
  return out;
}

RegionShape<3> under_outlines(std::shared_ptr<const Outlines> outlines, double tolerance) {
  RegionShape<3> out;
  out.exact = true;
  out.solid = under(outlines);
  for (int d = 0; d < 2; ++d) {
    out.bounds.first[d] = outlines->bounds().first[d] - tolerance;
    out.bounds.second[d] = outlines->bounds().second[d] + tolerance;
  }
  out.contains = [=](const Vec<3>& x) { return outlines->contains(x.head<2>(), tolerance); };
  out.coverage = [=](const Vec<3>& low, const Vec<3>& high) {
    if (outlines->crosses(low.head<2>(), high.head<2>())) return Coverage::part;
    const Vec<3> centre = 0.5 * (low + high);
    return outlines->contains(centre.head<2>(), tolerance) ? Coverage::all : Coverage::none;
  };
  return out;
}

template <int Dim>
RegionShape<Dim> union_of(std::vector<RegionShape<Dim>> parts) {
  RegionShape<Dim> out;
  out.exact = any_exact(parts);
  out.solid = combined<Dim>(parts, united<Dim>);
  out.bounds = parts[0].bounds;
  for (const auto& part : parts) {
    out.bounds.first = out.bounds.first.cwiseMin(part.bounds.first);
    out.bounds.second = out.bounds.second.cwiseMax(part.bounds.second);
  }
  const auto shapes = std::make_shared<const std::vector<RegionShape<Dim>>>(std::move(parts));
  out.contains = [shapes](const Vec<Dim>& x) {
    for (const auto& part : *shapes)
      if (part.contains(x)) return true;
    return false;
  };
  out.coverage = [shapes](const Vec<Dim>& low, const Vec<Dim>& high) {
    return opposite(with_all(
        shapes->size(), [&](std::size_t i) { return opposite((*shapes)[i].coverage(low, high)); }));
  };
  return out;
}

template <int Dim>
RegionShape<Dim> intersection_of(std::vector<RegionShape<Dim>> parts) {
  RegionShape<Dim> out;
  out.exact = any_exact(parts);
  out.solid = combined<Dim>(parts, common<Dim>);
  for (const auto& part : parts) {
    out.bounds.first = out.bounds.first.cwiseMax(part.bounds.first);
    out.bounds.second = out.bounds.second.cwiseMin(part.bounds.second);
  }
  const auto shapes = std::make_shared<const std::vector<RegionShape<Dim>>>(std::move(parts));
  out.contains = [shapes](const Vec<Dim>& x) {
    for (const auto& part : *shapes)
      if (!part.contains(x)) return false;
    return true;
  };
  out.coverage = [shapes](const Vec<Dim>& low, const Vec<Dim>& high) {
    return with_all(shapes->size(),
                    [&](std::size_t i) { return (*shapes)[i].coverage(low, high); });
  };
  return out;
}

template <int Dim>
RegionShape<Dim> difference_of(std::vector<RegionShape<Dim>> parts) {
  RegionShape<Dim> out;
  out.exact = any_exact(parts);
  out.solid = combined<Dim>(parts, difference<Dim>);
  out.bounds = parts[0].bounds;
  const auto shapes = std::make_shared<const std::vector<RegionShape<Dim>>>(std::move(parts));
  out.contains = [shapes](const Vec<Dim>& x) {
    for (std::size_t i = 1; i < shapes->size(); ++i)
      if ((*shapes)[i].contains(x)) return false;
    return (*shapes)[0].contains(x);
  };
  out.coverage = [shapes](const Vec<Dim>& low, const Vec<Dim>& high) {
    return with_all(shapes->size(), [&](std::size_t i) {
      const Coverage coverage = (*shapes)[i].coverage(low, high);
      return i == 0 ? coverage : opposite(coverage);
    });
  };
  out.within = within_of<Dim>(shapes, 1, out.contains);
  return out;
}

#define LAHAR_INSTANTIATE(Dim)                                                             \
  template RegionShape<Dim> side_of_surface<Dim>(std::shared_ptr<const Surface<Dim>>, int, \
                                                 double);                                  \
  template RegionShape<Dim> inside_solid<Dim>(SolidPtr<Dim>, double);                      \
  template RegionShape<Dim> union_of<Dim>(std::vector<RegionShape<Dim>>);                  \
  template RegionShape<Dim> intersection_of<Dim>(std::vector<RegionShape<Dim>>);           \
  template RegionShape<Dim> difference_of<Dim>(std::vector<RegionShape<Dim>>);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
