#include "tests/io/scenario/broken_case.h"

#include <doctest/doctest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "io/scenario/scenario.h"
#include "tests/io/base/thread_team.h"

namespace fs = std::filesystem;

namespace lahar::broken {

namespace {

const std::map<std::string, std::string> valid_case = {
    {"mpm.json", R"({
  "title": "Broken",
  "mesh": {
    "mesh": "mesh.txt",
    "entity_sets": "sets.json",
    "cell_type": "ED2Q4",
    "boundary_conditions": {
      "velocity_constraints": [{"nset_id": 0, "dir": 1, "velocity": 0.0}]
    }
  },
  "particles": [
    {"generator": {"type": "file", "location": "particles.txt", "material_id": 0}}
  ],
  "materials": [
    {"id": 0, "type": "LinearElastic2D", "density": 1000,
     "youngs_modulus": 1e6, "poisson_ratio": 0.3}
  ],
  "external_loading_conditions": {"gravity": [0, -9.81]},
  "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": 10},
  "post_processing": {"output_steps": 5}
}
)"},
    {"mesh.txt", R"(# two unit squares
6 2
0 0
1 0
2 0
0 1
1 1
2 1
0 1 4 3
1 2 5 4
)"},
    {"particles.txt", R"(3
0.25 0.5
0.75 0.5
1.5 0.5
)"},
    {"sets.json", R"({
  "node_sets": [{"id": 0, "set": [0, 1, 2]}],
  "particle_sets": [{"id": 3, "set": [0, 2]}]
}
)"},
};

// A folder of this process alone, empty, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder()
      : path_(fs::temp_directory_path() / ("lahar-broken-" + std::to_string(::getpid()))) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

void apply(const Edit& edit, const fs::path& folder, std::map<std::string, std::string>& files) {
  switch (edit.kind) {
    case Edit::Kind::remove:
      files.erase(edit.file);
      return;
    case Edit::Kind::folder:
      files.erase(edit.file);
      fs::create_directories(folder / edit.file);
      return;
    case Edit::Kind::write:
      files[edit.file] = edit.to;
      return;
    case Edit::Kind::replace: {
      std::string& text = files.at(edit.file);
      const auto at = text.find(edit.from);
      REQUIRE(at != std::string::npos);
      text.replace(at, edit.from.size(), edit.to);
      return;
    }
  }
}

// `text` without every occurrence of `part`.
std::string without(std::string text, const std::string& part) {
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part))
    text.erase(at, part.size());
  return text;
}

}  // namespace

namespace {

std::string read_file(const fs::path& file, const ScenarioOptions& options) {
  try {
    const Scenario s = read_scenario(file, options);
    return "accepted\n" + format_problems(s.warnings, "warning");
  } catch (const InputError& e) {
    return format_problems(e.problems());
  }
}

}  // namespace

std::string read(const std::vector<Edit>& edits, const std::vector<std::string>& overrides,
                 int team) {
  const TemporaryFolder folder;
  auto files = valid_case;
  for (const Edit& edit : edits) apply(edit, folder.path(), files);
  for (const auto& [name, text] : files)
    std::ofstream(folder.path() / name, std::ios::binary) << text;
  std::vector<std::string> said(static_cast<std::size_t>(team));
  const auto read_as = [&](const Team& member) {
    said[static_cast<std::size_t>(member.index())] =
        read_file(folder.path() / "mpm.json", {.overrides = overrides, .team = &member});
  };
  if (team == 1)
    read_as(Team());
  else
    run_team(team, read_as);
  for (const std::string& text : said) CHECK(text == said.front());
  return without(said.front(), folder.path().string() + "/");
}

void check(const std::vector<Entry>& table, std::size_t size) {
  CHECK(table.size() == size);
  for (const Entry& entry : table)
    for (const int team : {1, 2, 3}) {
      CAPTURE(entry.name);
      CAPTURE(team);
      CHECK(read(entry.edits, entry.overrides, team) == entry.expected);
    }
}

}  // namespace lahar::broken
