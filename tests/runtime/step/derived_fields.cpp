// Derived fields in frames: those that a scenario names, and what follows from the other columns.
#include "physics/particles/derived_fields.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "io/frames/csv.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

std::vector<std::string> names_of(const Frame& frame) {
  std::vector<std::string> names;
  for (const FrameColumn& column : frame.columns) names.push_back(column.name);
  return names;
}

/// A particle as the columns of a frame show it.
ParticleValues values_in(const Frame& frame, std::size_t i) {
  ParticleValues p;
  const auto take = [&](const std::vector<double>& values, int components, double* to) {
    const auto n = static_cast<std::size_t>(components);
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(i * n), n, to);
  };
  const auto get = [&](const char* name, double* to) {
    take(frame.find(name)->values, frame.find(name)->components, to);
  };
  take(frame.coordinates, frame.dim, p.x.data());
  get("mass", &p.mass);
  get("volume", &p.volume);
  get("velocity", p.v.data());
  get("displacement", p.u.data());
  get("stress", p.stress.data());
  get("strain", p.strain.data());
  return p;
}

template <int Dim>
Model<Dim> with_derived_fields(Model<Dim> model) {
  for (const DerivedField& field : derived_fields) model.output.derived_fields.push_back(&field);
  return model;
}

/// The end of a run has all derived fields, and they follow from what else is in the frame.
template <int Dim>
void check_fields(const Model<Dim>& model) {
  Simulation plain(model, {}), more(with_derived_fields(model), {});
  plain.advance(20);
  more.advance(20);
  const Frame before = plain.frame(), after = more.frame();
  REQUIRE(after.columns.size() == before.columns.size() + derived_fields.size());
  for (std::size_t k = 0; k < before.columns.size(); ++k)
    CHECK(after.columns[k].values == before.columns[k].values);
  for (const DerivedField& field : derived_fields) {
    CAPTURE(std::string(field.name));
    const FrameColumn* column = after.find(field.name);
    REQUIRE(column);
    CHECK(column->unit == field.unit);
    CHECK(column->components == field.components);
    CHECK_FALSE(is_state_variable(*column));
    std::vector<double> expected(column->values.size());
    for (std::size_t i = 0; i < after.id.size(); ++i)
      field.value(values_in(after, i), &expected[i * static_cast<std::size_t>(field.components)]);
    CHECK(column->values == expected);
    const bool of_liquid = field.name == "porosity" || field.name == "liquid_mass";
    CHECK(std::any_of(expected.begin(), expected.end(), [](double v) { return v != 0; }) !=
          of_liquid);
  }
}

}  // namespace

TEST_CASE("frames have the derived fields that a scenario names, in the order of their table") {
  const auto frame_of = [](const std::string& vtk) {
    const Model<2> model = model_of_text<2>(R"({
      "mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
      "materials": [{"type": "LinearElastic", "density": 1, "youngs_modulus": 1, "poisson_ratio": 0}],
      "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0,
                                   "region": {"box": {"min": [0, 0], "max": [1, 1]}}}}],
      "analysis": {"nsteps": 1}, "post_processing": {)" +
                                            vtk + "}}");
    return Simulation(model, {}).frame();
  };
  const std::vector<std::string> usual = names_of(frame_of(""));
  CHECK(names_of(frame_of(R"("vtk": ["stresses", "displacement"])")) == usual);
  std::vector<std::string> more = usual;
  more.insert(more.end(), {"speed", "von_mises_stress"});
  CHECK(names_of(frame_of(R"("vtk": ["von_mises_stress", "speed", "stresses", "speed"])")) == more);
}

TEST_CASE("derived fields follow from the columns of their frame") {
  SUBCASE("2D, strain follows from stress") {
    check_fields(two_discs());
  }
  SUBCASE("2D, strain is a column") {
    check_fields(dam_break());
  }
  SUBCASE("3D") {
    check_fields(dam_break_3d());
  }
}

TEST_CASE("derived fields of a table have their names, and read back") {
  Simulation simulation(with_derived_fields(two_discs()), {});
  simulation.advance(20);
  const Frame frame = simulation.frame();
  const std::string text = csv_text(frame);
  CHECK(
      text.substr(0, text.find('\n'))
          .find(
              "speed,kinetic_energy,mass_density,mean_stress,von_mises_stress,deviatoric_stress_xx,"
              "deviatoric_stress_yy,deviatoric_stress_zz,deviatoric_stress_xy,volumetric_strain,"
              "equivalent_strain") != std::string::npos);
  const Frame table = parse_csv(text, "");
  for (const DerivedField& field : derived_fields) {
    CAPTURE(std::string(field.name));
    REQUIRE(table.find(field.name));
    CHECK(table.find(field.name)->values == frame.find(field.name)->values);
    CHECK(table.find(field.name)->unit == field.unit);
  }
}
