// Friction and rotated nodes as they are read.
#include <doctest/doctest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "io/scenario/scenario.h"
#include "io/schema/cbgeo_deviations.h"
#include "io/schema/keys.h"

namespace fs = std::filesystem;
using namespace lahar;

namespace {

/// Side files in a folder of this process alone.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("lahar-walls-" + std::to_string(::getpid()))) {
    fs::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  void write(const char* name, const char* text) const { std::ofstream(path_ / name) << text; }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string scenario(int dim, const std::string& conditions) {
  const bool flat = dim == 2;
  return std::string(R"({"mesh": {"structured": {"cell_size": 1, "counts": )") +
         (flat ? "[2, 2]" : "[2, 2, 1]") + R"(}, "boundary_conditions": {)" + conditions +
         R"(}}, "particles": [{"generator": {"type": "gauss", "cset_id": -1,
             "nparticles_per_dir": 1, "material_id": 0}}],
         "sets": {"nodes": {"floor": {"box": {"max": )" +
         (flat ? "[9, 0]" : "[9, 9, 0]") + R"(}}}},
         "materials": [{"id": 0, "type": "LinearElastic", "density": 1, "youngs_modulus": 1,
                        "poisson_ratio": 0}],
         "analysis": {"dt": 1e-3, "nsteps": 1}})";
}

}  // namespace

TEST_CASE("frictions come from sets and files, in the order in which they are given") {
  const Folder folder;
  folder.write("friction.txt", "# node dir sign_n friction\n1 0 1 0.5\n7 1 -1 0.25\n");
  const auto s = read_scenario_text(scenario(2, R"("friction_constraints": [
        {"nset": "floor", "dir": "y", "sign_n": -1, "friction": 0.1}, {"file": "friction.txt"}])"),
                                    folder.path());
  const auto& read = entries_of<NodeFriction>(std::get<Model<2>>(s.model));
  REQUIRE(read.size() == 5);
  CHECK(read[1].node == 1);
  CHECK(read[1].normal == 1);
  CHECK(read[1].outward == -1);
  CHECK(read[1].friction == 0.1);
  CHECK(read[3].node == 1);  // the last one of a node counts
  CHECK(read[3].normal == 0);
  CHECK(read[3].outward == 1);
  CHECK(read[4].friction == 0.25);
}

TEST_CASE("Euler angles turn nodes by alpha + beta in 2D, by Rz(alpha) Rx(gamma) Rz(beta) in 3D") {
  const Folder folder;
  folder.write("two.txt", "4 0.5 0.25\n");
  folder.write("three.txt", "! node alpha beta gamma\n3 0.3 -0.7 1.1\n0 0.5 0.25 0\n");
  const auto flat =
      read_scenario_text(scenario(2, R"("nodal_euler_angles": "two.txt")"), folder.path());
  const auto& two = std::get<Model<2>>(flat.model).node_frames;
  REQUIRE(two.size() == 1);
  CHECK(two[0].node == 4);
  CHECK((two[0].axes.col(0) - Vec<2>(std::cos(0.75), std::sin(0.75))).norm() < 1e-15);
  CHECK((two[0].axes.col(1) - Vec<2>(-std::sin(0.75), std::cos(0.75))).norm() < 1e-15);

  const auto solid =
      read_scenario_text(scenario(3, R"("nodal_euler_angles": "three.txt")"), folder.path());
  const auto& three = std::get<Model<3>>(solid.model).node_frames;
  REQUIRE(three.size() == 2);
  CHECK(three[0].node == 3);
  // The third axis is turned by gamma about x, then by alpha about z; beta leaves it.
  const double s = std::sin(1.1), c = std::cos(1.1);
  CHECK((three[0].axes.col(2) - Vec<3>(std::sin(0.3) * s, -std::cos(0.3) * s, c)).norm() < 1e-15);
  // The first is (cos beta, sin beta, 0) before that.
  const Vec<3> first(std::cos(-0.7), std::sin(-0.7) * c, std::sin(-0.7) * s);
  const Vec<3> turned(std::cos(0.3) * first[0] - std::sin(0.3) * first[1],
                      std::sin(0.3) * first[0] + std::cos(0.3) * first[1], first[2]);
  CHECK((three[0].axes.col(0) - turned).norm() < 1e-15);
  CHECK((three[1].axes.col(0) - Vec<3>(std::cos(0.75), std::sin(0.75), 0)).norm() < 1e-15);
}

TEST_CASE("--as-cbgeo is kept with the scenario, so that a run goes on as it began") {
  ScenarioOptions options;
  const std::string text = scenario(2, "");
  const auto plain = read_scenario_text(text, "", options);
  CHECK_FALSE(std::get<Model<2>>(plain.model).analysis.as_cbgeo);
  options.as_cbgeo = true;
  const auto there = read_scenario_text(text, "", options);
  CHECK(std::get<Model<2>>(there.model).analysis.as_cbgeo);
  CHECK(there.full.find("\"as_cbgeo\": true") != std::string::npos);
  const auto again = read_scenario_text(there.full, "");
  CHECK(std::get<Model<2>>(again.model).analysis.as_cbgeo);
}

TEST_CASE("the reference page lists where CB-Geo MPM deviates") {
  const std::string page = scenario_reference();
  for (const CbgeoDeviation& deviation : cbgeo_deviations())
    CHECK(page.find(deviation.what) != std::string::npos);
}

TEST_CASE("accelerations come from sets and files, with functions of time, the last counts") {
  const Folder folder;
  folder.write("shake.txt", "# node dir acceleration\n1 0 0.5\n7 1 -0.25\n");
  std::string text = scenario(2, R"("acceleration_constraints": [
        {"nset": "floor", "dir": "x", "acceleration": 3, "math_function_id": 0},
        {"file": "shake.txt"}])");
  text.insert(1, R"("math_functions": [{"id": 0, "type": "Sin", "x0": 0, "a": 1}], )");
  const auto velocities = std::get<Model<2>>(read_scenario_text(text, folder.path()).model);
  // 3 (1 - cos t), 0.5 t
  std::map<Index, double> at_two;
  for (const NodeVelocity& v : entries_of<NodeVelocity>(velocities))
    if (v.function >= 0)
      at_two[v.node] = v.velocity * velocities.functions[static_cast<std::size_t>(v.function)](2.0);
  CHECK(at_two.at(0) == doctest::Approx(3 * (1 - std::cos(2.0))));
  CHECK(at_two.at(1) == doctest::Approx(0.5 * 2));

  const auto s = read_scenario_text(text, folder.path(), {{"analysis.preset=cbgeo"}});
  const auto& read = entries_of<NodeAcceleration>(std::get<Model<2>>(s.model));
  REQUIRE(read.size() == 4);
  CHECK(read[0].node == 0);
  CHECK(read[0].acceleration == 3);
  CHECK(read[0].function == 0);
  CHECK(read[1].node == 1);
  CHECK(read[1].dir == 0);
  CHECK(read[1].acceleration == 0.5);
  CHECK(read[1].function == -1);
}

TEST_CASE("areas of absorbing nodes follow from the cell and their place") {
  const auto areas = [](int dim, const char* position) {
    const std::string text = scenario(dim, std::string(R"("absorbing_constraints": [
        {"nset": "floor", "dir": 1, "delta": 5, "h_min": 2, "b": 0.5, "position": ")") +
                                               position + "\"}]");
    const auto s = read_scenario_text(text, "");
    return std::visit(
        [](const auto& model) {
          CHECK(model.analysis.takes_means);
          REQUIRE(!entries_of<NodeAbsorption>(model).empty());
          const NodeAbsorption& at = entries_of<NodeAbsorption>(model).back();
          CHECK(at.normal == 1);
          CHECK(at.delta == 5);
          CHECK(at.a == 1);
          CHECK(at.b == 0.5);
          return at.area;
        },
        s.model);
  };
  CHECK(areas(2, "corner") == 1);
  CHECK(areas(2, "edge") == 2);
  CHECK(areas(3, "corner") == 1);
  CHECK(areas(3, "edge") == 2);
  CHECK(areas(3, "face") == 4);
}

TEST_CASE("file names may be relative to another folder") {
  const Folder folder;
  fs::create_directories(folder.path() / "case");
  folder.write("friction.txt", "1 0 1 0.5\n");
  const fs::path file = folder.path() / "case" / "mpm.json";
  std::ofstream(file) << scenario(2, R"("friction_constraints": [{"file": "friction.txt"}])");
  ScenarioOptions options;
  options.folder = folder.path();
  CHECK(entries_of<NodeFriction>(std::get<Model<2>>(read_scenario(file, options).model)).size() ==
        1);
  CHECK_THROWS_AS(read_scenario(file), InputError);
}
