#include "io/run/run_folder.h"

#include <doctest/doctest.h>

#include <fstream>

#include "io/base/atomic_file.h"
#include "io/base/sha256.h"
#include "io/frames/vtkhdf.h"
#include "io/results/compare.h"
#include "io/results/export.h"
#include "physics/base/error.h"
#include "tests/io/frames/frame_samples.h"

namespace lahar {

using namespace test;
namespace fs = std::filesystem;

namespace {

RunFolderContents contents() {
  RunFolderContents c;
  c.info.title = "a case";
  c.info.command = {"lahar", "run", "scenario.json"};
  c.info.particles = 2;
  c.scenario = "{ // as it was\n}";
  c.scenario_full = "{}";
  return c;
}

Frame frame_at(Index step) {
  Frame frame = two_particles();
  frame.step = step;
  frame.time = static_cast<double>(step) / 8;
  return frame;
}

/// A finished run with frames at these steps.
void make_run(const fs::path& path, const std::vector<Index>& steps) {
  RunFolder run(path, contents());
  for (const Index step : steps)
    write_frame(frame_at(step), frames_folder(path) / frame_name(step, ".hdf"));
  run.finish({});
}

/// A finished run with these stages.
void make_stages(const fs::path& path, const std::vector<std::string>& names) {
  Index number = 0;
  for (const std::string& name : names) {
    RunFolderContents stage = contents();
    stage.info.stage = ++number;
    RunFolder(path / name, stage).finish({});
  }
}

bool contains(const fs::path& file, const std::string& text) {
  return read_text_file(file).find(text) != std::string::npos;
}

/// Message and hint of the InputError that `action` throws.
template <class Action>
std::string refusal(Action&& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.problems().front().message + " | " + error.problems().front().hint;
  }
  return "no error";
}

}  // namespace

TEST_CASE("a run folder holds what the conventions promise, and nothing else") {
  const TemporaryFolder folder;
  const fs::path path = folder.path / "deep/run";
  RunFolder run(path, contents());
  CHECK(contains(path / "manifest.json", "\"status\": \"running\""));
  run.log("first");
  run.log("second\n");
  CHECK(read_text_file(path / "log.txt") == "first\nsecond\n");
  HistoryRow row;
  row.step = 3;
  row.time = 0.1;
  row.momentum = {1, -2, 1e-30};
  row.max_speed = 0.5;
  run.history(row);
  CHECK(read_text_file(path / "history.csv") ==
        "step,time,dt,particles,mass,momentum_x,momentum_y,momentum_z,kinetic,internal,external,"
        "damping,friction,balance,max_speed,divided\n"
        "3,0.1,0,0,0,1,-2,1e-30,0,0,0,0,0,0,0.5,0\n");
  run.finish({.status = RunStatus::finished, .message = "", .steps = 5, .warnings = {"watch out"}});
  CHECK(contains(path / "manifest.json", "\"status\": \"finished\""));
  CHECK(contains(path / "manifest.json", "\"watch out\""));
  CHECK(read_text_file(path / "scenario.json") == contents().scenario);
  CHECK(names_in(path) == std::vector<std::string>{"frames", "history.csv", "log.txt",
                                                   "manifest.json", "scenario.full.json",
                                                   "scenario.json"});
  CHECK(names_in(frames_folder(path)).empty());
}

TEST_CASE("a folder that a new run would not take is refused before, and left as it is") {
  const TemporaryFolder folder;
  const fs::path path = folder.path / "run", notes = folder.path / "notes";
  const auto says = [&](const fs::path& at, bool overwrite) {
    return refusal([&] { check_run_folder(at, overwrite); });
  };
  CHECK(says(path, false) == "no error");
  CHECK_FALSE(fs::exists(path));
  {
    RunFolder run(path, contents());
    CHECK(says(path, true).find("being written to by another run") != std::string::npos);
    run.finish({});
  }
  CHECK(says(path, false).find("holds the results of an earlier run | ") != std::string::npos);
  CHECK(says(path, true) == "no error");
  CHECK(is_run_folder(path));
  fs::create_directory(notes);
  write_text_file(notes / "text", "mine");
  CHECK(says(notes, true).find("is not a run of Lahar") != std::string::npos);
}

TEST_CASE("an earlier run is replaced only on request, and only its results") {
  const TemporaryFolder folder;
  const fs::path path = folder.path / "run";
  make_run(path, {0, 10});
  export_run(path, ExportFormat::csv);
  write_text_file(path / "notes.txt", "mine");
  write_text_file(path / "frames/picture.png", "mine");
  CHECK(refusal([&] { make_run(path, {1}); }) ==
        "output folder " + path.string() + " holds the results of an earlier run | " +
            "add --restart latest to continue it, --overwrite to replace them, or choose another "
            "output folder");
  CHECK(frames_of_run(path).size() == 2);
  RunFolder(path, contents(), true).finish({});
  CHECK(frames_of_run(path).empty());
  CHECK(names_in(path / "export").empty());
  CHECK(read_text_file(path / "notes.txt") == "mine");
  CHECK(names_in(path / "frames") == std::vector<std::string>{"picture.png"});
}

TEST_CASE("a run with stages is replaced by one without only on request, and wholly") {
  const TemporaryFolder folder;
  const fs::path path = folder.path / "run";
  make_stages(path, {"one", "two"});
  write_text_file(path / "two/notes.txt", "mine");
  const std::string said = refusal([&] { check_run_folder(path, false); });
  CHECK(said.starts_with("output folder " + path.string() + " holds the results of an earlier"));
  CHECK(refusal([&] { RunFolder(path, contents()); }) == said);
  CHECK(refusal([&] { check_run_folder(path, true); }) == "no error");
  RunFolder(path, contents(), true).finish({});
  CHECK(folders_of_run(path).size() == 1);
  CHECK(stages_in(path).empty());
  CHECK_FALSE(fs::exists(path / "one"));
  CHECK(names_in(path / "two") == std::vector<std::string>{"notes.txt"});
}

TEST_CASE("a run with stages refuses a folder with a run without, or with other stages") {
  const TemporaryFolder folder;
  const fs::path path = folder.path / "run", staged = folder.path / "staged";
  const std::vector<std::string> names{"one", "three"};
  const auto says = [&](const fs::path& at, bool overwrite) {
    return refusal([&] { check_run_folder(at, names, overwrite); });
  };
  CHECK(says(path, false) == "no error");
  make_run(path, {0});
  make_stages(staged, {"first", "second"});
  for (const fs::path& at : {path, staged}) {
    CHECK(says(at, false).starts_with("output folder " + at.string() + " holds the results"));
    CHECK(says(at, true) == "no error");
  }
  write_text_file(path / "notes.txt", "mine");
  remove_unstaged_run(path);
  CHECK(names_in(path) == std::vector<std::string>{"notes.txt"});
  CHECK(says(path, false) == "no error");
  write_text_file(staged / "second/notes.txt", "mine");
  const auto left = remove_stages(staged, [](const std::string&) { return true; });
  CHECK(left == std::vector<std::string>{"second"});
  CHECK(names_in(staged) == std::vector<std::string>{"second"});
  CHECK(refusal([&] { RunFolder(staged / "second", contents(), true); }).find("not a run") !=
        std::string::npos);
  RunFolder(staged / "second", contents(), true, true).finish({});
  CHECK(read_text_file(staged / "second/notes.txt") == "mine");
}

TEST_CASE("stages that are being written to are not removed") {
  const TemporaryFolder folder;
  const fs::path path = folder.path / "run";
  RunFolderContents first = contents();
  first.info.stage = 1;
  const RunFolder stage(path / "one", first);
  const auto busy = [](const std::string& said) {
    return said.find("is being written to by another run") != std::string::npos;
  };
  CHECK(busy(refusal([&] { check_run_folder(path, true); })));
  CHECK(busy(refusal([&] { check_run_folder(path, {"other"}, true); })));
  CHECK(busy(refusal([&] { RunFolder(path, contents(), true); })));
  CHECK(is_run_folder(path / "one"));
}

TEST_CASE("files of the user beside stages are not replaced by those of a run") {
  const TemporaryFolder folder;
  make_stages(folder.path, {"one"});
  write_text_file(folder.path / "scenario.json", "mine");
  CHECK(refusal([&] { RunFolder(folder.path, contents(), true); }).find("not a run of Lahar") !=
        std::string::npos);
  CHECK(read_text_file(folder.path / "scenario.json") == "mine");
  CHECK(is_run_folder(folder.path / "one"));
}

TEST_CASE("of two stages with one number the later one counts") {
  const TemporaryFolder folder;
  make_stages(folder.path, {"one", "two"});
  const fs::path file = folder.path / "two/manifest.json";
  std::string older = read_text_file(file);
  older.replace(older.find("\"started\": \"2"), 13, "\"started\": \"1");
  make_stages(folder.path, {"begin", "three"});
  write_text_file(file, older);
  fs::remove_all(folder.path / "begin");
  std::vector<std::string> names;
  for (const FolderOfRun& one : folders_of_run(folder.path))
    names.push_back(one.folder.filename().string());
  CHECK(names == std::vector<std::string>{"one", "three"});
}

TEST_CASE("a folder that is no run is never touched") {
  const TemporaryFolder folder;
  write_text_file(folder.path / "thesis.tex", "years of work");
  for (const bool overwrite : {false, true})
    CHECK(refusal([&] { RunFolder(folder.path, contents(), overwrite); }) ==
          "output folder " + folder.path.string() + " exists and is not a run of Lahar | " +
              "choose another output folder, or remove this one yourself");
  CHECK(names_in(folder.path) == std::vector<std::string>{"thesis.tex"});
}

TEST_CASE("an empty folder may become a run") {
  const TemporaryFolder folder;
  RunFolder(folder.path, contents()).finish({});
  CHECK(is_run_folder(folder.path));
}

TEST_CASE("two runs do not write to one folder at the same time") {
  const TemporaryFolder folder;
  const RunFolder first(folder.path, contents());
  CHECK(refusal([&] { RunFolder(folder.path, contents(), true); }) ==
        "output folder " + folder.path.string() + " is being written to by another run | " +
            "wait for it to end, or choose another output folder");
}

TEST_CASE("a run in a folder that is removed or replaced ends, and writes nothing into another's") {
  const TemporaryFolder folder;
  const fs::path path = folder.path / "run", moved = folder.path / "moved";
  const auto lost = [&](RunFolder& run) {
    const std::string message = "run folder " + path.string() + " was removed, moved or replaced";
    CHECK_THROWS_WITH_AS(run.check_place(), doctest::Contains(message.c_str()), IoError);
    CHECK_THROWS_AS(run.sync(), IoError);
    CHECK_THROWS_AS(run.removed(std::vector<RemovedParticle>(1)), IoError);
    CHECK_THROWS_AS(run.finish({}), IoError);
  };
  {
    RunFolder first(path, contents());
    CHECK_NOTHROW(first.check_place());
    fs::rename(path, moved);
    lost(first);
    CHECK(!fs::exists(path));
  }
  {
    RunFolder second(path, contents());
    fs::remove_all(path);
    make_run(path, {7});
    const std::string manifest = read_text_file(path / "manifest.json");
    lost(second);
    CHECK(read_text_file(path / "manifest.json") == manifest);
    CHECK(!fs::exists(path / "removed.csv"));
  }
  CHECK(is_run_folder(moved));
}

TEST_CASE("a run that is only beginning in a folder refuses another, too") {
  const TemporaryFolder folder;
  const RunFolder first(folder.path, contents());
  // Before its manifest has its name, but after other files.
  fs::remove(folder.path / "manifest.json");
  CHECK(refusal([&] { RunFolder(folder.path, contents()); }) ==
        "output folder " + folder.path.string() + " is being written to by another run | " +
            "wait for it to end, or choose another output folder");
}

TEST_CASE("an output folder that cannot be made is an error with the system's reason") {
  const TemporaryFolder folder;
  write_text_file(folder.path / "file", "");
  const fs::path path = folder.path / "file/run";
  CHECK_THROWS_WITH_AS(RunFolder(path, contents()),
                       ("cannot make folder " + path.string() + ": Not a directory").c_str(),
                       IoError);
}

TEST_CASE("the manifest of a run that is not finished says failed") {
  const TemporaryFolder folder;
  { const RunFolder run(folder.path, contents()); }
  CHECK(contains(folder.path / "manifest.json", "\"status\": \"failed\""));
}

TEST_CASE("a frame of a run is found by its step, a missing one is answered with those there are") {
  const TemporaryFolder folder;
  const fs::path path = folder.path / "run";
  std::vector<Index> steps;
  for (Index step = 0; step < 12; ++step) steps.push_back(10 * step);
  make_run(path, steps);
  CHECK(find_frame(path).step == 110);
  CHECK(read_particles(path, 20).time == 2.5);
  CHECK(refusal([&] { find_frame(path, 25); }) ==
        "run " + path.string() +
            " has no frame at step 25 | its steps are 0, 10, 20, 30, 40, 50, ..., 110");
}

TEST_CASE("abandoned files of a killed run are not taken for frames, and are removed with it") {
  const TemporaryFolder folder;
  make_run(folder.path, {3});
  write_text_file(folder.path / "frames/.particles_0000000004.hdf.1234.part", "half");
  CHECK(frames_of_run(folder.path).size() == 1);
  RunFolder(folder.path, contents(), true).finish({});
  CHECK(names_in(folder.path / "frames").empty());
}

TEST_CASE("a run is exported at its last step, at one step, or at all") {
  const TemporaryFolder folder;
  const fs::path run = folder.path / "run", out = folder.path / "out";
  make_run(run, {0, 10});
  using Kind = FrameChoice::Kind;
  const auto exported = [&](ExportFormat format, FrameChoice choice, const fs::path& output) {
    std::vector<std::string> names;
    for (const fs::path& file : export_run(run, format, choice, output)) {
      CHECK(fs::file_size(file) > 0);
      names.push_back(file.lexically_relative(folder.path).string());
    }
    return names;
  };
  CHECK(exported(ExportFormat::csv, {}, {}) ==
        std::vector<std::string>{"run/export/particles_0000000010.csv"});
  CHECK(exported(ExportFormat::csv, {Kind::step, 0}, folder.path / "state.csv") ==
        std::vector<std::string>{"state.csv"});
  CHECK(exported(ExportFormat::vtu, {Kind::all}, out) ==
        std::vector<std::string>{"out/particles_0000000000.vtu", "out/particles_0000000010.vtu",
                                 "out/particles.pvd"});
  CHECK(refusal([&] { exported(ExportFormat::csv, {Kind::all}, out / "one.csv"); }) ==
        "2 frames do not fit into one file " + (out / "one.csv").string() +
            " | give a folder, or choose one step");
  CHECK(refusal([&] { export_format("xls"); }).starts_with("unknown export format 'xls'"));
  CHECK(compare(run, folder.path / "state.csv", {}, 0).passed);
}

TEST_CASE("an export replaces no file that the run wrote") {
  const TemporaryFolder folder;
  const fs::path run = folder.path / "run";
  make_run(run, {0, 10});
  const auto says = [&](const fs::path& output) {
    return refusal([&] { export_run(run, ExportFormat::csv, {}, output); });
  };
  const std::string before = read_text_file(run / "history.csv");
  CHECK(says(run / "history.csv") ==
        (run / "history.csv").string() +
            " is a file of the run: it would be lost | choose another name, or leave out --output: "
            "files then go to the folder export of the run");
  CHECK(says(run / "frames/../history.csv").find("is a file of the run") != std::string::npos);
  CHECK(read_text_file(run / "history.csv") == before);
  fs::create_directory(run / "gauges");
  write_text_file(run / "gauges/toe.csv", "step [-]\n");
  CHECK(says(run / "gauges/toe.csv").find("is a file of the run") != std::string::npos);
  for (int time = 0; time < 2; ++time) {
    CHECK(says(run / "state.csv") == "no error");
    CHECK(says({}) == "no error");
    CHECK(says(folder.path / "history.csv") == "no error");
  }
}

TEST_CASE("a single frame is exported beside itself") {
  const TemporaryFolder folder;
  write_frame(frame_at(3), folder.path / "a.hdf");
  CHECK(export_run(folder.path / "a.hdf", ExportFormat::vtu).front() == folder.path / "a.vtu");
}

TEST_CASE("hashes are those of the standard") {
  CHECK(sha256("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  CHECK(sha256("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  CHECK(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq") ==
        "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  CHECK(sha256(std::string(1'000'000, 'a')) ==
        "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_CASE("a file's hash is that of its text, however long it is") {
  const TemporaryFolder folder;
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{100}, std::size_t{1} << 20, (std::size_t{5} << 19) + 57}) {
    const std::string text(size, 'x');
    std::ofstream(folder.path / "a", std::ios::binary) << text;
    CHECK(sha256_of_file(folder.path / "a") == sha256(text));
  }
  CHECK_THROWS_AS(sha256_of_file(folder.path / "b"), IoError);
}

TEST_CASE("a folder of several runs is not taken for one, and its runs are named") {
  const TemporaryFolder folder;
  make_run(folder.path / "rest", {0});  // first: they are named in the order of their beginning
  make_run(folder.path / "slide", {0});
  const std::string path = folder.path.string();
  CHECK(refusal([&] { find_frame(folder.path); }) ==
        path + " is neither a run folder nor a frame | name one of the runs in it: " + path +
            "/rest, " + path + "/slide");
}

}  // namespace lahar
