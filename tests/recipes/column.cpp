// The recipe of CONTRIBUTING.md for a column of the particle: CMake adds its row to a copy of
// physics/particles/columns.h, with which this program and what it tests are compiled.
#include <doctest/doctest.h>

#include "io/frames/csv.h"
#include "physics/model/model.h"
#include "physics/particles/particles.h"
#include "runtime/step/snapshot.h"
#include "tests/contributing.h"

using namespace lahar;

TEST_CASE("the column of CONTRIBUTING.md is a row of the table") {
  CHECK(test::contributing_has("tests/recipes/column.inc"));
  CHECK(ColumnLayout<2>().components(Column::temperature) == 1);
  CHECK(ColumnLayout<3>().row(Column::temperature) == ColumnLayout<3>().rows() - 1);
}

TEST_CASE("a new column is zero at first, migrates, and is in frames and tables") {
  Model<2> model;
  model.materials.emplace_back();
  Patch<2> patch;
  patch.particles.resize(2);
  CHECK(patch.particles.row(Column::temperature)[1] == 0);
  patch.particles.id = {4, 7};
  patch.particles.row(Column::mass)[0] = 2;
  patch.particles.row(Column::temperature)[0] = 293;
  patch.particles.row(Column::temperature)[1] = 273;
  patch.bins = {{.cell = 0, .begin = 0, .end = 1, .limit = 1, .material = 0, .loaded = false}};
  patch.outbox.emplace_back();  // particle 7 is on its way
  patch.outbox[0].particles.append(patch.particles, 1);

  const Frame frame = snapshot(patch, model);
  CHECK(frame.id == std::vector<Index>{4, 7});
  const FrameColumn* temperature = frame.find("temperature");
  REQUIRE(temperature);
  CHECK(temperature->values == std::vector<double>{293, 273});
  CHECK(temperature->unit == "K");
  CHECK_FALSE(is_state_variable(*temperature));
  const std::string table = csv_text(frame);
  CHECK(table.find("strain_xy,opening") == std::string::npos);
  CHECK(table.find("strain_xy,temperature") != std::string::npos);
  CHECK(table.find("\n4,2,") != std::string::npos);
}
