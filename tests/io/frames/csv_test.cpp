#include "io/frames/csv.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/base/atomic_file.h"
#include "physics/base/error.h"
#include "tests/io/frames/frame_samples.h"
#include "tests/published_cases.h"

namespace lahar {

using namespace test;

namespace {

/// Line:column: message of every problem.
std::string problems_of(const std::string& text) {
  std::string all;
  try {
    parse_csv(text, "a.csv");
  } catch (const InputError& error) {
    for (const Problem& p : error.problems())
      all += p.file + ':' + std::to_string(p.line) + ':' + std::to_string(p.column) + ": " +
             p.message + '\n';
  }
  return all;
}

}  // namespace

TEST_CASE("a plane-strain table has the published columns and the shortest numbers") {
  CHECK(csv_text(two_particles()) ==
        "id,mass,volume,coord_x,coord_y,displacement_x,displacement_y,velocity_x,velocity_y,"
        "stress_xx,stress_yy,stress_zz,stress_xy,strain_xx,strain_yy,strain_xy,svars_0,"
        "material,pressure\n"
        "0,1,0.001,0.5,0.25,1,2,0,-1,-1,-2,-3,4,0.001,0.002,0.003,100,0,100\n"
        "7,2,0.002,1.5,0.1,3,4,1e-20,1e+300,1e+05,2e+05,3e+05,-0.5,0,0,0,0.30000000000000004,1,"
        "0.30000000000000004\n");
}

TEST_CASE("a 3D table has all six components of stress and strain") {
  Frame frame = sample_frame(3, 1);
  const std::string text = csv_text(frame);
  CHECK(text.substr(0, text.find('\n')) ==
        "id,mass,volume,coord_x,coord_y,coord_z,displacement_x,displacement_y,displacement_z,"
        "velocity_x,velocity_y,velocity_z,stress_xx,stress_yy,stress_zz,stress_xy,stress_yz,"
        "stress_xz,strain_xx,strain_yy,strain_zz,strain_xy,strain_yz,strain_xz,svars_0,"
        "material,pressure");
}

TEST_CASE("a table without particles is its header") {
  const Frame frame = sample_frame(2, 0);
  CHECK(csv_text(frame).starts_with("id,mass,"));
  CHECK(parse_csv(csv_text(frame), "").size() == 0);
}

TEST_CASE("numbers in a table read back to the same bits") {
  for (const int dim : {2, 3}) {
    Frame frame = sample_frame(dim, 500);
    for (FrameColumn& column : frame.columns)  // what a plane-strain table has no columns for
      if (dim == 2 && column.components == 6)
        for (Index i = 0; i < frame.size(); ++i) {
          column.values[6 * i + 4] = column.values[6 * i + 5] = 0;
          if (column.name == "strain") column.values[6 * i + 2] = 0;
        }
    const Frame back = parse_csv(csv_text(frame), "");
    Frame expected;  // in the order of tables
    expected.dim = dim;
    expected.id = frame.id;
    expected.coordinates = frame.coordinates;
    expected.material = frame.material;
    for (const char* name : {"mass", "volume", "displacement", "velocity", "stress", "strain"})
      expected.columns.push_back(*frame.find(name));
    expected.columns.push_back({"pressure", "", 1, frame.find("pressure")->values});
    expected.columns.push_back({"svars_0", "", 1, frame.find("pressure")->values});
    CHECK(same_bits(back, expected));
    CHECK(csv_text(back) == csv_text(frame));
  }
}

TEST_CASE(
    "a table has all that its frame has, under the frame's names, after the columns of before") {
  Frame frame = two_particles();
  frame.columns.push_back({"contact_force", "N", 2, {1, 2, 3, 4}});
  frame.columns.push_back({"pdstrain", "-", 1, {0.5, 0.25}});
  frame.columns.push_back({"domain_vectors", "m", 4, {1, 2, 3, 4, 5, 6, 7, 8}});
  frame.columns.push_back({"cell_id", "", 1, {17, 18}});
  const std::string text = csv_text(frame);
  CHECK(text.substr(0, text.find('\n'))
            .ends_with("strain_xy,svars_0,svars_1,material,pressure,contact_force_x,"
                       "contact_force_y,pdstrain,domain_vectors_0,domain_vectors_1,"
                       "domain_vectors_2,domain_vectors_3,cell_id"));
  CHECK(text.ends_with(",0.30000000000000004,0.25,1,0.30000000000000004,3,4,0.25,5,6,7,8,18\n"));
  const Frame back = parse_csv(text, "");
  CHECK(back.material == frame.material);
  CHECK(back.find("contact_force_y")->values == std::vector<double>{2, 4});
  CHECK(back.find("pdstrain")->values == back.find("svars_1")->values);
}

TEST_CASE("strains across the plane are in tables of two dimensions, where there are any") {
  Frame frame = two_particles();
  CHECK(csv_text(frame).find("strain_zz") == std::string::npos);
  for (FrameColumn& column : frame.columns)
    if (column.name == "strain") column.values[6 + 2] = 0.25;
  const std::string text = csv_text(frame);
  CHECK(text.find(",svars_0,material,strain_zz,pressure\n") != text.npos);
  const Frame back = parse_csv(text, "");
  CHECK(back.dim == 2);
  CHECK(back.find("strain")->values == frame.find("strain")->values);
  CHECK(!back.find("strain_zz"));
  CHECK(csv_text(back) == text);
}

TEST_CASE("NaN and infinity are written as pandas reads them, and read back") {
  Frame frame = two_particles();
  frame.columns[0].values[0] = -std::numeric_limits<double>::quiet_NaN();
  frame.columns[0].values[1] = -std::numeric_limits<double>::infinity();
  const std::string text = csv_text(frame);
  CHECK(text.find(",1,2,nan,-inf,-1,") != text.npos);
  const Frame back = parse_csv(text, "");
  CHECK(std::isnan(back.find("velocity")->values[0]));
  CHECK(std::isinf(back.find("velocity")->values[1]));
}

TEST_CASE("rows and columns of a table may come in any order, with DOS line ends and spaces") {
  const Frame frame = parse_csv(
      "velocity_y, velocity_x, id, cell_id, material_id\r\n 2, 1, 5, 17, 1\r\n\r\n+4,3,-1,18,0\r\n",
      "");
  CHECK(frame.dim == 2);
  CHECK(frame.id == std::vector<Index>{-1, 5});
  CHECK(frame.material == std::vector<std::int32_t>{0, 1});
  CHECK(frame.find("velocity")->values == std::vector<double>{3, 4, 1, 2});
  CHECK(frame.find("cell_id")->values == std::vector<double>{18, 17});
  CHECK(frame.coordinates.empty());
}

TEST_CASE("every problem of a table is reported with line and column") {
  CHECK(problems_of("") == "a.csv:1:0: the table is empty; expected a header line\n");
  CHECK(problems_of("ID,mass\n1,2\n") == "a.csv:1:0: there is no column 'id'\n");
  CHECK(problems_of("id,mass,mass\n") == "a.csv:1:9: column 'mass' occurs twice\n");
  CHECK(problems_of("id,stress_xx,stress_yy,stress_xy\n") ==
        "a.csv:1:0: a 2D table needs all of stress: stress_zz missing\n");
  CHECK(problems_of("id,coord_x,coord_z\n") ==
        "a.csv:1:0: a 3D table needs all of coordinates: coord_y missing\n");
  CHECK(problems_of("id,mass\n0,1e\n1.5,2\n2\n\n3,4,5\n4,\n") ==
        "a.csv:2:3: '1e' is not a number\n"
        "a.csv:3:1: '1.5' is not an integer\n"
        "a.csv:4:0: 1 values, but the header has 2 columns\n"
        "a.csv:6:0: 3 values, but the header has 2 columns\n"
        "a.csv:7:3: '' is not a number\n");
  CHECK(problems_of("id\n3\n4\n3\n") == "a.csv:0:0: particle id 3 occurs more than once\n");
}

TEST_CASE("of very many problems in a table the first twenty are listed") {
  std::string text = "id,mass\n";
  for (int i = 0; i < 1000; ++i) text += std::to_string(i) + ",x\n";
  const std::string problems = problems_of(text);
  CHECK(std::count(problems.begin(), problems.end(), '\n') == 21);
  CHECK(problems.ends_with("a.csv:21:4: 'x' is not a number\na.csv:0:0: and 980 more\n"));
}

TEST_CASE("numbers beyond the range of a double are refused, those below it are zero") {
  CHECK(problems_of("id,mass\n0,1e999\n") == "a.csv:2:3: '1e999' is not a number\n");
  CHECK(parse_csv("id,mass\n0,1e-999\n", "").find("mass")->values[0] == 0);
}

TEST_CASE("a missing table is an error with the system's reason") {
  const TemporaryFolder folder;
  const std::string file = (folder.path / "none.csv").string();
  CHECK_THROWS_WITH_AS(read_csv(file),
                       ("cannot read " + file + ": No such file or directory").c_str(), IoError);
  CHECK_THROWS_WITH_AS(read_csv(folder.path),
                       ("cannot read " + folder.path.string() + ": Is a directory").c_str(),
                       IoError);
  CHECK_THROWS_WITH_AS(write_csv(two_particles(), folder.path),
                       ("cannot write " + folder.path.string() + ": Is a directory").c_str(),
                       IoError);
}

TEST_CASE("published reference tables are read") {
  for (const auto& folder : test::published_cases()) {
    const std::filesystem::path file = folder / "reference.csv";
    CAPTURE(file.string());
    const Frame frame = read_csv(file);
    CHECK(frame.dim == (folder.filename().string().starts_with("2d") ? 2 : 3));
    CHECK(frame.size() > 0);
    for (const char* name : {"mass", "volume", "displacement", "velocity", "stress", "strain"})
      CHECK(frame.find(name) != nullptr);
    // Its columns are ours, in our order; those of a liquid in pores stand behind.
    const auto columns = [](const std::string& text) {
      const std::string row = text.substr(0, text.find('\n'));
      return row.substr(0, std::min(row.find(",liquid_"), row.find(",pore_pressure")));
    };
    CHECK(columns(csv_text(frame)) == columns(read_text_file(file)));
  }
}

}  // namespace lahar
