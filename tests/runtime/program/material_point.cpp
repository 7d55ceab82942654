// A material point along paths whose end is known: strengths in closed form, and what `lahar
// material` makes of an input.
#include "runtime/program/material_point.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "physics/base/error.h"
#include "physics/materials/law.h"
#include "runtime/program/material_command.h"
#include "tests/physics/materials/material_samples.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double radian = std::numbers::pi / 180;

/// The state at the end of a test: `strain` of zz in equal steps, the stress of xx and yy constant.
MaterialPoint triaxial(const Law& law, double pressure, double strain, int steps = 200) {
  MaterialPoint point(law, {-pressure, -pressure, -pressure, 0, 0, 0});
  Voigt increment{};
  for (int i = 0; i < steps; ++i) {
    increment[2] = strain / steps;
    REQUIRE(point.load_by(increment, {true, true, false, false, false, false},
                          {-pressure, -pressure, 0, 0, 0, 0}, 1.0));
  }
  return point;
}

double relative(double found, double expected) {
  return std::abs(found / expected - 1);
}

MohrCoulomb soil(double friction, double cohesion, double tension) {
  return {.youngs_modulus = 1e7,
          .poisson_ratio = 0.3,
          .friction = friction,
          .dilation = friction / 4,
          .cohesion = cohesion,
          .tension_cutoff = tension};
}

}  // namespace

TEST_CASE("Mohr-Coulomb bears 2 c cos(phi) / (1 - sin(phi)) in uniaxial compression") {
  for (const double phi : {0.0, 20.0, 35.0, 45.0}) {
    CAPTURE(phi);
    const double c = 3000, s = std::sin(phi * radian), k = std::cos(phi * radian);
    const MaterialPoint point = triaxial(soil(phi, c, 100), 0, -0.02);
    CHECK(relative(-point.stress()[2], 2 * c * k / (1 - s)) < 1e-8);
    CHECK(point.divided() == 0);
    // The sides are on the limit of tension where that is zero.
    const MaterialPoint without = triaxial(soil(phi, c, 0), 0, -0.02);
    CHECK(relative(-without.stress()[2], 2 * c * k / (1 - s)) < 1e-8);
    for (const std::size_t side : {0u, 1u})
      CHECK(relative(without.strain()[side], point.strain()[side]) < 1e-8);
  }
}

TEST_CASE("Mohr-Coulomb's strengths in triaxial compression and extension") {
  for (const double phi : {15.0, 30.0, 42.0})
    for (const double pressure : {2e4, 1e5, 1e6}) {
      CAPTURE(phi);
      CAPTURE(pressure);
      const double c = 2000, s = std::sin(phi * radian), k = std::cos(phi * radian);
      for (const double sign : {-1.0, 1.0}) {
        const MaterialPoint point = triaxial(soil(phi, c, 0), pressure, sign * 0.5);
        const double p = mean_pressure(point.stress()), q = deviatoric_stress(point.stress());
        // q = (6 sin / (3 -+ sin)) p + 6 c cos / (3 -+ sin): compression, extension
        const double below = 3 + sign * s;
        CHECK(relative(q, (6 * s * p + 6 * c * k) / below) < 1e-8);
      }
    }
}

TEST_CASE("Mohr-Coulomb's tension is cut off, at the apex too") {
  const double phi = 30, c = 2000, apex = c / std::tan(phi * radian);
  for (const double tension : {0.0, 0.3 * apex, apex}) {
    CAPTURE(tension);
    MaterialPoint point(soil(phi, c, tension), {-1e4, -1e4, -1e4, 0, 0, 0});
    for (int i = 0; i < 100; ++i) REQUIRE(point.strain_by({1e-4, 1e-4, 1e-4, 0, 0, 0}, 1));
    for (std::size_t k = 0; k < 6; ++k)
      CHECK(std::abs(point.stress()[k] - (k < 3 ? tension : 0)) < 1e-8 * apex);
  }
  const MaterialPoint pulled = triaxial(soil(phi, c, 500), 0, 0.02);
  CHECK(relative(pulled.stress()[2], 500) < 1e-8);
}

TEST_CASE("Mohr-Coulomb softens to its residual strength, with state variables that say so") {
  MohrCoulomb law = soil(35, 4000, 0);
  law.softening = true;
  law.residual_friction = 25;
  law.residual_dilation = 0;
  law.residual_cohesion = 1000;
  law.peak_pdstrain = 0.01;
  law.residual_pdstrain = 0.05;
  const auto strength = [](double phi, double c, double p) {
    const double s = std::sin(phi * radian);
    return (6 * s * p + 6 * c * std::cos(phi * radian)) / (3 - s);
  };
  const MaterialPoint before = triaxial(law, 1e5, -0.035), after = triaxial(law, 1e5, -0.15, 2000);
  CHECK(relative(deviatoric_stress(before.stress()),
                 strength(35, 4000, mean_pressure(before.stress()))) < 1e-8);
  CHECK(before.state()[6] < 0.01);
  CHECK(relative(deviatoric_stress(after.stress()),
                 strength(25, 1000, mean_pressure(after.stress()))) < 1e-8);
  CHECK(after.state()[6] > 0.05);
  CHECK(after.state()[0] == 25 * radian);
  CHECK(after.state()[1] == 0);
  CHECK(after.state()[2] == 1000);
  CHECK(relative(after.state()[3], -std::sqrt(3) * mean_pressure(after.stress())) < 1e-14);
  CHECK(relative(after.state()[4], std::sqrt(2.0 / 3) * deviatoric_stress(after.stress())) < 1e-14);
  CHECK(relative(after.state()[5], std::numbers::pi / 3) < 1e-7);  // triaxial compression
}

TEST_CASE("Drucker-Prager is as strong as Mohr-Coulomb in triaxial compression, and has its tip") {
  const double phi = 30, c = 2000, s = std::sin(phi * radian), k = std::cos(phi * radian);
  const DruckerPrager law{.youngs_modulus = 1e7,
                          .poisson_ratio = 0.3,
                          .friction = phi,
                          .dilation = 10,
                          .cohesion = c,
                          .tension_cutoff = no_default.value};
  const MaterialPoint point = triaxial(law, 1e5, -0.2);
  CHECK(relative(deviatoric_stress(point.stress()),
                 (6 * s * mean_pressure(point.stress()) + 6 * c * k) / (3 - s)) < 1e-8);
  // The flow's dilation: d(ev) = 6 sin(psi) / (3 - sin(psi)) d(eq).
  const double slope = 6 * std::sin(10 * radian) / (3 - std::sin(10 * radian));
  CHECK(relative(point.state()[1], slope * point.state()[0]) < 1e-8);
  MaterialPoint pulled(law, {});
  REQUIRE(pulled.strain_by({0.01, 0.012, 0.01, 0.001, 0, 0}, 1));
  CHECK(relative(-mean_pressure(pulled.stress()), c * k / s) < 1e-12);
  CHECK(deviatoric_stress(pulled.stress()) < 1e-8);
}

TEST_CASE("von Mises in uniaxial tension: yield stress, then E H / (E + H)") {
  const double E = 2e11, H = 1e10, yield = 3e8;
  const VonMises law{
      .youngs_modulus = E, .poisson_ratio = 0.3, .yield_stress = yield, .hardening_modulus = H};
  for (const double strain : {0.001, 0.01, 0.05}) {
    const double elastic = E * strain;
    const double expected =
        elastic <= yield ? elastic : yield + E * H / (E + H) * (strain - yield / E);
    CHECK(relative(triaxial(law, 0, strain).stress()[2], expected) < 1e-8);
  }
}

TEST_CASE(
    "a Bingham fluid shears with tau0 + mu times the rate, and creeps below the critical one") {
  const Bingham law{.youngs_modulus = 1e6,
                    .poisson_ratio = 0.3,
                    .tau0 = 100,
                    .mu = 20,
                    .critical_shear_rate = 0.01};
  for (const double rate : {0.0, 0.005, 0.00999, 0.02, 3.0}) {
    MaterialPoint point(law, {});
    REQUIRE(point.strain_by({0, 0, 0, rate * 0.1, 0, 0}, 0.1));
    const double yield = 100 * std::min(1.0, rate / 0.01);
    CHECK(point.stress()[3] == doctest::Approx(yield + 20 * rate).epsilon(1e-14));
  }
  MaterialPoint pressed(law, {});
  REQUIRE(pressed.strain_by({-1e-3, 0, 0, 0, 0, 0}, 1));
  CHECK(pressed.state()[0] == doctest::Approx(1e-3 * 1e6 / 3 / 0.4).epsilon(1e-14));
}

TEST_CASE("a neo-Hookean body in simple shear and in a state of initial stress") {
  const NeoHookean law{.youngs_modulus = 1e6, .poisson_ratio = 0.25};
  const double mu = 4e5;
  // Simple shear F = I + g e_x e_y in one step: b_xx = 1 + g^2, J = 1.
  Voigt stress{};
  std::vector<double> b(6);
  initial_state(Law(law), stress, b.data());
  LawInput<2, Scalar> in;
  for (auto& rate : in.rate) rate = Scalar(0.0);
  in.gradient[0][0] = in.gradient[1][0] = in.gradient[1][1] = Scalar(0.0);
  in.gradient[0][1] = Scalar(0.5);
  in.dt = 2;
  in.volumetric = 0;
  Scalar s[4], state[6];
  for (std::size_t k = 0; k < 6; ++k) state[k] = Scalar(b[k]);
  CHECK(update(law, in, s, state).failed == 0);
  CHECK(s[3][0] == doctest::Approx(mu).epsilon(1e-14));
  CHECK(s[0][0] == doctest::Approx(mu).epsilon(1e-14));
  CHECK(std::abs(s[1][0]) < 1e-9 * mu);
  // Turned inside out: no stress.
  in.gradient[0][0] = Scalar(-1.0);
  CHECK(update(law, in, s, state).failed == 1);

  const Voigt given{-2e5, 1e5, 3e4, 5e4, -2e4, 1e4};
  MaterialPoint stressed(Law(law), given);
  REQUIRE(stressed.strain_by({}, 1));
  for (std::size_t k = 0; k < 6; ++k) CHECK(std::abs(stressed.stress()[k] - given[k]) < 1e-8 * 2e5);
}

TEST_CASE("a driver leads its point through segments of all kinds, into a table and a picture") {
  const MaterialDriver driver = read_material_driver_text(R"({
    "title": "three segments",
    "material": {"type": "LinearElastic", "density": 1, "youngs_modulus": 1000, "poisson_ratio": 0.25},
    "initial_stress": [-1, -1, -1, 0, 0, 0],
    "path": [
      {"triaxial": "oedometer", "axial_strain": -0.01, "steps": 10},
      {"triaxial": "undrained", "axial_strain": 0.01, "steps": 5},
      {"change": [0, 0, 2, 0.001, 0, 0], "steps": 4,
       "control": ["strain", "strain", "stress", "strain", "strain", "stress"]}
    ]})",
                                                          ".");
  std::vector<PathPoint> points;
  Index divided = 0;
  follow_path(driver, points, divided);
  REQUIRE(points.size() == 20);
  // M = 1200, lambda = G = 400.
  CHECK(points[10].stress[2] == doctest::Approx(-13));
  CHECK(points[10].stress[0] == doctest::Approx(-5));
  CHECK(points[15].stress[2] == doctest::Approx(-13 + 8));
  CHECK(points[15].stress[0] == doctest::Approx(-5 - 4));
  CHECK(points[19].stress[2] == doctest::Approx(-5 + 2));
  CHECK(points[19].stress[3] == doctest::Approx(0.4));
  CHECK(points[19].strain[2] == within(1e-5, 2.0 / 1200));
  CHECK(divided == 0);
  const std::string table = path_table(driver, points);
  CHECK(
      table.starts_with("step,time,strain_xx,strain_yy,strain_zz,strain_xy,strain_yz,strain_xz,"
                        "stress_xx,stress_yy,stress_zz,stress_xy,stress_yz,stress_xz,p,q\n0,0,"));
  CHECK(std::count(table.begin(), table.end(), '\n') == 21);
  CHECK(path_picture(driver, points).find("three segments") != std::string::npos);
}

// q = M p on the path p = p0 + q / 3.
TEST_CASE("drained triaxial tests of Cam-Clay are followed with any number of steps") {
  constexpr double p0 = 2e5, M = 1.2;
  for (const int steps : {20, 50, 100, 200, 700, 1000}) {
    CAPTURE(steps);
    const MaterialDriver driver = read_material_driver_text(
        R"({"material": {"type": "ModifiedCamClay", "density": 1800, "youngs_modulus": 1e7,
                         "poisson_ratio": 0.3, "p_ref": 1e5, "e_ref": 1.12, "pc0": 2e5, "ocr": 1,
                         "m": 1.2, "lambda": 0.1, "kappa": 0.03},
            "initial_stress": [-2e5, -2e5, -2e5, 0, 0, 0],
            "path": [{"triaxial": "drained", "axial_strain": -0.5, "steps": )" +
            std::to_string(steps) + "}]}",
        ".");
    std::vector<PathPoint> points;
    Index divided = 0;
    follow_path(driver, points, divided);
    CHECK(points.size() == static_cast<std::size_t>(steps) + 1);
    CHECK(relative(deviatoric_stress(points.back().stress), 3 * M * p0 / (3 - M)) < 0.01);
  }
}

TEST_CASE("the table has every column once, also of laws with p and q among their states") {
  const MaterialDriver driver = read_material_driver_text(R"({
    "material": {"type": "ModifiedCamClay", "density": 1800, "youngs_modulus": 1e7,
                 "poisson_ratio": 0.3, "p_ref": 1e5, "e_ref": 1.12, "pc0": 2e5, "ocr": 1,
                 "m": 1.2, "lambda": 0.1, "kappa": 0.03},
    "initial_stress": [-2e5, -2e5, -2e5, 0, 0, 0],
    "path": [{"change": [5e-4, 5e-4, -1e-3, 0, 0, 0], "steps": 1}]})",
                                                          ".");
  std::vector<PathPoint> points;
  Index divided = 0;
  follow_path(driver, points, divided);
  const std::string table = path_table(driver, points);
  std::vector<std::vector<std::string>> rows;
  std::stringstream lines(table);
  for (std::string line, cell; std::getline(lines, line);) {
    rows.emplace_back();
    for (std::stringstream cells(line); std::getline(cells, cell, ',');)
      rows.back().push_back(cell);
  }
  REQUIRE(rows.size() == 3);
  for (const std::string& name : rows[0])
    CHECK(std::count(rows[0].begin(), rows[0].end(), name) == 1);
  for (const auto& row : rows) CHECK(row.size() == rows[0].size());
  const auto column = [&](const char* name) {
    const auto at = std::find(rows[0].begin(), rows[0].end(), name) - rows[0].begin();
    return std::stod(rows[2].at(static_cast<std::size_t>(at)));
  };
  CHECK(column("p") == doctest::Approx((2 * 192882.4825752268 + 211655.0108685302) / 3));
  CHECK(column("pc") == doctest::Approx(200368.9146817101));
}

TEST_CASE("a path that the material cannot follow ends with a message that names the step") {
  const MaterialDriver driver = read_material_driver_text(R"({
    "material": {"type": "VonMises", "density": 1, "youngs_modulus": 1e6, "poisson_ratio": 0.25,
                 "yield_stress": 100},
    "path": [{"change": [0, 0, 200, 0, 0, 0], "steps": 10,
              "control": ["stress", "stress", "stress", "strain", "strain", "strain"]}]})",
                                                          ".");
  std::vector<PathPoint> points;
  Index divided = 0;
  try {
    follow_path(driver, points, divided);
    FAIL("a stress of twice the strength was reached");
  } catch (const SimulationError& error) {
    const std::string text = error.what();
    CHECK(
        text.find("material 'VonMises': segment 1, step 6 of 10: the path cannot be followed after "
                  "stress (") == 0);
  }
  CHECK(points.size() == 6);
}

// Each answer of the law takes milliseconds there: thousands of them took half a minute.
TEST_CASE("the search for a stress that a soil does not bear ends soon") {
  auto law = sample_of<NorSand>();
  law.void_ratio_initial = 0.65;
  law.p_image_initial = 87014.6;
  MaterialPoint point(law, {-1e5, -1e5, 4096, 0, 0, 2147483648});
  Voigt increment{0, 0, -1e-3, 0, 0, 0};
  CHECK(!point.load_by(increment, {true, true}, {-1e5, -1e5, 0, 0, 0, 0}, 1));
  CHECK(point.answers() >= 100);
  CHECK(point.answers() <= MaterialPoint::most_answers);
}

TEST_CASE("strains of a path that are no strains are refused") {
  const auto problem = [](const std::string& segment) {
    try {
      read_material_driver_text(R"({"material": {"type": "VonMises", "density": 1,
        "youngs_modulus": 1e6, "poisson_ratio": 0.25, "yield_stress": 100}, "path": [)" +
                                    segment + "]}",
                                ".");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(problem(R"({"triaxial": "drained", "axial_strain": -10, "steps": 1})").empty());
  CHECK(problem(R"({"triaxial": "drained", "axial_strain": -2147483649, "steps": 5000})")
            .find("'axial_strain'") != std::string::npos);
  const std::string shear = R"("steps": 1, "change": [1e5, 0, 0, 11, 0, 0],
                               "control": ["stress", "strain", "strain", )";
  CHECK(problem("{" + shear + R"("strain", "strain", "strain"]})")
            .find("strains of a segment must be at most 10, found 11") != std::string::npos);
  CHECK(problem("{" + shear + R"("stress", "strain", "strain"]})").empty());
}
