// The search for a factor of safety, the strength that it divides (of materials and of what they
// touch), and when a body has failed.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "physics/materials/strength.h"
#include "physics/model/model_strength.h"
#include "runtime/program/failure_bounds.h"
#include "runtime/program/safety_run.h"

using namespace lahar;

namespace {

SafetyTrial trial_of(double factor, bool stable) {
  SafetyTrial trial{.factor = factor};
  trial.end = stable ? SafetyTrial::End::rest : SafetyTrial::End::moved;
  return trial;
}

/// Particles of 0.25 m^2 and 500 kg in a box of 8 m by 3 m, in two pieces. The last one has moved.
FrameSource box() {
  const auto piece = [](std::size_t i) {
    Frame frame;
    frame.dim = 2;
    frame.columns = {{"mass", "kg", 1, {}}, {"volume", "m^3", 1, {}}, {"displacement", "m", 2, {}}};
    for (int x = 0; x <= 16; ++x)
      for (int y = 0; y <= 6; ++y) {
        if ((x > 8) != (i > 0)) continue;
        frame.coordinates.insert(frame.coordinates.end(), {0.5 * x, 0.5 * y});
        frame.columns[0].values.push_back(500);
        frame.columns[1].values.push_back(0.25);
        const bool moved = x == 16 && y == 6;
        frame.columns[2].values.insert(frame.columns[2].values.end(),
                                       {moved ? -0.03 : 0.001, moved ? -0.04 : 0.0});
      }
    return frame;
  };
  FrameSource source;
  source.header.dim = 2;
  source.sizes = {63, 56};
  source.piece = piece;
  return source;
}

Material elastic(double youngs_modulus) {
  Material material;
  material.density = 2000;
  material.law = LinearElastic{.youngs_modulus = youngs_modulus, .poisson_ratio = 0.25};
  return material;
}

const std::vector<Material> soft_and_stiff{elastic(2.5e7), elastic(2.5e8)};

}  // namespace

TEST_CASE("the factor of safety is bracketed as narrowly as asked for") {
  for (const double limit : {1.05, 1.4, 2.0, 3.3, 13.0}) {
    const SafetyResult result = find_factor({.most = 16, .tolerance = 0.01}, [&](double factor) {
      return trial_of(factor, factor <= limit);
    });
    REQUIRE(result.fails);
    CHECK(result.stable <= limit);
    CHECK(*result.fails > limit);
    CHECK(*result.fails - result.stable <= 0.01 * result.stable);
    CHECK(result.trials.size() < 14);
    REQUIRE(result.failure());
    CHECK(result.failure()->factor == *result.fails);
  }
}

TEST_CASE("a body that never fails has a factor above the bound") {
  const SafetyResult result = find_factor({.most = 5, .tolerance = 0.01},
                                          [](double factor) { return trial_of(factor, true); });
  CHECK_FALSE(result.fails);
  CHECK_FALSE(result.failure());
  CHECK(result.stable == 5);
  CHECK(result.trials.back().factor == 5);
}

TEST_CASE(
    "a search that goes on makes the trials that it would have made, also with another bracket") {
  const auto made = [](double factor) { return trial_of(factor, factor <= 3.3); };
  const SafetyResult whole = find_factor({.most = 16, .tolerance = 0.001}, made);
  for (std::size_t count = 0; count <= whole.trials.size(); ++count) {
    SafetyResult known;
    for (std::size_t k = 0; k < count; ++k) known.add(whole.trials[k]);
    std::size_t more = 0;
    const auto counted = [&](double factor) { return ++more, made(factor); };
    const SafetyResult rest = find_factor({.most = 16, .tolerance = 0.001}, counted, known);
    CHECK(count + more == whole.trials.size());
    CHECK(rest.stable == whole.stable);
    CHECK(*rest.fails == *whole.fails);
    for (std::size_t k = 0; k < whole.trials.size(); ++k)
      CHECK(rest.trials[k].factor == whole.trials[k].factor);
    if (known.fails) CHECK(trials_left({.most = 16, .tolerance = 0.001}, known) >= double(more));
  }
  CHECK(find_factor({.most = 16, .tolerance = 0.1}, made, whole).trials.size() ==
        whole.trials.size());
  CHECK(trials_left({.most = 16, .tolerance = 0.001}, whole) == 0);
}

TEST_CASE("a body has failed when it has moved by its settlement, or moves for long") {
  const Communicator alone;
  const double G = 1e7, thickness = 119 * 0.25 / 8;  // of the soft material; volume over width
  const FailureBounds bounds = failure_bounds(box(), soft_and_stiff, {0, -10}, alone);
  CHECK(bounds.displacement ==
        doctest::Approx(2000 * 10 * thickness * thickness / G).epsilon(1e-12));
  CHECK(bounds.time == doctest::Approx(30 * 8 / std::sqrt(G / 2000)).epsilon(1e-12));
  // Gravity along x: the body is 3 m wide.
  const FailureBounds turned = failure_bounds(box(), soft_and_stiff, {10, 0}, alone);
  CHECK(turned.displacement / bounds.displacement ==
        doctest::Approx(8.0 * 8.0 / (3.0 * 3.0)).epsilon(1e-12));
  CHECK(std::isinf(failure_bounds(box(), soft_and_stiff, {0, 0}, alone).displacement));
  CHECK(largest_displacement(box(), alone) == doctest::Approx(0.05).epsilon(1e-12));
}

TEST_CASE("strength is divided by a factor, tan(phi) and not phi") {
  MohrCoulomb soil{};
  soil.friction = 30;
  soil.dilation = 25;
  soil.cohesion = 1000;
  soil.tension_cutoff = 200;
  soil.residual_friction = 20;
  soil.residual_cohesion = 100;
  Law law = soil;
  REQUIRE(reduce_strength(law, 2.0));
  const auto& reduced = std::get<MohrCoulomb>(law);
  constexpr double radian = std::numbers::pi / 180;
  CHECK(std::tan(reduced.friction * radian) == doctest::Approx(std::tan(30 * radian) / 2));
  CHECK(std::tan(reduced.residual_friction * radian) == doctest::Approx(std::tan(20 * radian) / 2));
  CHECK(reduced.cohesion == 500);
  CHECK(reduced.residual_cohesion == 50);
  CHECK(reduced.tension_cutoff == 100);
  CHECK(reduced.dilation == reduced.friction);
  CHECK(reduced.problem().empty());

  Law metal = VonMises{.youngs_modulus = 1, .poisson_ratio = 0, .yield_stress = 6};
  REQUIRE(reduce_strength(metal, 3.0));
  CHECK(std::get<VonMises>(metal).yield_stress == 2);
  Law elastic = LinearElastic{};
  CHECK_FALSE(reduce_strength(elastic, 2.0));
}

TEST_CASE("friction and cohesion of rigid bodies, walls and bodies in contact are divided, too") {
  constexpr double rough = std::numeric_limits<double>::infinity();
  const Communicator alone;
  Model<2> model;
  model.materials = {elastic(1e7)};
  CHECK_FALSE(strength_of(AnyModel(model), alone).any());
  model.rigid_bodies.resize(3);
  model.rigid_bodies[0].name = "bed";
  model.rigid_bodies[0].friction = 0.6;
  model.rigid_bodies[1].name = "glue";
  model.rigid_bodies[1].cohesion = 3000;
  model.rigid_bodies[2].name = "rock";
  model.rigid_bodies[2].friction = rough;
  entries_of<NodeFriction>(model) = {{.node = 0, .normal = 1, .outward = -1, .friction = 0.3},
                                     {.node = 1, .normal = 1, .outward = -1, .friction = rough}};
  model.analysis.contact = {.bodies = 2, .friction = 0.9};
  const StrengthOfModel divided = reduce_strength(model, 1.5);
  CHECK_FALSE(divided.materials);
  CHECK(divided.rigid_bodies);
  CHECK(divided.walls);
  CHECK(divided.contact);
  CHECK(model.rigid_bodies[0].friction == doctest::Approx(0.4));
  CHECK(model.rigid_bodies[1].cohesion == doctest::Approx(2000));
  CHECK(model.rigid_bodies[2].friction == rough);
  CHECK(entries_of<NodeFriction>(model)[0].friction == doctest::Approx(0.2));
  CHECK(entries_of<NodeFriction>(model)[1].friction == rough);
  CHECK(model.analysis.contact.friction == doctest::Approx(0.6));
  model.materials[0].name = "steel";
  model.materials.push_back(elastic(1e7));
  model.materials[1].name = "clay";
  model.materials[1].law = VonMises{.youngs_modulus = 1, .poisson_ratio = 0, .yield_stress = 6};
  CHECK(describe_strength(AnyModel(model), strength_of(AnyModel(model), alone)) ==
        "material 'clay'; friction and cohesion of rigid bodies 'bed', 'glue'; friction of walls; "
        "friction of bodies in contact");
}

TEST_CASE("what is rough everywhere, or of no body in contact, has no friction to divide") {
  constexpr double rough = std::numeric_limits<double>::infinity();
  Model<3> model;
  model.materials = {elastic(1e7)};
  model.rigid_bodies.resize(1);
  model.rigid_bodies[0].friction = rough;
  entries_of<NodeFriction>(model) = {{.node = 0, .normal = 2, .outward = -1, .friction = rough}};
  model.analysis.contact = {.bodies = 1, .friction = 0.5};
  CHECK_FALSE(reduce_strength(model, 2.0).any());
}
