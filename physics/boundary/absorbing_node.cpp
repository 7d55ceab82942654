#include "physics/boundary/absorbing_node.h"

#include "physics/base/node_vector.h"

namespace lahar {

template <int Dim>
void AbsorbingNode<Dim>::set(const double* displacement, const double* waves) {
  const double per_mass = 1.0 / waves[mass_lane];
  const double c_p = waves[0] * per_mass, c_s = waves[1] * per_mass, rho = waves[2] * per_mass;
  for (int d = 0; d < Dim; ++d) {
    const double c = d == normal ? c_p : c_s;
    dashpot[d] = area * rho * (d == normal ? a : b) * c;
    spring[d] = area * rho * c * c / delta * (displacement[d] * per_mass);
  }
  drag.setZero();
}

template <int Dim>
void AbsorbingNode<Dim>::release() {
  spring.setZero();
  dashpot.setZero();
  drag.setZero();
}

template struct AbsorbingNode<2>;
template struct AbsorbingNode<3>;

}  // namespace lahar
