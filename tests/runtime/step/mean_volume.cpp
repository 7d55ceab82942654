// B-bar in explicit steps: the same bits however the tasks are executed, and means that do not know
// how cells are shared among patches.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/runtime/step/restart_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

/// Steps in which particles cross cells and patches; with USL fewer, in which it is stable.
template <int Dim>
Model<Dim> with_mean(Model<Dim> model, Scheme scheme) {
  model.analysis.mean_volume = true;
  model.analysis.scheme = scheme;
  model.analysis.nsteps = scheme == Scheme::usl ? 30 : 60;
  model.output.frame_steps = model.output.history_steps = 10;
  model.watchdog.action = Watchdog::Action::none;
  return model;
}

template <int Dim>
void check_mean(const Model<Dim>& model, Scheme scheme) {
  CAPTURE(static_cast<int>(scheme));
  const Model<Dim> with = with_mean(model, scheme);
  check_ways(with);
  check_restart(with, 11, 27, {flow(2), serial()});
}

/// Largest difference of the coordinates of two frames [m].
double distance(const Frame& a, const Frame& b) {
  REQUIRE(a.id == b.id);
  double most = 0;
  for (std::size_t k = 0; k < a.coordinates.size(); ++k)
    most = std::max(most, std::abs(a.coordinates[k] - b.coordinates[k]));
  return most;
}

}  // namespace

TEST_CASE("B-bar gives the serial loop's bits, and goes on from any state") {
  for (const Scheme scheme : schemes) {
    check_mean(two_discs(), scheme);
    check_mean(distorted(two_discs(), 0.012), scheme);
    check_mean(in_contact(two_discs()), scheme);
    check_mean(with_absorbing(with_walls(two_discs())), scheme);
    for (const ShapeFunctions functions : {ShapeFunctions::gimp, ShapeFunctions::quadratic_spline})
      check_mean(with_functions(two_discs(), functions), scheme);
    Model<2> adaptive = two_discs();
    adaptive.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
    check_mean(adaptive, scheme);
    Model<3> water = dam_break_3d();
    if (scheme == Scheme::usl) water.analysis.step.dt = 4e-3;
    check_mean(water, scheme);
    check_mean(with_functions(water, ShapeFunctions::quadratic_spline), scheme);
  }
  check_ways(with_mean(jet("usl", false), Scheme::usl));
  check_ways(with_mean(jet("usf", true), Scheme::usf));
}

// Forces wait for particles that neighbours send. If those were mapped apart, as without means,
// their pressures would be means of their own.
TEST_CASE("with B-bar particles move alike, however cells are shared among patches") {
  for (const Scheme scheme : schemes) {
    Model<2> whole = with_mean(two_discs(), scheme), cut = whole;
    whole.analysis.patch_particles = 100000;
    cut.analysis.patch_particles = 8;
    CAPTURE(static_cast<int>(scheme));
    const Outcome one = run(whole, serial()), many = run(cut, serial());
    CHECK(distance(one.frames.back(), many.frames.back()) < 1e-9);
    CHECK(crossings(cut, one.frames.back()) > one.frames.back().size() / 20);
    whole.analysis.mean_volume = false;
    CHECK(distance(one.frames.back(), run(whole, serial()).frames.back()) > 1e-5);
  }
}
