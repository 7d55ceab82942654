// Published cases of which the stresses are printed in their tests, to all digits.
#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <string>

#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// 2d/uniaxial_traction: a bar of three cells that is pulled at its end.
Model<2> pulled_bar(const std::string& load) {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "counts": [3, 1]}, "isoparametric": false,
             "boundary_conditions": {
               "velocity_constraints": [{"nset": "left", "dir": 0, "velocity": 0.0}]}},
    "sets": {"nodes": {"left": {"box": {"min": [0, 0], "max": [0, 0.1]}},
                       "right": {"box": {"min": [0.3, 0], "max": [0.3, 0.1]}}},
             "particles": {"end": {"box": {"min": [0.26, 0], "max": [0.3, 0.1]}}}},
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0}}],
    "materials": [{"type": "LinearElastic2D", "density": 1000.0, "youngs_modulus": 1000000.0,
                   "poisson_ratio": 0.0}],
    "external_loading_conditions": {)" +
                          load + R"(},
    "math_functions": [{"id": 0, "type": "Linear", "xvalues": [0.0, 0.5, 1.0],
                        "fxvalues": [0.0, 1.0, 1.0]}],
    "analysis": {"dt": 0.001, "velocity_update": true, "nsteps": 1000, "as_cbgeo": true}})");
}

struct Range {
  double least, most;
};

/// Least and largest stress_xx after so many updates.
void check_stresses(Model<2> model, const std::map<Index, Range>& expected) {
  Simulation simulation(std::move(model));
  for (const auto& [step, range] : expected) {
    CAPTURE(step);
    simulation.advance(step - simulation.step());
    const Frame frame = simulation.frame();
    const FrameColumn* stress = frame.find("stress");
    std::vector<double> xx;
    for (std::size_t i = 0; i < stress->values.size(); i += 6) xx.push_back(stress->values[i]);
    const auto [least, most] = std::minmax_element(xx.begin(), xx.end());
    constexpr double rounding = 1e-13;  // measured: 1e-15
    CHECK(std::abs(*least - range.least) < rounding);
    CHECK(std::abs(*most - range.most) < rounding);
  }
}

}  // namespace

// Tests of mpm-benchmarks have the states after 301, 511, ... updates (files were written after the
// update of the step they are named by), those of mpm-examples after 300, 510, ...
TEST_CASE("published numbers: a bar that forces of nodes pull") {
  check_stresses(pulled_bar(R"("concentrated_nodal_forces": [
                   {"math_function_id": 0, "nset": "right", "dir": 0, "force": 0.05}])"),
                 {{300, {0.590520812744999, 0.595453247132066}},
                  {301, {0.5925210678182377, 0.5974539476363379}},
                  {510, {1.0024898572800125, 1.0107003439391022}},
                  {511, {1.0026665338366039, 1.0112231542459431}},
                  {750, {1.0000057400725588, 1.0000241541441601}},
                  {751, {1.0000053000532143, 1.0000225119807862}},
                  {991, {0.9999990078443788, 0.9999990292713694}},
                  {1000, {0.999998970020447, 0.999998991968051}}});
}

TEST_CASE("published numbers: a bar that tractions of particles pull") {
  check_stresses(pulled_bar(R"("particle_surface_traction": [
                   {"math_function_id": 0, "pset": "end", "dir": 0, "traction": 1}])"),
                 {{300, {0.4435084213078205, 0.5946521054012821}},
                  {301, {0.4450086768966724, 0.5966527842046769}},
                  {510, {0.7526811177289789, 1.0104848452100940}},
                  {511, {0.7528092313640623, 1.0109599915279937}},
                  {750, {0.7500094308335878, 1.0000240617444776}},
                  {751, {0.7500090055681591, 1.0000224746314728}},
                  {990, {0.7500029258993646, 0.9999997852991345}},
                  {991, {0.750002924022295, 0.9999997782938734}}});
}
