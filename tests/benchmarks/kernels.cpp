// Every kernel alone, on one patch that stays in cache: tests/run builds it where Google Benchmark
// is installed (libbenchmark-dev). For ratios before and after a change on one machine:
//   build/release/tests/benchmark_kernels --benchmark_filter=P2G --benchmark_repetitions=5
// "items" are particles.
#include "physics/kernels/kernels.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "runtime/patches/patch_set.h"
#include "runtime/step/timestep.h"

using namespace lahar;

namespace {

/// `per_axis` particles along each axis of every cell, of linear elastic material.
template <int Dim>
Model<Dim> block(std::array<Index, Dim> counts, int per_axis, bool isoparametric) {
  Model<Dim> model;
  auto mesh = Mesh<Dim>::structured(Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts);
  if (isoparametric) {
    std::vector<Vec<Dim>> nodes;
    std::vector<typename Mesh<Dim>::Corners> cells;
    for (Index n = 0; n < mesh.n_nodes(); ++n) {
      const Vec<Dim> x = mesh.node(n);
      nodes.push_back(x + 0.1 * Vec<Dim>(x.array().sin()).reverse());
    }
    for (Index c = 0; c < mesh.n_cells(); ++c) cells.push_back(mesh.cell_nodes(c));
    mesh = Mesh<Dim>::from_tables(std::move(nodes), std::move(cells), true);
  }
  for (Index c = 0; c < mesh.n_cells(); ++c) {
    const CellGeometry<Dim> cell = mesh.geometry(c);
    const int n = static_cast<int>(std::pow(per_axis, Dim) + 0.5);
    for (int k = 0; k < n; ++k) {
      Vec<Dim> x = Vec<Dim>::Zero(), xi;
      for (int d = 0, rest = k; d < Dim; ++d, rest /= per_axis)
        xi[d] = (2.0 * (rest % per_axis) + 1.0) / per_axis - 1.0;
      for (int a = 0; a < corners<Dim>; ++a) {
        double N = 1.0;
        for (int d = 0; d < Dim; ++d) N *= 0.5 * (1.0 + ((a >> d) & 1 ? xi[d] : -xi[d]));
        x += N * cell.corner[static_cast<std::size_t>(a)];
      }
      model.particles.x.push_back(x);
      model.particles.cell.push_back(c);
      model.particles.volume.push_back(1.0 / n);
      model.particles.material.push_back(0);
    }
  }
  model.mesh = std::make_shared<const Mesh<Dim>>(std::move(mesh));
  model.materials = {{.id = 0,
                      .name = "elastic",
                      .density = 1000,
                      .law = LinearElastic{.youngs_modulus = 1e6, .poisson_ratio = 0.3}}};
  model.analysis.scheme = Scheme::usl;
  return model;
}

/// A stage of the USL step over all particles of the one patch.
template <int Dim>
void stage(benchmark::State& state, std::array<Index, Dim> counts, int per_axis, bool isoparametric,
           const std::string& name) {
  Model<Dim> model = block<Dim>(counts, per_axis, isoparametric);
  model.analysis.patch_particles = 1 << 20;
  PatchSet<Dim> patches(model, 0, node_sum_copies(model.analysis));
  const auto stages = timestep<Dim>(model.analysis);
  const StepContext<Dim> context{&model, &patches.partition(), 0, 0.0, 1e-6};
  for (int p = 0; p < patches.size(); ++p) receive(patches[p]);
  Patch<Dim>& patch = patches[0];
  map_first(patch, stages, context);
  velocity_and_integrate(patch, context);
  const auto at = std::find_if(stages.begin(), stages.end(),
                               [&](const auto& s) { return s.stage.name == name; });
  const auto s = static_cast<std::size_t>(at - stages.begin());
  for (auto _ : state) {
    run_phase(patch, stages, Phase{{}, s, s + 1}, context, context, [](std::size_t) {});
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * patch.count);
}

}  // namespace

int main(int argc, char** argv) {
  const auto add = [](const std::string& body, auto run) {
    for (const char* name : {"integrate", "stress", "G2P", "locate", "P2G", "force"})
      benchmark::RegisterBenchmark((body + "/" + name).c_str(),
                                   [=](benchmark::State& state) { run(state, name); });
  };
  const auto q4 = [](bool isoparametric) {
    return [=](benchmark::State& state, const char* name) {
      stage<2>(state, {16, 16}, 4, isoparametric, name);
    };
  };
  const auto h8 = [](bool isoparametric) {
    return [=](benchmark::State& state, const char* name) {
      stage<3>(state, {8, 8, 8}, 2, isoparametric, name);
    };
  };
  add("Q4", q4(false));
  add("H8", h8(false));
  add("Q4 isoparametric", q4(true));
  add("H8 isoparametric", h8(true));
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
