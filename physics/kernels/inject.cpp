/// \file Particles that come into the model at the beginning of a step.
#include <algorithm>
#include <cmath>

#include "physics/kernels/kernels.h"
#include "physics/materials/law.h"
#include "physics/mesh/inverse_mapping.h"
#include "physics/particles/loads.h"
#include "physics/particles/particle_domain.h"

namespace lahar {

namespace {

/// True if no body has a particle in this cell.
template <int Dim>
bool is_empty(const Patch<Dim>& patch, Local cell) {
  const std::size_t cells = patch.topology.cells.size() / patch.bodies();
  for (std::size_t c = static_cast<std::size_t>(cell) % cells; c < patch.first_bin.size();
       c += cells)
    for (Local r = patch.first_bin[c]; r >= 0;) {
      const ParticleBin& bin = patch.bins[static_cast<std::size_t>(r)];
      if (bin.begin < bin.end) return false;
      r = bin.next;
    }
  return true;
}

/// State variables of a material that has seen nothing yet.
template <int Dim>
void set_law_state(Particles<Dim>& to, const Law& law) {
  if (!to.layout().has(Column::state)) return;
  std::vector<double> state(state_variables(law).size());
  initial_state(law, Voigt{}, state.data());
  for (std::size_t k = 0; k < state.size(); ++k)
    std::fill_n(to.row(Column::state, static_cast<int>(k)), to.size(), state[k]);
}

/// For a point inside a cell.
template <int Dim>
Vec<Dim> natural_coordinates(const Patch<Dim>& patch, const Mesh<Dim>& mesh, Local cell,
                             const Vec<Dim>& x) {
  const auto c = static_cast<std::size_t>(cell);
  if (!patch.cartesian)
    return mesh.natural_coordinates(patch.topology.cells[c], x).value_or(Vec<Dim>::Zero());
  Vec<Dim> xi;
  for (std::size_t d = 0; d < Dim; ++d) xi[d] = (x[d] - patch.box[c][d]) * patch.box[c][Dim + d];
  return clamp_to_cell<Dim>(xi);
}

/// The particles of one event: at rest in their cell but for the velocity, without stress.
template <int Dim>
void make_particles(const InjectionCell& at, const Patch<Dim>& patch, const StepContext<Dim>& step,
                    Particles<Dim>& to) {
  const Model<Dim>& model = *step.model;
  const Injection<Dim>& source = model.injections[at.generator];
  const InjectionCounts counts = count_injections(model.injections);
  const std::uint64_t loads = loads_of_all(model);
  const bool has_size = to.layout().has(Column::size), has_xi = to.layout().has(Column::xi),
             with_domain = has_domain(to.layout()), has_liquid = to.layout().has(Column::liquid_v);
  to.resize(0);  // what is not set below is zero
  to.resize(static_cast<Local>(source.per_cell));
  if (loads != 0) to.loads.assign(static_cast<std::size_t>(source.per_cell), loads);
  set_law_state(to, model.materials[source.material].law);
  for (Local p = 0; p < to.size(); ++p) {
    const auto i = static_cast<std::size_t>(p);
    const Vec<Dim>& x = patch.injection_points[at.first_point + i];
    const double depth = depth_at(model.analysis, x[0]), volume = at.volume * depth;
    const double edge = std::pow(at.volume, 1.0 / Dim);
    to.id[i] = counts.id(step.step, at.event, p);
    to.material[i] = source.material;
    to.row(Column::volume)[p] = volume;
    to.row(Column::mass)[p] = volume * model.materials[source.material].density;
    for (int d = 0; d < Dim; ++d) {
      if (has_size) to.row(Column::size, d)[p] = edge;
      to.row(Column::x, d)[p] = x[d];
      to.row(Column::v, d)[p] = source.velocity[d];
      if (has_liquid) to.row(Column::liquid_v, d)[p] = source.velocity[d];
    }
    if (with_domain)
      set_domain(to, p, patch.box[static_cast<std::size_t>(at.cell)], depth,
                 model.analysis.cbgeo_domains ? source.per_cell : 0);
    if (!has_xi) continue;
    const Vec<Dim> xi = natural_coordinates(patch, *model.mesh, at.cell, x);
    for (int d = 0; d < Dim; ++d) to.row(Column::xi, d)[p] = xi[d];
  }
}

}  // namespace

template <int Dim>
void inject(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.injection_cells.empty()) return;
  Particles<Dim> fresh(patch.particles.layout());
  for (const InjectionCell& at : patch.injection_cells) {
    const Injection<Dim>& source = step.model->injections[at.generator];
    if (!source.active(step.time) || !is_empty(patch, at.cell)) continue;
    make_particles(at, patch, step, fresh);
    place_new(patch, fresh, at.cell);
    patch.injected.push_back(at.event);
    // Their kinetic energy comes from outside.
    double depth = 0;  // of all of them
    for (Index i = 0; i < source.per_cell; ++i)
      depth += depth_at(step.model->analysis,
                        patch.injection_points[at.first_point + static_cast<std::size_t>(i)][0]);
    patch.work.external += 0.5 * depth * at.volume *
                           step.model->materials[source.material].density *
                           source.velocity.squaredNorm();
  }
}

/// As time_step_limit(), of particles as make_particles() makes them.
template <int Dim>
double injection_limit(const Patch<Dim>& patch, std::size_t generator, const Model<Dim>& model) {
  const Injection<Dim>& injection = model.injections[generator];
  const Material& material = model.materials[injection.material];
  const double speed = wave_speed(material) + injection.velocity.norm();
  const double diffusion = 2.0 * Dim * viscosity(material.law) / material.density;
  double limit = std::numeric_limits<double>::infinity();
  for (const InjectionCell& at : patch.injection_cells) {
    if (at.generator != generator) continue;
    const double h = patch.cell_size[static_cast<std::size_t>(at.cell)];
    limit = std::min(limit, 1.0 / std::max(speed / h, diffusion / (h * h)));
  }
  return limit;
}

#define LAHAR_INSTANTIATE(Dim)                                     \
  template void inject<Dim>(Patch<Dim>&, const StepContext<Dim>&); \
  template double injection_limit<Dim>(const Patch<Dim>&, std::size_t, const Model<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)

}  // namespace lahar
