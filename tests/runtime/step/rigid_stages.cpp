// Rigid bodies of stages: those that are there again go on where the stage before left them.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>

#include "runtime/step/restart.h"
#include "tests/runtime/step/restart_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr const char* bed = R"({"name": "bed", "region": {"half_space": {"point": [0, 0.83],
                                "normal": [0.1, 1]}}, "friction": 0.4})";
constexpr const char* wall = R"({"name": "wall", "region": {"box": {"min": [0.5, 0.7],
  "max": [0.79, 1.6]}}, "friction": 0.1, "velocity": [1.5, 0.1], "spin": 0.4, "centre": [0.6, 0.7]})";
constexpr const char* disc = R"({"name": "disc", "region": {"sphere": {"centre": [1.7, 1.75],
  "radius": 0.21}}, "density": 2000, "velocity": [0.5, -2], "spin": 3, "friction": 0.5})";

/// A heap on a bed, with the bodies that each of the stages has. Returns one of them.
Model<2> heap(const std::vector<std::string>& bodies_of_stages, std::size_t stage, int steps = 40) {
  std::string stages;
  for (std::size_t k = 0; k < bodies_of_stages.size(); ++k)
    stages += fmt::format(R"({}{{"name": "{}", "rigid_bodies": [{}]}})", k == 0 ? "" : ", ", k,
                          bodies_of_stages[k]);
  const std::string text = fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.1, "extent": [4, 2.5]}}}},
    "materials": [{{"type": "LinearElastic", "density": 1500, "youngs_modulus": 2e5,
                   "poisson_ratio": 0.2}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                 "region": {{"difference": [
                      {{"box": {{"min": [0.8, 0.4], "max": [2.4, 1.5]}}}},
                      {{"half_space": {{"point": [0, 0.84], "normal": [0.1, 1]}}}}]}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -10]}},
    "analysis": {{"mpm_scheme": "musl", "dt": 1e-3, "nsteps": {}, "patch_particles": 64}},
    "post_processing": {{"gauges": [{{"name": "bed", "type": "force", "rigid_body": "bed"}}]}},
    "stages": [{}]}})",
      steps, stages);
  ScenarioOptions options = plain_defaults(text);
  options.stage = stage;
  return std::get<Model<2>>(read_scenario_text(text, "", options).model);
}

std::string list(std::initializer_list<const char*> bodies) {
  std::string all;
  for (const char* body : bodies) all += (all.empty() ? "" : ", ") + std::string(body);
  return all;
}

const RigidBodyRow& row_of(const HistoryRow& row, const std::string& name) {
  for (const RigidBodyRow& body : row.bodies)
    if (body.name == name) return body;
  throw InputError("no body " + name);
}

std::string refusal_at_start(const Model<2>& model, const StoredState& state) {
  try {
    Simulation(model, serial(), {}, state_at_start(state.view(), false));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("rigid bodies in two stages move as in one run") {
  const std::string all = list({bed, wall, disc});
  Simulation whole(heap({all}, 0, 80), serial());
  whole.run();
  Simulation first(heap({all, all}, 0), serial());
  first.run();
  const StoredState state(first.state());
  Simulation second(heap({all, all}, 1), flow(2), {}, state_at_start(state.view(), false));
  const HistoryRow start = second.history(), before = first.history();
  second.run();
  const HistoryRow end = second.history(), expected = whole.history();
  for (const char* name : {"bed", "wall", "disc"}) {
    CAPTURE(name);
    const RigidBodyRow &a = row_of(before, name), &b = row_of(start, name), &c = row_of(end, name),
                       &d = row_of(expected, name);
    CHECK(a.place == b.place);
    CHECK(a.velocity == b.velocity);
    CHECK(a.spin == b.spin);
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(b.rotation[k] == doctest::Approx(a.rotation[k]).epsilon(1e-14));
      CHECK(c.place[k] == doctest::Approx(d.place[k]).epsilon(1e-10));
      CHECK(c.rotation[k] == doctest::Approx(d.rotation[k]).epsilon(1e-10));
      CHECK(c.velocity[k] == doctest::Approx(d.velocity[k]).epsilon(1e-8));
    }
  }
  CHECK(row_of(end, "disc").place[1] < 1.7);
  CHECK(end.kinetic == doctest::Approx(expected.kinetic).epsilon(1e-8));
}

TEST_CASE("a run goes on within its second stage with bodies that move: the bits of one that did") {
  const std::string free = list({bed, wall, disc}), driven = list({bed, wall});
  for (const std::string& bodies : {free, driven}) {
    Simulation first(heap({bodies, bodies}, 0), serial());
    first.run();
    const StoredState begin(first.state());
    const Model<2> model = heap({bodies, bodies}, 1);
    Simulation whole(model, serial(), {}, state_at_start(begin.view(), false));
    whole.advance(17);
    const StoredState middle(whole.state());
    Simulation resumed(model, flow(2), {}, middle.view());
    whole.run();
    resumed.run();
    CHECK(difference(StoredState(whole.state()), StoredState(resumed.state())) == "");
  }
}

TEST_CASE("a stage may hold, push, free and take away rigid bodies, and bring others") {
  const std::string held_disc = R"({"name": "disc", "region": {"sphere": {"centre": [1.7, 1.75],
                                    "radius": 0.21}}, "friction": 0.5})";
  const std::string other = R"({"name": "roof", "region": {"box": {"min": [0, 2.2],
                                "max": [4, 2.4]}}})";
  const std::vector<std::string> bodies = {
      list({bed, wall, disc}), list({bed, held_disc.c_str(), other.c_str()}), list({bed, disc})};
  Simulation first(heap(bodies, 0), serial());
  first.run();
  const StoredState one(first.state());
  Simulation second(heap(bodies, 1), serial(), {}, state_at_start(one.view(), false));
  second.run();
  const HistoryRow held = second.history();
  CHECK(held.bodies.size() == 3);
  CHECK(row_of(held, "disc").place == row_of(first.history(), "disc").place);
  CHECK(row_of(held, "disc").velocity == std::array<double, 3>{});
  CHECK(row_of(held, "roof").place[1] == doctest::Approx(2.3));
  const StoredState two(second.state());
  Simulation third(heap(bodies, 2), serial(), {}, state_at_start(two.view(), false));
  CHECK(row_of(third.history(), "disc").place == row_of(held, "disc").place);
  CHECK(row_of(third.history(), "disc").velocity == std::array<double, 3>{});  // it was held
  third.run();
  CHECK(row_of(third.history(), "disc").place[1] < row_of(held, "disc").place[1]);
}

TEST_CASE("a moving rigid body stops in the directions in which a stage fixes it") {
  const std::string fixed = R"({"name": "disc", "region": {"sphere": {"centre": [1.7, 1.75],
    "radius": 0.21}}, "density": 2000, "friction": 0.5, "fixed": ["x", "spin"]})";
  const std::vector<std::string> bodies = {list({bed, wall, disc}),
                                           list({bed, wall, fixed.c_str()})};
  Simulation first(heap(bodies, 0, 10), serial());
  first.run();
  const StoredState state(first.state());
  Simulation second(heap(bodies, 1, 10), serial(), {}, state_at_start(state.view(), false));
  const auto before = row_of(first.history(), "disc"), start = row_of(second.history(), "disc");
  CHECK(before.velocity[0] > 0.1);
  CHECK(start.velocity[0] == 0);
  CHECK(start.velocity[1] == before.velocity[1]);
  CHECK(start.spin[2] == 0);
  second.run();
  const auto end = row_of(second.history(), "disc");
  CHECK(end.place[0] == before.place[0]);
  CHECK(end.place[1] < before.place[1]);
  CHECK(end.rotation[2] == doctest::Approx(before.rotation[2]).epsilon(1e-12));
}

TEST_CASE("a rigid body that a stage brings is refused where there is material") {
  const std::string plate = R"({"name": "plate", "region": {"box": {"min": [1, 1.2],
                                "max": [1.5, 2]}}})";
  const std::vector<std::string> bodies = {bed, list({bed, plate.c_str()})};
  Simulation first(heap(bodies, 0), serial());
  first.run();
  const std::string said = refusal_at_start(heap(bodies, 1), StoredState(first.state()));
  CAPTURE(said);
  CHECK(said.find("particles are inside of the rigid body 'plate' when the stage begins") !=
        std::string::npos);
}

TEST_CASE("a stage that holds a free body along some axes stops it there, in 2D as in 3D") {
  // Its velocity and spin are those of the stage before.
  const std::string held = R"({"name": "disc", "region": {"sphere": {"centre": [1.7, 1.75],
    "radius": 0.21}}, "density": 2000, "friction": 0.5, "fixed": ["x", "spin"]})";
  const std::vector<std::string> bodies = {list({bed, disc}), list({bed, held.c_str()})};
  Simulation first(heap(bodies, 0), serial());
  first.run();
  const StoredState state(first.state());
  Simulation second(heap(bodies, 1), serial(), {}, state_at_start(state.view(), false));
  const RigidBodyRow before = row_of(first.history(), "disc");
  second.run();
  const RigidBodyRow after = row_of(second.history(), "disc");
  REQUIRE(std::abs(before.velocity[0]) > 0.01);
  REQUIRE(std::abs(before.spin[2]) > 0.01);
  CHECK(after.place[0] == doctest::Approx(before.place[0]).epsilon(1e-12));
  CHECK(after.rotation[2] == doctest::Approx(before.rotation[2]).epsilon(1e-12));
  CHECK(after.velocity[0] == 0);
  CHECK(after.spin[2] == 0);
  CHECK(after.place[1] != before.place[1]);
}
