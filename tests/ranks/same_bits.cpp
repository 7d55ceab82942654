// Results on several ranks are those of one, to the last bit: checkpoint files are compared.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "io/base/atomic_file.h"
#include "io/scenario/scenario.h"
#include "runtime/bench/bench_cases.h"
#include "runtime/output/checkpoint_writer.h"
#include "runtime/step/restart.h"
#include "tests/ranks/checkpoint_bytes.h"
#include "tests/ranks/reference_run.h"
#include "tests/ranks/shared_folder.h"
#include "tests/runtime/step/falling_dust.h"
#include "tests/runtime/step/plane_models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Checkpoints that are written while steps are taken.
class OnTheWay {
 public:
  OnTheWay(std::filesystem::path folder, const Communicator& ranks)
      : folder_(std::move(folder)), ranks_(ranks), writer_({.folder = folder_}, ranks) {}
  Observer observer() {
    Observer observer;
    observer.checkpoint = [this](const SimulationState& state) {
      copies_ += state.copied;
      CheckpointHeader header;
      header.run = state.run;
      writer_.write(header, state);
    };
    observer.poll = [this] { writer_.progress(); };
    return observer;
  }
  int copies() const { return copies_; }  ///< of states, by tasks
  /// The bytes of that of a step, on every rank.
  std::string at(Index step) {
    writer_.finish();
    ranks_.wait_for_all();
    return read_text_file(folder_ / checkpoint_name(step));
  }

 private:
  std::filesystem::path folder_;
  const Communicator& ranks_;
  CheckpointWriter writer_;
  int copies_ = 0;
};

/// Returns how many states were copied by tasks.
template <int Dim>
int check(const Model<Dim>& model, Index steps, const std::vector<ExecutionOptions>& ways) {
  int copies = 0;
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks);
  const Reference<Dim> reference(model, steps, folder, ranks);
  Model<Dim> keeping = model;
  keeping.output.checkpoint_steps = steps / 2;
  for (std::size_t k = 0; k < ways.size(); ++k) {
    CAPTURE(k);
    ExecutionOptions way = ways[k];
    way.ranks = ranks;
    const auto own = folder.path / std::to_string(k);
    if (ranks.rank() == 0) make_folder(own);
    OnTheWay checkpoints(own / "way", ranks);
    Simulation simulation(keeping, way, checkpoints.observer());
    simulation.advance(steps);
    CHECK(checkpoints.at(steps / 2) == reference.middle);
    CHECK(checkpoint_of(simulation, ranks, own) == reference.end);
    copies += checkpoints.copies();
  }
  // Go on, on all ranks, from what one rank wrote halfway.
  const CheckpointReader middle(folder.path / "one" / checkpoint_name(steps / 2));
  ExecutionOptions way = ways.front();
  way.ranks = ranks;
  Simulation simulation(model, way, {}, state_in(middle));
  simulation.advance(steps - steps / 2);
  CHECK(checkpoint_of(simulation, ranks, folder.path / "on") == reference.end);
  return copies;
}

const std::vector<ExecutionOptions> threads_only{{.threads = 1}, {.threads = 2}, {.threads = 4}};

BalanceOptions every(Step steps, Partitioner partitioner = Partitioner::curve) {
  return {BalanceOptions::When::forced, steps, partitioner};
}

/// Threads, patches that move between ranks, all waiting for all, late messages, messages of MPI.
const std::vector<ExecutionOptions> all_ways{
    {.threads = 1},
    {.threads = 2},
    {.threads = 4},
    {.threads = 1, .balance = every(50)},
    {.threads = 2, .balance = every(20, Partitioner::scotch)},
    {.mode = ExecutionOptions::Mode::bulk, .threads = 1},
    {.threads = 1, .latency = 2e-4},
    {.threads = 2, .balance = every(50), .shared_memory = false}};

Model<2> example(const std::string& name, const std::vector<std::string>& overrides) {
  return std::get<Model<2>>(
      read_scenario(std::string(LAHAR_SOURCE_DIR) + "/examples/" + name, {.overrides = overrides})
          .model);
}

/// Patches of `particles`, and an adaptive step for a model that has a fixed one, or the reverse.
template <int Dim>
Model<Dim> with_patches(Model<Dim> model, Index particles) {
  model.analysis.patch_particles = particles;
  model.analysis.nsteps = 100000;
  return model;
}
template <int Dim>
Model<Dim> adaptive(Model<Dim> model) {
  model.analysis.step.adaptive = true;
  model.analysis.step.safety = 0.4;
  return model;
}

}  // namespace

TEST_CASE("plate with a hole") {
  const Model<2> plate = with_patches(bench_plate({}), 2000);
  check(plate, 60, threads_only);
  check(adaptive(plate), 40, threads_only);
}

TEST_CASE("plate of cells that are no boxes") {
  check(with_patches(bench_plate_isoparametric(), 2000), 30, threads_only);
}

TEST_CASE("discs in cells of other elements") {
  for (const char* element : {"ED2T3", "ED2Q9"}) {
    CAPTURE(element);
    Model<2> discs =
        with_patches(example("two-discs.json", {std::string("mesh.cell_type=") + element}), 40);
    check(discs, 80, {{.threads = 1}, {.threads = 4}, {.threads = 1, .balance = every(20)}});
  }
}

TEST_CASE("a collapse of water whose particles cross many patches") {
  const Model<2> water = with_patches(example("dam-break.json", {}), 200);
  check(water, 300, all_ways);
  Model<2> fixed = water;
  fixed.analysis.step.adaptive = false;
  fixed.analysis.step.dt = 5e-5;
  check(fixed, 300, all_ways);
}

TEST_CASE("discs that fly: ranks that have no particles at first, and none at last") {
  const Model<2> discs = with_patches(two_discs(), 40);
  check(discs, 116, all_ways);
  check(adaptive(discs), 100, threads_only);
}

TEST_CASE("dam break in three dimensions") {
  const Model<3> water = with_patches(dam_break_3d(), 100);
  check(water, 80, all_ways);
  check(adaptive(water), 40, threads_only);
}

TEST_CASE("the mean of volumetric strains in cells whose particles come from other ranks") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
    CAPTURE(static_cast<int>(scheme));
    Model<2> discs = with_patches(two_discs(), 24);
    discs.analysis.mean_volume = true;
    discs.analysis.scheme = scheme;
    const Index steps = scheme == Scheme::usl ? 30 : 80;
    check(discs, steps, all_ways);
    check(with_functions(adaptive(discs), ShapeFunctions::quadratic_spline), steps, threads_only);
  }
}

TEST_CASE("sheets and bodies of revolution are the same on any ranks") {
  for (const Plane plane : {Plane::stress, Plane::axisymmetric})
    for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
      CAPTURE(static_cast<int>(plane));
      CAPTURE(static_cast<int>(scheme));
      Model<2> discs = with_plane(with_patches(two_discs(), 24), plane);
      discs.analysis.scheme = scheme;
      if (scheme == Scheme::usl) discs.analysis.step.dt = 1e-3;
      const Index steps = 60;
      check(discs, steps, all_ways);
      check(with_functions(adaptive(discs), ShapeFunctions::quadratic_spline), steps, threads_only);
    }
}

TEST_CASE("particles that leave the mesh are listed alike, in the same order") {
  Model<2> discs = with_patches(two_discs(), 40);
  discs.analysis.remove_leaving_particles = true;
  discs.particles.velocity.assign(static_cast<std::size_t>(discs.particles.size()), {3, 1});
  const auto listed = [&](const ExecutionOptions& way) {
    std::string rows;
    Observer observer;
    observer.removed = [&](std::span<const RemovedParticle> particles) {
      for (const RemovedParticle& particle : particles) rows += removed_line(particle);
    };
    Simulation simulation(discs, way, observer);
    simulation.advance(110);
    return rows;
  };
  const std::string alone = listed({.threads = 1});
  CHECK(std::count(alone.begin(), alone.end(), '\n') > 10);
  for (ExecutionOptions way : all_ways) {
    way.ranks = Communicator::world();
    CHECK(listed(way) == alone);
  }
}

TEST_CASE("a jet that is injected, into nothing at first") {
  const Model<2> soft = with_patches(jet("usl", false), 16);
  check(soft, 120, all_ways);
  check(with_patches(jet("usf", true), 16), 70, threads_only);
  check(distorted(soft, 0.02), 70, threads_only);
  // Where nobody may leave, states with particles that came in are copied while steps are taken.
  Model<2> filled = soft;
  filled.analysis.remove_leaving_particles = false;
  CHECK(check(filled, 70, all_ways) > 0);
}

TEST_CASE("friction and rotated axes of nodes that patches of several ranks share") {
  check(with_patches(with_walls(two_discs()), 40), 80, threads_only);
}

TEST_CASE("absorbing nodes that patches of several ranks share") {
  Model<2> discs = with_patches(with_absorbing(two_discs()), 40);
  check(discs, 80, all_ways);
  discs.analysis.scheme = Scheme::usl;
  check(discs, 30, threads_only);
  check(with_patches(with_absorbing(dam_break_3d()), 100), 40, threads_only);
}

TEST_CASE("a liquid in pores across patches of several ranks") {
  for (const std::string scheme : {"usf", "usl", "musl"}) {
    CAPTURE(scheme);
    const Index steps = scheme == "usl" ? 20 : 120;  // USL: see usl_discs in tests/runtime
    check(saturated_block(scheme, "element"), steps, all_ways);
    check(saturated_block(scheme, "quadratic_spline"), steps, threads_only);
  }
  check(saturated_cube("apic"), 80, threads_only);
}

TEST_CASE("water outside of saturated soil across patches of several ranks") {
  for (const std::string scheme : {"usf", "musl"}) {
    CAPTURE(scheme);
    check(beside_water(saturated_block(scheme, "element")), 60, all_ways);
    check(beside_water(saturated_block(scheme, "gimp")), 60, threads_only);
  }
}

TEST_CASE("bodies in contact across patches of several ranks") {
  check(with_patches(in_contact(two_discs()), 40), 80, all_ways);
  check(with_patches(in_contact(dam_break_3d()), 100), 40, threads_only);
}

TEST_CASE("patches that are split because particles gather in them") {
  Model<2> dust = falling_dust();
  dust.analysis.nsteps = 100000;
  check(dust, 90, all_ways);
  check(adaptive(dust), 60, threads_only);
  // Ranks have parts of a mesh from tables.
  check(distorted(dust, 0.008), 90, all_ways);
  Model<3> deep = falling_dust_3d();
  deep.analysis.nsteps = 100000;
  check(deep, 60, all_ways);
  // On all ranks: this does happen.
  Simulation simulation(deep, {.threads = 1, .ranks = Communicator::world()});
  simulation.advance(60);
  CHECK(simulation.info().splits > 2);
}

TEST_CASE("patches that are split while particles are injected into them") {
  Model<2> dust = falling_dust_with_source();
  dust.analysis.nsteps = 100000;
  check(dust, 90, all_ways);
  Simulation simulation(dust, {.threads = 1, .ranks = Communicator::world()});
  simulation.advance(35);
  const Index splits = simulation.info().splits, particles = simulation.info().particles;
  simulation.advance(55);
  CHECK(simulation.info().splits > splits);
  CHECK(simulation.info().particles > particles);
}

TEST_CASE("patches that are split between bodies in contact") {
  Model<2> dust = in_contact(falling_dust());
  dust.analysis.nsteps = 100000;
  check(dust, 60, all_ways);
  Simulation simulation(dust, {.threads = 1, .ranks = Communicator::world()});
  simulation.advance(60);
  CHECK(simulation.info().splits > 2);
}

TEST_CASE("a run goes on, on all ranks, from any step around a split") {
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks);
  const Model<2> dust = falling_dust();
  Simulation simulation(dust, {.threads = 1, .ranks = ranks});
  const Index end = 60;
  std::vector<Index> steps;
  for (Index step = 20; step < end; step += 3) {
    simulation.advance(step - simulation.step());
    checkpoint_of(simulation, ranks, folder.path / "all");
    steps.push_back(step);
  }
  simulation.advance(end - simulation.step());
  const std::string expected = checkpoint_of(simulation, ranks, folder.path / "all");
  CHECK(simulation.info().splits > 2);
  for (const Index step : steps) {
    const CheckpointReader middle(folder.path / "all" / checkpoint_name(step));
    Simulation other(dust, {.threads = 2, .ranks = ranks}, {}, state_in(middle));
    other.advance(end - step);
    CHECK(checkpoint_of(other, ranks, folder.path / std::to_string(step)) == expected);
    if (ranks.rank() == 0) {  // and on one alone
      Simulation alone(dust, {.threads = 1}, {}, state_in(middle));
      alone.advance(end - step);
      CHECK(checkpoint_of(alone, {}, folder.path / ("alone" + std::to_string(step))) == expected);
    }
    ranks.wait_for_all();
  }
}

TEST_CASE("CPDI, with affine velocities, and CPDI2, whose corners travel with particles") {
  const auto discs = with_patches(two_discs(), 40);
  check(with_functions(discs, ShapeFunctions::cpdi, Affine::apic), 60, threads_only);
  check(with_functions(discs, ShapeFunctions::cpdi2), 60,
        {{.threads = 1}, {.threads = 2}, {.threads = 1, .balance = every(20)}});
  check(with_functions(with_patches(dam_break_3d(), 100), ShapeFunctions::cpdi2), 16, threads_only);
}

TEST_CASE("GIMP, and splines with affine velocities") {
  check(with_functions(with_patches(two_discs(), 40), ShapeFunctions::gimp), 60,
        {{.threads = 1}, {.threads = 2}, {.threads = 1, .balance = every(20)}});
  check(with_functions(with_patches(dam_break_3d(), 100), ShapeFunctions::gimp), 16, threads_only);
  check(with_functions(with_patches(dam_break_3d(), 100), ShapeFunctions::quadratic_spline,
                       Affine::apic),
        16, threads_only);
  Model<3> last = with_functions(with_patches(dam_break_3d(), 100),
                                 ShapeFunctions::quadratic_spline, Affine::apic);
  last.analysis.scheme = Scheme::usl;  // G2P gives stress its gradients
  check(last, 16, threads_only);
}

TEST_CASE("filters of the velocity transfer") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl})
    for (const int order : {2, 3}) {
      Model<2> discs = with_patches(two_discs(), 40);
      discs.analysis.scheme = scheme;
      discs.analysis.transfer = {.rates = {20.0}, .order = order, .filters_change = order == 3};
      if (order == 3) {
        discs.analysis.transfer.viscous = 30.0;
        with_viscosity_of_pressure(discs);
      }
      check(discs, scheme == Scheme::usl ? 35 : 60, threads_only);
    }
}

TEST_CASE("filters of orders that exchange a kind of sum several times in a step") {
  for (const int order : {4, 5, 10}) {
    Model<2> discs = in_contact(with_absorbing(with_patches(two_discs(), 40)));
    discs.analysis.scheme = Scheme::musl;
    discs.analysis.transfer = {.rates = {20.0, 20.0}, .order = order};
    CAPTURE(order);
    check(discs, 40, threads_only);
    discs.analysis.scheme = Scheme::usf;
    discs.analysis.pressure_smoothing = true;
    check(discs, 40, threads_only);
  }
}

TEST_CASE("particles that come apart (ASFLIP)") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
    Model<2> discs = separable(with_patches(two_discs(), 40), ShapeFunctions::quadratic_spline);
    discs.analysis.scheme = scheme;
    check(discs, scheme == Scheme::usl ? 35 : 60, threads_only);
    Model<3> water = separable(with_patches(dam_break_3d(), 100), ShapeFunctions::quadratic_spline);
    water.analysis.scheme = scheme;
    check(water, 16, threads_only);
  }
}

TEST_CASE("fewer patches than ranks") {
  check(with_patches(two_discs(), 100000), 60, threads_only);
}

TEST_CASE("fields of materials, and constraints that follow functions of time") {
  for (const bool adaptive : {false, true}) {
    const Model<2> model = std::get<Model<2>>(read_scenario_text(std::string(R"({
      "mesh": {"structured": {"cell_size": 0.1, "counts": [30, 12]},
               "boundary_conditions": {
                 "velocity_constraints": [{"nset": "base", "dir": "x", "velocity": 0.5,
                   "math_function_id": "shake"}, {"nset": "base", "dir": "y", "velocity": 0}],
                 "particles_velocity_constraints": [{"pset": "pushed", "dir": "x", "velocity": 1,
                   "math_function_id": "shake"}]}},
      "math_functions": [{"name": "shake", "type": "Sin", "x0": -0.01, "a": 60,
                          "xrange": [-1, 9]}],
      "sets": {"nodes": {"base": {"half_space": {"point": [0, 0], "normal": [0, 1]}}},
               "particles": {"pushed": {"box": {"min": [0, 0.7], "max": [3, 9]}}}},
      "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                     "region": {"box": {"min": [0.5, 0], "max": [2.5, 0.8]}}}}],
      "materials": [{"type": "LinearElastic", "density": 1000, "poisson_ratio": 0, "youngs_modulus":
        {"mean": 1e4, "cov": 0.3, "correlation_length": [1, 0.2], "seed": 3, "classes": 12}}],
      "analysis": {"nsteps": 120, "patch_particles": 24, )") + (adaptive ? R"("end_time": 9}})"
                                                                         : R"("dt": 2e-3}})"),
                                                                 LAHAR_SOURCE_DIR)
                                                  .model);
    CHECK(model.materials.size() > 5);
    CHECK(model.analysis.particles_follow_time);
    CAPTURE(adaptive);
    check(model, 120, {{.threads = 1}, {.threads = 2, .balance = every(20)}});
  }
}

TEST_CASE("particles with prescribed velocities drive nodes of all ranks, to the bit of one") {
  for (const char* scheme : {"usf", "usl", "musl"}) {
    const Model<2> model = std::get<Model<2>>(read_scenario_text(std::string(R"({
      "mesh": {"structured": {"cell_size": 0.1, "counts": [40, 10]},
               "boundary_conditions": {"particles_velocity_constraints": [
                 {"pset": "pushed", "dir": "y", "velocity": 0.1}]}},
      "sets": {"particles": {"pushed": {"box": {"min": [0.6, 0], "max": [9, 9]}}}},
      "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                     "velocity": [2, 0], "region": {"box": {"min": [0.2, 0.2], "max": [1.0, 0.4]}}}}],
      "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e4,
                     "poisson_ratio": 0}],
      "analysis": {"dt": 2e-3, "nsteps": 200, "patch_particles": 8, "mpm_scheme": ")") +
                                                                     scheme + "\"}}",
                                                                 LAHAR_SOURCE_DIR)
                                                  .model);
    CHECK(model.analysis.drives_nodes);
    CAPTURE(scheme);
    check(model, 200, {{.threads = 1}, {.threads = 2, .balance = every(20)}});
  }
}
