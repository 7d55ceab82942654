#include "io/results/compare.h"

#include <doctest/doctest.h>

#include <limits>

#include "io/base/atomic_file.h"
#include "io/frames/csv.h"
#include "io/frames/vtkhdf.h"
#include "physics/base/error.h"
#include "tests/io/frames/frame_samples.h"
#include "tests/within.h"

namespace lahar {

using namespace test;
using Verdict = FieldDifference::Verdict;

namespace {

const FieldDifference& field(const Comparison& comparison, const std::string& name) {
  for (const FieldDifference& f : comparison.fields)
    if (f.name == name) return f;
  FAIL("no field " << name);
  return comparison.fields.front();
}

/// Values of a column of a frame, to be changed.
std::vector<double>& values(Frame& frame, const std::string& name) {
  return const_cast<FrameColumn*>(frame.find(name))->values;
}

Frame one_field(const std::string& name, const std::string& unit, std::vector<double> numbers) {
  Frame frame;
  frame.dim = 2;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    frame.id.push_back(static_cast<Index>(i));
    frame.coordinates.insert(frame.coordinates.end(), {0, 1});
  }
  frame.columns = {{name, unit, 1, std::move(numbers)}};
  return frame;
}

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("a state agrees with itself to the last bit") {
  for (const int dim : {2, 3}) {
    const Comparison c = compare(sample_frame(dim, 100), sample_frame(dim, 100), {0, 0, 0});
    CHECK(c.passed);
    CHECK(c.matched == 100);
    for (const FieldDifference& f : c.fields) CHECK(f.verdict == Verdict::same);
    CHECK(c.fields.size() == 9);  // with material
  }
}

TEST_CASE("relative means to the largest magnitude over all components of a tensor in B") {
  const Frame b = two_particles();  // largest stress 3e5, of another component and particle
  Frame a = b;
  values(a, "stress")[3] += 0.3;  // xy of particle 0
  const Comparison c = compare(a, b);
  const FieldDifference& stress = field(c, "stress");
  CHECK(stress.absolute == doctest::Approx(0.3));
  CHECK(stress.scale == 3e5);
  CHECK(stress.relative == test::within(1e-5, 1e-6));
  CHECK(stress.at == 0);
  CHECK(stress.component == "xy");
  CHECK(stress.verdict == Verdict::differs);
  CHECK_FALSE(c.passed);
  CHECK(compare(a, b, {.rtol = 1.1e-6}).passed);
  CHECK_FALSE(compare(a, b, {.rtol = 0.9e-6}).passed);
  CHECK(compare(a, b, {.rtol = 0, .atol = 0.31}).passed);
  CHECK_FALSE(compare(a, b, {.rtol = 0, .atol = 0.29}).passed);
}

TEST_CASE("each state variable is relative to itself") {
  Frame b = two_particles();
  b.columns.push_back({"angle", "-", 1, {1e-3, 0}});
  Frame a = b;
  values(a, "angle")[0] *= 1.5;
  const Comparison c = compare(a, b);
  CHECK(field(c, "svars_0").verdict == Verdict::same);
  CHECK(field(c, "svars_1").relative == doctest::Approx(0.5));
}

TEST_CASE("a field that is rounding noise throughout is compared absolutely") {
  const Frame b = one_field("speed", "m/s", {1e-16, 2e-14}), a = one_field("speed", "m/s", {0, 0});
  const Comparison c = compare(a, b);
  CHECK(c.passed);
  CHECK(c.fields[1].floored);
  CHECK(c.text().find("floor: at most 1e-10 in all of B") != std::string::npos);
  CHECK_FALSE(compare(a, b, {.floor = 1e-15}).passed);
  // Noise against a signal differs, whichever side has it.
  const Frame signal = one_field("speed", "m/s", {1e-3, 0});
  CHECK_FALSE(compare(signal, b).passed);
  CHECK_FALSE(compare(b, signal).passed);
}

TEST_CASE("small strains are compared relatively: a stiff body has no larger ones") {
  Frame b = two_particles();
  for (double& value : values(b, "strain")) value *= 1e-9;  // at most 3e-12
  Frame a = b;
  values(a, "strain")[0] *= 1.001;
  CHECK(field(compare(a, b), "strain").verdict == Verdict::differs);
}

TEST_CASE("masses and volumes have no floor: tiny particles are compared relatively") {
  for (const char* name : {"mass", "volume"}) {
    const Frame b = one_field(name, "kg", {1e-15, 1e-15}),
                a = one_field(name, "kg", {1e-15, 2e-15});
    CHECK_FALSE(compare(a, b).passed);
  }
}

TEST_CASE("a difference from a field of zeros is infinite, relatively") {
  const Frame b = one_field("speed", "m/s", {0, 0}), a = one_field("speed", "m/s", {0, 1e-3});
  CHECK(compare(a, b).fields[1].relative == std::numeric_limits<double>::infinity());
  CHECK_FALSE(compare(a, b).passed);
}

TEST_CASE("a NaN anywhere is a difference, on both sides too") {
  const Frame good = one_field("speed", "m/s", {1, 2}), bad = one_field("speed", "m/s", {1, nan});
  const double infinity = std::numeric_limits<double>::infinity();
  const Tolerances loose{.rtol = infinity, .atol = infinity, .floor = infinity};
  for (const auto& [a, b] : {std::pair{good, bad}, std::pair{bad, good}, std::pair{bad, bad}}) {
    const Comparison c = compare(a, b, loose);
    CHECK_FALSE(c.passed);
    CHECK(c.fields[1].not_finite == 1);
    CHECK(c.fields[1].at == 1);
  }
  const Frame endless = one_field("speed", "m/s", {1, infinity});
  CHECK_FALSE(compare(endless, endless, loose).passed);
}

TEST_CASE("particles are matched by id, not by position") {
  Frame b = one_field("speed", "m/s", {10, 20, 30}), a = one_field("speed", "m/s", {30, 10, 20});
  a.id = {2, 0, 1};
  CHECK(compare(a, b).passed);
}

TEST_CASE("ids that one side lacks are counted, and the first few named") {
  Frame a = one_field("speed", "m/s", std::vector<double>(10, 1.0));
  Frame b = one_field("speed", "m/s", {1, 1});
  b.id = {3, 42};
  const Comparison c = compare(a, b);
  CHECK_FALSE(c.passed);
  CHECK(c.matched == 1);
  CHECK(c.only_in_a.count == 9);
  CHECK(c.only_in_a.first == std::vector<Index>{0, 1, 2, 4, 5});
  CHECK(c.only_in_b.first == std::vector<Index>{42});
  CHECK(c.text().find("9 particles only in A: 0, 1, 2, 4, 5, ...\n1 particle only in B: 42\n") !=
        std::string::npos);
}

TEST_CASE("a particle that occurs twice is a difference") {
  Frame a = one_field("speed", "m/s", {1, 1, 1});
  a.id = {0, 1, 1};
  const Comparison c = compare(a, one_field("speed", "m/s", {1, 1}));
  CHECK_FALSE(c.passed);
  CHECK(c.problems == std::vector<std::string>{"A has particle 1 more than once"});
}

TEST_CASE("a named field on one side only fails, any other is noted") {
  Frame a = two_particles(), b = two_particles();
  b.material.clear();
  CHECK(compare(a, b).passed);
  CHECK(compare(a, b).notes == std::vector<std::string>{"not compared: material (only in A)"});
  std::erase_if(b.columns, [](const FrameColumn& c) { return c.name == "strain"; });
  std::erase_if(a.columns, [](const FrameColumn& c) { return c.name == "pressure"; });
  const Comparison c = compare(a, b);
  CHECK_FALSE(c.passed);
  CHECK(field(c, "strain").verdict == Verdict::missing);
  CHECK(c.problems == std::vector<std::string>{"svars_0 is only in B", "strain is only in A"});
}

TEST_CASE("2D and 3D states do not agree") {
  const Comparison c = compare(sample_frame(2, 3), sample_frame(3, 3));
  CHECK_FALSE(c.passed);
  CHECK(c.problems.front() == "coordinates has 2 components in A and 3 in B");
}

TEST_CASE("materials are compared exactly") {
  Frame a = two_particles(), b = two_particles();
  a.material[0] = 9;
  CHECK_FALSE(compare(a, b, {.rtol = 100, .atol = 100}).passed);
}

TEST_CASE("a frame agrees with the table made from it, its pressure is svars_0") {
  const TemporaryFolder folder;
  write_frame(two_particles(), folder.path / "a.hdf");
  write_csv(two_particles(), folder.path / "b.csv");
  const Comparison c = compare(folder.path / "a.hdf", folder.path / "b.csv", {0, 0, 0});
  CHECK(c.passed);
  CHECK(field(c, "svars_0").unit == "Pa");
}

TEST_CASE("components of a vector in a table are compared with the vector of a frame") {
  const TemporaryFolder folder;
  Frame frame = two_particles();
  frame.columns.push_back({"liquid_velocity", "m/s", 2, {1, 2, 3, 4}});
  frame.columns.push_back({"domain_vectors", "m", 4, {1, 2, 3, 4, 5, 6, 7, 8}});
  write_csv(frame, folder.path / "table.csv");
  const Frame table = read_csv(folder.path / "table.csv");
  for (const auto& [a, b] : {std::pair{frame, table}, std::pair{table, frame}}) {
    const Comparison c = compare(a, b, {0, 0, 0});
    CHECK(c.passed);
    CHECK(field(c, "liquid_velocity").verdict == Verdict::same);
    CHECK(field(c, "liquid_velocity").unit == "m/s");
    CHECK(field(c, "domain_vectors").verdict == Verdict::same);
    for (const std::string& note : c.notes) CHECK(note.find("liquid_velocity") == note.npos);
  }
  values(frame, "liquid_velocity")[3] += 0.5;
  for (const auto& [a, b] : {std::pair{frame, table}, std::pair{table, frame}}) {
    const Comparison c = compare(a, b);
    const FieldDifference& differs = field(c, "liquid_velocity");
    CHECK(differs.verdict == Verdict::differs);
    CHECK(differs.absolute == 0.5);
    CHECK(differs.component == "y");
    CHECK(differs.at == 7);
  }
}

TEST_CASE("the result reads like this") {
  Frame a = two_particles();
  values(a, "stress")[3] += 0.25;
  values(a, "velocity")[0] = nan;
  values(a, "displacement")[2] += 1e-9;
  CHECK(compare(a, two_particles()).text() ==
        "A: A (2 particles)\n"
        "B: B (2 particles)\n"
        "\n"
        "field         unit     max |A-B|  relative  at particle  verdict\n"
        "coordinates   m                0         0            -  same\n"
        "velocity      m/s   1 NaN or inf         -        0 (x)  DIFFERS\n"
        "displacement  m            1e-09   2.5e-10        7 (x)  within\n"
        "stress        Pa            0.25  8.33e-07       0 (xy)  DIFFERS\n"
        "strain        -                0         0            -  same\n"
        "volume        m^3              0         0            -  same\n"
        "mass          kg               0         0            -  same\n"
        "svars_0       Pa               0         0            -  same\n"
        "material      -                0         0            -  same\n"
        "\n"
        "DIFFERENT: 2 particles compared, rtol 1e-08, atol 0, floor 1e-10\n");
}

TEST_CASE("comparing what does not exist says so") {
  CHECK_THROWS_WITH_AS(compare("/nowhere/a", "/nowhere/b", {}), "/nowhere/a does not exist",
                       InputError);
  const TemporaryFolder folder;
  write_text_file(folder.path / "other.csv", "id,foo\n1,2\n");
  CHECK_THROWS_WITH_AS(read_particles(folder.path / "other.csv"),
                       "there are no columns 'coord_x' and 'coord_y'", InputError);
  CHECK_THROWS_WITH_AS(read_particles(folder.path),
                       (folder.path.string() + " is neither a run folder nor a frame").c_str(),
                       InputError);
}

}  // namespace lahar
