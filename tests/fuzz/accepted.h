/// \file What holds of every scenario that was accepted, whatever its tables of bounds say.
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>
#include <variant>

#include "physics/model/model.h"

namespace lahar::fuzz {

/// Throws std::logic_error, which no input may bring about.
inline void require(bool holds, const std::string& what) {
  if (!holds) throw std::logic_error("accepted, though " + what);
}

inline bool is_positive(double value) {
  return std::isfinite(value) && value > 0;
}

inline void check_material(const Material& material) {
  require(is_positive(material.density), "a density is not positive");
  std::visit(
      [](const auto& law) {
        bool none = false;
        if constexpr (requires { law.incompressible; }) none = law.incompressible;
        require(none || is_positive(law.wave_modulus()), "a stiffness is not positive");
        if constexpr (requires { law.viscosity(); })
          require(std::isfinite(law.viscosity()) && law.viscosity() >= 0,
                  "a viscosity is negative");
      },
      material.law);
}

template <int Dim>
void check_model(const Model<Dim>& model) {
  for (const Material& material : model.materials) check_material(material);
  const ParticleTable<Dim>& particles = model.particles;
  for (std::size_t i = 0; i < particles.x.size(); ++i) {
    require(particles.x[i].allFinite(), "a position is not finite");
    require(is_positive(particles.volume[i]), "a volume is not positive");
    require(particles.material[i] < model.materials.size(), "a particle has no material");
    require(is_positive(particles.mass.empty()
                            ? particles.volume[i] * model.materials[particles.material[i]].density
                            : particles.mass[i]),
            "a mass is not positive");
    require(particles.cell[i] >= 0 && particles.cell[i] < model.mesh->n_cells(),
            "a particle is in no cell");
    require(particles.velocity.empty() || particles.velocity[i].allFinite(),
            "a velocity is not finite");
  }
  const Analysis& analysis = model.analysis;
  require(analysis.step.adaptive ? analysis.step.dt > 0 : is_positive(analysis.step.dt),
          "the time step is not positive");
  require(is_positive(analysis.step.safety) && analysis.step.safety <= 1, "the safety is above 1");
  require(analysis.nsteps >= 0 && analysis.first_step >= 0, "a number of steps is negative");
  require(analysis.end_time >= 0, "the end is before the beginning");
  require(analysis.damping >= 0 && analysis.damping <= 1, "the damping is not within [0, 1]");
  require(analysis.contact.friction >= 0, "a friction is negative");
  require(analysis.patch_particles > 0, "patches shall have no particles");
}

}  // namespace lahar::fuzz
