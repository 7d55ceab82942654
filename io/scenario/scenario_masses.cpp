// Masses that no particle can have, though volume and density are numbers each.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "io/scenario/scenario_builder.h"

namespace lahar {

template <int Dim>
void ScenarioBuilder<Dim>::check_masses() {
  // Where there are problems already, volumes and materials may be missing.
  if (team_.any(!mesh_ || !in_.problems.empty())) return;
  const ParticleTable<Dim>& p = model_.particles;
  constexpr double none = -std::numeric_limits<double>::infinity();
  double first = none, total = 0;  // minus the id of the first one, so that the largest counts
  for (const auto& range : rows_.own_ranges())
    for (Index row = range.first; row < range.end; ++row) {
      const auto i = static_cast<std::size_t>(range.local + row - range.first);
      const double mass = p.volume[i] * model_.materials[p.material[i]].density;
      total += mass;
      if (!(mass > 0) || !std::isfinite(mass)) first = std::max(first, -static_cast<double>(row));
    }
  const std::vector<double> worst = team_.most(std::vector<double>{first, total});
  const char* hint =
      "the volume is that of its cell over the number of particles in it, or from "
      "mesh.particles_volumes; lengths are in m, densities in kg/m^3";
  if (worst[0] > none)
    in_.error(section("mesh"),
              fmt::format("the mass of particle {:.0f}, its volume times the density of its "
                          "material, must be a finite number above 0",
                          -worst[0]),
              hint);
  else if (!std::isfinite(worst[1]))
    in_.error(section("mesh"), "the mass of all particles together must be a finite number", hint);
}

template void ScenarioBuilder<2>::check_masses();
template void ScenarioBuilder<3>::check_masses();

}  // namespace lahar
