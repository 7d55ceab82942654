// A block on an inclined plane of which the nodes have rotated axes and friction: it slides with
// g (sin theta - mu cos theta), or sticks if mu >= tan theta.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double g = 9.81;

template <int Dim>
using Rotation = Eigen::Matrix<double, Dim, Dim>;

/// Turn mesh and particles, hold the nodes of the floor (along the last axis) along the turned
/// normal, with friction.
template <int Dim>
Model<Dim> on_incline(Model<Dim> model, const Rotation<Dim>& turn, double friction) {
  const Mesh<Dim>& flat = *model.mesh;
  std::vector<Vec<Dim>> nodes;
  for (Index n = 0; n < flat.n_nodes(); ++n) {
    nodes.push_back(turn * flat.node(n));
    if (flat.node(n)[Dim - 1] > 1e-9) continue;
    model.node_frames.push_back({n, turn});
    entries_of<NodeVelocity>(model).push_back({n, Dim - 1, 0.0});
    if (friction > 0) entries_of<NodeFriction>(model).push_back({n, Dim - 1, -1, friction});
  }
  std::vector<typename Mesh<Dim>::Corners> cells;
  for (Index c = 0; c < flat.n_cells(); ++c) cells.push_back(flat.cell_nodes(c));
  model.mesh = std::make_shared<const Mesh<Dim>>(
      Mesh<Dim>::from_tables(std::move(nodes), std::move(cells), true));
  for (Vec<Dim>& x : model.particles.x) x = turn * x;
  model.gravity = Vec<Dim>::Zero();
  model.gravity[Dim - 1] = -g;
  return model;
}

Model<2> block() {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.25, "extent": [3, 1]}},
    "materials": [{"type": "LinearElastic", "density": 1800, "youngs_modulus": 1e9,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [1, 0], "max": [2, 0.5]}}}}],
    "analysis": {"velocity_update": "pic", "dt": 1e-4, "nsteps": 1000, "patch_particles": 32}})");
}

Model<3> brick() {
  return model_of_text<3>(R"({
    "mesh": {"structured": {"cell_size": 0.25, "extent": [2, 2, 0.75]}},
    "materials": [{"type": "LinearElastic", "density": 1800, "youngs_modulus": 1e9,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [0.5, 0.5, 0], "max": [1.5, 1.5, 0.5]}}}}],
    "analysis": {"velocity_update": "pic", "dt": 1e-4, "nsteps": 1000, "patch_particles": 64}})");
}

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

/// Velocity of the centre of mass at the end.
template <int Dim>
Vec<Dim> final_velocity(Model<Dim> model) {
  Simulation simulation(std::move(model));
  simulation.run();
  const HistoryRow end = simulation.history();
  Vec<Dim> v;
  for (int d = 0; d < Dim; ++d) v[d] = end.momentum[static_cast<std::size_t>(d)] / end.mass;
  return v;
}

}  // namespace

TEST_CASE("a block slides down an incline as Coulomb says, by rotated axes of the nodes") {
  const double theta = 30 * degree;
  const Rotation<2> turn = Eigen::Rotation2D<double>(-theta).toRotationMatrix();
  for (const Scheme scheme : schemes)
    for (const double mu : {0.0, 0.1, 0.4}) {
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(mu);
      Model<2> model = on_incline<2>(block(), turn, mu);
      model.analysis.scheme = scheme;
      const double expected = 0.1 * g * (std::sin(theta) - mu * std::cos(theta));
      const Vec<2> v = turn.transpose() * final_velocity(std::move(model));
      CHECK(v[0] == test::within(5e-3, expected));  // little is left with mu = 0.4
      CHECK(std::abs(v[1]) < 1e-3 * expected);
    }
}

TEST_CASE(
    "Cundall's damping takes its share of what a wall leaves out of balance, not of its push") {
  constexpr double theta = 30 * degree, share = 0.3;
  const Rotation<2> turn = Eigen::Rotation2D<double>(-theta).toRotationMatrix();
  for (const Scheme scheme : schemes)
    for (const double mu : {0.0, 0.1, 0.4}) {
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(mu);
      Model<2> model = on_incline<2>(block(), turn, mu);
      model.analysis.scheme = scheme;
      model.analysis.damping = share;
      const double expected = (1 - share) * 0.1 * g * (std::sin(theta) - mu * std::cos(theta));
      const Vec<2> v = turn.transpose() * final_velocity(std::move(model));
      CHECK(v[0] == test::within(0.02, expected));
      CHECK(std::abs(v[1]) < 1e-3 * expected);
    }
}

TEST_CASE("a block sticks on an incline that is flatter than the angle of friction") {
  const double theta = 30 * degree;
  const Rotation<2> turn = Eigen::Rotation2D<double>(-theta).toRotationMatrix();
  for (const Scheme scheme : schemes) {
    CAPTURE(static_cast<int>(scheme));
    Model<2> model = on_incline<2>(block(), turn, 0.7);
    model.analysis.scheme = scheme;
    const Vec<2> v = turn.transpose() * final_velocity(std::move(model));
    CHECK(v.norm() < 1e-3 * 0.1 * g * std::sin(theta));  // of what it would have without friction
  }
}

TEST_CASE("a brick slides along the steepest descent of a plane, whatever the nodes' axes") {
  const double theta = 30 * degree;
  using Turn = Eigen::AngleAxis<double>;
  const Rotation<3> turn =
      (Turn(0.4, Vec<3>::UnitZ()) * Turn(theta, Vec<3>::UnitX()) * Turn(0.7, Vec<3>::UnitZ()))
          .toRotationMatrix();
  const Vec<3> normal = turn.col(2);
  const Vec<3> down = (-Vec<3>::UnitZ() + normal * normal[2]).normalized();
  for (const Scheme scheme : schemes) {
    CAPTURE(static_cast<int>(scheme));
    const double mu = 0.2, expected = 0.1 * g * (std::sin(theta) - mu * std::cos(theta));
    Model<3> model = on_incline<3>(brick(), turn, mu);
    model.analysis.scheme = scheme;
    const Vec<3> v = final_velocity(std::move(model));
    CHECK((v - expected * down).norm() < 1e-3 * expected);
    Model<3> held = on_incline<3>(brick(), turn, 0.7);
    held.analysis.scheme = scheme;
    CHECK(final_velocity(std::move(held)).norm() < 1e-3 * 0.1 * g * std::sin(theta));
  }
}

TEST_CASE("friction takes the energy that the incline's block is short of") {
  const double theta = 30 * degree, mu = 0.3;
  const Rotation<2> turn = Eigen::Rotation2D<double>(-theta).toRotationMatrix();
  for (const Scheme scheme : schemes) {
    CAPTURE(static_cast<int>(scheme));
    Model<2> model = on_incline<2>(block(), turn, mu);
    model.analysis.scheme = scheme;
    Simulation simulation(std::move(model));
    simulation.run();
    const HistoryRow end = simulation.history();
    const double path = 0.5 * 0.1 * 0.1 * g * (std::sin(theta) - mu * std::cos(theta));
    CHECK(end.damping == test::within(0.01, mu * end.mass * g * std::cos(theta) * path));
    CHECK(end.external == test::within(0.01, end.mass * g * std::sin(theta) * path));
  }
}

TEST_CASE("Newmark: all of a block on an incline begins with g sin theta, or sticks") {
  const double theta = 30 * degree;
  const Rotation<2> turn = Eigen::Rotation2D<double>(-theta).toRotationMatrix();
  constexpr double dt = 1e-8;  // no wave has come far
  for (const double mu : {0.0, 0.7}) {
    CAPTURE(mu);
    Model<2> model = on_incline<2>(block(), turn, mu);
    for (NodeFriction& wall : entries_of<NodeFriction>(model)) wall.two_sided = false;
    model.analysis.scheme = Scheme::newmark;
    model.analysis.step.dt = dt;
    model.analysis.nsteps = 1;
    Simulation simulation(std::move(model));
    simulation.run();
    const State state(simulation.frame());
    for (Index p = 0; p < state.size(); ++p) {
      const Vec<2> v =
          turn.transpose() * Vec<2>(state.get("velocity", p, 0), state.get("velocity", p, 1)) / dt;
      const double height = turn.col(1).dot(Vec<2>(state.x(p, 0), state.x(p, 1)));
      // The lowest cell has the nodes at the plane; functions of elements are linear there.
      const double free = std::min(1.0, height / 0.25);
      CHECK(v[0] == test::within(1e-6, (mu == 0 ? 1.0 : free) * g * std::sin(theta)));
      CHECK(v[1] == test::within(1e-6, -free * g * std::cos(theta)));
    }
  }
}
