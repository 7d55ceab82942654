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
                                            ExecutionOptions options, bool copied) {
  const SharedFolder folder(ranks);
  FrameOutput output(folder.path, ranks);
  options.ranks = ranks;
  options.staging_bytes = copied ? options.staging_bytes : 0;
  Observer observer;
  observer.frame = [&](FramePieces&& frame) { output.add(std::move(frame)); };
  observer.large_frame = [&](const FrameSource& frame) { output.write(frame); };
  observer.poll = [&] { output.progress(); };
  Simulation simulation(model, options, observer);
  output.while_waiting([&] { simulation.poll(); });
  output.write(simulation.frame_source());
  simulation.run();
  output.write(simulation.frame_source());
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
