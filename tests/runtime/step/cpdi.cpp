// Runs with CPDI and CPDI2: what their domains do.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A soft block of 4 x 4 (x 2) cells in the middle of a mesh, whose inner part turns fast.
template <int Dim>
Model<Dim> swirling_block(const std::string& functions, const std::string& scheme) {
  const bool flat = Dim == 2;
  Model<Dim> model = model_of_text<Dim>(fmt::format(
      R"({{"mesh": {{"structured": {{"cell_size": 0.25, "extent": {0}}}}},
  "materials": [{{"type": "NeoHookean", "density": 1000, "youngs_modulus": 200,
                  "poisson_ratio": 0.3}}],
  "particles": [{{"generator": {{"type": "region", "per_cell": {1}, "material": 0,
     "region": {{"box": {{"min": {2}, "max": {3}}}}}}}}}],
  "analysis": {{"mpm_scheme": "{4}", "shape_functions": "{5}", "dt": {6}, "end_time": 1.2,
                "patch_particles": 24}}}})",
      flat ? "[3, 3]" : "[2.5, 2.5, 1.5]", flat ? 3 : 2, flat ? "[1, 1]" : "[0.75, 0.75, 0.5]",
      flat ? "[2, 2]" : "[1.75, 1.75, 1]", scheme, functions, flat ? 2e-3 : 5e-3));
  Vec<Dim> middle = Vec<Dim>::Constant(flat ? 1.5 : 1.25);
  for (const Vec<Dim>& x : model.particles.x) {
    const Vec<Dim> r = x - middle;
    const double rate = 2 * std::exp(-4 * (r[0] * r[0] + r[1] * r[1]));
    Vec<Dim> v = 0.3 * Vec<Dim>::Unit(0);
    v[0] -= rate * r[1];
    v[1] += rate * r[0];
    if (!flat) v[2] = 0.4 * r[0];
    model.particles.velocity.push_back(v);
  }
  return model;
}

/// Corners of all domains by particle id: CPDI2's own, or those of CPDI's vectors.
template <int Dim>
std::map<std::pair<Index, int>, Vec<Dim>> corners_in(const Frame& frame) {
  std::map<std::pair<Index, int>, Vec<Dim>> at;
  const FrameColumn* offsets = frame.find("domain_corners");
  const FrameColumn* vectors = frame.find("domain_vectors");
  REQUIRE((offsets != nullptr) != (vectors != nullptr));
  for (std::size_t p = 0; p < frame.id.size(); ++p)
    for (int c = 0; c < corners<Dim>; ++c) {
      Vec<Dim> x;
      for (int d = 0; d < Dim; ++d) {
        x[d] = frame.coordinates[Dim * p + static_cast<std::size_t>(d)];
        const auto component = [&](const FrameColumn& column, int k) {
          return column.values[static_cast<std::size_t>(column.components) * p +
                               static_cast<std::size_t>(k)];
        };
        if (offsets) x[d] += component(*offsets, Dim * c + d);
        for (int k = 0; k < Dim && vectors; ++k)
          x[d] += (c >> k & 1 ? 1 : -1) * component(*vectors, Dim * k + d);
      }
      at[{frame.id[p], c}] = x;
    }
  return at;
}

/// The furthest that corners which are one at the start are from each other [m].
template <int Dim>
double widest_gap(const Frame& start, const Frame& end) {
  std::map<std::array<Index, Dim>, std::vector<std::pair<Index, int>>> shared;
  for (const auto& [corner, x] : corners_in<Dim>(start)) {
    std::array<Index, Dim> place;
    for (std::size_t d = 0; d < Dim; ++d)
      place[d] = std::llround(x[static_cast<Eigen::Index>(d)] * 1e6);
    shared[place].push_back(corner);
  }
  // A block of n^Dim particles has (n + 1)^Dim corners.
  const auto n =
      std::llround(std::pow(static_cast<double>(start.size()) / (Dim == 3 ? 0.5 : 1), 1.0 / Dim));
  CHECK(shared.size() == static_cast<std::size_t>((n + 1) * (n + 1) * (Dim == 3 ? n / 2 + 1 : 1)));
  const auto now = corners_in<Dim>(end);
  double widest = 0;
  for (const auto& [place, together] : shared)
    for (const auto& corner : together)
      widest = std::max(widest, (now.at(corner) - now.at(together.front())).norm());
  return widest;
}

/// Gaps at the end of a run, with how far its material has been turned and sheared.
template <int Dim>
double gap_after(const std::string& functions, const std::string& scheme) {
  const Model<Dim> model = swirling_block<Dim>(functions, scheme);
  Simulation simulation(model, flow(2));
  const Frame start = simulation.frame();
  CHECK(widest_gap<Dim>(start, start) < 1e-15);
  simulation.run();
  const Frame end = simulation.frame();
  CHECK(crossings(model, end) > end.size() / 2);
  return widest_gap<Dim>(start, end);
}

/// Two particles in cells of 1 m that fly apart; their domains follow.
Model<2> torn(const std::string& functions, const std::string& large) {
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{"mesh": {{"structured": {{"cell_size": 1, "extent": [10, 3]}}}},
  "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e-3,
                  "poisson_ratio": 0}}],
  "particles": [{{"generator": {{"type": "region", "per_cell": 1, "material": 0,
     "region": {{"box": {{"min": [4, 1], "max": [6, 2]}}}}}}}}],
  "analysis": {{"mpm_scheme": "usl", "shape_functions": "{}", "large_domains": "{}", "dt": 0.05,
                "nsteps": 60, "patch_particles": 1}}}})",
      functions, large));
  for (const Vec<2>& x : model.particles.x)
    model.particles.velocity.push_back({x[0] < 5 ? -0.5 : 0.5, 0});
  return model;
}

}  // namespace

TEST_CASE("corners that CPDI2 particles share stay together in turns and shear, to rounding") {
  for (const std::string scheme : {"usf", "usl", "musl"}) {
    CAPTURE(scheme);
    CHECK(gap_after<2>("cpdi2", scheme) < 1e-12);
    CHECK(gap_after<3>("cpdi2", scheme) < 1e-12);
  }
  // Parallelograms come apart by a good part of their size, 0.083 and 0.125 m.
  CHECK(gap_after<2>("cpdi", "usl") > 0.01);
  CHECK(gap_after<3>("cpdi", "usl") > 0.01);
}

TEST_CASE("the volume of CPDI2 particles is that of their domains, but for the time steps") {
  double worst[2] = {0, 0};
  for (const int k : {0, 1}) {
    Model<2> model = swirling_block<2>("cpdi2", "usl");
    if (k == 1) model.analysis.step.dt /= 4;
    model.analysis.nsteps = 100000;
    Simulation simulation(std::move(model), flow(2));
    simulation.run();
    const Frame end = simulation.frame();
    const auto corner = corners_in<2>(end);
    for (std::size_t p = 0; p < end.id.size(); ++p) {
      const auto at = [&](int c) { return corner.at({end.id[p], c}); };
      const Vec<2> a = at(3) - at(0), b = at(2) - at(1);
      const double area = 0.5 * (a[0] * b[1] - a[1] * b[0]);
      worst[k] = std::max(worst[k], std::abs(end.find("volume")->values[p] / area - 1));
    }
  }
  CHECK(worst[0] > 1e-6);
  CHECK(worst[0] < 0.02);
  CHECK(worst[1] == within(0.3, worst[0] / 4));
}

TEST_CASE("a domain that grows too large stops the run where that is asked for, and only there") {
  for (const std::string functions : {"gimp", "cpdi", "cpdi2"}) {
    CAPTURE(functions);
    const Outcome stopped = run(torn(functions, "error"), serial());
    CHECK(stopped.error.find("rank 0, patch ") != std::string::npos);
    CHECK(stopped.error.find(", stage locate: particle 0 at (") != std::string::npos);
    CHECK(stopped.error.find(
              " has a domain that reaches beyond the cells around its own. Use larger cells or "
              "smaller particles, or take the functions of a smaller domain with "
              "\"large_domains\": \"clip\" in \"analysis\".") != std::string::npos);
    for (const ExecutionOptions& way : {flow(2), flow(8)})
      CHECK(run(torn(functions, "error"), way).error == stopped.error);
    CHECK(run(torn(functions, "clip"), serial()).error == "");
  }
}

TEST_CASE("a CPDI2 domain that folds stops the run with what to do") {
  // A fast particle is driven into one at rest.
  Model<2> model = torn("cpdi2", "clip");
  for (Vec<2>& v : model.particles.velocity) v = {-3 * v[0], v[0]};
  const Outcome outcome = run(model, serial());
  MESSAGE(outcome.error);
  CHECK(outcome.error.find("folds") != std::string::npos);
}
