#include "physics/particles/columns.h"

#include <algorithm>

#include "physics/materials/law.h"
#include "physics/model/model.h"
#include "physics/model/transfer_options.h"

namespace lahar {

template <int Dim>
ColumnNeeds column_needs(const Model<Dim>& model, std::span<const char> used, bool stressed) {
  ColumnNeeds needs;
  const Analysis& analysis = model.analysis;
  const ShapeFunctionsRow& functions = row_of(analysis.functions);
  const bool moves_first = maps_velocities_again(analysis);
  needs.size = !model.tractions.empty();
  needs.natural = !model.mesh->is_cartesian() || moves_first;
  needs.affine = analysis.affine != Affine::none;
  needs.domain = functions.domain == ParticleDomain::box;
  needs.next_domain = functions.stretches;
  needs.vectors = functions.domain == ParticleDomain::vectors;
  needs.corners = functions.domain == ParticleDomain::corners;
  needs.next_corners = needs.corners && moves_first;
  needs.strain = stressed || deforms_across(analysis) || model.changes.keeps_strains;
  needs.strain_across = deforms_across(analysis);
  needs.liquid = analysis.two_phase;
  needs.liquid_affine = needs.liquid && needs.affine;
  needs.acceleration = is_implicit(analysis) && !analysis.implicit.quasi_static;
  needs.contact = analysis.rigid_bodies;
  needs.contact_liquid = needs.contact && needs.liquid;
  for (std::size_t m = 0; m < used.size(); ++m) {
    if (!used[m]) continue;
    const Law& law = model.materials[m].law;
    needs.state = std::max(needs.state, static_cast<int>(state_variables(law).size()));
    needs.opening = needs.opening || (analysis.opening && can_open(law));
    needs.strain = needs.strain || !strain_follows_from_stress(law);
  }
  return needs;
}

template ColumnNeeds column_needs<2>(const Model<2>&, std::span<const char>, bool);
template ColumnNeeds column_needs<3>(const Model<3>&, std::span<const char>, bool);

}  // namespace lahar
