// Which bodies a scenario makes.
#include <doctest/doctest.h>

#include <string>

#include "io/scenario/scenario.h"

using namespace lahar;

namespace {

/// Four cells in a row with a particle each, of materials a, a, b, b; the second and third are the
/// set "middle".
Scenario scenario(const std::string& analysis, const ScenarioOptions& options = {}) {
  const std::string generator =
      R"({"generator": {"type": "region", "per_cell": 1, "velocity": [1, 0],
    "region": {"box": {"min": [)";
  return read_scenario_text(
      R"({"mesh": {"structured": {"cell_size": 1, "counts": [4, 1]}},
          "sets": {"particles": {"middle": {"box": {"min": [1, 0], "max": [3, 1]}}}},
          "materials": [
            {"id": 3, "name": "a", "type": "LinearElastic", "density": 1, "youngs_modulus": 1,
             "poisson_ratio": 0},
            {"id": 5, "name": "b", "type": "LinearElastic", "density": 2, "youngs_modulus": 1,
             "poisson_ratio": 0}],
          "particles": [)" +
          generator + R"(0, 0], "max": [2, 1]}}, "material": "a"}}, )" + generator +
          R"(2, 0], "max": [4, 1]}}, "material": "b"}}],
          "analysis": {"dt": 1e-3, "nsteps": 1)" +
          analysis + "}}",
      "", options);
}

/// Body of each particle, and the number of bodies.
std::pair<std::vector<int>, int> bodies(const std::string& analysis) {
  const Scenario s = scenario(analysis);
  const auto& model = std::get<Model<2>>(s.model);
  std::vector<int> body;
  for (std::size_t p = 0; p < model.particles.material.size(); ++p) {
    const Material& material = model.materials[model.particles.material[p]];
    body.push_back(material.body);
    CHECK(material.name == (p < 2 ? "a" : "b"));  // as without bodies
    CHECK(material.id == (p < 2 ? 3 : 5));
    CHECK(material.density == (p < 2 ? 1 : 2));
  }
  return {body, model.analysis.contact.bodies};
}

using Bodies = std::pair<std::vector<int>, int>;

}  // namespace

TEST_CASE("bodies are materials, or what the list names, and the rest is the first") {
  CHECK(bodies("") == Bodies{{0, 0, 0, 0}, 1});
  CHECK(bodies(R"(, "interface": false)") == Bodies{{0, 0, 0, 0}, 1});
  CHECK(bodies(R"(, "interface": true)") == Bodies{{0, 0, 1, 1}, 2});
  const auto list = [](const std::string& entries) {
    return R"(, "interface": true, "contact": {"bodies": [)" + entries + "]}";
  };
  CHECK(bodies(list(R"({"material": "b"})")) == Bodies{{0, 0, 1, 1}, 2});
  CHECK(bodies(list(R"({"material_id": 3})")) == Bodies{{1, 1, 0, 0}, 2});
  CHECK(bodies(list(R"({"pset": "middle"})")) == Bodies{{0, 1, 1, 0}, 2});
  CHECK(bodies(list(R"({"material": "a"}, {"pset": "middle"})")) == Bodies{{1, 2, 2, 0}, 3});
  CHECK(bodies(list(R"({"material": "a"}, {"material": "b"})")) == Bodies{{0, 0, 1, 1}, 2});
}

TEST_CASE("bodies that come by injection alone are counted") {
  const std::string injected = R"(, "particles": [
    {"generator": {"type": "inject", "cset": "first", "nparticles_per_dir": 1, "material": "b"}},
    {"generator": {"type": "region", "per_cell": 1, "material": "a",
                   "region": {"box": {"min": [2, 0], "max": [4, 1]}}}}])";
  const Scenario s = read_scenario_text(
      R"({"mesh": {"structured": {"cell_size": 1, "counts": [4, 1]}},
          "sets": {"cells": {"first": {"box": {"min": [0, 0], "max": [1, 1]}}}},
          "materials": [
            {"name": "unused", "type": "LinearElastic", "density": 1, "youngs_modulus": 1,
             "poisson_ratio": 0},
            {"name": "a", "type": "LinearElastic", "density": 1, "youngs_modulus": 1,
             "poisson_ratio": 0},
            {"name": "b", "type": "LinearElastic", "density": 2, "youngs_modulus": 1,
             "poisson_ratio": 0}],
          "analysis": {"dt": 1e-3, "nsteps": 1, "interface": true})" +
          injected + "}",
      "", {});
  const auto& model = std::get<Model<2>>(s.model);
  CHECK(model.analysis.contact.bodies == 2);
  CHECK(model.materials.at(1).body == 0);
  CHECK(model.materials.at(2).body == 1);
  CHECK(model.injections.at(0).material == 2);
  CHECK(s.warnings.empty());
}

TEST_CASE("the friction of bodies") {
  const auto friction = [](const std::string& contact) {
    const Scenario s = scenario(R"(, "interface": true)" + contact);
    return std::get<Model<2>>(s.model).analysis.contact.friction;
  };
  CHECK(friction("") == 0);
  CHECK(friction(R"(, "contact": {"friction": 0.4})") == 0.4);
}

TEST_CASE("an interface of one body is warned about") {
  const Scenario s =
      scenario(R"(, "interface": true, "contact": {"bodies": [{"pset_id": "middle"}]})",
               {.overrides = {R"(sets.particles.middle={"all": true})"}});
  REQUIRE(s.warnings.size() == 1);
  CHECK(s.warnings[0].message == "'interface' has no effect: all particles are one body");
}

TEST_CASE("contact with usf or usl is refused with the reason, CB-Geo's input gets a warning") {
  for (const std::string scheme : {"usf", "usl"}) {
    const std::string keys = R"(, "interface": true, "mpm_scheme": ")" + scheme + '"';
    std::string message;
    try {
      scenario(keys);
    } catch (const InputError& error) {
      message = error.what();
    }
    CHECK(message.find("'interface' does not go together with this 'mpm_scheme': " + scheme +
                       " takes strains from") != std::string::npos);
    const Scenario s = scenario(keys + R"(, "preset": "cbgeo")");
    REQUIRE(s.warnings.size() == 1);
    CHECK(s.warnings[0].message.starts_with("'interface' is inaccurate with this 'mpm_scheme': " +
                                            scheme));
  }
  CHECK(scenario(R"(, "interface": true, "mpm_scheme": "musl")").warnings.empty());
}
