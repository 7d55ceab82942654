// Mohr-Coulomb against the stresses that CB-Geo MPM's own unit tests hold for single increments
// (github.com/cb-geo/mpm, tests/materials/mohr_coulomb_test.cc at e1cf08c5).
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "physics/materials/law.h"

using namespace lahar;

namespace {

MohrCoulomb soil(double friction, double dilation) {
  MohrCoulomb m{};
  m.youngs_modulus = 1e7;
  m.poisson_ratio = 0.3;
  m.friction = friction;
  m.dilation = dilation;
  m.cohesion = 2000;
  return m;
}

MohrCoulomb softening_soil() {
  MohrCoulomb m = soil(30, 15);
  m.softening = true;
  m.residual_cohesion = 1000;
  m.residual_pdstrain = 1e-3;
  return m;
}

struct Published {
  std::string name;
  MohrCoulomb law;
  Voigt stress, strain, expected;
  double pdstrain = 0;  ///< before the increment
  double expected_pdstrain = -1;
};

// Six from inside of the yield surface, five from it or within 0.1 Pa of it; stresses [Pa], xx yy
// zz xy yz xz.
const Published table[] = {
    {"cohesion, shear",
     soil(0, 0),
     {-5000, -6000, -7000, -1000, 0, 0},
     {-1e-3, 0, 0, 0, 0, 0},
     {-16697.4520573296, -12864.9366103543, -13437.6113323161, -572.6747219618, 0, 0}},
    {"cohesion, tension",
     soil(0, 0),
     {-5000, -6000, -7000, -1000, 0, 0},
     {1e-3, 0, 0, 0, 0, 0},
     {-920.7979744249, -4207.8691181054, -4877.8540405517, -378.1586271491, 0, 0}},
    {"friction, shear",
     soil(30, 0),
     {-5000, -6000, -7000, -1000, 0, 0},
     {1e-4, 0, 0, 2e-3, 0, 0},
     {-4615.3075306146, -5748.3019110924, -5136.390558293, 4285.6743957206, 0, 0}},
    {"friction, tension",
     soil(30, 0),
     {-5000, -6000, -7000, -1000, 0, 0},
     {1e-3, 0, 0, 0, 0, 0},
     {-58.2831643542, -4519.4698892777, -5428.76807945, -513.2338710089, 0, 0}},
    {"dilation, shear",
     soil(30, 15),
     {-5000, -6000, -7000, -1000, 0, 0},
     {1e-4, 0, 0, 2e-3, 0, 0},
     {-5508.1587191762, -6766.3597033789, -6471.6605527693, 4759.2819837233, 0, 0}},
    {"dilation, tension",
     soil(30, 15),
     {-5000, -6000, -7000, -1000, 0, 0},
     {1e-3, 0, 0, 0, 0, 0},
     {-58.2831643542, -4519.4698892777, -5428.76807945, -513.2338710089, 0, 0}},
    {"cohesion, from the surface to the edge",
     soil(0, 0),
     {-2000, -5000, -6000, 0, 0, 0},
     {1e-3, 0, 0, 0, 0, 0},
     {0, -1348.42814081, -488.58203346, 0, 0, 0}},
    {"friction, from the surface",
     soil(30, 0),
     {-1000, -7000, -9928.20323028, 0, 0, 0},
     {1e-4, 0, 0, 1e-3, 0, 0},
     {-1790.7690510275, -5719.5499679831, -7917.8842112694, 2805.9964832764, 0, 0}},
    {"six components",
     softening_soil(),
     {-1000, -6000, -9293, -600, -700, -800},
     {1e-4, 0, 0, 1e-3, 2e-4, 3e-4},
     {-1586.3024514519, -5772.7074804481, -8553.2117176438, 2321.1100892241, 38.1040241342,
      267.5707659057},
     0,
     0.0002112522},
    {"while it softens",
     softening_soil(),
     {-5000, -6000, -6000, -3674.5, -1000, -2000},
     {5e-4, -5e-4, 0, 1e-4, 2e-4, 3e-4},
     {-3505.5428972498, -9698.6386632491, -6103.8408725349, -2407.3321062492, -282.7379093982,
      -549.7637416201},
     0.00011976829482,
     0.0003546242},
    {"when it has softened",
     softening_soil(),
     {-5000, -6000, -6853, -100, -200, -300},
     {1e-4, 0, 0, 1e-4, 2e-4, 3e-4},
     {-4206.8535416451, -5293.085016198, -5853.0614421569, 149.2284505527, 298.4569011055,
      447.6853516582},
     0.00244948974278,
     0.0025425174},
};

/// Largest difference from the published stress [Pa]; `state` has the state after the increment.
double difference(const Published& p, bool as_cbgeo, double* state) {
  MohrCoulomb law = p.law;
  law.as_cbgeo = as_cbgeo;
  Voigt stress = p.stress;
  law.initial_state(stress.data(), state);
  state[6] = p.pdstrain;
  REQUIRE(update_in_parts(prepare(law), Increment{p.strain, 1e-4, 0}, stress, state) == 1);
  double off = 0;
  for (std::size_t k = 0; k < 6; ++k) off = std::max(off, std::abs(stress[k] - p.expected[k]));
  return off;
}

}  // namespace

TEST_CASE("Mohr-Coulomb as CB-Geo MPM: stresses and plastic strains frozen in its unit tests") {
  for (const Published& p : table) {
    CAPTURE(p.name);
    double state[7]{};
    CHECK(difference(p, true, state) < 1e-8);  // they have ten digits after the point, or eight
    if (p.expected_pdstrain >= 0) CHECK(std::abs(state[6] - p.expected_pdstrain) < 1e-10);
  }
}

TEST_CASE("Mohr-Coulomb to rounding: the same but for stresses near the yield surface") {
  for (const Published& p : table) {
    CAPTURE(p.name);
    double state[7]{};
    const double off = difference(p, false, state);
    // Those that begin 0.03 to 0.09 Pa from the surface are on it for CB-Geo MPM, whose first step
    // then is along the tangent there. Here they are not: the return is from the trial stress.
    const bool near_surface = p.expected_pdstrain >= 0;
    if (near_surface)
      CHECK((off > 10 && off < 60));
    else
      CHECK(off < 1e-8);
  }
}
