// Sheets and bodies of revolution: the same bits however the tasks are executed.
#include <doctest/doctest.h>

#include "tests/runtime/step/plane_models.h"
#include "tests/runtime/step/restart_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

/// Steps in which particles cross cells and patches; with USL shorter ones, in which it is stable.
Model<2> in_steps(Model<2> model, Scheme scheme) {
  model.analysis.scheme = scheme;
  model.analysis.nsteps = 60;
  if (scheme == Scheme::usl) model.analysis.step.dt = 1e-3;
  model.output.frame_steps = model.output.history_steps = 10;
  model.watchdog.action = Watchdog::Action::none;
  return model;
}

void check(const Model<2>& model) {
  check_ways(model);
  check_restart(model, 11, 27, {flow(2), serial()});
}

Model<2> yielding(Model<2> model) {
  for (Material& material : model.materials)
    material.law = VonMises{.youngs_modulus = 2000, .poisson_ratio = 0.3, .yield_stress = 100};
  return model;
}

}  // namespace

TEST_CASE("axisymmetric models give the serial loop's bits, and go on from any state") {
  for (const Scheme scheme : schemes) {
    CAPTURE(static_cast<int>(scheme));
    const auto ring = [&](Model<2> model) {
      return in_steps(with_plane(std::move(model), Plane::axisymmetric), scheme);
    };
    check(ring(two_discs()));
    check(ring(yielding(two_discs())));
    check(ring(distorted(two_discs(), 0.012)));
    for (const ShapeFunctions functions :
         {ShapeFunctions::gimp, ShapeFunctions::cpdi, ShapeFunctions::quadratic_spline})
      check(ring(with_functions(two_discs(), functions)));
    check(ring(dam_break()));
    Model<2> means = ring(two_discs());
    means.analysis.mean_volume = true;
    check(means);
    Model<2> affine = ring(two_discs());
    affine.analysis.affine = Affine::apic;
    affine.analysis.transfer.flip = 0.0;
    check(affine);
    Model<2> adaptive = ring(two_discs());
    adaptive.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
    check(adaptive);
  }
}

TEST_CASE("sheets give the serial loop's bits, and go on from any state") {
  for (const Scheme scheme : schemes) {
    CAPTURE(static_cast<int>(scheme));
    const auto sheet = [&](Model<2> model) {
      return in_steps(with_plane(std::move(model), Plane::stress), scheme);
    };
    check(sheet(two_discs()));
    check(sheet(yielding(two_discs())));
    check(sheet(distorted(two_discs(), 0.012)));
    for (const ShapeFunctions functions : {ShapeFunctions::gimp, ShapeFunctions::quadratic_spline})
      check(sheet(with_functions(yielding(two_discs()), functions)));
  }
}
