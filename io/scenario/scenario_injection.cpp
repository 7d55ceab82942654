// Generators that add particles during the run, and the cells of generators that name a set.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <span>

#include "io/base/text.h"
#include "io/mesh/shared_mesh.h"
#include "io/scenario/scenario_builder.h"
#include "io/scenario/surface_faces.h"
#include "physics/base/directory_rank.h"

namespace lahar {

/// This member's part of the cells of a generator.
template <int Dim>
std::optional<std::vector<Index>> ScenarioBuilder<Dim>::cells_of(const JsonValue& generator) {
  const JsonValue* set = in_.either(generator, "cset_id", "cset");
  if (set && !(set->is_number() && set->number() == -1)) {
    const std::vector<Index>* listed = sets_.cells.find(*set, in_);
    return listed ? std::optional(*listed) : std::nullopt;
  }
  if (!mesh_) return std::nullopt;
  need_memory(generator, sizeof(Index) * static_cast<double>(n_cells()) / team_.size(),
              fmt::format("a list of {} cells", format_count(n_cells())));
  const auto [first, end] = own_cells(n_cells(), team_);
  std::vector<Index> own(static_cast<std::size_t>(end - first));
  std::iota(own.begin(), own.end(), first);
  return own;
}

namespace {

/// Let every member have the cells that it keeps (directory_rank()), instead of its part of the
/// list. Collective.
template <int Dim>
void send_home(Injection<Dim>& injection, const Team& team) {
  struct Cell {
    Index position, cell;
    double volume;
  };
  using Point = std::array<double, static_cast<std::size_t>(Dim)>;
  const auto size = static_cast<std::size_t>(team.size());
  std::vector<std::vector<Cell>> cells(size);
  std::vector<std::vector<Point>> points(size);
  Index position = team.part(injection.all_cells, team.index());
  auto x = injection.x.begin();
  for (std::size_t i = 0; i < injection.cells.size(); ++i) {
    const auto to = static_cast<std::size_t>(directory_rank(injection.cells[i], team.size()));
    cells[to].push_back({position++, injection.cells[i], injection.volume[i]});
    for (Index k = 0; k < injection.per_cell; ++k)
      std::copy_n((x++)->data(), Dim, points[to].emplace_back().begin());
  }
  injection.cells.clear();
  injection.volume.clear();
  injection.x.clear();
  for (const Cell& cell : joined(team.exchange(std::move(cells)))) {
    injection.position.push_back(cell.position);
    injection.cells.push_back(cell.cell);
    injection.volume.push_back(cell.volume);
  }
  for (const Point& point : joined(team.exchange(std::move(points))))
    injection.x.emplace_back(point.data());
}

/// Particles come when those before have left the cell. This is the share of the cell that has
/// flowed in until then, while its box moves on with `velocity` [m/s]: 1 of many particles, 1/2 of
/// one in the middle. What comes but once fills the cell.
template <int Dim>
double share_of_event(const std::pair<Vec<Dim>, Vec<Dim>>& cell, std::span<const Vec<Dim>> points,
                      const Vec<Dim>& velocity, double duration) {
  constexpr double never = std::numeric_limits<double>::infinity();
  double last = 0;  // [s]
  for (const Vec<Dim>& x : points) {
    double leaves = never;
    for (int d = 0; d < Dim; ++d)
      if (velocity[d] != 0)
        leaves = std::min(
            leaves, ((velocity[d] > 0 ? cell.second[d] : cell.first[d]) - x[d]) / velocity[d]);
    last = std::max(last, leaves);
  }
  if (!(last < duration)) return 1;
  const Vec<Dim> flows = last * velocity.cwiseAbs().cwiseQuotient(cell.second - cell.first);
  return std::min(1.0, flows.sum());
}

/// [m^3/s] that leave the cells of all members together with a velocity, but for faces at the
/// border of the mesh, as those on a bed. Collective.
template <int Dim>
double flow_out_of(const Mesh<Dim>& mesh, std::vector<Index> cells, const Vec<Dim>& velocity,
                   const Analysis& analysis, const Team& team) {
  constexpr double rounding = 1e-9;
  const auto [low, high] = mesh.bounds();
  std::sort(cells.begin(), cells.end());
  double out = 0;
  for (const CellFace<Dim>& face : faces_of_surface<Dim>(mesh, cells, cells, team)) {
    const auto corner = [&](int k) {
      return Vec<Dim>(face.x[static_cast<std::size_t>(k % face.corners)].data());
    };
    bool at_border = false;
    for (int d = 0; d < Dim; ++d)
      for (const double end : {low[d], high[d]}) {
        bool all = true;
        for (int k = 0; k < face.corners; ++k)
          all = all && std::abs(corner(k)[d] - end) <= rounding * (high[d] - low[d]);
        at_border = at_border || all;
      }
    if (at_border) continue;
    Vec<Dim> area, middle = Vec<Dim>::Zero();  // the area along its normal
    for (int k = 0; k < face.corners; ++k) middle += corner(k) / face.corners;
    if constexpr (Dim == 2) {
      const Vec<2> along = corner(1) - corner(0);
      area = Vec<2>(along[1], -along[0]) * depth_at(analysis, middle[0]);
    } else {
      area = 0.5 * (corner(2) - corner(0)).cross(corner(3) - corner(1));  // of three: 3 is 0
    }
    if (area.dot(middle - Vec<Dim>(face.centre.data())) < 0) area = -area;
    out += std::max(0.0, area.dot(velocity));
  }
  return out;
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::build_injection(const JsonValue& generator) {
  Injection<Dim> injection;
  const int material = find_material(generator);
  injection.material = static_cast<std::uint16_t>(std::max(material, 0));
  injection.velocity = get_vector<Dim>(generator, "velocity").value_or(Vec<Dim>::Zero());
  if (const JsonValue* set = in_.either(generator, "pset_id", "pset"))
    in_.warning(*set, "injected particles are in no particle set",
                "loads and constraints of all particles (-1) act on them; leave the key out");
  if (const JsonValue* duration = generator.find("duration")) {
    const auto times = get_numbers(generator, "duration");
    if (times.size() != 2 || !(times[0] < times[1]))
      in_.error(*duration,
                fmt::format("'duration' must be [start, end] with start < end, found {}",
                            to_json(*duration)),
                "particles come in steps that begin at start <= t < end [s]");
    else
      injection.start = times[0], injection.end = times[1];
  }
  const auto n = get_integer(generator, "nparticles_per_dir");
  const auto cells = cells_of(generator);
  if (!check_gauss_points(generator) || !mesh_ || !n || !cells) return;
  injection.all_cells = team_.sum(static_cast<Index>(cells->size()));
  if (injection.all_cells == 0)
    return in_.error(generator, "there is no cell to inject particles into");
  const Index points = gauss_count(*cells, static_cast<int>(*n));
  need_memory(generator, sizeof(Vec<Dim>) * static_cast<double>(points) / team_.size(),
              fmt::format("{} places of injection", format_count(points)));
  const auto mesh = mesh_with(*cells);
  injection.x = fill_cells<Dim>(*mesh, *cells, static_cast<int>(*n)).x;
  injection.per_cell = team_.sum(static_cast<Index>(injection.x.size())) / injection.all_cells;
  for (std::size_t i = 0; i < cells->size(); ++i) {
    const Index cell = (*cells)[i];
    const auto n_points = static_cast<std::size_t>(injection.per_cell);
    const double share =
        in_.cbgeo_defaults
            ? 1.0
            : share_of_event<Dim>(mesh->cell_bounds(cell),
                                  std::span(injection.x).subspan(i * n_points, n_points),
                                  injection.velocity, injection.end - injection.start);
    injection.volume.push_back(share * mesh->cell_volume(cell) /
                               static_cast<double>(injection.per_cell));
  }
  if (!in_.cbgeo_defaults) {
    double filling = 0;
    for (std::size_t i = 0; i < cells->size(); ++i) {
      const auto [low, high] = mesh->cell_bounds((*cells)[i]);
      filling += injection.volume[i] * static_cast<double>(injection.per_cell) *
                 depth_at(model_.analysis, (low[0] + high[0]) / 2);
    }
    injection.filling = team_.sum(filling);
    injection.flow = flow_out_of<Dim>(*mesh, *cells, injection.velocity, model_.analysis, team_);
  }
  injection.cells = *cells;
  if (!team_.alone()) send_home(injection, team_);
  model_.injections.push_back(std::move(injection));
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
