// Fields that follow from columns of the particle.
#include "physics/particles/derived_fields.h"

#include <doctest/doctest.h>

#include <map>
#include <set>
#include <string>

#include "physics/materials/materials.h"
#include "physics/particles/columns.h"
#include "tests/contributing.h"

using namespace lahar;

namespace {

constexpr DerivedField example[] = {
#include "tests/recipes/field.inc"
};

Voigt values_of(std::string_view name, const ParticleValues& p) {
  Voigt values{};
  for (const DerivedField& field : derived_fields)
    if (field.name == name) field.value(p, values.data());
  return values;
}
double value_of(std::string_view name, const ParticleValues& p) {
  return values_of(name, p)[0];
}

template <class... Laws>
void add_names(std::map<std::string_view, int>& names, const std::variant<Laws...>*) {
  std::set<std::string_view> all;  // laws may share a variable
  const auto add = [&](const auto& variables) {
    for (const StateVariable& variable : variables) all.insert(variable.name);
  };
  (add(Laws::state), ...);
  for (const auto name : all) ++names[name];
}

}  // namespace

TEST_CASE("a stress has its pressure, deviator and equivalent stress") {
  ParticleValues p;
  p.stress = {-30, 0, 0, 0, 0, 0};  // uniaxial compression
  CHECK(value_of("mean_stress", p) == 10);
  CHECK(value_of("von_mises_stress", p) == doctest::Approx(30));
  p.stress = {-5, -5, -5, 0, 3, 4};  // and shear
  CHECK(value_of("mean_stress", p) == 5);
  CHECK(value_of("von_mises_stress", p) == doctest::Approx(std::sqrt(3.0) * 5));
  CHECK(values_of("deviatoric_stress", p) == Voigt{0, 0, 0, 0, 3, 4});
}

TEST_CASE("a strain has its volume and equivalent strain") {
  ParticleValues p;
  p.strain = {0.02, -0.01, -0.01, 0, 0, 0};  // of constant volume, along x
  CHECK(value_of("volumetric_strain", p) == doctest::Approx(0));
  CHECK(value_of("equivalent_strain", p) == doctest::Approx(0.02));
  p.strain = {0, 0, 0, 0.03, 0, 0};  // simple shear, as engineering shear
  CHECK(value_of("equivalent_strain", p) == doctest::Approx(0.03 / std::sqrt(3.0)));
  p.strain = {0.01, 0.01, 0.01, 0, 0, 0};
  CHECK(value_of("volumetric_strain", p) == doctest::Approx(0.03));
  CHECK(value_of("equivalent_strain", p) == doctest::Approx(0));
}

TEST_CASE("a particle has its speed, kinetic energy and density") {
  ParticleValues p;
  p.mass = 6, p.volume = 0.003, p.v = {2, 3, -6};
  CHECK(value_of("speed", p) == 7);
  CHECK(value_of("kinetic_energy", p) == 147);
  CHECK(value_of("mass_density", p) == doctest::Approx(2000));
}

TEST_CASE("columns, derived fields and state variables have names of their own") {
  std::map<std::string_view, int> names;
  for (const ColumnInfo& info : column_table) ++names[info.name];
  for (const DerivedField& field : derived_fields) ++names[field.name];
  add_names(names, static_cast<const Law*>(nullptr));
  for (const auto& [name, count] : names) {
    CAPTURE(std::string(name));
    CHECK(count == 1);
  }
  for (const DerivedField& field : derived_fields)
    CHECK((field.components == 1 || field.components == 6));
}

TEST_CASE("the derived field of CONTRIBUTING.md is a row of the table") {
  CHECK(test::contributing_has("tests/recipes/field.inc"));
  ParticleValues p;
  p.stress = {-30, 0, 0, 0, 0, 0};
  double ratio = -1;
  example[0].value(p, &ratio);
  CHECK(ratio == doctest::Approx(3));
  example[0].value({}, &ratio);
  CHECK(ratio == 0);
}
