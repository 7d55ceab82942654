// Nodes as output shows them: against motions that are known, and the same in all patches.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "runtime/output/node_job.h"
#include "runtime/step/simulation.h"
#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A block in the middle of a mesh, which touches nothing.
Model<2> flying(const std::string& scheme, const std::string& more, const std::string& gravity) {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [2, 2]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e4,
                   "poisson_ratio": 0.2}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "velocity": [1.5, -0.5],
      "material": 0, "region": {"box": {"min": [0.5, 0.8], "max": [1, 1.2]}}}}],
    "external_loading_conditions": {"gravity": [0, )" +
                          gravity + R"(]},
    "analysis": {"dt": 2e-3, "nsteps": 60, "patch_particles": 12, "mpm_scheme": ")" +
                          scheme + "\"" + more + R"(},
    "post_processing": {"output_steps": 20, "frame_fields": ["mass"],
                        "node_fields": ["velocity", "mass", "acceleration"]}})");
}

struct NodesOfRun {
  std::vector<FramePieces> nodes;  ///< those beside frames, then the last ones
  std::vector<Index> frames;       ///< steps
};

template <int Dim>
NodesOfRun nodes_of(const Model<Dim>& model, const ExecutionOptions& way) {
  NodesOfRun found;
  Observer observer;
  observer.frame = [&](FramePieces&& frame) { found.frames.push_back(frame.header.step); };
  observer.large_frame = [&](const FrameSource& frame) {
    found.frames.push_back(frame.header.step);
  };
  observer.nodes = [&](FramePieces&& nodes) { found.nodes.push_back(std::move(nodes)); };
  Simulation simulation(model, way, observer);
  CHECK(!simulation.nodes());  // no step was taken
  simulation.run();
  auto last = simulation.nodes();
  REQUIRE(last);
  found.nodes.push_back(std::move(*last));
  return found;
}

/// Nodes that are in several pieces have the same bits in all of them. Returns how many are.
Index check_copies(const FramePieces& nodes) {
  std::map<Index, std::vector<double>> known;
  Index again = 0;
  for (const Frame& piece : nodes.pieces)
    for (std::size_t i = 0; i < piece.id.size(); ++i) {
      std::vector<double> values;
      const auto take = [&](const std::vector<double>& from, int width) {
        const auto first = from.begin() + static_cast<std::ptrdiff_t>(i) * width;
        values.insert(values.end(), first, first + width);
      };
      take(piece.coordinates, piece.dim);
      for (const FrameColumn& column : piece.columns) take(column.values, column.components);
      const auto [at, is_new] = known.emplace(piece.id[i], values);
      if (is_new) continue;
      ++again;
      CHECK(same_bits(at->second, values));
    }
  return again;
}

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

template <int Dim>
double particle_mass(const Model<Dim>& model) {
  Simulation simulation(model, serial());
  return sum(simulation.frame().find("mass")->values);
}

/// All of a body move with the same velocity.
void check_motion(const Frame& nodes, const std::array<double, 2>& v, double g) {
  const auto& velocity = nodes.find("velocity")->values;
  const auto& acceleration = nodes.find("acceleration")->values;
  const auto& mass = nodes.find("mass")->values;
  REQUIRE(nodes.size() > 0);
  double worst = 0;
  for (std::size_t i = 0; i < nodes.id.size(); ++i) {
    CHECK(mass[i] > 0);
    if (mass[i] < 1e-6) continue;  // of what rounding leaves of its force
    worst = std::max({worst, std::abs(velocity[2 * i] - v[0]), std::abs(velocity[2 * i + 1] - v[1]),
                      std::abs(acceleration[2 * i]), std::abs(acceleration[2 * i + 1] - g)});
  }
  CHECK(worst < 1e-8);
}

}  // namespace

TEST_CASE("nodes of a body that flies have its velocity, no acceleration, and its mass") {
  for (const std::string scheme : {"usl", "usf", "musl"})
    for (const std::string functions : {"element", "gimp", "quadratic_spline"}) {
      // Rounding grows at nodes of little mass.
      if (scheme == "usl" && functions == "element") continue;
      CAPTURE(scheme);
      CAPTURE(functions);
      const std::string more = R"(, "shape_functions": ")" + functions + "\"";
      const Model<2> model = flying(scheme, more, "0");
      const double mass = particle_mass(model);
      const NodesOfRun found = nodes_of(model, flow(2));
      REQUIRE(found.frames == std::vector<Index>{20, 40, 60});
      REQUIRE(found.nodes.size() == 4);
      for (const FramePieces& pieces : found.nodes) {
        CHECK(check_copies(pieces) > 0);
        const Frame nodes = unite_nodes(pieces);
        CHECK(sum(nodes.find("mass")->values) == doctest::Approx(mass).epsilon(1e-12));
        check_motion(nodes, {1.5, -0.5}, 0);
      }
      for (std::size_t k = 0; k < 3; ++k) CHECK(found.nodes[k].header.step == found.frames[k]);
      CHECK(found.nodes[3].header.step == 60);
    }
}

TEST_CASE("nodes of a body in free fall have the velocity at the end of the step") {
  for (const std::string scheme : {"usl", "usf", "musl"}) {
    CAPTURE(scheme);
    const std::string more = R"(, "shape_functions": "gimp")";
    for (const FramePieces& pieces : nodes_of(flying(scheme, more, "-10"), serial()).nodes)
      check_motion(unite_nodes(pieces), {1.5, -0.5 - 10 * pieces.header.time}, -10);
  }
}

TEST_CASE("nodes of implicit steps have the mean velocity of the step") {
  const Model<2> model = flying("newmark", "", "-10");
  for (const FramePieces& pieces : nodes_of(model, {.threads = 2}).nodes) {
    CHECK(check_copies(pieces) > 0);
    const Frame nodes = unite_nodes(pieces);
    CHECK(sum(nodes.find("mass")->values) == doctest::Approx(particle_mass(model)).epsilon(1e-12));
    const double middle = pieces.header.time - 0.5 * model.analysis.step.dt;
    const auto& velocity = nodes.find("velocity")->values;
    for (std::size_t i = 0; i < nodes.id.size(); ++i) {
      CHECK(velocity[2 * i] == within(1e-5, 1.5));
      CHECK(velocity[2 * i + 1] == within(1e-5, -0.5 - 10 * middle));
    }
  }
}

TEST_CASE("nodes are the same however a run is executed, and the run is the same without them") {
  Model<2> discs = two_discs();
  discs.analysis.patch_particles = 16;
  const auto with_nodes = [](auto model) {
    model.output.node_fields = {NodeField::mass, NodeField::velocity, NodeField::acceleration};
    model.analysis.shows_nodes = true;
    return model;
  };
  const auto check = [&](const auto& plain) {
    const auto model = with_nodes(plain);
    const NodesOfRun expected = nodes_of(model, serial());
    REQUIRE(expected.nodes.size() == expected.frames.size() + 1);
    for (ExecutionOptions way : {flow(1), flow(3), random_order(1)})
      for (const bool copied : {true, false}) {
        CAPTURE(describe(way));
        CAPTURE(copied);
        if (!copied) way.staging_bytes = 0;
        const NodesOfRun found = nodes_of(model, way);
        REQUIRE(found.nodes.size() == expected.nodes.size());
        CHECK(found.frames == expected.frames);
        for (std::size_t i = 0; i < found.nodes.size(); ++i) {
          check_copies(found.nodes[i]);
          CHECK(same_bits(unite_nodes(found.nodes[i]), unite_nodes(expected.nodes[i])));
        }
      }
    CHECK(same_bits(run(model, flow(2)), run(plain, serial())));
  };
  check(discs);
  discs.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
  check(discs);
  check(with_functions(two_discs(), ShapeFunctions::cubic_spline));
  check(dam_break_3d());
  check(jet("musl", true));
  check(in_contact(two_discs()));
}

TEST_CASE("nodes at which bodies meet have the mass and the momentum of all bodies") {
  Model<2> model = in_contact(two_discs());
  model.output.node_fields = {NodeField::mass, NodeField::velocity};
  model.analysis.shows_nodes = true;
  for (const FramePieces& pieces : nodes_of(model, serial()).nodes) {
    const Frame nodes = unite_nodes(pieces);
    const auto& mass = nodes.find("mass")->values;
    const auto& velocity = nodes.find("velocity")->values;
    CHECK(sum(mass) == doctest::Approx(particle_mass(model)).epsilon(1e-12));
    double momentum = 0;
    for (std::size_t i = 0; i < mass.size(); ++i) momentum += mass[i] * velocity[2 * i];
    const HistoryRow start = Simulation(model, serial()).history();
    CHECK(momentum == doctest::Approx(start.momentum[0]).epsilon(1e-9));
  }
}

TEST_CASE("places of nodes follow their ids, and the first rank that has one writes it") {
  const std::vector<std::vector<NodeRun>> runs{
      {{0, 3}, {10, 14}}, {{2, 5}, {8, 12}, {20, 21}}, {}, {{13, 16}}};
  Index total = 0;
  const auto places = [&](int rank) {
    std::vector<std::array<Index, 3>> all;
    for (const PlacedRun& run : place_nodes(runs, rank, total))
      all.push_back({run.ids.begin, run.ids.end, run.place});
    return all;
  };
  using Places = std::vector<std::array<Index, 3>>;
  CHECK(places(0) == Places{{0, 3, 0}, {10, 14, 7}});
  CHECK(places(1) == Places{{3, 5, 3}, {8, 10, 5}, {20, 21, 13}});
  CHECK(places(2).empty());
  CHECK(places(3) == Places{{14, 16, 11}});
  CHECK(total == 14);
  CHECK(place_nodes({{}, {}}, 0, total).empty());
  CHECK(total == 0);
}
