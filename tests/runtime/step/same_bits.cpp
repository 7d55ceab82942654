// The promise: bitwise the same results, however the tasks are executed.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// All ways of executing give the serial loop's bits, on a case whose particles change patches.
template <int Dim>
void check_all_ways(Model<Dim> model, const std::vector<ExecutionOptions>& ways) {
  model.watchdog.action =
      Watchdog::Action::none;  // bits are equal, whether results make sense or not
  const Outcome reference = run(model, serial());
  REQUIRE(reference.error == "");
  REQUIRE(reference.frames.size() >= 2);
  REQUIRE(reference.rows.size() >= 2);
  const Frame& end = reference.frames.back();
  REQUIRE(end.size() == model.particles.size());
  for (const double x : end.coordinates) REQUIRE(std::isfinite(x));
  CHECK(crossings(model, end) > end.size() / 20);
  for (const ExecutionOptions& way : ways) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(model, way), reference));
  }
}

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

/// Steps that USL takes the discs without collapsing cells: nodes of little mass become too fast.
constexpr Index usl_discs = 35;

/// For USL: a shorter run, in which all particles move on.
template <int Dim>
void move_off(Model<Dim>& model, const Vec<Dim>& velocity, Index steps) {
  model.particles.velocity.assign(static_cast<std::size_t>(model.particles.size()), velocity);
  model.analysis.nsteps = steps;
  model.output.frame_steps = model.output.history_steps = 5;
}

}  // namespace

TEST_CASE("two discs: every scheme, velocity update and damping gives the serial loop's bits") {
  for (const Scheme scheme : schemes)
    for (const double flip : {1.0, 0.0, 0.9}) {
      Model<2> model = two_discs();
      model.analysis.scheme = scheme;
      model.analysis.transfer.flip = flip;
      model.analysis.damping = flip == 0.9 ? 0.02 : 0.0;
      if (scheme == Scheme::usl) model.analysis.nsteps = usl_discs;
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(flip);
      check_all_ways(model, other_ways());
    }
}

TEST_CASE("filters of the velocity transfer give the serial loop's bits") {
  const auto filtered = [](auto model, int order, bool filters_change) {
    model.analysis.transfer = {
        .rates = std::vector<double>(2, 20.0), .order = order, .filters_change = filters_change};
    if (order == 3) {
      model.analysis.transfer.viscous = 30.0;
      with_viscosity_of_pressure(model);
    }
    return model;
  };
  for (const Scheme scheme : schemes)
    for (const int order : {1, 2, 3, 4}) {
      Model<2> model = filtered(two_discs(), order, order == 3);
      model.analysis.scheme = scheme;
      if (scheme == Scheme::usl) model.analysis.nsteps = usl_discs;
      if (order == 2) model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(order);
      check_all_ways(model, other_ways());
      if (order == 3) check_all_ways(in_contact(model), {flow(2), flow(8), random_order(9)});
    }
  for (const ShapeFunctions functions : {ShapeFunctions::gimp, ShapeFunctions::quadratic_spline}) {
    check_all_ways(with_functions(filtered(two_discs(), 3, false), functions),
                   {flow(8), random_order(2)});
    check_all_ways(with_functions(filtered(dam_break_3d(), 2, true), functions),
                   {flow(8), random_order(2)});
  }
  check_all_ways(
      distorted(with_functions(filtered(two_discs(), 2, false), ShapeFunctions::element), 0.012),
      {flow(8), random_order(2)});
  Model<3> water = with_walls(filtered(dam_break_3d(), 3, false));
  water.analysis.pressure_smoothing = true;
  check_all_ways(water, {flow(8), random_order(2)});
}

TEST_CASE("two discs with adaptive steps and an end time give the serial loop's bits") {
  for (const Scheme scheme : schemes) {
    Model<2> model = two_discs();
    model.analysis.scheme = scheme;
    model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.4};
    model.analysis.end_time = scheme == Scheme::usl ? 0.25 : 0.3;  // then a cell collapses
    model.analysis.nsteps = 1000000;
    CAPTURE(static_cast<int>(scheme));
    check_all_ways(model, other_ways());
  }
}

TEST_CASE("dam break: smoothed pressure and adaptive steps give the serial loop's bits") {
  for (const Scheme scheme : schemes)
    for (const bool smoothing : {false, true})
      for (const bool adaptive : {false, true}) {
        Model<2> model = dam_break();
        model.analysis.scheme = scheme;
        model.analysis.pressure_smoothing = smoothing;
        if (scheme == Scheme::usl) move_off(model, {3, 0}, 15);
        if (adaptive) model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.5};
        CAPTURE(static_cast<int>(scheme));
        CAPTURE(smoothing);
        CAPTURE(adaptive);
        check_all_ways(model, {flow(2), flow(8), random_order(4)});
      }
}

TEST_CASE("hexahedra: every scheme gives the serial loop's bits") {
  for (const Scheme scheme : schemes) {
    Model<3> model = dam_break_3d();
    model.analysis.scheme = scheme;
    if (scheme == Scheme::usl) move_off(model, {1.5, 0, 0}, 20);
    CAPTURE(static_cast<int>(scheme));
    check_all_ways(model, other_ways());
  }
}

TEST_CASE("distorted cells: every scheme gives the serial loop's bits") {
  for (const Scheme scheme : schemes) {
    Model<2> discs = distorted(two_discs(), 0.012);
    discs.analysis.scheme = scheme;
    if (scheme == Scheme::usl) discs.analysis.nsteps = usl_discs;
    CAPTURE(static_cast<int>(scheme));
    check_all_ways(discs, other_ways());
  }
  Model<3> water = distorted(dam_break_3d(), 0.03);
  water.analysis.step.dt = 5e-3;
  check_all_ways(water, {flow(2), flow(8), random_order(9)});
}

TEST_CASE("friction and rotated axes give the serial loop's bits") {
  for (const Scheme scheme : schemes) {
    Model<2> discs = with_walls(two_discs());
    discs.analysis.scheme = scheme;
    if (scheme == Scheme::usl) discs.analysis.nsteps = usl_discs;
    CAPTURE(static_cast<int>(scheme));
    check_all_ways(discs, other_ways());
  }
  check_all_ways(with_walls(dam_break_3d()), {flow(2), flow(8), random_order(9)});
}

TEST_CASE("absorbing boundaries give the serial loop's bits") {
  for (const Scheme scheme : schemes)
    for (const bool adaptive : {false, true}) {
      Model<2> discs = with_absorbing(with_walls(two_discs()));
      discs.analysis.scheme = scheme;
      if (scheme == Scheme::usl) discs.analysis.nsteps = usl_discs;
      if (adaptive) discs.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(adaptive);
      check_all_ways(discs, other_ways());
    }
  check_all_ways(with_absorbing(dam_break_3d()), {flow(2), flow(8), random_order(9)});
  check_all_ways(with_absorbing(in_contact(two_discs())), {flow(2), flow(8), random_order(9)});
  check_all_ways(distorted(with_absorbing(two_discs()), 0.012), {flow(2), random_order(9)});
  Model<2> discs = with_absorbing(two_discs());
  for (const ShapeFunctions functions : {ShapeFunctions::gimp, ShapeFunctions::quadratic_spline})
    check_all_ways(with_functions(discs, functions), {flow(2), random_order(9)});
}

TEST_CASE("contact of bodies gives the serial loop's bits") {
  for (const Scheme scheme : schemes)
    for (const bool adaptive : {false, true}) {
      Model<2> discs = in_contact(two_discs());
      discs.analysis.scheme = scheme;
      if (scheme == Scheme::usl) discs.analysis.nsteps = usl_discs;
      if (adaptive) discs.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(adaptive);
      check_all_ways(discs, other_ways());
    }
  Model<2> water = in_contact(with_walls(dam_break()));
  water.analysis.pressure_smoothing = true;
  check_all_ways(water, {flow(2), flow(8), random_order(9)});
  check_all_ways(distorted(in_contact(two_discs()), 0.012), {flow(2), flow(8), random_order(9)});
  check_all_ways(in_contact(dam_break_3d()), {flow(2), flow(8), random_order(9)});
}

TEST_CASE("bodies that never share a node move as without contact, to the last bit") {
  for (const Scheme scheme : schemes) {
    Model<2> apart = two_discs();
    apart.analysis.scheme = scheme;
    apart.analysis.nsteps = 60;
    for (std::size_t p = 0; p < apart.particles.x.size(); ++p) {  // both up, side by side
      const bool left = apart.particles.material[p] == 0;
      apart.particles.x[p] += left ? Vec<2>(-0.05, -0.1) : Vec<2>(0.05, -0.4);
      apart.particles.velocity[p] = Vec<2>(left ? -0.1 : 0.1, 1.5);
      apart.particles.cell[p] = apart.mesh->locate(apart.particles.x[p]).cell;
    }
    const Outcome alone = run(apart, serial()), both = run(in_contact(apart), serial());
    REQUIRE(alone.error == "");
    CHECK(crossings(apart, alone.frames.back()) > 10);
    REQUIRE(both.frames.size() == alone.frames.size());
    for (std::size_t k = 0; k < both.frames.size(); ++k)
      CHECK(same_bits(both.frames[k], alone.frames[k]));
    // Sums of a patch go from body to body.
    for (std::size_t k = 0; k < both.rows.size(); ++k)
      CHECK(both.rows[k].kinetic == doctest::Approx(alone.rows[k].kinetic).epsilon(1e-13));
  }
}

TEST_CASE("GIMP, CPDI, splines and affine velocities give the serial loop's bits") {
  const auto check_discs = [](ShapeFunctions functions, Affine affine) {
    for (const Scheme scheme : schemes) {
      Model<2> discs = with_functions(two_discs(), functions, affine);
      discs.analysis.scheme = scheme;
      if (scheme == Scheme::usl) discs.analysis.nsteps = usl_discs;
      CAPTURE(static_cast<int>(functions));
      CAPTURE(static_cast<int>(affine));
      CAPTURE(static_cast<int>(scheme));
      check_all_ways(discs, {flow(2), flow(8), random_order(4)});
    }
  };
  check_discs(ShapeFunctions::gimp, Affine::none);
  check_discs(ShapeFunctions::cpdi, Affine::apic);
  check_discs(ShapeFunctions::cpdi2, Affine::none);
  check_discs(ShapeFunctions::quadratic_spline, Affine::apic);
  check_discs(ShapeFunctions::element, Affine::tpic);
  check_all_ways(with_functions(dam_break(), ShapeFunctions::uniform_gimp), {flow(8)});
  Model<2> smoothed = with_functions(dam_break(), ShapeFunctions::cubic_spline);
  smoothed.analysis.pressure_smoothing = true;
  check_all_ways(smoothed, {flow(8), random_order(2)});
  for (const Scheme scheme : schemes) {  // 60 steps of water: its domains do not fold yet
    Model<3> water = with_functions(dam_break_3d(), ShapeFunctions::cpdi2, Affine::apic);
    water.analysis.scheme = scheme;
    check_all_ways(water, {flow(8)});
  }
  for (const Scheme scheme : {Scheme::usf, Scheme::musl}) {
    Model<3> water = with_functions(dam_break_3d(), ShapeFunctions::gimp);
    water.analysis.scheme = scheme;
    check_all_ways(water, {flow(8), random_order(4)});
    water = with_functions(dam_break_3d(), ShapeFunctions::quadratic_spline, Affine::apic);
    water.analysis.scheme = scheme;
    check_all_ways(water, {flow(8), random_order(4)});
  }
  for (const Affine affine : {Affine::none, Affine::apic}) {  // G2P gives stress its gradients
    Model<3> water = with_functions(dam_break_3d(), ShapeFunctions::quadratic_spline, affine);
    water.analysis.scheme = Scheme::usl;
    move_off<3>(water, {1.5, 0, 0}, 16);
    check_all_ways(water, {flow(8), random_order(4)});
  }
}

TEST_CASE("particles that come apart (ASFLIP) give the serial loop's bits") {
  for (const Scheme scheme : schemes)
    for (const ShapeFunctions functions :
         {ShapeFunctions::element, ShapeFunctions::cpdi, ShapeFunctions::quadratic_spline}) {
      Model<2> discs = separable(two_discs(), functions);
      discs.analysis.scheme = scheme;
      if (scheme != Scheme::musl) discs.analysis.nsteps = usl_discs;
      CAPTURE(static_cast<int>(functions));
      CAPTURE(static_cast<int>(scheme));
      check_all_ways(discs, {flow(2), flow(8), random_order(4)});
      if (functions == ShapeFunctions::quadratic_spline)
        check_all_ways(in_contact(discs), {flow(8), random_order(4)});
    }
  for (const Scheme scheme : schemes) {
    Model<3> water = separable(dam_break_3d(), ShapeFunctions::quadratic_spline);
    water.analysis.scheme = scheme;
    check_all_ways(water, {flow(8), random_order(4)});
  }
}

TEST_CASE("loads and prescribed velocities that travel with particles give the serial bits") {
  Model<2> model = two_discs();
  const Index n = model.particles.size();
  ParticleTraction push{.particles = {}, .dir = 1, .traction = 300, .function = 0};
  ParticleVelocity drag{.particles = {}, .dir = 0, .velocity = 0.8};
  for (Index p = 0; p < n; p += 3) push.particles.push_back(p);
  for (Index p = 1; p < n / 4; p += 5) drag.particles.push_back(p);
  model.functions = {{.kind = MathFunction::Kind::linear, .x = {0, 0.1}, .f = {0, 1}}};
  model.tractions = {push};
  model.particle_velocities = {drag};
  entries_of<NodeForce>(model) = {{.node = 210, .dir = 0, .force = 2.0, .function = -1}};
  check_all_ways(model, other_ways());
  for (const Scheme scheme : schemes) {
    Model<2> driven = model;
    driven.analysis.drives_nodes = true;
    driven.analysis.scheme = scheme;
    if (scheme == Scheme::usl) driven.analysis.nsteps = usl_discs;
    CAPTURE(static_cast<int>(scheme));
    check_all_ways(driven, other_ways());
  }
  // They still act on the same particles at the end, wherever those are.
  const Outcome outcome = run(model, serial());
  const auto& v = outcome.frames.back().find("velocity")->values;
  for (const Index p : drag.particles) CHECK(v[static_cast<std::size_t>(2 * p)] == 0.8);
}

TEST_CASE("another layer of exchanged nodes does not change a bit") {
  const auto check = [](const auto& model) {
    const Outcome narrow = run(model, serial());
    for (ExecutionOptions way : {serial(), flow(3), random_order(5)}) {
      way.support_rings = 1;
      CAPTURE(describe(way));
      const Outcome wide = run(model, way);
      REQUIRE(wide.frames.size() == narrow.frames.size());
      for (std::size_t k = 0; k < wide.frames.size(); ++k)
        CHECK(same_bits(wide.frames[k], narrow.frames[k]));
      REQUIRE(wide.rows.size() == narrow.rows.size());
      // Patches are created and dropped at other steps, so that work is summed in another order.
      for (std::size_t k = 0; k < wide.rows.size(); ++k) {
        CHECK(wide.rows[k].kinetic == narrow.rows[k].kinetic);
        CHECK(wide.rows[k].momentum == narrow.rows[k].momentum);
        CHECK(wide.rows[k].internal == doctest::Approx(narrow.rows[k].internal).epsilon(1e-11));
      }
    }
  };
  check(two_discs());
  check(dam_break());
  check(dam_break_3d());
  check(distorted(two_discs(), 0.012));
}

TEST_CASE("steps taken one at a time or all at once give the same bits") {
  for (const bool adaptive : {false, true})
    for (const ExecutionOptions& way : {serial(), flow(3), random_order(2)}) {
      Model<2> model = dam_break();
      model.analysis.scheme = Scheme::musl;
      model.analysis.pressure_smoothing = true;
      if (adaptive) model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.5};
      CAPTURE(describe(way));
      CAPTURE(adaptive);
      Simulation at_once(model, way), in_parts(model, way);
      at_once.advance(60);
      for (int k = 0; k < 20; ++k) in_parts.advance(1);
      for (int k = 0; k < 8; ++k) in_parts.advance(5);
      CHECK(in_parts.step() == 60);
      CHECK(same_bits(in_parts.frame(), at_once.frame()));
      // Sums of work are cut at other places, so only rounding may differ.
      CHECK(in_parts.history().kinetic == at_once.history().kinetic);
      CHECK(in_parts.history().internal ==
            doctest::Approx(at_once.history().internal).epsilon(1e-12));
    }
}

TEST_CASE("looking at a run does not change it") {
  const Model<2> model = two_discs();
  Simulation watched(model, flow(2)), alone(model, flow(2));
  for (int k = 0; k < 8; ++k) {
    watched.advance(10);
    CHECK(same_bits(watched.frame(), watched.frame()));
    CHECK(same_bits(watched.history(), watched.history()));
    watched.info();
  }
  alone.run();
  CHECK(same_bits(watched.frame(), alone.frame()));
}
