#include "io/scenario/scenario_difference.h"

#include <doctest/doctest.h>

#include <filesystem>

#include "io/scenario/scenario.h"

namespace lahar {

namespace {

const std::string scenario = R"({
  // a column
  "mesh": {"structured": {"cell_size": 0.5, "extent": [2, 2]}},
  "materials": [{"name": "soil", "type": "LinearElastic", "density": 1000,
                 "youngs_modulus": 1e6, "poisson_ratio": 0.3}],
  "particles": [{"generator": {"type": "region", "material": "soil",
                               "region": {"box": {"min": [0, 0], "max": [1, 1]}}}}],
  "analysis": {"dt": 1e-3, "nsteps": 100}})";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}

/// "pointer: before -> now" for each difference, "(allowed)" behind those that are.
std::vector<std::string> lines(const std::string& before, const std::string& now) {
  std::vector<std::string> all;
  for (const auto& one :
       differences(read_scenario_text(before, "").full, read_scenario_text(now, "").full))
    all.push_back(one.where + ": " + one.before + " -> " + one.now +
                  (one.allowed ? " (allowed)" : ""));
  return all;
}

}  // namespace

TEST_CASE("scenarios that say the same in other words do not differ") {
  CHECK(lines(scenario, scenario).empty());
  CHECK(lines(scenario, replaced(scenario, "// a column", "/* a heap */")).empty());
  CHECK(lines(scenario, replaced(scenario, "1e-3", "0.001")).empty());
  CHECK(lines(scenario, replaced(scenario, "\"nsteps\": 100", "\"nsteps\": 1.0E+2")).empty());
  CHECK(
      lines(scenario, replaced(scenario, "\"dt\": 1e-3",
                               "\"mpm_scheme\": \"usl\", \"patch_particles\": 4096, \"dt\": 1e-3"))
          .empty());
}

TEST_CASE("differences in duration and output are allowed, all others are not") {
  using Lines = std::vector<std::string>;
  CHECK(lines(scenario, replaced(scenario, "\"nsteps\": 100", "\"nsteps\": 200")) ==
        Lines{"/analysis/nsteps: 100 -> 200 (allowed)"});
  CHECK(lines(scenario,
              replaced(scenario, "\"nsteps\": 100", "\"nsteps\": 100, \"end_time\": 0.5")) ==
        Lines{"/analysis/end_time: not given -> 0.5 (allowed)"});
  CHECK(lines(scenario, replaced(scenario, "\"analysis\"",
                                 "\"post_processing\": {\"checkpoint_steps\": 7}, \"analysis\"")) ==
        Lines{"/post_processing/checkpoint_steps: 0 -> 7 (allowed)"});
  CHECK(lines(scenario, replaced(scenario, "1e-3", "2e-3")) ==
        Lines{"/analysis/dt: 0.001 -> 0.002"});
  CHECK(lines(scenario, replaced(scenario, "\"density\": 1000", "\"density\": 1001")) ==
        Lines{"/materials/0/density: 1000 -> 1001"});
  CHECK(lines(scenario, replaced(scenario, "[1, 1]", "[1, 2]")).size() == 1);
}

TEST_CASE("a pointer that only begins like an allowed one is not allowed") {
  const auto found = differences("{\"titles\": 1, \"post_processing_x\": 1, \"title\": 1}",
                                 "{\"titles\": 2, \"post_processing_x\": 2, \"title\": 2}");
  REQUIRE(found.size() == 3);
  for (const auto& one : found) CHECK(one.allowed == (one.where == "/title"));
}

TEST_CASE("side files are compared by what is in them, not by where they lie") {
  const std::vector<SideFileHash> before{{"a/mesh.txt", "12"}, {"a/particles.txt", "34"}};
  CHECK(differences(before, {{"b/mesh.txt", "12"}, {"b/particles.txt", "34"}}).empty());
  const auto changed = differences(before, {{"a/mesh.txt", "12"}, {"a/particles.txt", "35"}});
  REQUIRE(changed.size() == 1);
  CHECK(changed[0].where == "side file a/particles.txt");
  CHECK(changed[0].before.find("34") != std::string::npos);
  CHECK_FALSE(changed[0].allowed);
  CHECK(differences(before, std::vector<SideFileHash>{before[0]}).size() == 1);
}

}  // namespace lahar
