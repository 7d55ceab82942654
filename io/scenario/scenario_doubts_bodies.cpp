// Warnings of bodies that stick together or stiffen each other, and of what cannot move or soften.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <variant>

#include "io/scenario/scenario_builder.h"
#include "physics/base/sort_unique.h"
#include "physics/materials/law.h"

namespace lahar {

template <int Dim>
bool ScenarioBuilder<Dim>::decides_on_contact() const {
  const JsonValue* interface = section("analysis").find("interface");
  return in_.cbgeo_defaults || (interface && !interface->defaulted);
}

// A body of its own material, with prescribed velocities, beside another material.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_bonds() {
  if (!model_.analysis.drives_nodes || decides_on_contact()) return;
  const ParticleTable<Dim>& p = model_.particles;
  std::vector<bool> is_prescribed(p.x.size());
  for (const auto& entry : model_.particle_velocities)
    for (const Index i : entry.particles)
      is_prescribed[static_cast<std::size_t>(rows_.local(i))] = true;
  const std::size_t n = model_.materials.size();
  std::vector<double> has(2 * n, 0.0);  // prescribed particles, and others, by material
  for (std::size_t i = 0; i < p.x.size(); ++i)
    has[2 * p.material[i] + (is_prescribed[i] ? 0 : 1)] = 1.0;
  has = team_.most(std::move(has));
  bool others = false, bodies = false;
  for (std::size_t m = 0; m < n; ++m) {
    others |= has[2 * m + 1] > 0.0;
    bodies |= has[2 * m] > 0.0 && has[2 * m + 1] == 0.0;
  }
  if (!others || !bodies) return;
  in_.warning(
      *boundary().find("particles_velocity_constraints"),
      "other material sticks to particles with prescribed velocities, as if they were up "
      "to a cell and a half larger: forces on a body that is pushed into soil come out too "
      "high",
      "\"interface\": true with \"contact\": {\"friction\": ...} in analysis gives a body its "
      "own size; \"interface\": false keeps it bonded without this warning");
}

// Bodies of different materials that are apart at the beginning. Fluids may flow together.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_distance(const std::vector<Box>& boxes) {
  constexpr double touching = 1.01;  // distance of particles in cells, at most
  const std::size_t n = boxes.size();
  if (decides_on_contact() || n < 2) return;
  std::vector<double> material(n, -1.0);  // of the generator's first particle
  for_own_particles([&](std::size_t g, std::size_t i) {
    if (material[g] < 0.0) material[g] = model_.particles.material[i];
  });
  material = team_.most(std::move(material));
  const auto meet = [&](std::size_t a, std::size_t b) {
    return !apart(boxes[a], boxes[b], touching * outer_cell());
  };
  std::vector<std::size_t> body(n);  // generators that touch have the same
  std::iota(body.begin(), body.end(), std::size_t{0});
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b < a; ++b)
      if (meet(a, b)) std::replace(body.begin(), body.end(), body[a], body[b]);
  const auto is_fluid = [&](std::size_t g) {
    return has_pressure(model_.materials[static_cast<std::size_t>(material[g])].law);
  };
  for (std::size_t a = 1; a < n; ++a)
    for (std::size_t b = 0; b < a; ++b) {
      if (body[a] == body[b] || material[a] == material[b] || is_fluid(a) || is_fluid(b)) continue;
      return in_.warning(
          *generators_[a].generator,
          fmt::format("these particles are a body apart from those {}: without contact they stop "
                      "each other at the distance of a cell, and stick together",
                      in_.document.line(*generators_[b].generator)),
          "\"interface\": true with \"contact\": {\"friction\": ...} in analysis lets them touch, "
          "slide and part; \"interface\": false keeps one velocity for all without this warning");
    }
}

// Constraints that leave no node free.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_stillness() {
  const Index nodes = mesh_->n_nodes();
  bool all = true;  // directions
  for (int d = 0; d < Dim; ++d) {
    const auto& held = entries_of<NodeVelocity>(model_);
    const auto count = std::count_if(held.begin(), held.end(), [d](const NodeVelocity& v) {
      return v.dir == d && v.velocity == 0;
    });
    all = team_.sum(static_cast<Index>(count)) == nodes && all;
  }
  if (all && boundary().find("velocity_constraints"))
    in_.warning(*boundary().find("velocity_constraints"),
                "all nodes of the mesh are held in all directions: nothing can move",
                "the normal of a half_space points to where there are no nodes of the set");
  for (const FrictionEntry& e : friction_entries_)
    if (team_.sum(static_cast<Index>(e.end - e.first)) == nodes)
      in_.warning(*e.entry, "all nodes of the mesh are nodes of this wall",
                  "the normal of a half_space points to where there are no nodes of the set");
}

template <int Dim>
void ScenarioBuilder<Dim>::warn_of_no_pressure() {
  if (in_.cbgeo_defaults || is_projection(model_.analysis)) return;
  for (const JsonValue* material : get_list(root_, "materials"))
    if (get_bool(*material, "incompressible").value_or(false))
      in_.warning(*material->find("incompressible"),
                  "an incompressible liquid has no pressure but in projections: nothing holds its "
                  "volume, and its cells collapse",
                  "leave it out: 'bulk_modulus' then holds the volume; or take \"mpm_scheme\": "
                  "\"projection\"");
}

// What a law reads only where it softens.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_softening() {
  if (in_.cbgeo_defaults) return;
  const auto materials = get_list(root_, "materials");
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const auto* law = std::get_if<MohrCoulomb>(&model_.materials[m].law);
    if (!law || law->softening) continue;
    for (const std::string_view key : {"residual_friction", "residual_dilation",
                                       "residual_cohesion", "peak_pdstrain", "residual_pdstrain"}) {
      const JsonValue* value = materials[m]->find(key);
      if (!value || value->defaulted) continue;
      in_.warning(*value,
                  fmt::format("'{}' has no effect: material '{}' does not soften", key,
                              model_.materials[m].name),
                  "set \"softening\": true, or leave the key out");
      break;
    }
  }
}

namespace {

/// A cell, a material, and the cell at it or beside it that has particles of the material.
struct Filled {
  Index cell;
  int material;
  Index by;
  auto operator<=>(const Filled&) const = default;
};

bool yields(const Law& law) {
  return std::holds_alternative<MohrCoulomb>(law) || std::holds_alternative<DruckerPrager>(law) ||
         std::holds_alternative<VonMises>(law) || std::holds_alternative<ModifiedCamClay>(law) ||
         std::holds_alternative<NorSand>(law);
}

/// Whether shear gathers in a material and not in another: both have angles of friction and
/// cohesions, and of one of them the first has less, of none more.
bool is_weaker(const JsonValue& material, const JsonValue& than) {
  bool weaker = false;
  for (const std::string_view key : {"friction", "cohesion"}) {
    const auto own = get_number(material, key), other = get_number(than, key);
    if (!own || !other || *own > *other) return false;
    weaker |= *own < *other;
  }
  return weaker;
}

}  // namespace

// A material is three cells thick where a cell and all around it have particles of it; one that is
// weaker than another, in which shear gathers, five where all within two of a cell have. Along an
// axis on which the mesh itself has hardly any cells, it need not be.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_thin_layers() {
  const auto entries = get_list(root_, "materials");
  const std::size_t n = entries.size();
  const auto& materials = model_.materials;
  if (in_.cbgeo_defaults || !mesh_->is_structured() ||
      std::none_of(materials.begin(), materials.end(), [](auto& m) { return yields(m.law); }))
    return;
  const ParticleTable<Dim>& p = model_.particles;
  std::vector<Filled> own;
  for (std::size_t i = 0; i < p.x.size(); ++i)
    if (yields(materials[p.material[i]].law))
      own.push_back({p.cell[i], static_cast<int>(p.material[i] % n), p.cell[i]});
  sort_unique(own);
  const auto counts = mesh_->counts();
  std::vector<Index> block(n, 3);   // cells along each axis that counts
  std::vector<Index> around(n, 1);  // of a block
  for (std::size_t m = 0; m < n; ++m) {
    if (std::any_of(entries.begin(), entries.end(),
                    [&](const JsonValue* other) { return is_weaker(*entries[m], *other); }))
      block[m] = 5;
    for (const Index count : counts) around[m] *= count > block[m] ? block[m] : 1;
  }
  const auto around_of = [&](const Filled& at) {
    return around[static_cast<std::size_t>(at.material)];
  };
  /// The k-th cell of the block around one; -1 beyond the mesh.
  const auto neighbour = [&](const Filled& of, Index k) {
    const Index edge = block[static_cast<std::size_t>(of.material)];
    Index at = of.cell, cell = 0, stride = 1;
    for (const Index count : counts) {
      Index along = at % count;
      at /= count;
      if (count > edge) along += k % edge - edge / 2, k /= edge;
      if (along < 0 || along >= count) return Index{-1};
      cell += stride * along;
      stride *= count;
    }
    return cell;
  };
  const auto all_around = [&](const Filled& at, const std::vector<Filled>& filled) {
    for (Index k = 0; k < around_of(at); ++k) {
      const Index cell = neighbour(at, k);
      if (!std::binary_search(filled.begin(), filled.end(), Filled{cell, at.material, cell}))
        return false;
    }
    return true;
  };
  std::vector<double> has(n, 0.0), thick(n, 0.0);
  for (const Filled& at : own) {
    double& found = thick[static_cast<std::size_t>(at.material)];
    has[static_cast<std::size_t>(at.material)] = 1.0;
    if (found == 0.0 && all_around(at, own)) found = 1.0;
  }
  has = team_.most(std::move(has));
  thick = team_.most(std::move(thick));
  // What members do not see in their own shares: each cell gets to know what is around it.
  std::vector<std::vector<Filled>> to(static_cast<std::size_t>(team_.size()));
  for (const Filled& from : own)
    for (Index k = 0; k < around_of(from) && thick[static_cast<std::size_t>(from.material)] == 0.0;
         ++k)
      if (const Index cell = neighbour(from, k); cell >= 0 && !team_.alone())
        to[static_cast<std::size_t>(team_.member(cell, mesh_->n_cells()))].push_back(
            {cell, from.material, from.cell});
  std::vector<Filled> told = joined(team_.exchange(std::move(to)));
  sort_unique(told);
  for (std::size_t begin = 0, end = 0; begin < told.size(); begin = end) {
    const Filled& at = told[begin];
    while (end < told.size() && told[end].cell == at.cell && told[end].material == at.material)
      ++end;
    if (static_cast<Index>(end - begin) == around_of(at))
      thick[static_cast<std::size_t>(at.material)] = 1.0;
  }
  thick = team_.most(std::move(thick));
  for (std::size_t m = 0; m < n; ++m)
    if (has[m] > 0.0 && thick[m] == 0.0)
      in_.warning(*entries[m],
                  fmt::format("material '{}' is at most {} cells thick: coarse cells make a thin "
                              "layer too strong, so that what rests on it may not slide at all",
                              materials[m].name, block[m] == 3 ? "two" : "four"),
                  fmt::format("make cells {} of its thickness or smaller, and compare with half of "
                              "that",
                              block[m] == 3 ? "a quarter" : "an eighth"));
}

// Smooth functions have no kinks. Where a material meets one that is much stiffer, the change of
// strain takes place in the softer one, over about a cell, which then hardly deforms there.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_stiffness_contrast() {
  constexpr double least_error = 0.03;  // of what the softer material deforms by under a load
  // Cells of it that do not deform, with any contrast; and the contrast with half of that.
  constexpr double most_cells = 0.6, half = 25;
  const ShapeFunctions functions = model_.analysis.functions;
  if (in_.cbgeo_defaults || !mesh_->is_structured() ||
      (functions != ShapeFunctions::quadratic_spline && functions != ShapeFunctions::cubic_spline))
    return;
  const auto entries = get_list(root_, "materials");
  const std::size_t n = entries.size();
  std::vector<double> modulus;
  for (std::size_t m = 0; m < n; ++m) {
    const Law& law = model_.materials[m].law;
    // Liquids change their shape, and some soils their stiffness.
    modulus.push_back(has_pressure(law) || stiffness_follows_stress(law) ? 0.0 : wave_modulus(law));
  }
  /// Cells that a material loses at each face beside another one.
  const auto lost_beside = [](double own, double other) {
    const double ratio = other / own - 1;
    return ratio > 0 ? most_cells * ratio / (ratio + half) : 0.0;
  };
  const double stiffest_of_all = *std::max_element(modulus.begin(), modulus.end());
  if (std::none_of(modulus.begin(), modulus.end(), [&](double own) {
        return own > 0 && 2 * Dim * lost_beside(own, stiffest_of_all) >= least_error;
      }))
    return;
  // Each cell has the stiffest material of its particles.
  struct Stiffest {
    Index cell;
    int material;
  };
  const auto keep_stiffest = [&](std::vector<Stiffest>& cells) {
    std::sort(cells.begin(), cells.end(), [&](const Stiffest& a, const Stiffest& b) {
      const double x = modulus[static_cast<std::size_t>(a.material)],
                   y = modulus[static_cast<std::size_t>(b.material)];
      return a.cell != b.cell ? a.cell < b.cell : x != y ? x > y : a.material < b.material;
    });
    cells.erase(std::unique(cells.begin(), cells.end(),
                            [](const Stiffest& a, const Stiffest& b) { return a.cell == b.cell; }),
                cells.end());
  };
  const ParticleTable<Dim>& p = model_.particles;
  std::vector<Stiffest> own;
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const auto m = static_cast<int>(p.material[i] % n);
    if (p.cell[i] < 0 || modulus[static_cast<std::size_t>(m)] == 0) continue;
    if (own.empty() || own.back().cell != p.cell[i] || own.back().material != m)
      own.push_back({p.cell[i], m});
  }
  keep_stiffest(own);
  const auto keeper = [&](Index cell) { return team_.member(cell, mesh_->n_cells()); };
  std::vector<std::vector<Stiffest>> to(static_cast<std::size_t>(team_.size()));
  for (const Stiffest& one : own) to[static_cast<std::size_t>(keeper(one.cell))].push_back(one);
  own = joined(team_.exchange(std::move(to)));
  keep_stiffest(own);
  const auto counts = mesh_->counts();
  std::vector<Index> cells(n, 0), neighbours;
  std::vector<std::size_t> of;  // the material whose cell has this neighbour
  for (const Stiffest& one : own) {
    const auto m = static_cast<std::size_t>(one.material);
    ++cells[m];
    Index stride = 1;
    for (const Index count : counts) {
      const Index along = one.cell / stride % count;
      for (const Index step : {Index{-1}, Index{1}}) {
        if (along + step < 0 || along + step >= count) continue;
        neighbours.push_back(one.cell + step * stride);
        of.push_back(m);
      }
      stride *= count;
    }
  }
  const auto beside = ask<int>(team_, neighbours, keeper, [&](Index cell) {
    const auto at = std::lower_bound(own.begin(), own.end(), cell,
                                     [](const Stiffest& a, Index key) { return a.cell < key; });
    return at != own.end() && at->cell == cell ? at->material : -1;
  });
  std::vector<double> lost(n, 0.0), contrast(n, 0.0);  // cells; of a material's stiffest neighbour
  std::vector<double> stiffest(n, -1.0);
  for (std::size_t k = 0; k < beside.size(); ++k) {
    if (beside[k] < 0) continue;
    const std::size_t m = of[k], other = static_cast<std::size_t>(beside[k]);
    lost[m] += lost_beside(modulus[m], modulus[other]);
    const double ratio = modulus[other] / modulus[m];
    if (ratio > contrast[m]) contrast[m] = ratio, stiffest[m] = static_cast<double>(other);
  }
  for (std::size_t m = 0; m < n; ++m) {
    const double all = static_cast<double>(team_.sum(cells[m])), ratio = team_.sum(lost[m]) / all;
    const double share = ratio / (1 + ratio);  // thin layers have no cell to lose
    const auto of_all = team_.most({contrast[m]});
    const auto who = team_.most({contrast[m] == of_all.front() ? stiffest[m] : -1.0});
    if (all == 0 || !(share >= least_error)) continue;
    in_.warning(
        *entries[m],
        fmt::format(
            "material '{}' meets '{}', which is {:.3g} times as stiff: smooth functions "
            "carry its stiffness into the softer one, which deforms about {:.0f} % too little, "
            "by its own weight up to twice as much",
            model_.materials[m].name, model_.materials[static_cast<std::size_t>(who.front())].name,
            of_all.front(), 100 * share),
        "\"shape_functions\": \"gimp\", with the border of the two on faces of cells; half the "
        "cell, which halves this error; or a rigid body in place of what hardly deforms");
  }
}

// Springs of foundations follow displacements of particles: those that begin at zero again unload
// them.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_lost_foundations() {
  if (!model_.changes.reset_displacements) return;
  const bool springs = team_.any(!entries_of<NodeSpring>(model_).empty());
  const bool absorbing = team_.any(!entries_of<NodeAbsorption>(model_).empty());
  if (!springs && !absorbing) return;
  in_.warning(
      *root_.find("at_start")->find("reset"),
      fmt::format("{} lose their force where displacements begin at zero again: what they "
                  "hold against a static load settles once more",
                  springs && absorbing ? "springs and absorbing boundaries"
                  : springs            ? "springs"
                                       : "absorbing boundaries"),
      "if they were there before this stage, leave \"displacement\" out of 'reset', and take "
      "the difference to the last frame of the stage before");
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
