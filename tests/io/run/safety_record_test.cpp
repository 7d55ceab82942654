// What a search for a factor of safety leaves in its folder, and what is read of it.
#include "io/run/safety_record.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <string>

#include "io/base/atomic_file.h"
#include "tests/io/frames/frame_samples.h"

using namespace lahar;

namespace {

using End = SafetyTrial::End;

SafetyResult three_trials() {
  SafetyResult result;
  result.add({.factor = 2, .end = End::moved, .steps = 120, .displacement = 0.1});
  result.add({.factor = 1.5, .end = End::broke, .steps = 7, .problem = "a particle is lost"});
  result.add({.factor = 1.25, .end = End::settles, .steps = 3000, .displacement = 1.0 / 3});
  return result;
}

}  // namespace

TEST_CASE("trials narrow the bracket of the factor of safety") {
  const SafetyResult result = three_trials();
  CHECK(result.stable == 1.25);
  REQUIRE(result.fails);
  CHECK(*result.fails == 1.5);
  CHECK(result.factor() == 1.375);
  CHECK(result.failure()->end == End::broke);
  CHECK(SafetyResult{}.failure() == nullptr);
}

TEST_CASE("the table of trials reads back to the same bits, without rows that are not whole") {
  const SafetyResult result = three_trials();
  const std::string text = safety_table_text(result);
  CHECK(text.starts_with("factor,stable,steps,displacement [m],end\n2,0,120,0.1,moved\n"));
  const SafetyResult read = safety_result_of(text + "1.3,1,5,0.1,unknown\nx,1,5,0.1,moved\n1.2,0");
  CHECK(safety_table_text(read) == text);
  CHECK(read.trials.size() == 3);
  CHECK(read.stable == 1.25);
  CHECK(safety_result_of("").trials.empty());
  CHECK(safety_result_of("factor,steps\n1,2\n").trials.empty());
}

TEST_CASE("the record of a search says how it stands") {
  const test::TemporaryFolder folder;
  CHECK_FALSE(read_safety(folder.path));
  SafetyRecord record;
  record.title = "slope";
  record.command = {"lahar", "safety", "slope.json"};
  record.bounds = {.most = 8, .tolerance = 0.02};
  write_safety_record(folder.path, record, {});
  CHECK(read_text_file(folder.path / "safety.json").find("\"stable\": null") != std::string::npos);

  record.equilibrium = {"equilibrium/checkpoints/checkpoint_0000000010.h5", "abc"};
  record.mechanism = 1.5;
  record.status = RunStatus::stopped;
  record.message = "signal 2";
  write_text_file(safety_table(folder.path), safety_table_text(three_trials()));
  write_safety_record(folder.path, record, three_trials());
  const auto found = read_safety(folder.path);
  REQUIRE(found);
  CHECK(found->record.title == "slope");
  CHECK(found->record.command == record.command);
  CHECK(found->record.bounds.most == 8);
  CHECK(found->record.bounds.tolerance == 0.02);
  CHECK(found->record.equilibrium == record.equilibrium);
  CHECK(found->record.mechanism == 1.5);
  CHECK(found->record.status == RunStatus::stopped);
  CHECK(found->record.message == "signal 2");
  CHECK(found->result.factor() == 1.375);

  remove_safety(folder.path);
  CHECK_FALSE(read_safety(folder.path));
}

TEST_CASE("a file that is no record of a search is not read as one") {
  const test::TemporaryFolder folder;
  for (const char* text : {"", "{", "[1]", "{\"status\": 1}"}) {
    write_text_file(folder.path / "safety.json", text);
    CHECK_FALSE(read_safety(folder.path));
  }
  write_text_file(folder.path / "safety.json",
                  "{\"lahar_safety\": 1, \"program\": 3, \"command\": 3, \"equilibrium\": []}");
  REQUIRE(read_safety(folder.path));
  CHECK(read_safety(folder.path)->record.status == RunStatus::running);
}
