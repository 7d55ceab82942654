// Generators that add particles during the run, and the cells of generators that name a set.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
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
  const std::vector<Index> counts = team.each(static_cast<Index>(injection.cells.size()));
  Index position = std::accumulate(counts.begin(), counts.begin() + team.index(), Index{0});
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

/// How material with a velocity passes a cell.
struct Passage {
  double inflow = 0;  ///< [m^3/s; m^2/s per m of depth]
  double last = 0;    ///< [s] until the last of some points has left
};

template <int Dim>
Passage passage_of(const Mesh<Dim>& mesh, Index cell, std::span<const Vec<Dim>> points,
                   const Vec<Dim>& velocity) {
  Passage through;
  std::vector<double> leaves(points.size(), std::numeric_limits<double>::infinity());
  for (int k = 0; k < info(mesh.element()).faces; ++k) {
    const FacePiece<Dim> face = whole_face(face_of(mesh, cell, k));
    const double out = face.area.dot(velocity);
    through.inflow += std::max(0.0, -out);
    for (std::size_t i = 0; i < points.size() && out > 0; ++i)
      leaves[i] = std::min(leaves[i], face.area.dot(face.x - points[i]) / out);
  }
  for (const double time : leaves) through.last = std::max(through.last, time);
  return through;
}

/// [m^3/s] that leave the surface of cells with a velocity, but for faces at the border of the
/// mesh, as those on a bed.
template <int Dim>
double flow_out_of(const Mesh<Dim>& mesh, std::span<const CellFace<Dim>> surface,
                   const Vec<Dim>& velocity, const Analysis& analysis) {
  constexpr double rounding = 1e-9;
  const auto [low, high] = mesh.bounds();
  double out = 0;
  for (const CellFace<Dim>& face : surface) {
    bool at_border = false;
    for (std::size_t d = 0; d < Dim; ++d)
      for (const double end : {low[d], high[d]}) {
        bool all = true;
        for (std::size_t k = 0; k < static_cast<std::size_t>(face.corners); ++k)
          all = all && std::abs(face.x[k][d] - end) <= rounding * (high[d] - low[d]);
        at_border = at_border || all;
      }
    if (at_border) continue;
    const FacePiece<Dim> whole = whole_face(face);
    out += std::max(0.0, whole.area.dot(velocity)) * depth_at(analysis, whole.x[0]);
  }
  return out;
}

/// Of triangles and tetrahedra what share_of_event() is of boxes.
struct SimplexShares {
  std::vector<double> of_cells;
  double missing = 0;  ///< about what part of the flow does not come in
};

/// Some of these cells flow into others. When a cell that others fill is empty says nothing of the
/// flow. So a cell gets what comes in from outside of the set, and nothing where nothing does.
/// While particles of other cells are there, what comes in from outside is missing. Collective.
template <int Dim>
SimplexShares shares_of_simplices(const Mesh<Dim>& mesh, const Injection<Dim>& injection,
                                  std::span<const CellFace<Dim>> surface, const Analysis& analysis,
                                  const Team& team) {
  constexpr double rounding = 1e-9;      // of a flow
  std::map<Index, double> from_outside;  // by cell [m^3/s; m^2/s per m of depth]
  double whole = 0;                      // [m^3/s]
  for (const CellFace<Dim>& one : surface) {
    const FacePiece<Dim> face = whole_face(one);
    const double in = std::max(0.0, -face.area.dot(injection.velocity));
    from_outside[one.cell] += in;
    whole += in * depth_at(analysis, face.x[0]);
  }
  // What cannot leave at the border of the mesh does not come in either.
  const double passes = injection.flow > 0 ? std::min(1.0, injection.flow / whole) : 1.0;
  const auto n = static_cast<std::size_t>(injection.per_cell);
  SimplexShares shares;
  double all = 0, missing = 0;
  for (std::size_t i = 0; i < injection.cells.size(); ++i) {
    const Index cell = injection.cells[i];
    const Passage through =
        passage_of<Dim>(mesh, cell, std::span(injection.x).subspan(i * n, n), injection.velocity);
    double share = 1;  // what comes but once fills the cell
    if (through.last < injection.end - injection.start) {
      const auto found = from_outside.find(cell);
      double in = found == from_outside.end() ? 0.0 : found->second;
      if (!(in > rounding * through.inflow)) in = 0;
      share = passes * in * through.last / mesh.cell_volume(cell);
      all += in;
      if (in > 0) missing += in * std::max(0.0, 1 - in / through.inflow);
    }
    shares.of_cells.push_back(share);
  }
  all = team.sum(all), missing = team.sum(missing);
  if (all > 0) shares.missing = missing / all;
  return shares;
}

/// Leave out the cells whose particles have no volume.
template <int Dim>
void leave_out_empty(Injection<Dim>& injection) {
  const auto per_cell = static_cast<std::size_t>(injection.per_cell);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < injection.cells.size(); ++i) {
    if (injection.volume[i] == 0) continue;
    injection.cells[kept] = injection.cells[i];
    injection.volume[kept] = injection.volume[i];
    for (std::size_t k = 0; k < per_cell; ++k)
      injection.x[kept * per_cell + k] = injection.x[i * per_cell + k];
    ++kept;
  }
  injection.cells.resize(kept);
  injection.volume.resize(kept);
  injection.x.resize(kept * per_cell);
}

}  // namespace

// Volumes of particles, so that as much comes in as flows out.
template <int Dim>
void ScenarioBuilder<Dim>::share_inflow(const JsonValue& generator, const Mesh<Dim>& mesh,
                                        Injection<Dim>& injection) {
  constexpr double much = 0.1;  // of the flow
  const Vec<Dim>& velocity = injection.velocity;
  const auto n = static_cast<std::size_t>(injection.per_cell);
  std::vector<Index> sorted = injection.cells;
  std::sort(sorted.begin(), sorted.end());
  const auto surface = faces_of_surface<Dim>(mesh, sorted, sorted, team_);
  injection.flow = flow_out_of<Dim>(mesh, surface, velocity, model_.analysis);
  const bool simplices = info(mesh.element()).simplex;
  SimplexShares shares;
  if (simplices)
    shares = shares_of_simplices<Dim>(mesh, injection, surface, model_.analysis, team_);
  for (std::size_t i = 0; i < injection.cells.size(); ++i) {
    const Index cell = injection.cells[i];
    const double share = simplices ? shares.of_cells[i]
                                   : share_of_event<Dim>(mesh.cell_bounds(cell),
                                                         std::span(injection.x).subspan(i * n, n),
                                                         velocity, injection.end - injection.start);
    injection.volume.push_back(share * mesh.cell_volume(cell) / static_cast<double>(n));
  }
  if (simplices) {
    leave_out_empty(injection);
    injection.all_cells = team_.sum(static_cast<Index>(injection.cells.size()));
  }
  if (shares.missing > much)
    in_.warning(generator,
                fmt::format("about {:.0f} % of this inflow will be missing: it enters cells that "
                            "other cells of the set flow into, too, and only empty cells get "
                            "particles",
                            100 * shares.missing),
                "take cells in one layer across 'velocity', with sides along it; boxes (cell_type "
                "ED2Q4 or ED3H8) are the best");
  double filling = 0;
  for (std::size_t i = 0; i < injection.cells.size(); ++i) {
    const auto [low, high] = mesh.cell_bounds(injection.cells[i]);
    filling += injection.volume[i] * static_cast<double>(injection.per_cell) *
               depth_at(model_.analysis, (low[0] + high[0]) / 2);
  }
  injection.filling = team_.sum(filling);
}

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
  injection.cells = *cells;
  if (in_.cbgeo_defaults)
    for (const Index cell : injection.cells)
      injection.volume.push_back(mesh->cell_volume(cell) / static_cast<double>(injection.per_cell));
  else
    share_inflow(generator, *mesh, injection);
  if (!team_.alone()) send_home(injection, team_);
  model_.injections.push_back(std::move(injection));
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
