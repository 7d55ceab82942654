#include "physics/materials/modified_cam_clay.h"

#include <doctest/doctest.h>

#include "tests/physics/materials/soil_paths.h"
#include "tests/within.h"

using lahar::ModifiedCamClay;
using lahar::Voigt;
using lahar::test::within;
using S = ModifiedCamClay::State;
using Clay = soil::Particle<ModifiedCamClay>;

namespace {

/// The material of the reference's own unit tests, normally consolidated at 200 kPa.
ModifiedCamClay clay(double pc0 = 2e5, double ocr = 1) {
  ModifiedCamClay m{};
  m.youngs_modulus = 1e7;
  m.poisson_ratio = 0.3;
  m.p_ref = 1e5;
  m.e_ref = 1.12;
  m.pc0 = pc0;
  m.ocr = ocr;
  m.m = 1.2;
  m.lambda = 0.1;
  m.kappa = 0.03;
  return m;
}

ModifiedCamClay bonded(double pc0 = 2e5, double ocr = 1) {
  ModifiedCamClay m = clay(pc0, ocr);
  m.bonding = true;
  m.s_h = 0.5;
  m.mc_a = 1e5;
  m.mc_b = 1.6;
  m.mc_c = 4e4;
  m.mc_d = 1;
  m.m_degradation = 5;
  m.m_shear = 2e7;
  return m;
}

const Voigt shear{0.0005, 0.0005, -0.001, 0, 0, 0};

/// Plastic work-free measure of how far a stress is beyond the yield surface, relative to its size.
double excess(const Clay& c) {
  const double size = c.state[S::pc] + c.state[S::pcd] + 2 * c.state[S::pcc];
  return c.state[S::f_function] / (size * size);
}

}  // namespace

namespace {

/// With the void ratio that the reference begins with, which has slopes the other way round.
ModifiedCamClay with_void_ratio_of_reference(ModifiedCamClay m) {
  m.e_ref += (m.lambda - 2 * m.kappa) * std::log(m.ocr);
  return m;
}

}  // namespace

TEST_CASE("Cam-Clay: values frozen in the reference's unit tests") {
  const ModifiedCamClay oc = with_void_ratio_of_reference(clay(3e5, 1.5)), nc = clay();
  Clay elastic(oc, soil::isotropic(2e5));
  CHECK(elastic.state[S::void_ratio] == doctest::Approx(1.0385213287).epsilon(1e-10));
  elastic.strain(shear);
  CHECK(elastic.stress[0] == doctest::Approx(-193727.6266809207).epsilon(1e-12));
  CHECK(elastic.stress[2] == doctest::Approx(-212544.7466381585).epsilon(1e-12));

  Clay plastic(nc, soil::isotropic(2e5));
  plastic.strain(shear);
  CHECK(plastic.stress[0] == doctest::Approx(-192882.4825752268).epsilon(1e-11));
  CHECK(plastic.stress[2] == doctest::Approx(-211655.0108685302).epsilon(1e-11));
  CHECK(plastic.state[S::pc] == doctest::Approx(200368.9146817101).epsilon(1e-11));
  CHECK(plastic.most_parts == 1);

  ModifiedCamClay m = oc;
  m.bonding = true;
  m.s_h = 0.5;
  m.mc_a = m.mc_c = 25000;
  m.m_degradation = 1;
  Clay with_bonds(m, soil::isotropic(2e5));
  with_bonds.strain(shear);
  CHECK(with_bonds.stress[0] == doctest::Approx(-193727.6266809207).epsilon(1e-12));
  CHECK(with_bonds.stress[2] == doctest::Approx(-212544.7466381585).epsilon(1e-12));
  CHECK(with_bonds.state[S::pc] == 3e5);
}

TEST_CASE("Cam-Clay: as CB-Geo MPM, the void ratio changes in plastic increments only") {
  ModifiedCamClay m = clay();
  m.as_cbgeo = true;
  Clay c(m, soil::isotropic(2e5));
  const double e0 = c.state[S::void_ratio], K = 2e5 * (1 + e0) / m.kappa;
  c.strain({1e-3, 1e-3, 1e-3, 0, 0, 0});
  CHECK(c.state[S::void_ratio] == e0);
  CHECK(c.p() == doctest::Approx(2e5 - K * 3e-3).epsilon(1e-12));
  c.strain({-2e-3, -2e-3, -2e-3, 0, 0, 0});
  CHECK(c.state[S::pvstrain] > 0);
  CHECK(c.state[S::void_ratio] == doctest::Approx(e0 - (1 + e0) * 6e-3).epsilon(1e-12));
  // Its initial moduli, exchanged.
  Clay free(m, soil::isotropic(0));
  CHECK(free.state[S::bulk_modulus] == doctest::Approx(3846153.846).epsilon(1e-9));
  CHECK(free.state[S::shear_modulus] == doctest::Approx(4615384.61538462).epsilon(1e-9));
}

TEST_CASE("Cam-Clay: swelling follows de = -kappa ln(p / p0)") {
  const ModifiedCamClay m = clay();
  for (const int n : {1000, 10000}) {
    Clay c(m, soil::isotropic(2e5));
    const double e0 = c.state[S::void_ratio];
    c.strain({0.006, 0.006, 0.006, 0, 0, 0}, n);
    const double swelling = -m.kappa * std::log(c.p() / 2e5);
    // Moduli of the beginning of a step: the error is its change of p, halved.
    CHECK(c.state[S::void_ratio] - e0 == within(n == 1000 ? 7e-4 : 7e-5, swelling));
    CHECK(c.state[S::pvstrain] == 0);
  }
}

TEST_CASE("Cam-Clay: virgin compression follows de = -lambda ln(p / p0)") {
  const ModifiedCamClay m = clay();
  Clay c(m, soil::isotropic(2e5));
  const double e0 = c.state[S::void_ratio];
  c.strain({-0.01, -0.01, -0.01, 0, 0, 0}, 3000);
  CHECK(e0 - c.state[S::void_ratio] == within(1e-3, m.lambda * std::log(c.p() / 2e5)));
  CHECK(c.p() == doctest::Approx(c.state[S::pc]).epsilon(1e-9));
}

TEST_CASE("Cam-Clay: undrained triaxial compression of normally consolidated clay") {
  const ModifiedCamClay m = clay();
  double before = 0;
  for (const int n : {2000, 4000, 8000}) {  // of 1e-4, 5e-5, 2.5e-5
    Clay c(m, soil::isotropic(2e5));
    double worst = 0;
    for (int i = 0; i < n; ++i) {
      c.strain({0.1 / n, 0.1 / n, -0.2 / n, 0, 0, 0});
      const double eta = c.q() / c.p(), M2 = m.m * m.m;
      const double exact = 2e5 * std::pow(M2 / (M2 + eta * eta), 1 - m.kappa / m.lambda);
      worst = std::max(worst, std::abs(c.p() / exact - 1));
    }
    CHECK(worst < 0.32 / n);
    if (before > 0) CHECK(before / worst == within(0.05, 2));
    before = worst;
    CHECK(c.p() == within(2e-4, 2e5 * std::pow(2, m.kappa / m.lambda - 1)));
    CHECK(c.q() == doctest::Approx(m.m * c.p()).epsilon(1e-9));
    CHECK(c.most_parts == 1);
  }
}

TEST_CASE("Cam-Clay: undrained, over-consolidated: p stays until the ellipse is met") {
  const ModifiedCamClay m = clay(3e5, 1.5);
  Clay c(m, soil::isotropic(2e5));
  const double q_yield = m.m * std::sqrt(2e5 * (3e5 - 2e5));
  double q = 0;
  while (c.state[S::pdstrain] == 0) {
    q = c.q();
    CHECK(c.p() == doctest::Approx(2e5).epsilon(1e-12));
    c.strain({5e-6, 5e-6, -1e-5, 0, 0, 0});
  }
  CHECK(q == within(2e-3, q_yield));
  CHECK(c.q() == within(2e-3, q_yield));
}

TEST_CASE("Cam-Clay: drained triaxial compression ends at p = 3 p0 / (3 - M)") {
  for (const double p0 : {2e5, 1.5e5, 0.5e5}) {  // normally and over-consolidated, the last softens
    const ModifiedCamClay m = clay(2e5, 2e5 / p0);
    Clay c(m, soil::isotropic(p0));
    const double e_ncl = c.state[S::void_ratio] + m.lambda * std::log(2e5) -
                         m.kappa * std::log(2e5 / p0);  // at 1 Pa, before: on the swelling line
    CHECK(e_ncl == doctest::Approx(m.e_ref + m.lambda * std::log(m.p_ref)).epsilon(1e-12));
    soil::drained(c, 0.2, 2000);
    CHECK(c.p() == within(0.01, 3 * p0 / (3 - m.m)));
    CHECK(c.q() == within(0.015, m.m * c.p()));
    // The critical state line lies (lambda - kappa) ln 2 below that of normal consolidation.
    const double e_critical =
        e_ncl - (m.lambda - m.kappa) * std::log(2) - m.lambda * std::log(c.p());
    CHECK(c.state[S::void_ratio] == within(2e-3, e_critical));
    soil::drained(c, 0.5, 5000);
    CHECK(c.p() == within(1e-4, 3 * p0 / (3 - m.m)));
    CHECK(c.q() == within(1e-4, m.m * c.p()));
    CHECK(c.state[S::void_ratio] ==
          within(5e-4, e_ncl - (m.lambda - m.kappa) * std::log(2) - m.lambda * std::log(c.p())));
  }
}

TEST_CASE("Cam-Clay: three invariants: strength in compression and extension") {
  ModifiedCamClay m = clay();
  m.three_invariants = true;
  Clay compression(m, soil::isotropic(2e5)), extension = compression, plane = compression;
  compression.strain({0.1, 0.1, -0.2, 0, 0, 0}, 2000);
  extension.strain({-0.1, -0.1, 0.2, 0, 0, 0}, 2000);
  plane.strain({0.2, 0, -0.2, 0, 0, 0}, 2000);
  CHECK(compression.q() / compression.p() == doctest::Approx(m.m).epsilon(1e-8));
  CHECK(extension.q() / extension.p() == doctest::Approx(3 * m.m / (3 + m.m)).epsilon(1e-7));
  // Radial flow: without volume change in plane strain the intermediate stress is the mean.
  CHECK(plane.invariants().theta == within(1e-6, std::numbers::pi / 6));
  CHECK(plane.q() / plane.p() == doctest::Approx(plane.state[S::m_theta]).epsilon(1e-8));
  m.three_invariants = false;
  Clay circle(m, soil::isotropic(2e5));
  circle.strain({-0.1, -0.1, 0.2, 0, 0, 0}, 2000);
  CHECK(circle.q() / circle.p() == doctest::Approx(m.m).epsilon(1e-8));
}

TEST_CASE("Cam-Clay: bonds of no strength, and bonds that are lost, leave plain Cam-Clay") {
  ModifiedCamClay none = bonded();
  none.mc_a = none.mc_c = none.m_shear = 0;
  const ModifiedCamClay plain_law = clay(), bonded_law = bonded();
  Clay plain(plain_law, soil::isotropic(2e5)), weak(none, soil::isotropic(2e5));
  soil::Random random;
  for (int i = 0; i < 200; ++i) {
    const Voigt increment = random.strain(5e-4);
    plain.strain(increment);
    weak.strain(increment);
    CHECK(lahar::distance(plain.stress, weak.stress) < 1e-12 * plain.state[S::pc]);
  }
  Clay bonds(bonded_law, soil::isotropic(2e5));
  bonds.strain({0.5, 0.5, -1.0, 0, 0, 0}, 10000);
  CHECK(bonds.state[S::chi] < 1e-2);
  CHECK(bonds.q() / (bonds.p() + bonds.state[S::pcc]) == within(0.01, 1.2));
}

TEST_CASE("Cam-Clay: bonds strengthen and stiffen, and only ever degrade") {
  const ModifiedCamClay law = bonded();
  Clay c(law, soil::isotropic(2e5));
  const double pcd = 1e5 * std::pow(0.5, 1.6), pcc = 2e4,
               K = 2e5 * (1 + c.state[S::void_ratio]) / 0.03;
  CHECK(c.state[S::pcd] == doctest::Approx(pcd));
  CHECK(c.state[S::pcc] == doctest::Approx(pcc));
  CHECK(c.state[S::shear_modulus] ==
        doctest::Approx(K * 3 * 0.4 / 2.6 + law.m_shear * 0.5).epsilon(1e-12));
  // Isotropic compression: elastic up to pc + pcd + pcc, and no degradation even beyond.
  while (c.state[S::pvstrain] == 0) c.strain({-1e-5, -1e-5, -1e-5, 0, 0, 0});
  CHECK(c.p() == within(2e-3, 2e5 + pcd + pcc));
  c.strain({-1e-3, -1e-3, -1e-3, 0, 0, 0}, 100);
  CHECK(c.state[S::chi] == doctest::Approx(1).epsilon(1e-12));
  soil::Random random;
  for (int i = 0; i < 2000; ++i) {
    const double chi = c.state[S::chi], sum = c.state[S::pdstrain];
    c.strain(random.strain(i % 2 ? 1e-3 : 1e-5));
    CHECK(c.state[S::chi] <= chi);
    CHECK(c.state[S::chi] >= 0);
    CHECK(c.state[S::chi] == doctest::Approx(std::exp(-law.m_degradation * c.state[S::pdstrain])));
    if (c.state[S::pdstrain] == sum) CHECK(c.state[S::chi] == chi);
    CHECK(excess(c) < 1e-9);
  }
}

TEST_CASE("Cam-Clay: the subloading surface") {
  ModifiedCamClay m = clay(4e5, 2), plain_law = clay(4e5, 2);
  m.subloading = true;
  m.subloading_u = 20;
  Clay c(m, soil::isotropic(2e5));
  CHECK(c.state[S::subloading_r] == doctest::Approx(0.5));
  // Plastic strain inside of the yield surface; R grows with it, and falls in unloading.
  double R = c.state[S::subloading_r];
  for (int i = 0; i < 300; ++i) {
    c.strain({5e-5, 5e-5, -1e-4, 0, 0, 0});
    CHECK(c.state[S::subloading_r] >= R);
    R = c.state[S::subloading_r];
    CHECK(std::abs(excess(c)) < 1e-9);
  }
  CHECK(R > 0.6);
  CHECK(R < 1);
  CHECK(c.state[S::pdstrain] > 1e-3);
  const double sum = c.state[S::pdstrain];
  c.strain({-5e-5, -5e-5, 1e-4, 0, 0, 0}, 10);
  CHECK(c.state[S::subloading_r] < R);
  CHECK(c.state[S::pdstrain] == sum);
  c.strain({0.25, 0.25, -0.5, 0, 0, 0}, 5000);
  CHECK(c.q() / c.p() == within(1e-3, m.m));
  CHECK(c.state[S::subloading_r] <= 1);

  // Fast growth: no plastic strain before the yield surface, plain Cam-Clay.
  m.subloading_u = 1e6;
  Clay fast(m, soil::isotropic(2e5)), plain(plain_law, soil::isotropic(2e5));
  for (int i = 0; i < 2000; ++i) {
    fast.strain({5e-6, 5e-6, -1e-5, 0, 0, 0});
    plain.strain({5e-6, 5e-6, -1e-5, 0, 0, 0});
    CHECK(lahar::distance(fast.stress, plain.stress) < 2e-3 * plain.p());
  }
}

TEST_CASE("Cam-Clay: a rotated path has the rotated stress") {
  ModifiedCamClay m = bonded();
  m.three_invariants = m.subloading = true;
  m.subloading_u = 30;
  const Voigt start{-1.5e5, -2e5, -1.2e5, 1e4, -2e4, 5e3};
  CHECK(soil::rotation_error(m, start, 2e-4, 50, 2e5) < 1e-9);
  CHECK(soil::rotation_error(clay(), start, 2e-4, 50, 2e5) < 1e-9);
}

TEST_CASE("Cam-Clay: a split increment converges with first order") {
  ModifiedCamClay m = bonded();
  m.three_invariants = m.subloading = true;
  m.subloading_u = 30;
  const Voigt increment{1e-3, 4e-4, -2e-3, 1e-3, 0, -5e-4};
  for (const ModifiedCamClay& law : {clay(), m}) {
    const Clay start(law, soil::isotropic(1.99e5));
    CHECK(soil::order_when_split(start, increment, 64) == within(0.05, 1));
  }
}

TEST_CASE("Cam-Clay: any increment converges, to a state that is allowed and bounded") {
  ModifiedCamClay all = bonded(3e5, 1.5);
  all.three_invariants = all.subloading = true;
  all.subloading_u = 10;
  soil::Random random;
  for (const ModifiedCamClay& law : {clay(3e5, 1.5), bonded(3e5, 1.5), all})
    for (const double size : {1e-6, 1e-4, 1e-2}) {
      Clay c(law, soil::isotropic(2e5));
      for (int i = 0; i < 1000; ++i) {
        c.strain(random.strain(size));
        REQUIRE(excess(c) < 1e-8);
        REQUIRE(c.p() >= -c.state[S::pcc] - 1e-9 * c.state[S::pc]);
        REQUIRE(c.state[S::pc] >= ModifiedCamClay::least_pc * law.pc0);
        REQUIRE(c.state[S::void_ratio] > -1);
        REQUIRE((c.state[S::subloading_r] > 0 && c.state[S::subloading_r] <= 1));
      }
    }
}

TEST_CASE("Cam-Clay: torn apart it has no stress, pressed together again it has") {
  const ModifiedCamClay m = clay();
  Clay c(m, soil::isotropic(2e5));
  c.strain({0.05, 0.05, 0.05, 0, 0, 0}, 1000);
  CHECK(c.p() >= 0);
  CHECK(c.p() < 1e3);
  c.strain({-0.2, -0.2, -0.2, 0, 0, 0}, 4000);
  CHECK(c.p() > 1e5);
  // A body without initial stress: E and nu until there is pressure.
  Clay free(m, soil::isotropic(0));
  free.strain({-1e-6, -1e-6, -1e-6, 0, 0, 0});
  CHECK(free.p() == doctest::Approx(3e-6 * 1e7 / (3 * 0.4)).epsilon(1e-12));
}

TEST_CASE("Cam-Clay: parameters that exclude each other are named") {
  CHECK(clay().problem() == "");
  CHECK(bonded().problem() == "");
  ModifiedCamClay m = clay();
  m.kappa = m.lambda;
  CHECK(m.problem() == "kappa must be less than lambda");
  m = clay(2e5, 0.5);
  CHECK(m.problem() == "ocr must be at least 1");
  m = clay();
  m.e_ref = 0.01;
  CHECK(m.problem().find("void ratio that is not positive") != std::string::npos);
  m = clay();
  m.subloading = true;
  CHECK(m.problem() == "\"subloading\": true needs subloading_u");
  m = bonded();
  m.s_h = 0;
  CHECK(m.problem() == "s_h must be more than 0 and at most 1");
  m.mc_b = std::nan("");
  CHECK(m.problem() == "\"bonding\": true needs mc_b");
}
