// Runs on meshes of every element.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "physics/mesh/element.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

using enum Element;

constexpr double dt = 1e-3;

/// A block that flies through a grid of an element, 2 boxes wide in a mesh of 6.
template <int Dim>
Model<Dim> flying_block(Element element, const std::string& gravity, Scheme scheme, double young) {
  Model<Dim> model = model_of_text<Dim>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.5, "counts": [6, 6{0}]}}, "cell_type": "{1}"}},
    "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": {6},
                   "poisson_ratio": 0.3}}],
    "external_loading_conditions": {{"gravity": {2}}},
    "particles": [{{"generator": {{"type": "region", "per_cell": 3, "material": 0,
                   "region": {{"box": {{"min": [1, 1.5{3}], "max": [2, 2.5{4}]}}}}}}}}],
    "analysis": {{"preset": "cbgeo", "dt": {5}, "nsteps": 400, "patch_particles": 60}}}})",
      Dim == 3 ? ", 2" : "", info(element).name, gravity, Dim == 3 ? ", 0" : "",
      Dim == 3 ? ", 1" : "", dt, young));
  model.analysis.scheme = scheme;
  return model;
}

template <int Dim, bool positive = false>
void check_free_fall(Element element, Scheme scheme) {
  // Where corners have no positive mass, stresses from rounding grow.
  const bool grows = !positive && (element == T6 || element == Q8 || element == H20);
  Model<Dim> model =
      flying_block<Dim>(element, Dim == 2 ? "[0, -10]" : "[0, -10, 0]", scheme, grows ? 1e-3 : 1e5);
  model.analysis.lagrange_functions = !positive;
  const Vec<Dim> v0 = 1.0 * Vec<Dim>::Unit(0);
  model.particles.velocity.assign(model.particles.x.size(), v0);
  constexpr Index steps = 300;
  Simulation simulation(model, flow(2));
  const Frame start = simulation.frame();
  simulation.advance(steps);
  const Frame end = simulation.frame();
  REQUIRE(end.size() == start.size());
  Vec<Dim> moved = steps * dt * v0;
  moved[1] -= 10 * dt * dt * steps * (steps + 1) / 2;
  double worst = 0;
  for (std::size_t k = 0; k < end.coordinates.size(); ++k)
    worst = std::max(worst, std::abs(end.coordinates[k] - start.coordinates[k] -
                                     moved[static_cast<Eigen::Index>(k % Dim)]));
  CHECK(crossings(model, end) > end.size() / 4);
  CHECK(worst < 1e-9);
}

template <int Dim, bool positive = false>
void check_momentum(Element element, Scheme scheme) {
  Model<Dim> model = flying_block<Dim>(element, Dim == 2 ? "[0, 0]" : "[0, 0, 0]", scheme, 1e5);
  model.analysis.lagrange_functions = !positive;
  for (const Vec<Dim>& x : model.particles.x) {
    Vec<Dim> v = Vec<Dim>::Constant(0.3);
    v[0] += 0.1 * (x[0] - 1.5);
    v[1] -= 0.1 * (x[1] - 2);
    model.particles.velocity.push_back(v);
  }
  Simulation simulation(model, flow(2));
  const HistoryRow start = simulation.history();
  simulation.advance(20);
  const HistoryRow end = simulation.history();
  CHECK(end.internal > 0);
  for (std::size_t d = 0; d < Dim; ++d)
    CHECK(end.momentum[d] == doctest::Approx(start.momentum[d]).epsilon(1e-12));
}

/// Call check(element, scheme) for all of both.
template <class Check>
void for_all(std::initializer_list<Element> elements, Check check) {
  for (const Element element : elements)
    for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
      CAPTURE(info(element).name);
      CAPTURE(static_cast<int>(scheme));
      check(element, scheme);
    }
}

}  // namespace

TEST_CASE("a block falls freely through cells of every element as a rigid body") {
  for_all({T3, T6, Q4, Q8, Q9}, check_free_fall<2>);
  for_all({Tet4, H8, H20, H27}, check_free_fall<3>);
  for_all({T6, Q9}, check_free_fall<2, true>);
  for_all({H27}, check_free_fall<3, true>);
}

TEST_CASE("a block that vibrates keeps its momentum in cells of every element") {
  for_all({T3, T6, Q4, Q8, Q9}, check_momentum<2>);
  for_all({Tet4, H8, H20, H27}, check_momentum<3>);
  for_all({T6, Q9}, check_momentum<2, true>);
  for_all({H27}, check_momentum<3, true>);
}
