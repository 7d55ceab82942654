// Generators that add particles during the run, and the cells of generators that name a set.
#include <fmt/format.h>

#include "io/scenario_builder.h"

namespace lahar {

template <int Dim>
std::optional<CellList> ScenarioBuilder<Dim>::cells_of(const JsonValue& generator) {
  const JsonValue* set = in_.either(generator, "cset_id", "cset");
  if (!set || (set->is_number() && set->number() == -1))
    return mesh_ ? std::optional(CellList{nullptr, n_cells()}) : std::nullopt;
  const std::vector<Index>* listed = sets_.cells.find(*set, in_);
  if (!listed) return std::nullopt;
  return CellList{listed, static_cast<Index>(listed->size())};
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
  for (Index i = 0; i < cells->size; ++i) injection.cells.push_back((*cells)[i]);
  if (injection.cells.empty()) in_.error(generator, "there is no cell to inject particles into");
  if (injection.cells.empty()) return;
  // Of a mesh in shares every member looks at some cells; all have all injections.
  const bool shared = mesh_->is_share();
  const std::vector<Index> own = shared ? own_part(*cells) : injection.cells;
  const auto mesh = mesh_with(own);
  auto points = fill_cells<Dim>(*mesh, own, static_cast<int>(*n));
  std::vector<double> volume;
  for (const Index cell : own) volume.push_back(mesh->cell_volume(cell));
  if (shared) {
    std::vector<double> x;
    for (const Vec<Dim>& point : points.x) x.insert(x.end(), point.data(), point.data() + Dim);
    points.x.clear();
    for (const auto& part : team_.gather(x))
      for (std::size_t i = 0; i < part.size(); i += Dim) points.x.emplace_back(&part[i]);
    const auto parts = team_.gather(volume);
    volume.clear();
    for (const auto& part : parts) volume.insert(volume.end(), part.begin(), part.end());
  }
  injection.x = std::move(points.x);
  injection.per_cell =
      static_cast<Index>(injection.x.size()) / static_cast<Index>(injection.cells.size());
  for (double& v : volume) v /= static_cast<double>(injection.per_cell);
  injection.volume = std::move(volume);
  model_.injections.push_back(std::move(injection));
}

#define LAHAR_INSTANTIATE(Dim)                                                       \
  template std::optional<CellList> ScenarioBuilder<Dim>::cells_of(const JsonValue&); \
  template void ScenarioBuilder<Dim>::build_injection(const JsonValue&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
