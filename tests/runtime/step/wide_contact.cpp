// Contact of bodies with functions that reach beyond a cell.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// How far body 1 is ahead of body 0 along the line on which they meet [m]; negative: they overlap.
double gap(const Model<2>& model, const Frame& frame) {
  const Vec<2> ahead = Vec<2>(0.4, 0.3).normalized();  // from centre to centre
  double last = -std::numeric_limits<double>::infinity(), first = -last;
  for (std::size_t k = 0; k < frame.id.size(); ++k) {
    const double at = ahead.dot(Vec<2>(frame.coordinates[2 * k], frame.coordinates[2 * k + 1]));
    if (model.particles.material[static_cast<std::size_t>(frame.id[k])] == 0)
      last = std::max(last, at);
    else
      first = std::min(first, at);
  }
  return first - last;
}

}  // namespace

TEST_CASE("discs that collide keep their momentum and do not pass through each other") {
  struct Case {
    ShapeFunctions functions;
    Affine affine;
  };
  for (const Case c :
       {Case{ShapeFunctions::element, Affine::none}, Case{ShapeFunctions::gimp, Affine::none},
        Case{ShapeFunctions::uniform_gimp, Affine::none}, Case{ShapeFunctions::cpdi, Affine::none},
        Case{ShapeFunctions::cpdi2, Affine::none},
        Case{ShapeFunctions::quadratic_spline, Affine::none},
        Case{ShapeFunctions::quadratic_spline, Affine::apic},
        Case{ShapeFunctions::cubic_spline, Affine::none}}) {
    CAPTURE(static_cast<int>(c.functions));
    CAPTURE(static_cast<int>(c.affine));
    Model<2> model = in_contact(with_functions(two_discs(), c.functions, c.affine), 0.0);
    for (Material& material : model.materials)  // stiff: they touch and part again
      std::get<LinearElastic>(material.law).youngs_modulus = 2e5;
    model.analysis.step.dt = 5e-4;
    model.analysis.nsteps = 400;
    model.output.frame_steps = model.output.history_steps = 10;
    const Outcome outcome = run(model, serial());
    REQUIRE(outcome.error == "");
    const HistoryRow& start = outcome.rows.front();
    for (const HistoryRow& row : outcome.rows)
      for (std::size_t d = 0; d < 2; ++d)
        CHECK(std::abs(row.momentum[d] - start.momentum[d]) < 1e-11 * start.mass);
    double closest = 1;
    for (const Frame& frame : outcome.frames) closest = std::min(closest, gap(model, frame));
    CHECK(
        (closest > 0.0 && closest < 0.03));  // between centres of particles, whose halves are 0.01
    CHECK(gap(model, outcome.frames.back()) > 0.15);  // and are parted again
  }
}

// After 25 steps of 0.5 mm all particles of a disc are at edges of cells, but for rounding.
TEST_CASE("discs that fly over the edges of cells keep their momentum, and have no stress") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl})
    for (const ShapeFunctions functions :
         {ShapeFunctions::element, ShapeFunctions::gimp, ShapeFunctions::quadratic_spline})
      for (const bool contact : {false, true}) {
        CAPTURE(static_cast<int>(scheme));
        CAPTURE(static_cast<int>(functions));
        CAPTURE(contact);
        Model<2> model = with_functions(two_discs(), functions);
        if (contact) model = in_contact(model, 0.3);
        const Vec<2> fast{1, 0.6};
        for (std::size_t p = 0; p < model.particles.x.size(); ++p)  // both: they do not meet
          model.particles.velocity[p] = fast;
        for (Material& material : model.materials)
          std::get<LinearElastic>(material.law).youngs_modulus = 2e5;
        model.analysis.scheme = scheme;
        model.analysis.step.dt = 5e-4;
        model.analysis.nsteps = 60;
        model.output.history_steps = 1;
        const Outcome outcome = run(model, serial());
        REQUIRE(outcome.error == "");
        const HistoryRow& start = outcome.rows.front();
        for (const HistoryRow& row : outcome.rows)
          for (std::size_t d = 0; d < 2; ++d)
            CHECK(std::abs(row.momentum[d] - start.momentum[d]) < 1e-13 * start.mass);
        CHECK(std::abs(outcome.rows.back().internal) < 1e-12 * start.kinetic);
      }
}

TEST_CASE("discs that collide keep their momentum to rounding with any scheme and functions") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl})
    for (const ShapeFunctions functions :
         {ShapeFunctions::element, ShapeFunctions::gimp, ShapeFunctions::quadratic_spline}) {
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(static_cast<int>(functions));
      Model<2> model = in_contact(with_functions(two_discs(), functions), 0.3);
      model.analysis.scheme = scheme;
      model.analysis.step.dt = 5e-4;
      model.analysis.nsteps = scheme == Scheme::usl ? 130 : 400;  // they meet at about 120
      model.output.history_steps = 1;
      const Outcome outcome = run(model, serial());
      REQUIRE(outcome.error == "");
      const HistoryRow& start = outcome.rows.front();
      double lost = 0;
      for (const HistoryRow& row : outcome.rows)
        for (std::size_t d = 0; d < 2; ++d)
          lost = std::max(lost, std::abs(row.momentum[d] - start.momentum[d]));
      CHECK(lost < 1e-12 * start.mass);
    }
}
