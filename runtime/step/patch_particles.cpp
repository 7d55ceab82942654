#include "runtime/step/patch_particles.h"

#include "physics/particles/patch.h"

namespace lahar {

template <int Dim>
PatchParticles particles_in_place(const Patch<Dim>& patch) {
  const Particles<Dim>& all = patch.particles;
  PatchParticles shown;
  shown.patch = patch.topology.patch;
  shown.id = all.id;
  shown.material = all.material;
  for (const ParticleBin& bin : patch.bins) shown.bins.emplace_back(bin.begin, bin.end);
  for (const ColumnInfo& info : column_table) {
    if (!all.layout().has(info.column)) continue;
    const int n = all.layout().components(info);
    const double* first = all.row(info.column);
    const std::size_t stride =
        n > 1 ? static_cast<std::size_t>(all.row(info.column, 1) - first) : all.id.size();
    shown.columns.push_back({info.name, info.unit, n, first, stride});
  }
  return shown;
}

template PatchParticles particles_in_place<2>(const Patch<2>&);
template PatchParticles particles_in_place<3>(const Patch<3>&);

}  // namespace lahar
