// Saturated soil that is compressed and keeps its water: the effective stress goes the way that the
// volume leaves to its skeleton, law by law, and the pore pressure follows from the total stress.
//
// A block between smooth plates is compressed along y. Its sides are free: total stresses across
// are zero, from the beginning on, when the skeleton is under an isotropic pressure and the water
// under as much tension. So the specimen is that of a triaxial test (3D) or of one in plane strain
// (2D), held by a vacuum. Water does not flow.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double porosity = 0.4, bulk_modulus = 5e8;  // [-], [Pa] of the water
constexpr double youngs_modulus = 1e7, poisson = 0.3;
constexpr double K = youngs_modulus / (3 * (1 - 2 * poisson)),
                 G = youngs_modulus / (2 * (1 + poisson));
constexpr double friction = 25, cohesion = 5e3;  // [degrees], [Pa]
const double sine = std::sin(friction * std::numbers::pi / 180),
             cosine = std::cos(friction * std::numbers::pi / 180);
/// Share of a change of the mean total stress that the water takes (Skempton 1954).
constexpr double share_of_water = 1 / (1 + porosity * K / bulk_modulus);

struct Specimen {
  std::string law;           ///< its keys
  double pressure = 1e5;     ///< effective, at the beginning [Pa]
  double shortening = 0.06;  ///< about, at the end
};

std::string elastic_law(const std::string& type, const std::string& more = "") {
  return fmt::format(R"("type": "{}", "youngs_modulus": {}, "poisson_ratio": {}{})", type,
                     youngs_modulus, poisson, more);
}

/// From rest to the full speed, smoothly.
std::string ramp(double length) {
  constexpr int pieces = 10;
  std::string times, values;
  for (int i = 0; i <= pieces; ++i) {
    times += fmt::format("{}, ", i * length / pieces);
    values += fmt::format("{}, ", 0.5 - 0.5 * std::cos(std::numbers::pi * i / pieces));
  }
  return fmt::format(R"({{"id": 0, "type": "Linear", "xvalues": [{}1e3], "fxvalues": [{}1]}})",
                     times, values);
}

template <int Dim>
Model<Dim> model_of(const Specimen& specimen) {
  constexpr double h = 0.1, duration = 0.3;  // [m], [s]
  const auto vector = [](double x, double y, double z) {
    return Dim == 2 ? fmt::format("[{}, {}]", x, y) : fmt::format("[{}, {}, {}]", x, y, z);
  };
  const auto row = [&](int k) {
    return fmt::format(R"({{"box": {{"min": {}, "max": {}}}}})", vector(-1, (k - 0.1) * h, -1),
                       vector(1, (k + 0.1) * h, 1));
  };
  const auto held = [](const char* set, const char* dir) {
    return fmt::format(R"({{"nset": "{}", "dir": "{}", "velocity": 0}}, )", set, dir);
  };
  const auto moved = [&](const char* set, int k) {
    return fmt::format(R"({{"nset": "{}", "dir": "y", "velocity": {}, "math_function_id": 0}})",
                       set, -k * h * specimen.shortening / duration);
  };
  return model_by_default<Dim>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {0}, "counts": {1}}},
      "particles_stresses": {{"type": "isotropic", "values": -{2}}},
      "particles_pore_pressures": {{"type": "isotropic", "values": -{2}}},
      "boundary_conditions": {{"velocity_constraints": [{3} {4}, {5}]}}}},
    "sets": {{"nodes": {{
      "x": {{"half_space": {{"point": {6}, "normal": {7}}}}},
      "z": {{"half_space": {{"point": {6}, "normal": {8}}}}},
      "base": {9}, "middle": {10}, "top": {11}}}}},
    "materials": [
      {{"name": "soil", "density": 2650, "porosity": {12}, "k_x": 1e-12, {13}}},
      {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": {14},
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 1,
      "region": {{"box": {{"min": {6}, "max": {15}}}}}}}}}],
    "math_functions": [{16}],
    "analysis": {{"mpm_scheme": "musl", "shape_functions": "gimp", "velocity_update": "apic",
                 "end_time": {17}}}}})",
      h, Dim == 2 ? "[3, 2]" : "[3, 2, 3]", specimen.pressure,
      held("x", "x") + held("base", "y") + (Dim == 3 ? held("z", "z") : ""), moved("middle", 1),
      moved("top", 2), vector(0, 0, 0), vector(1, 0, 0), Dim == 2 ? vector(1, 0, 0) : "[0, 0, 1]",
      row(0), row(1), row(2), porosity, specimen.law, bulk_modulus, vector(2 * h, 2 * h, 2 * h),
      ramp(0.2 * duration), duration));
}

/// Stresses of a particle [Pa], positive in compression.
struct Stresses {
  double x, y, z;  ///< effective ones, along the axes
  double water;
  double shortening;  ///< logarithmic strain along y

  Stresses(const State& state, Index i)
      : x(-state.get("stress", i, 0)),
        y(-state.get("stress", i, 1)),
        z(-state.get("stress", i, 2)),
        water(state.get("pore_pressure", i)),
        shortening(-state.get("strain", i, 1)) {}
  double p() const { return (x + y + z) / 3; }
  double q() const {
    return std::sqrt(0.5 * ((x - y) * (x - y) + (y - z) * (y - z) + (z - x) * (z - x)));
  }
};

/// [Pa] of what the beginning starts across the block.
constexpr double swing = 400;

/// Call check(stresses, frame, particle) at ten times, for all particles.
template <int Dim, class Check>
void compress(const Specimen& specimen, Check check) {
  CAPTURE(Dim);
  Model<Dim> model = model_of<Dim>(specimen);
  const double end = model.analysis.end_time;
  Simulation simulation(std::move(model));
  double before = 0;
  for (int k = 1; k <= 10; ++k) {
    while (!simulation.finished() && simulation.time() < 0.1 * k * end) simulation.advance(50);
    const State state(simulation.frame());
    double shortening = 0;
    for (Index i = 0; i < state.size(); ++i) {
      const Stresses now(state, i);
      CAPTURE(now.shortening);
      CAPTURE(now.p());
      CAPTURE(now.q());
      CAPTURE(now.water);
      shortening = now.shortening;
      CHECK(std::abs(now.x + now.water) < swing);
      check(now, state, i);
      if (i + 1 == state.size() && k == 10)
        MESSAGE(fmt::format("{}D: after {:.4f}: p' {:.5g}, q {:.5g}, water {:.5g}", Dim, shortening,
                            now.p(), now.q(), now.water));
    }
    CHECK(shortening > before);
    before = shortening;
  }
  CHECK(before > 0.85 * specimen.shortening);
}

/// The volume is that of the water: what the skeleton is compressed by from then on [Pa].
double compression(const Stresses& now, double start) {
  return K * porosity / bulk_modulus * (now.water + start);
}

}  // namespace

TEST_CASE("undrained: elastic skeletons leave the mean stress to the water") {
  const Specimen specimen{.law = elastic_law("LinearElastic"), .pressure = 1e4, .shortening = 0.02};
  compress<3>(specimen, [&](const Stresses& now, const State& state, Index i) {
    const double across = -state.get("strain", i, 0);
    CHECK(now.q() == test::within(1e-3, 2 * G * (now.shortening - across)));
    CHECK(now.p() - specimen.pressure == test::within(0.02, compression(now, specimen.pressure)));
    if (now.shortening > 0.005)
      CHECK(now.water + specimen.pressure == test::within(0.01, share_of_water * now.q() / 3));
  });
  // In plane strain without change of volume, the mean stress is that of the plane.
  compress<2>(specimen, [&](const Stresses& now, const State&, Index) {
    if (now.shortening > 0.005)
      CHECK(now.water + specimen.pressure ==
            test::within(0.01, share_of_water * (now.y - now.x) / 2));
  });
}

TEST_CASE("undrained: a skeleton of rubber has the stress of its stretches") {
  compress<3>(
      {.law = elastic_law("NeoHookean"), .pressure = 0, .shortening = 0.06},
      [](const Stresses& now, const State& state, Index i) {
        const double strain = state.get("strain", i, 1);
        CHECK(now.q() == test::within(0.01, G * (std::exp(-strain) - std::exp(2 * strain))));
      });
}

TEST_CASE("undrained: with von Mises q stays at the yield stress, p' where it was") {
  constexpr double yield_stress = 6e4;
  const Specimen specimen{
      .law = elastic_law("VonMises", fmt::format(R"(, "yield_stress": {})", yield_stress))};
  compress<3>(specimen, [&](const Stresses& now, const State&, Index) {
    CHECK(now.p() == test::within(0.003, specimen.pressure));
    if (now.shortening < 0.01) return;
    CHECK(now.q() == test::within(0.003, yield_stress));
    CHECK(now.water + specimen.pressure == test::within(0.01, yield_stress / 3));
  });
}

TEST_CASE(
    "undrained: a skeleton with friction that does not dilate keeps p', and so its strength") {
  const double slope = 6 * sine / (3 - sine), intercept = 6 * cohesion * cosine / (3 - sine);
  const std::string strength =
      fmt::format(R"(, "friction": {}, "dilation": 0, "cohesion": {}, "tension_cutoff": 0)",
                  friction, cohesion);
  for (const char* type : {"MohrCoulomb", "DruckerPrager"}) {
    CAPTURE(type);
    const Specimen specimen{.law = elastic_law(type, strength)};
    compress<3>(specimen, [&](const Stresses& now, const State&, Index) {
      CHECK(now.p() == test::within(0.004, specimen.pressure));
      if (now.shortening > 0.015)
        CHECK(now.q() == test::within(0.005, slope * now.p() + intercept));
    });
  }
  // Mohr and Coulomb's strength is that of the plane; the smooth flow potential keeps p' there,
  // too.
  compress<2>({.law = elastic_law("MohrCoulomb", strength)},
              [&](const Stresses& now, const State&, Index) {
                CHECK(now.p() == test::within(0.004, 1e5));
                if (now.shortening > 0.02)
                  CHECK((now.y - now.x) / 2 ==
                        test::within(0.005, (now.y + now.x) / 2 * sine + cohesion * cosine));
              });
}

TEST_CASE("undrained: a skeleton that dilates presses itself together along its cone") {
  const double slope = 6 * sine / (3 - sine), intercept = 6 * cohesion * cosine / (3 - sine);
  constexpr double dilation = 5;
  const double s = std::sin(dilation * std::numbers::pi / 180), flow = 6 * s / (3 - s);
  const Specimen specimen{
      .law = elastic_law("DruckerPrager",
                         fmt::format(R"(, "friction": {}, "dilation": {}, "cohesion": {})",
                                     friction, dilation, cohesion))};
  const double yields = (slope * specimen.pressure + intercept) / (3 * G);
  // dq = 3 G (d(eq) - dx) = slope dp, dp = K flow dx
  const double rise = 3 * G * K * flow / (3 * G + slope * K * flow);
  compress<3>(specimen, [&](const Stresses& now, const State&, Index) {
    if (now.shortening < 1.2 * yields) return;
    CHECK(now.q() == test::within(0.003, slope * now.p() + intercept));
    CHECK(now.p() == test::within(0.005, specimen.pressure + compression(now, specimen.pressure) +
                                             rise * (now.shortening - yields)));
  });
}

TEST_CASE("undrained: Cam-Clay goes along its path to the critical state") {
  // p / p0 = (M^2 / (M^2 + eta^2))^(1 - kappa / lambda), normally consolidated, for any direction
  // of the deviator (Roscoe and Burland 1968).
  constexpr double M = 1.2, lambda = 0.1, kappa = 0.02, share = 1 - kappa / lambda;
  const Specimen specimen{.law = fmt::format(
                              R"("type": "ModifiedCamClay", "youngs_modulus": 1e7,
      "poisson_ratio": 0.3, "p_ref": 1e5, "e_ref": {}, "pc0": 1e5, "ocr": 1, "m": {},
      "lambda": {}, "kappa": {})",
                              porosity / (1 - porosity), M, lambda, kappa)};
  const auto check = [&](const Stresses& now, const State&, Index) {
    const double eta = now.q() / now.p();
    CHECK(now.p() ==
          test::within(0.005, specimen.pressure * std::pow(M * M / (M * M + eta * eta), share)));
    if (now.shortening > 0.05) {
      CHECK(now.p() == test::within(0.01, specimen.pressure * std::pow(2, -share)));
      CHECK(eta == test::within(0.01, M));
    }
  };
  compress<3>(specimen, check);
  compress<2>(specimen, check);
}

TEST_CASE("undrained: NorSand ends at the critical pressure of its void ratio") {
  constexpr double critical = 0.03, void_ratio = porosity / (1 - porosity), end = 1.3e5;
  const double phi = 32 * std::numbers::pi / 180, M = 6 * std::sin(phi) / (3 - std::sin(phi));
  const Specimen specimen{
      .law = fmt::format(R"("type": "NorSand", "poisson_ratio": 0.2, "reference_pressure": 1e5,
      "friction_cs": 32, "N": 0.3, "lambda": {}, "kappa": 0.003, "gamma": {}, "chi": 3.5,
      "hardening_modulus": 5000, "void_ratio_initial": {}, "p_image_initial": 8e4)",
                         critical, void_ratio + critical * std::log(end / 1e5), void_ratio),
      .shortening = 0.08};
  compress<3>(specimen, [&](const Stresses& now, const State& state, Index i) {
    CHECK(state.get("void_ratio", i) == test::within(1e-3, void_ratio));
    if (now.shortening < 0.07) return;
    CHECK(now.p() == test::within(0.01, end));
    CHECK(now.q() / now.p() == test::within(0.01, M));
  });
}
