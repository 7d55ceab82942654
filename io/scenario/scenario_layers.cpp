// Particles that fill a region: how fine, what of parts that its boundary cuts, and layers.
#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "io/scenario/scenario_builder.h"
#include "io/scenario/surface_order.h"

namespace lahar {

namespace {

/// As the largest `per_cell` (keys_particles.cpp).
constexpr double most_parts_of_edge = 64;
constexpr int default_parts = 2;  ///< the same as there

/// Wider ones are probably meant for another mesh [-].
constexpr double most_cells_of_spacing = 1.2;

/// A cell that is a whole number of spacings wide but for rounding has so many parts [-].
constexpr double whole_number = 1e-6;

}  // namespace

/// Parts of a cell along each axis, from `per_cell` or `spacing`; nothing if reported.
template <int Dim>
std::optional<int> ScenarioBuilder<Dim>::parts_of_cell(const JsonValue& generator) {
  const JsonValue* spacing = generator.find("spacing");
  const JsonValue* per_cell = generator.find("per_cell");
  if (!spacing) {
    if (!per_cell && written(generator, "per_cell")) return std::nullopt;  // reported
    return per_cell ? static_cast<int>(per_cell->number()) : default_parts;
  }
  if (per_cell) {
    in_.error(*spacing, "'spacing' and 'per_cell' both say how many particles a cell has",
              "give one of them");
    return std::nullopt;
  }
  const double edge = outer_cell().maxCoeff();
  const double parts = std::max(1.0, std::ceil(edge / spacing->number() - whole_number));
  if (spacing->number() > most_cells_of_spacing * edge)
    in_.warning(*spacing,
                fmt::format("a spacing of {} is wider than a cell, {}: each cell gets a particle",
                            to_json(*spacing), edge),
                "make cells twice as wide as particles are apart, or leave 'spacing' out");
  if (parts <= most_parts_of_edge) return static_cast<int>(parts);
  in_.error(
      *spacing,
      fmt::format("a spacing of {} makes {:.0f} particles along each edge of a cell, which is "
                  "{} wide; at most {:.0f} are possible",
                  to_json(*spacing), parts, edge, most_parts_of_edge),
      "spacing is in metres");
  return std::nullopt;
}

template <int Dim>
bool ScenarioBuilder<Dim>::wants_exact_cuts(const JsonValue& generator, const Region<Dim>& region) {
  const JsonValue* given = generator.find("cut_cells");
  return given ? given->as<std::string>() == "exact" : region.cuts_exactly();
}

/// What particles of parts get that the boundary of a region cuts.
template <int Dim>
CutCells ScenarioBuilder<Dim>::cut_cells_of(const JsonValue& generator, const Region<Dim>& region) {
  const JsonValue* given = generator.find("cut_cells");
  const bool exact = wants_exact_cuts(generator, region);
  if (!exact || mesh_->is_multilinear()) return exact ? CutCells::exact : CutCells::centres;
  const std::string what =
      fmt::format("cells that the region cuts have exact volumes only in meshes of {}",
                  info(multilinear<Dim>).name);
  if (given)
    in_.error(*given, what, "write \"cut_cells\": \"centres\"");
  else
    in_.warning(generator, what + "; parts with their centre inside are taken as a whole",
                "write \"cut_cells\": \"centres\" if that is what you want");
  return CutCells::centres;
}

/// Particles of a region, and what is said about them.
template <int Dim>
NewParticles<Dim> ScenarioBuilder<Dim>::fill_region_of(const JsonValue& generator,
                                                       const Region<Dim>& region) {
  const auto n = parts_of_cell(generator);
  if (!n) return {};
  const CutCells cut = cut_cells_of(generator, region);
  auto fresh = fill(generator, region, *n, cut);
  fresh.parts = *n;
  const JsonValue* shape = generator.find("region");
  const Index made = team_.sum(static_cast<Index>(fresh.x.size()));
  if (shape && made > 0) warn_of_clipping(*shape, region, made);
  if (shape && cut == CutCells::centres && !generator.find("cut_cells") && mesh_->is_multilinear())
    warn_of_rounded_volume(generator, *shape, region, fresh);
  return fresh;
}

// Simple shapes keep whole parts, whose domains are those of boxes (GIMP, CPDI), and which are not
// light. So the volume is right only where their faces lie between parts.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_rounded_volume(const JsonValue& generator,
                                                  const JsonValue& shape, const Region<Dim>& region,
                                                  const NewParticles<Dim>& made) {
  constexpr double most = 0.01;
  const auto volume = [&](const NewParticles<Dim>& particles) {
    return team_.sum(std::accumulate(particles.volume.begin(), particles.volume.end(), 0.0));
  };
  const double exact = volume(fill(generator, region, made.parts, CutCells::exact));
  const double error = volume(made) / exact - 1;
  if (!(exact > 0 && std::abs(error) > most)) return;
  in_.warning(shape,
              fmt::format("the particles have {:.1f} % {} volume than this region: each part of a "
                          "cell whose centre is inside counts as a whole",
                          100 * std::abs(error), error > 0 ? "more" : "less"),
              "\"cut_cells\": \"exact\" gives particles the volume that is inside, lighter ones at "
              "the surface; or take smaller cells, or a larger 'per_cell'");
}

// A region that ends at a surface means soil up to it, and nothing lies between it and the first
// layer. Boxes may be higher than the ground.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_missing_top(const JsonValue& generator, const Region<Dim>& all,
                                               const std::vector<Region<Dim>>& tops) {
  constexpr int points = Dim == 2 ? 128 : 40;  // along each axis of the mesh
  constexpr double most = 0.02;                // of the region
  const JsonValue* shape = generator.find("region");
  if (!shape || !names_surface(*shape)) return;
  const auto [low, high] = mesh_->bounds();
  Index n = 1, inside = 0, missing = 0;
  for (int d = 0; d < Dim; ++d) n *= points;
  for (Index k = 0; k < n; ++k) {
    Vec<Dim> x;
    Index left = k;
    for (int d = 0; d < Dim; ++d, left /= points)
      x[d] = low[d] + (high[d] - low[d]) * (static_cast<double>(left % points) + 0.5) / points;
    if (!all.contains(x)) continue;
    ++inside;
    missing += tops.front().contains(x) ? 0 : 1;
  }
  const double share =
      static_cast<double>(missing) / static_cast<double>(std::max<Index>(inside, 1));
  if (share < most) return;
  in_.warning(
      *get_list(generator, "layers").front(),
      fmt::format("{:.0f} % of the region lies above the first layer and gets no "
                  "particles: about {:.3g} m^{}",
                  100 * share,
                  (high - low).prod() * static_cast<double>(missing) / static_cast<double>(n), Dim),
      "the first layer begins at the top of the region: \"below\" its surface");
}

/// Each layer reaches from its surface down to that of the next one.
template <int Dim>
void ScenarioBuilder<Dim>::generate_layers(const JsonValue& generator, const Region<Dim>& all) {
  const auto layers = get_list(generator, "layers");
  if (const JsonValue* material = in_.either(generator, "material_id", "material"))
    in_.error(*material, "each of the layers has its material", "leave this one out");
  if (layers.empty() && generator.find("layers")->valid())
    in_.error(*generator.find("layers"), "there are no layers",
              "[{\"below\": a surface, \"material\": ...}, ...], the uppermost first");
  std::vector<Region<Dim>> tops;
  for (const JsonValue* layer : layers)
    if (const JsonValue* name = layer->find("below"))
      if (const auto surface = surface_named(*name, {}))
        tops.push_back(Region<Dim>(surface, region_tolerance_));
  Index made = 0;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const int material = find_material(*layers[i]);
    if (tops.size() != layers.size() || !mesh_) continue;  // reported
    std::vector<const Region<Dim>*> in_all{&all}, below;
    for (std::size_t k = 0; k <= i; ++k) in_all.push_back(&tops[k]);
    if (i + 1 < layers.size()) below.push_back(&tops[i + 1]);
    const Index before = rows_.total();
    add_particles(generator, *layers[i], material,
                  fill_region_of(generator, Region<Dim>(in_all, below)));
    if (rows_.total() == before)
      in_.warning(*layers[i],
                  "this layer has no particles: it lies above the one before or outside "
                  "of the region");
    made += rows_.total() - before;
  }
  if (made > 0) return warn_of_missing_top(generator, all, tops);
  particles_complete_ = false;
  if (in_.problems.empty())
    in_.error(generator, "the layers contain no particle", "do they lie inside the mesh?");
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
