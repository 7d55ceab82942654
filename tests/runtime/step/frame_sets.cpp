// Frames of a set of particles: full frames without the other particles.
#include <doctest/doctest.h>

#include <algorithm>

#include "physics/base/error.h"
#include "runtime/step/simulation.h"
#include "tests/runtime/step/models.h"
#include "tests/runtime/step/restart_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// The particles of a frame that are in a set.
Frame filtered(const Frame& all, const std::vector<Index>& ids) {
  Frame some = all;
  some.id.clear();
  some.material.clear();
  some.coordinates.clear();
  for (FrameColumn& column : some.columns) column.values.clear();
  const auto take = [](const auto& from, std::size_t i, int width, auto& to) {
    const auto first = from.begin() + static_cast<std::ptrdiff_t>(i) * width;
    to.insert(to.end(), first, first + width);
  };
  for (std::size_t i = 0; i < all.id.size(); ++i) {
    if (!std::binary_search(ids.begin(), ids.end(), all.id[i])) continue;
    take(all.id, i, 1, some.id);
    take(all.material, i, 1, some.material);
    take(all.coordinates, i, all.dim, some.coordinates);
    for (std::size_t k = 0; k < all.columns.size(); ++k)
      take(all.columns[k].values, i, all.columns[k].components, some.columns[k].values);
  }
  return some;
}

template <int Dim>
Model<Dim> with_set(Model<Dim> model, const std::vector<Index>& ids) {
  model.output.frame_particles = std::make_shared<const std::vector<Index>>(ids);
  return model;
}

std::vector<Index> every(Index step, Index n) {
  std::vector<Index> ids;
  for (Index id = 1; id < n; id += step) ids.push_back(id);
  return ids;
}

template <int Dim>
void check(const Model<Dim>& model, const std::vector<Index>& ids) {
  Outcome expected = run(model, serial());
  REQUIRE(expected.frames.size() > 2);
  for (Frame& frame : expected.frames) frame = filtered(frame, ids);
  CHECK(expected.frames.front().size() > 0);
  for (ExecutionOptions way : {serial(), flow(2), random_order(1)}) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(with_set(model, ids), way), expected));
  }
}

}  // namespace

TEST_CASE("frames of a set are full frames without the other particles, and the run is the same") {
  Model<2> discs = two_discs();
  discs.analysis.patch_particles = 16;
  const Index n = discs.particles.size();
  check(discs, every(3, n));
  check(discs, {0, n - 1});
  discs.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
  check(discs, every(7, n));
  for (auto& v : discs.particles.velocity) v *= 2;  // some leave the mesh
  discs.analysis.remove_leaving_particles = true;
  discs.analysis.nsteps = 300;
  check(discs, every(2, n));
  check(dam_break_3d(), every(5, 200));
}

TEST_CASE("particles that come in during the run are in no set of frames") {
  const auto model = [](const std::string& set) {
    return model_of_text<2>(R"({
      "mesh": {"structured": {"cell_size": 0.1, "extent": [2, 1.5]}},
      "sets": {"cells": {"inlet": {"box": {"min": [0, 1], "max": [0.1, 1.4]}}}},
      "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e4,
                     "poisson_ratio": 0.2}],
      "particles": [
        {"generator": {"type": "inject", "cset": "inlet", "nparticles_per_dir": 2,
                       "velocity": [2, 0], "material": 0}},
        {"generator": {"type": "region", "per_cell": 2, "material": 0, "pset": "block",
                       "region": {"box": {"min": [1, 0.5], "max": [1.2, 0.7]}}}}],
      "analysis": {"dt": 5e-3, "nsteps": 60, "patch_particles": 24},
      "post_processing": {"output_steps": 10, "frame_pset": )" +
                            set + "}}");
  };
  const Outcome all = run(model("-1"), serial()), block = run(model("\"block\""), flow(2));
  CHECK(all.frames.back().size() > 16);
  REQUIRE(block.frames.size() == all.frames.size());
  for (std::size_t i = 0; i < all.frames.size(); ++i) {
    CHECK(block.frames[i].size() == 16);
    CHECK(same_bits(block.frames[i], filtered(all.frames[i], block.frames[0].id)));
  }
}

TEST_CASE("large frames of a set hold what copied ones do") {
  Model<2> model = two_discs();
  const std::vector<Index> ids = every(4, model.particles.size());
  model = with_set(model, ids);
  const Outcome copied = run(model, serial());
  ExecutionOptions way = flow(2);
  way.staging_bytes = 0;
  std::vector<Frame> frames;
  Observer observer;
  observer.frame = [](FramePieces&&) { FAIL("a large frame was copied"); };
  observer.large_frame = [&](const FrameSource& frame) {
    Index n = 0;
    for (std::size_t i = 0; i < frame.sizes.size(); ++i) {
      CHECK(frame.piece(i).size() == frame.sizes[i]);
      n += frame.sizes[i];
    }
    CHECK(n == static_cast<Index>(ids.size()));
    frames.push_back(join(frame));
  };
  Simulation simulation(model, way, observer);
  simulation.run();
  frames.push_back(simulation.frame());
  REQUIRE(frames.size() == copied.frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) CHECK(same_bits(frames[i], copied.frames[i]));
}

TEST_CASE("memory and disk are planned for the particles of the set, and states hold all") {
  const Model<2> all = two_discs();
  const Index n = all.particles.size();
  const Simulation full(all, serial());
  Simulation part(with_set(all, every(4, n)), serial());
  const auto of_set = static_cast<double>(every(4, n).size()) / static_cast<double>(n);
  const SimulationInfo a = full.info(), b = part.info();
  CHECK(static_cast<double>(b.frame_bytes) ==
        doctest::Approx(of_set * static_cast<double>(a.frame_bytes)));
  CHECK(b.all_frame_bytes == b.frame_bytes);
  CHECK(b.state_bytes == a.state_bytes);
  CHECK(b.particles == a.particles);

  part.advance(40);
  const StoredState state(part.state());
  Simulation again(all, serial(), {}, state.view());  // post_processing may change
  CHECK(again.frame().size() == n);
}
