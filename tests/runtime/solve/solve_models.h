/// \file A body cut into patches, of which solvers are tested, and the ways to execute their
/// rounds.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "runtime/solve/rounds.h"
#include "runtime/step/timestep.h"
#include "tests/runtime/step/models.h"

namespace lahar::test {

/// An L of cells with particles, within a mesh that has empty cells around it.
template <int Dim>
Model<Dim> l_shape() {
  const bool flat = Dim == 2;
  const std::string region = flat
                                 ? R"({"difference": [{"box": {"min": [0, 0], "max": [10, 8]}},
                                {"box": {"min": [5, 4], "max": [10, 8]}}]})"
                                 : R"({"difference": [{"box": {"min": [0, 0, 0], "max": [6, 5, 4]}},
                                {"box": {"min": [3, 2, 0], "max": [6, 5, 4]}}]})";
  Model<Dim> model = model_of_text<Dim>(R"({"mesh": {"structured": {"cell_size": 1, "extent": )" +
                                        std::string(flat ? "[14, 11]" : "[8, 7, 6]") + R"(}},
        "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                       "poisson_ratio": 0.3}],
        "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0,
                                     "region": )" +
                                        region + R"(}}],
        "analysis": {"dt": 1e-3, "nsteps": 1, "patch_particles": )" +
                                        std::string(flat ? "5" : "9") + R"(}})");
  model.analysis.scheme = Scheme::newmark;  // whose sums have copies
  return model;
}

/// A square or cube of n cells along each axis, with a particle in each.
template <int Dim>
Model<Dim> cube(int n) {
  const std::string side = std::to_string(n);
  const std::string sides = "[" + side + ", " + side + (Dim == 3 ? ", " + side : "") + "]";
  Model<Dim> model =
      model_of_text<Dim>(R"({"mesh": {"structured": {"cell_size": 1, "extent": )" + sides + R"(}},
        "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                       "poisson_ratio": 0.3}],
        "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0, "region":
                       {"box": {"min": [0, 0)" +
                         std::string(Dim == 3 ? ", 0" : "") + R"(], "max": )" + sides + R"(}}}}],
        "analysis": {"dt": 1e-3, "nsteps": 1, "patch_particles": 200}})");
  model.analysis.scheme = Scheme::newmark;  // whose sums have copies
  return model;
}

/// The patches of a model for some lists of stages.
template <int Dim>
struct SolvePatches {
  Model<Dim> model;
  PatchSet<Dim> patches;
  std::unique_ptr<ExchangeGroups> groups;  ///< with several ranks

  SolvePatches(Model<Dim> model_in, const std::vector<TimestepStage<Dim>>& stages,
               const Communicator& ranks = {})
      : model(std::move(model_in)),
        patches(model, 0, node_sum_copies(model.analysis), 1, ranks, message_of_sums(stages)) {
    if (ranks.several()) groups = std::make_unique<ExchangeGroups>(ranks, 2);
  }
  StepContext<Dim> context(Step round) const { return {&model, &patches.partition(), round, 0, 1}; }
};

/// What rounds are executed as.
inline std::vector<ExecutorOptions> ways_of_rounds(bool several) {
  using Mode = ExecutionMode;
  std::vector<ExecutorOptions> ways;
  for (const int threads : {1, 2, 4})
    ways.push_back({.mode = Mode::flow_graph, .threads = threads, .verify = true});
  ways.push_back({.mode = Mode::bulk, .threads = 2});
  if (several) return ways;
  ways.push_back({.mode = Mode::serial});
  for (const std::uint64_t seed : {1, 2, 3})
    ways.push_back({.mode = Mode::random_order, .seed = seed});
  return ways;
}

}  // namespace lahar::test
