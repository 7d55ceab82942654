#include <doctest/doctest.h>
#include <unistd.h>

#include <fstream>

#include "io/base/memory_limit.h"
#include "io/scenario/scenario.h"
#include "tests/io/base/thread_team.h"
#include "tests/io/scenario/broken_case.h"

namespace fs = std::filesystem;
using namespace lahar;

namespace {

std::string said(const std::string& text, double bytes, int team = 1) {
  std::vector<std::string> all(static_cast<std::size_t>(team));
  const auto read = [&](const Team& member) {
    std::string& own = all[static_cast<std::size_t>(member.index())];
    try {
      ScenarioOptions options;
      options.team = &member;
      options.memory = {bytes, "the test has less"};
      read_scenario_text(text, ".", options);
      own = "accepted";
    } catch (const InputError& error) {
      own = error.what();
    }
  };
  if (team == 1)
    read(Team());
  else
    run_team(team, read);
  for (const std::string& own : all) CHECK(own == all.front());
  return all.front();
}

/// A scenario of so many cells, with a generator and more in `mesh`.
std::string scenario(const std::string& counts, const std::string& generator,
                     const std::string& mesh = "") {
  return R"({"mesh": {"structured": {"cell_size": 1, "counts": )" + counts + "}" + mesh +
         R"(}, "particles": [{"generator": {"material_id": 0, )" + generator + R"(}}],
 "materials": [{"type": "LinearElastic", "density": 1, "youngs_modulus": 1, "poisson_ratio": 0}],
 "analysis": {"nsteps": 1, "dt": 1e-3}})";
}

constexpr double mebi = 1024.0 * 1024.0;
const std::string few =
    R"("type": "region", "region": {"box": {"min": [0, 0, 0], "max": [2, 2, 2]}})";

}  // namespace

TEST_CASE("what a case needs is refused before it is taken") {
  const std::string many = R"("type": "region", "per_cell": 4)";
  const std::string gauss = R"("type": "gauss", "cset_id": -1, "nparticles_per_dir": 4)";
  const std::string inject = R"("type": "inject", "cset_id": -1, "nparticles_per_dir": 4)";
  for (const int team : {1, 2, 3}) {
    CAPTURE(team);
    // 1e9 nodes or cells: nothing of this could be made here.
    CHECK(said(scenario("[800, 1000, 1000]", many), 4 * mebi, team).find("particles or more") !=
          std::string::npos);
    CHECK(said(scenario("[800, 1000, 1000]", gauss), 4 * mebi, team).find("800,000,000 cells") !=
          std::string::npos);
    CHECK(said(scenario("[800, 1000, 1000]", inject), 4 * mebi, team).find("800,000,000 cells") !=
          std::string::npos);
    CHECK(said(scenario("[20, 20, 20]", gauss), 8 * mebi, team).find("512,000 particles") !=
          std::string::npos);
    CHECK(said(scenario("[20, 20, 20]", inject), mebi, team).find("512,000 places of injection") !=
          std::string::npos);
    CHECK(said(scenario("[500, 500, 500]", few, R"(, "cell_type": "ED3T4")"), 64 * mebi, team)
              .find("a mesh of 125,751,501 nodes and 750,000,000 cells of") != std::string::npos);
    CHECK(said(scenario("[800, 1000, 1000]", few, R"(, "boundary_conditions": {
              "velocity_constraints": [{"nset_id": -1, "dir": 0, "velocity": 0}]})"),
               64 * mebi, team)
              .find("what is said of all 802,602,801 nodes") != std::string::npos);
  }
  CHECK(said(scenario("[20, 20, 20]", few), 64 * mebi) == "accepted");
  const std::string set =
      R"(}, "sets": {"nodes": {"all": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, -1]}}})";
  CHECK(said(scenario("[800, 1000, 1000]", few, set), 64 * mebi).find("sets, one with more than") !=
        std::string::npos);
}

TEST_CASE("a message of memory has numbers, the limit and what to do") {
  const Problem problem =
      too_much_memory(3.5 * 1024 * mebi, "a mesh", {mebi, "this machine has 1"});
  CHECK(problem.message == "3.5 GiB of memory are needed for a mesh; this machine has 1");
  CHECK(problem.hint.find("--memory SIZE") != std::string::npos);
}

TEST_CASE("a region that was refused fills nothing") {
  const std::string two_points =
      R"("type": "region", "region": {"polygon": {"points": [[0, 0], [1, 0]], "axis": "z", "range": [0, 1]}})";
  // Everywhere would be 8e8 cells.
  CHECK(said(scenario("[800, 1000, 1000]", two_points), mebi).find("polygon") != std::string::npos);
}

TEST_CASE("sizes of memory are numbers with units") {
  CHECK(bytes_of("65536") == 65536);
  CHECK(bytes_of("500M") == 500 * mebi);
  CHECK(bytes_of("64G") == 65536 * mebi);
  CHECK(bytes_of("1.5 TiB") == 1.5 * mebi * mebi);
  CHECK(bytes_of("2KB") == 2048);
  for (const char* text : {"", "G", "-1G", "0", "1X", "1e400", "nan", "inf", "64 G B"})
    CHECK_THROWS_AS(bytes_of(text), InputError);
}

TEST_CASE("control groups limit memory, each and all around it") {
  const fs::path root = fs::temp_directory_path() / ("lahar-groups-" + std::to_string(::getpid()));
  const auto write = [&](const char* file, const char* text) {
    fs::create_directories((root / file).parent_path());
    std::ofstream(root / file) << text;
  };
  CHECK(std::isinf(group_limit(root, "0::/\n")));
  write("a/memory.max", "1000000\n");
  write("a/b/memory.max", "max\n");
  write("a/b/c/memory.max", "2000000\n");
  CHECK(group_limit(root, "0::/a/b/c\n") == 1000000);
  CHECK(std::isinf(group_limit(root, "0::/other\n")));
  write("memory/job/memory.limit_in_bytes", "3000000\n");
  CHECK(group_limit(root, "5:devices:/\n4:memory:/job/step\n0::/\n") == 3000000);
  write("memory/job/memory.limit_in_bytes", "9223372036854771712\n");
  CHECK(std::isinf(group_limit(root, "4:cpu,memory:/job\n")));
  fs::remove_all(root);
}

TEST_CASE("ranks of a machine share its memory, --memory takes its place") {
  CHECK(memory_limit(0, 1).bytes > 0);
  CHECK(memory_limit(0, 4).bytes * 3.9 < memory_limit(0, 1).bytes);
  CHECK(memory_limit(100 * mebi, 2).bytes == 50 * mebi);
  CHECK(memory_limit(100 * mebi, 2).source ==
        "--memory allows 100.0 MiB, 50.0 MiB for each of 2 ranks on it");
}
