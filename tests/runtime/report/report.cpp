// What reports are made of; tests/pages opens pages in a browser.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "io/base/atomic_file.h"
#include "io/run/table.h"
#include "physics/base/error.h"
#include "runtime/picture/svg.h"
#include "runtime/report/html.h"
#include "runtime/report/map_picture.h"
#include "runtime/report/report_text.h"
#include "runtime/report/run_progress.h"
#include "runtime/report/run_results.h"
#include "runtime/report/safety_text.h"
#include "runtime/report/samples.h"
#include "tests/io/frames/frame_samples.h"

using namespace lahar;

namespace {

struct Folder : test::TemporaryFolder {
  std::filesystem::path file(const std::string& name, const std::string& text) const {
    make_folder((path / name).parent_path());
    write_text_file(path / name, text);
    return path / name;
  }
};

}  // namespace

TEST_CASE("Tables have units in their heads, texts, and perhaps a last line that is not complete") {
  const Folder folder;
  const Table table = read_table(folder.file(
      "t.csv", "step [-],time [s],body,height [m]\n0,0.5,ball,1\n1,1.5,floor,nan\n2,2.5,ba"));
  REQUIRE(table.rows() == 2);
  CHECK(table.find("time")->unit == "s");
  CHECK(table.values("time") == std::vector<double>{0.5, 1.5});
  CHECK(table.find("body")->texts == std::vector<std::string>{"ball", "floor"});
  CHECK(std::isnan(table.values("height")[1]));
  CHECK(table.values("none") == std::vector<double>{0, 0});
  const Table last = read_last_row(folder.path / "t.csv");
  REQUIRE(last.rows() == 1);
  CHECK(last.values("time") == std::vector<double>{1.5});
  CHECK(read_last_row(folder.file("head.csv", "step,time\n")).rows() == 0);
  CHECK(read_last_row(folder.file("cut.csv", "step,ti")).rows() == 0);
}

TEST_CASE("Maps of ESRI ASCII are read from the north, and damaged ones are refused") {
  const Folder folder;
  const std::string head =
      "ncols 3\nnrows 2\nxllcenter 10\nyllcenter 20\ncellsize 2\nNODATA_value -9999\n";
  const MapRaster map = read_map(folder.file("m.asc", head + "1 2 3\n4 -9999 6\n"));
  CHECK(map.left == 9);
  CHECK(map.bottom == 19);
  CHECK(map.values[2] == 3);
  CHECK(std::isnan(map.values[4]));
  const MapPicture picture(
      map, {.name = "speed", .unit = "m/s", .title = "a & b", .ink = {}, .scale = {}});
  Svg svg(picture.width(), picture.height());
  picture.draw(svg);
  const std::string drawn = svg.finish();
  for (const char* text : {"speed", "[m/s]", "a &amp; b", "<image"})
    CHECK(drawn.find(text) != std::string::npos);
  CHECK_THROWS_WITH_AS(read_map(folder.file("m.asc", head + "1 2 3\n")),
                       doctest::Contains("it has 3 of 6 values"), IoError);
  CHECK_THROWS_AS(read_map(folder.file("m.asc", "ncols 100000\nnrows 100000\ncellsize 1\n1\n")),
                  IoError);
}

TEST_CASE("A report says how to repeat a run, and whether its scenario was changed by options") {
  const auto text_of = [](const std::vector<std::string>& command) {
    RunPart part;
    part.manifest = {{"command", command}};
    part.scenario = "{}";
    return provenance({RunResults{.label = "", .title = "", .parts = {part}}});
  };
  const auto has = [](const std::string& text, const char* piece) {
    return text.find(piece) != std::string::npos;
  };
  const std::string plain = text_of({"lahar", "run", "a b.json"});
  CHECK(has(plain, "Repeat it with this command; results are equal bit by bit"));
  CHECK(has(plain, ">lahar run 'a b.json'</pre>"));
  CHECK(has(plain, "Scenario as it was<"));
  const std::string changed = text_of({"lahar", "run", "a.json", "--set", "title=it's"});
  CHECK(has(changed, ">lahar run a.json --set 'title=it'\\''s'</pre>"));
  CHECK(has(changed, "Scenario as it was, without the changes of --set; scenario.full.json has"));
  const std::string python = text_of({"python", "study.py"});
  CHECK(!has(python, "Repeat it"));
  CHECK(has(python, "A program in Python made this run. Below is what started that program."));
  CHECK(has(python, ">python study.py</pre>"));
}

TEST_CASE("Stages of a run follow each other in time, by when they began") {
  const Folder folder;
  const std::string history = "step,time,particles\n0,0,10\n5,2,10\n";
  for (const auto& [name, started] :
       {std::pair{"b", "2026-01-01T10:00:00Z"}, {"a", "2026-01-01T11:00:00Z"}}) {
    folder.file(
        std::string(name) + "/manifest.json",
        std::string("{\"lahar_run\": 1, \"title\": \"x\", \"status\": \"finished\", \"steps\": 5, "
                    "\"time\": 2.5, \"wall_seconds\": 3, \"started\": \"") +
            started + "\"}");
    folder.file(std::string(name) + "/history.csv", history);
  }
  const RunResults run = read_run(folder.path);
  REQUIRE(run.parts.size() == 2);
  CHECK(run.parts[0].name == "b");
  CHECK(run.parts[1].begin == 2.5);
  CHECK(run.end_time() == 5);
  CHECK(run.steps() == 10);
  CHECK(run.wall_seconds() == 6);
  CHECK(run.particle_steps() == 100);
  CHECK_THROWS_AS(read_run(folder.path / "none"), InputError);
}

TEST_CASE("Stages that began in the same second follow each other by their numbers") {
  const Folder folder;
  for (const auto& [name, stage] : {std::pair{"slide", 2}, {"wait", 1}, {"alter", 3}})
    folder.file(std::string(name) + "/manifest.json",
                fmt::format("{{\"lahar_run\": 1, \"status\": \"finished\", \"stage\": {}, "
                            "\"started\": \"2026-01-01T10:00:00Z\"}}",
                            stage));
  const RunResults run = read_run(folder.path);
  REQUIRE(run.parts.size() == 3);
  CHECK(run.parts[0].name == "wait");
  CHECK(run.parts[1].name == "slide");
  CHECK(run.parts[2].name == "alter");
  CHECK(read_progress(folder.path).stage == "alter");
}

TEST_CASE("The speed of a run that was restarted is that of its last part") {
  const Folder folder;
  folder.file("manifest.json",
              "{\"lahar_run\": 1, \"status\": \"finished\", \"wall_seconds\": 2, "
              "\"restarts\": [{\"step\": 3}, {\"step\": 12}]}");
  folder.file("history.csv", "step,time,particles\n0,0,10\n10,1,10\n20,2,30\n");
  const RunResults run = read_run(folder.path);
  CHECK(run.parts[0].timed_from() == 12);
  CHECK(run.particle_steps() == 8 * 30);
}

TEST_CASE("A page shows names that are not UTF-8") {
  Chart chart;
  chart.lines = {{"run\xff", line_colour(0), {0, 1}, {1, 2}}};
  const std::string page = charts({chart});
  CHECK(page.find("run\xef\xbf\xbd") != std::string::npos);
}

TEST_CASE("Times of tasks are those of the last table of a log") {
  const Folder folder;
  folder.file("manifest.json", "{\"lahar_run\": 1, \"status\": \"finished\"}");
  folder.file(
      "log.txt",
      "40 steps in 0.0 s\n"
      "  task                calls   total [s]    avg [us]    min [us]    max [us]    share\n"
      "  P2G remap           1,240       0.303       12.14        0.00      373.58     7.2 %\n"
      "  idle, graph                     0.021                                            51.5 "
      "%\n\n"
      "next: lahar export\n");
  const RunResults run = read_run(folder.path);
  REQUIRE(run.parts[0].stages.size() == 2);
  CHECK(run.parts[0].stages[0].name == "P2G remap");
  CHECK(run.parts[0].stages[0].seconds == 0.303);
  CHECK(run.parts[0].stages[1].name == "idle, graph");
  CHECK(run.parts[0].stages[1].share == doctest::Approx(0.515));
}

TEST_CASE("Frames of a report are spread over a run, with the first and the last") {
  std::vector<ReportFrame> frames;
  for (Index k = 0; k < 100; ++k) frames.push_back({nullptr, {k, ""}});
  for (const std::size_t count : {2u, 4u, 7u, 99u, 100u, 300u}) {
    const auto some = spread(frames, count);
    CHECK(some.size() == std::min<std::size_t>(count, 100));
    CHECK(some.front().file.step == 0);
    CHECK(some.back().file.step == 99);
  }
  CHECK(spread(frames, 1).front().file.step == 99);
}

TEST_CASE("A report of a search shows the factor of safety, its bracket and the trials") {
  const Folder folder;
  CHECK(safety_text({RunResults{.label = "", .title = "", .parts = {}}}).empty());
  const std::string manifest = "{\"lahar_run\": 1, \"status\": \"finished\", \"title\": \"slope\"}";
  folder.file("equilibrium/manifest.json", manifest);
  folder.file("mechanism/manifest.json", manifest);
  SafetyRecord record;
  record.divided = "material 'clay & silt'";
  record.equilibrium.file = "equilibrium/checkpoints/checkpoint_0000000010.h5";
  record.mechanism = 1.5;
  record.status = RunStatus::finished;
  SafetyResult result;
  result.add({.factor = 2, .end = SafetyTrial::End::moved, .steps = 1200, .displacement = 0.25});
  result.add({.factor = 1.5, .end = SafetyTrial::End::restless, .steps = 70, .displacement = 0.1});
  result.add({.factor = 1.25, .end = SafetyTrial::End::rest, .steps = 7, .displacement = 0.01});
  folder.file("safety.csv", safety_table_text(result));
  write_safety_record(folder.path, record, result);

  const RunResults run = read_run(folder.path);
  REQUIRE(run.parts.size() == 2);
  CHECK(run.parts[0].heading() == "equilibrium");
  CHECK(run.parts[1].heading() == "mechanism");
  CHECK(verdict(run).find("finished") != std::string::npos);
  const std::string text = safety_text({run});
  for (const char* piece :
       {">1.375<", ">1.25<", ">1.5<", "18 % wide", "clay &amp; silt", "fails: it moves too far",
        "fails: it does not come to rest", ">1,200<", ">0.25<", "<svg", "factor of safety"})
    CHECK_MESSAGE(text.find(piece) != std::string::npos, piece);
  const std::string two = safety_text({run, run});
  CHECK(two.find("<th class=\"words\">search</th>") != std::string::npos);
  CHECK(two.find("<details>") != std::string::npos);
}
