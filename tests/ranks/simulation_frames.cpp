// Frames of a simulation on several ranks.
#include <doctest/doctest.h>

#include "io/frames/vtkhdf.h"
#include "io/run/run_folder.h"
#include "runtime/output/frame_output.h"
#include "tests/ranks/shared_folder.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// The files of a run, written as `lahar run` does; empty on ranks other than 0.
template <int Dim>
std::map<std::string, std::string> files_of(const Model<Dim>& model, const Communicator& ranks,
                                            ExecutionOptions options, bool copied,
                                            int writers = 0) {
  const SharedFolder folder(ranks);
  FrameOutput output(folder.path, ranks, {}, writers);
  options.ranks = ranks;
  options.staging_bytes = copied ? options.staging_bytes : 0;
  Observer observer;
  observer.frame = [&](FramePieces&& frame) { output.add(std::move(frame)); };
  observer.large_frame = [&](const FrameSource& frame) { output.write(frame); };
  observer.nodes = [&](FramePieces&& nodes) { output.add_nodes(std::move(nodes)); };
  observer.poll = [&] { output.progress(); };
  Simulation simulation(model, options, observer);
  output.while_waiting([&] { simulation.poll(); });
  output.write(simulation.frame_source());
  simulation.run();
  output.write(simulation.frame_source());
  if (auto nodes = simulation.nodes()) output.add_nodes(std::move(*nodes));
  output.finish();
  const Frame last = simulation.frame();
  if (ranks.rank() != 0) return {};
  CHECK(same_bits(read_frame(folder.path / frame_name(simulation.step(), ".hdf")), last));
  return contents_of(folder.path);
}

/// Every rank computes the reference for itself.
template <int Dim>
void check(const Model<Dim>& model, std::size_t frames) {
  const Communicator ranks = Communicator::world();
  const auto reference = files_of(model, Communicator(), serial(), true);
  CHECK(reference.size() == frames + 1);  // and the index
  for (const int threads : {1, 2})
    for (const bool copied : {true, false}) {
      CAPTURE(threads);
      CAPTURE(copied);
      const auto files = files_of(model, ranks, {.threads = threads}, copied);
      if (ranks.rank() == 0) CHECK(files == reference);
    }
  const auto files = files_of(model, ranks, {.threads = 1}, true, 1);  // one rank writes for all
  if (ranks.rank() == 0) CHECK(files == reference);
}

}  // namespace

TEST_CASE("frame files are the same for any number of ranks, byte by byte") {
  Model<2> discs = two_discs();
  discs.analysis.patch_particles = 16;
  discs.analysis.nsteps = 60;
  discs.output.frame_steps = 7;
  check(discs, 10);
  discs.output.frame_steps = 4;
  discs.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
  check(discs, 16);
  check(dam_break_3d(), 4);
  check(jet("musl", true), 13);
}

TEST_CASE("frames of a set and nodes are the same for any number of ranks, byte by byte") {
  Model<2> discs = two_discs();
  discs.analysis.patch_particles = 16;
  discs.analysis.nsteps = 60;
  discs.output.frame_steps = 7;
  std::vector<Index> ids;
  for (Index id = 0; id < discs.particles.size(); id += 3) ids.push_back(id);
  discs.output.frame_particles = std::make_shared<const std::vector<Index>>(ids);
  check(discs, 10);
  const auto with_nodes = [](auto model) {
    model.output.node_fields = {NodeField::velocity, NodeField::mass, NodeField::acceleration};
    model.analysis.shows_nodes = true;
    return model;
  };
  // Nodes come with all frames but the first, and have an index.
  check(with_nodes(discs), 10 + 9 + 1);
  discs.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
  discs.output.frame_steps = 4;
  check(with_nodes(discs), 16 + 15 + 1);
  check(with_nodes(dam_break_3d()), 4 + 3 + 1);
  check(with_nodes(jet("musl", true)), 13 + 12 + 1);
  check(with_nodes(in_contact(two_discs())), 5 + 4 + 1);
}
