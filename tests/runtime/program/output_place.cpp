// Where a scenario may have its results: in its own folder, unless the command says another.
#include <doctest/doctest.h>

#include <filesystem>

#include "io/base/problems.h"
#include "runtime/program/stages_run.h"

using namespace lahar;

namespace {

/// Where the results of a scenario would be, and what is wrong with that; "" = nothing.
std::string refusal(const std::string& scenario, const std::string& planned,
                    const std::string& folder = "") {
  RunArguments arguments;
  arguments.scenario = scenario;
  arguments.options.folder = folder;
  const auto problem = distant_output(arguments, planned);
  return problem ? problem->message : "";
}

/// The scenario as text, with its results under `path`.
std::string scenario_with(const std::string& path, const std::string& mpm_type) {
  return R"({"mesh": {"structured": {"cell_size": 0.1, "extent": [1, 1]}},
 "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                              "region": {"box": {"min": [0, 0], "max": [0.2, 0.2]}}}}],
 "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e5,
                "poisson_ratio": 0.3}],
 "analysis": {)" +
         mpm_type + R"("uuid": "case", "dt": 1e-4, "nsteps": 1},
 "post_processing": {
   "path": ")" +
         path + "\"}}";
}

/// What `lahar run` says of it before the model is built.
std::string said_of_run(const std::string& path, const std::string& output = "",
                        const std::string& mpm_type = "", bool as_cbgeo = false) {
  RunArguments arguments;
  arguments.scenario = "there/case.json";
  arguments.output = output;
  ScenarioOptions options;
  options.text_name = arguments.scenario;
  options.as_cbgeo = as_cbgeo;
  options.planned = [&](const std::string& folder, const std::vector<std::string>& stages) {
    check_output(arguments, folder, stages);
  };
  try {
    read_scenario_text(scenario_with(path, mpm_type), "there", options);
  } catch (const InputError& error) {
    return format_problems(error.problems());
  }
  return "";
}

}  // namespace

TEST_CASE("results in the folder of the scenario are planned, wherever that is") {
  CHECK(refusal("case.json", "results/case").empty());
  CHECK(refusal("./case.json", "results/case").empty());
  CHECK(refusal("../case.json", "../results/case").empty());
  CHECK(refusal("/there/case.json", "/there/case").empty());
  CHECK(refusal("there/../case.json", "case").empty());
  const auto here = std::filesystem::current_path().string();
  CHECK(refusal("case.json", here + "/results/case").empty());
  CHECK(refusal("case.json", "/there/results/case", "/there").empty());
}

TEST_CASE("results out of the folder of the scenario are refused") {
  CHECK(refusal("/there/case.json", "/elsewhere/case") ==
        "results would be in /elsewhere/case, which is not in the folder of the scenario, /there/");
  for (const char* folder : {"../case", "/case", "../../results/case"}) {
    CAPTURE(folder);
    CHECK_FALSE(refusal("case.json", folder).empty());
  }
  CHECK_FALSE(refusal("/there/case.json", "/therein/case").empty());  // no folder, but a like name
  CHECK_FALSE(refusal("/there/case.json", "/there/results/case", "/here").empty());
}

TEST_CASE("a path that leads out of the scenario's folder is shown where it is written") {
  const auto elsewhere = (std::filesystem::current_path() / "elsewhere" / "case").string();
  const auto there = (std::filesystem::current_path() / "there" / "").string();
  CHECK(said_of_run("../elsewhere") ==
        "there/case.json:8:12: error: results would be in " + elsewhere +
            ", which is not in the folder of the scenario, " + there +
            " [/post_processing/path]\n"
            "     \"path\": \"../elsewhere\"}}\n"
            "             ^\n"
            "  hint: take a folder in there, such as \"results/\", or say --output FOLDER: a "
            "scenario of others must not write where it likes\n");
  CHECK(said_of_run("results/../../elsewhere") != "");
  CHECK(said_of_run("/tmp") != "");
  CHECK(said_of_run("/tmp", "", "\"type\": \"MPMExplicit2D\", ", true) != "");  // of CB-Geo MPM too
  CHECK(said_of_run("results/") == "");
  CHECK(said_of_run(".") == "");
  CHECK(said_of_run("results/../others") == "");
  CHECK(said_of_run("../elsewhere", "/nowhere/at/all") == "");  // --output
}
