/// \file Rows that follow from columns of particles with a liquid in their pores, of some bins.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "physics/base/simd.h"
#include "physics/materials/pore_liquid.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Rows as long as those of particles, which kernels take in place of columns. They are a buffer of
/// the thread: those of a chunk stay in its cache.
template <int Rows>
std::array<double*, Rows> pore_rows(Local slots) {
  static thread_local std::array<std::vector<double>, Rows> rows;
  std::array<double*, Rows> begin;
  for (std::size_t k = 0; k < Rows; ++k) {
    // One vector more than slots may be read. What is there must be finite.
    const auto size = static_cast<std::size_t>(slots + lanes<Pack>);
    if (rows[k].size() < size) rows[k].assign(size, 0.0);
    begin[k] = rows[k].data();
  }
  return begin;
}

/// Whether the particles of a bin have a liquid in their pores.
template <int Dim>
auto has_liquid(const Model<Dim>& model) {
  return
      [&model](const ParticleBin& bin) { return model.materials[bin.material].liquid.has_value(); };
}

/// Call fill(pores or null, p, n) for packs of the particles of each bin, n of them from p on.
template <int Dim, class Fill>
void for_each_pore_pack(const Model<Dim>& model, ParticleBins bins, Fill fill) {
  for (const ParticleBin& bin : bins) {
    const auto& liquid = model.materials[bin.material].liquid;
    std::optional<Pores> pores;
    if (liquid) pores.emplace(*liquid);
    for (Local p = bin.begin; p < bin.end; p += lanes<Pack>)
      fill(pores ? &*pores : nullptr, p, bin.end - p);
  }
}

/// Porosity of the particles of a bin together [-]. Pressures that come from strains which the
/// particles of a cell have in common need a porosity that they have in common: of each alone,
/// small differences of the porosity times the discharge would add up to pressures.
template <int Dim>
double mean_porosity(const Patch<Dim>& patch, const Pores& pores, const ParticleBin& bin) {
  const double* m = patch.particles.row(Column::mass);
  const double* V = patch.particles.row(Column::volume);
  double mass = 0, volume = 0;
  for (Local p = bin.begin; p < bin.end; ++p) mass += m[p], volume += V[p];
  return pores.porosity(Scalar(mass), Scalar(volume))[0];
}

/// Liquid mass [kg] of the particles of some bins, zero where pores hold none.
template <int Dim>
void fill_liquid_mass(const Patch<Dim>& patch, const Model<Dim>& model, ParticleBins bins,
                      double* to) {
  const double* m = patch.particles.row(Column::mass);
  const double* V = patch.particles.row(Column::volume);
  for_each_pore_pack(model, bins, [&](const Pores* pores, Local p, Local n) {
    const Pack mass = pores ? pores->liquid_mass(load<Pack>(m + p), load<Pack>(V + p)) : Pack(0.0);
    store_first(mass, to + p, n);
  });
}

}  // namespace lahar
