#include "io/run/body_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numeric>

#include "io/base/atomic_file.h"
#include "io/frames/surface_files.h"
#include "io/run/manifest.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

/// Parts of the grid along the shortest side, at least: what is thin is found, too.
constexpr double least_parts = 6;
/// What overlaps the mesh by a smaller share of its longest side only touches it.
constexpr double least_overlap = 1e-6;

/// Into how many parts sides are cut for about so many points: equal parts, as far as short sides
/// get enough of them.
template <int Dim>
Vec<Dim> parts_of(const Vec<Dim>& size, double points) {
  std::array<int, Dim> axes;
  std::iota(axes.begin(), axes.end(), 0);
  std::ranges::sort(axes, {}, [&](int d) { return size[d]; });
  Vec<Dim> parts;
  double volume = size.prod();
  int left = Dim;
  for (const int d : axes) {
    const double length = std::pow(volume / points, 1.0 / left--);
    parts[d] = std::max(least_parts, std::ceil(size[d] / length));
    volume /= size[d];
    points /= parts[d];
  }
  return parts;
}

}  // namespace

template <int Dim>
LevelSurface<Dim> surface_within(const Solid<Dim>& solid, const std::pair<Vec<Dim>, Vec<Dim>>& box,
                                 double points) {
  const auto [solid_low, solid_high] = solid.bounds();
  const Vec<Dim> low = solid_low.cwiseMax(box.first), high = solid_high.cwiseMin(box.second);
  const Vec<Dim> size = high - low;
  if (!(size.minCoeff() > least_overlap * (box.second - box.first).maxCoeff())) return {};
  const Vec<Dim> parts = parts_of<Dim>(size, points);
  GridValues<Dim> grid{.low = low, .spacing = size.cwiseQuotient(parts), .n = {}, .values = {}};
  Vec<Dim> last = high;
  for (int d = 0; d < Dim; ++d) {
    grid.n[static_cast<std::size_t>(d)] = static_cast<Index>(parts[d]) + 1;
    // A layer around it, so that it is closed, but not beyond the box.
    if (solid_low[d] > box.first[d]) {
      grid.low[d] -= grid.spacing[d];
      ++grid.n[static_cast<std::size_t>(d)];
    }
    if (solid_high[d] < box.second[d]) {
      last[d] += grid.spacing[d];
      ++grid.n[static_cast<std::size_t>(d)];
    }
  }
  // Where a surface ends distances are infinite.
  const double far = 2 * grid.spacing.maxCoeff();
  grid.values.resize(static_cast<std::size_t>(grid.size()));
  for (Index point = 0; point < grid.size(); ++point) {
    const Vec<Dim> x = grid.place(point).cwiseMin(last);  // not beyond it by rounding
    grid.values[static_cast<std::size_t>(point)] =
        static_cast<float>(std::clamp(-solid.nearest(x).distance, -far, far));
  }
  return level_surface<Dim>(grid, 0);
}

std::filesystem::path bodies_folder(const std::filesystem::path& run) {
  return run / "bodies";
}

std::filesystem::path body_file(const std::filesystem::path& run, std::size_t index,
                                const std::string& name) {
  constexpr std::size_t longest = 100;
  std::string stem = name.substr(0, longest);
  for (char& c : stem)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-') c = '_';
  return bodies_folder(run) / fmt::format("{}-{}.vtp", index, stem);
}

void write_body_shapes(const std::filesystem::path& run, const std::vector<BodyShape>& shapes) {
  if (shapes.empty()) return;
  make_folder(bodies_folder(run));
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const std::filesystem::path file = body_file(run, i, shapes[i].name);
    if (const auto* lines = std::get_if<Lines>(&shapes[i].surface))
      write_vtp<2>(*lines, 0, file);
    else
      write_vtp<3>(std::get<Triangles>(shapes[i].surface), 0, file);
  }
}

std::vector<BodyShape> read_body_shapes(const std::filesystem::path& run) {
  std::vector<BodyShape> shapes;
  const std::optional<nlohmann::json> manifest = read_manifest(run);
  if (!manifest || !manifest->contains("rigid_bodies")) return shapes;
  try {
    const bool flat = manifest->at("model").at("dim") == 2;
    std::size_t index = 0;
    for (const nlohmann::json& body : manifest->at("rigid_bodies")) {
      BodyShape shape{.name = body.at("name"), .centre = body.at("centre"), .surface = {}};
      const std::filesystem::path file = body_file(run, index++, shape.name);
      if (!std::filesystem::exists(file)) continue;
      if (flat)
        shape.surface = read_vtp<2>(file);
      else
        shape.surface = read_vtp<3>(file);
      shapes.push_back(std::move(shape));
    }
  } catch (const nlohmann::json::exception& error) {
    throw IoError(fmt::format("cannot read {}: its rigid bodies are not as Lahar writes them ({})",
                              (run / "manifest.json").string(), error.what()));
  }
  return shapes;
}

template Lines surface_within<2>(const Solid<2>&, const std::pair<Vec<2>, Vec<2>>&, double);
template Triangles surface_within<3>(const Solid<3>&, const std::pair<Vec<3>, Vec<3>>&, double);

}  // namespace lahar
