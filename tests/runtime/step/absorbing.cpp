// Forces of absorbing nodes against the formulas, written out once more.
#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <random>

#include "physics/materials/law.h"
#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Unit cells, two materials, particles that moved and move at random; no weight.
template <int Dim>
Model<Dim> scattered() {
  const std::string origin = Dim == 2 ? "[3, 2]" : "[3, 2, 2]";
  Model<Dim> model = model_of_text<Dim>(R"({
    "mesh": {"structured": {"cell_size": 1, "extent": )" +
                                        origin + R"(}},
    "materials": [
      {"type": "LinearElastic", "density": 1000, "youngs_modulus": 2e5, "poisson_ratio": 0.3},
      {"type": "MohrCoulomb", "density": 1800, "youngs_modulus": 1e6, "poisson_ratio": 0.2,
       "friction": 30, "dilation": 0, "cohesion": 1e3, "tension_cutoff": 1}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0}}],
    "analysis": {"mpm_scheme": "usl", "dt": 1e-3, "nsteps": 1, "patch_particles": 8}})");
  std::mt19937_64 random(5);
  std::uniform_real_distribution<> around(-1, 1);
  ParticleTable<Dim>& p = model.particles;
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    p.material[i] = i % 3 == 0 ? 1 : 0;
    p.volume[i] *= 1 + 0.3 * around(random);
    Vec<Dim> v, u;
    for (int d = 0; d < Dim; ++d) {
      p.x[i][d] += 0.2 * around(random);
      v[d] = around(random);
      u[d] = 0.1 * around(random);
    }
    p.velocity.push_back(v);
    p.displacement.push_back(u);
    const double rho = model.materials[p.material[i]].density;
    p.mass.push_back(rho * p.volume[i] * (1 + 0.2 * around(random)));  // denser or not
  }
  return model;
}

/// What the particles around a node give it.
template <int Dim>
struct NodeMeans {
  double m = 0, c_p = 0, c_s = 0, rho = 0;
  Vec<Dim> v = Vec<Dim>::Zero(), u = Vec<Dim>::Zero();
};

template <int Dim>
double function_of(const Model<Dim>& model, Index node, const Vec<Dim>& x) {
  double N = 1;
  for (int d = 0; d < Dim; ++d) N *= std::max(0.0, 1 - std::abs(x[d] - model.mesh->node(node)[d]));
  return N;
}

/// One step of FLIP without stress: v += dt sum_i N_i a_i.
template <int Dim>
void check_one_step() {
  Model<Dim> model = scattered<Dim>();
  // A side of the mesh, its normal along x, and one node that has a second boundary.
  for (Index n = 0; n < model.mesh->n_nodes(); ++n)
    if (model.mesh->node(n)[0] == 0)
      entries_of<NodeAbsorption>(model).push_back({n, 0, 0.25, 5, 1.2, 0.8});
  const Index corner = entries_of<NodeAbsorption>(model).front().node;
  entries_of<NodeAbsorption>(model).push_back({corner, 1, 0.5, 2, 1, 1});
  model.analysis.takes_means = true;

  const double E = 2e5, nu = 0.3, M = E * (1 - nu) / ((1 + nu) * (1 - 2 * nu));
  CHECK(shear_wave_modulus(model.materials[0].law) == doctest::Approx(E / 2 / (1 + nu)));
  const double c_p[] = {std::sqrt(M / 1000), std::sqrt(1e6 * 0.8 / 1.2 / 0.6 / 1800)};
  const double c_s[] = {std::sqrt(E / 2 / (1 + nu) / 1000), std::sqrt(1e6 / 2.4 / 1800)};
  const ParticleTable<Dim> p = model.particles;
  std::map<Index, NodeMeans<Dim>> nodes;
  for (const auto& at : entries_of<NodeAbsorption>(model)) {
    NodeMeans<Dim> mean;
    for (std::size_t i = 0; i < p.x.size(); ++i) {
      const double m = p.mass[i] * function_of(model, at.node, p.x[i]);
      mean.m += m;
      mean.c_p += m * c_p[p.material[i]];
      mean.c_s += m * c_s[p.material[i]];
      mean.rho += m * model.materials[p.material[i]].density;
      mean.v += m * p.velocity[i];
      mean.u += m * p.displacement[i];
    }
    nodes[at.node] = mean;
  }
  std::map<Index, Vec<Dim>> force;
  for (const auto& at : entries_of<NodeAbsorption>(model)) {
    const NodeMeans<Dim>& sum = nodes[at.node];
    const double rho = sum.rho / sum.m;
    Vec<Dim>& f = force.try_emplace(at.node, Vec<Dim>::Zero()).first->second;
    for (int d = 0; d < Dim; ++d) {
      const double c = (d == at.normal ? sum.c_p : sum.c_s) / sum.m;
      const double factor = d == at.normal ? at.a : at.b;
      f[d] -= at.area *
              (rho * factor * c * sum.v[d] / sum.m + rho * c * c / at.delta * sum.u[d] / sum.m);
    }
  }
  const double dt = model.analysis.step.dt;
  for (const ExecutionOptions& way : {serial(), flow(2)}) {
    Simulation simulation(model, way);
    simulation.advance(1);
    const Frame end = simulation.frame();
    const FrameColumn* v = end.find("velocity");
    double most = 0;
    for (std::size_t k = 0; k < end.id.size(); ++k) {
      const auto i = static_cast<std::size_t>(end.id[k]);
      Vec<Dim> expected = p.velocity[i];
      for (const auto& [node, f] : force)
        expected += dt * function_of(model, node, p.x[i]) / nodes[node].m * f;
      most = std::max(most, (expected - p.velocity[i]).norm());
      for (int d = 0; d < Dim; ++d) {
        const auto at = k * Dim + static_cast<std::size_t>(d);
        CHECK(v->values[at] == doctest::Approx(expected[d]).epsilon(1e-12));
      }
    }
    CHECK(most > 0.01);
  }
}

}  // namespace

TEST_CASE("absorbing nodes: one step is that of their springs and dashpots") {
  check_one_step<2>();
  check_one_step<3>();
}

TEST_CASE("absorbing nodes: the work of springs and dashpots balances the energy") {
  // Springs alone, nearly: a soft boundary swings, and history says where the energy is.
  Model<2> model = scattered<2>();
  for (Index n = 0; n < model.mesh->n_nodes(); ++n)
    if (model.mesh->node(n)[0] == 0)
      entries_of<NodeAbsorption>(model).push_back({n, 0, 0.05, 5, 0.5, 0.5});
  model.analysis.takes_means = true;
  model.analysis.nsteps = 100;
  Simulation simulation(model, serial());
  simulation.advance(100);
  const HistoryRow row = simulation.history();
  CHECK(row.damping > 0);
  CHECK(row.external != 0);
  // FLIP takes of the nodes' motion what the particles do not keep: 3 % here.
  CHECK(std::abs(row.balance) < 0.05 * row.kinetic);
}

TEST_CASE("absorbing nodes: a dashpot stops a node, however light, and does not turn it back") {
  // Two dashpots, each of which alone would stop the node thousands of times over in a step.
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 1, "extent": [1, 1]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e-3,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0}}],
    "analysis": {"mpm_scheme": "usl", "dt": 1e-3, "nsteps": 1000}})");
  model.particles.x = {Vec<2>(0.75, 0.5)};
  model.particles.velocity = {Vec<2>(-0.2, 0.1)};
  for (Index n = 0; n < model.mesh->n_nodes(); ++n)
    if (model.mesh->node(n)[0] == 0)
      for (int entry = 0; entry < 2; ++entry)
        entries_of<NodeAbsorption>(model).push_back({n, 0, 0.5, 5, 1e9, 1e9});
  model.analysis.takes_means = true;
  Simulation simulation(model, serial());
  simulation.advance(1);
  const Frame first = simulation.frame();
  const auto& v = first.find("velocity")->values;
  CHECK(v[0] == doctest::Approx(0.75 * -0.2).epsilon(1e-9));  // what the nodes at x = 1 keep
  CHECK(v[1] == doctest::Approx(0.75 * 0.1).epsilon(1e-9));
  const double begin = simulation.history().kinetic;
  double kinetic = begin;
  for (int k = 0; k < 500; ++k) {
    simulation.advance(1);
    const double now = simulation.history().kinetic;
    CHECK(now <= kinetic + 1e-12 * begin);
    kinetic = now;
  }
}

TEST_CASE("nodes that are all accelerated move their particles as the function of time says") {
  Model<2> model = two_discs();
  MathFunction sine;
  sine.kind = MathFunction::Kind::sine;
  sine.a = 30;
  model.functions.push_back(sine);
  for (Index n = 0; n < model.mesh->n_nodes(); ++n) {
    entries_of<NodeAcceleration>(model).push_back({n, 0, 7.0});
    entries_of<NodeAcceleration>(model).push_back({n, 0, 2.0, 0});  // the last wins
    entries_of<NodeAcceleration>(model).push_back({n, 1, -0.5});
  }
  for (auto& v : model.particles.velocity) v = Vec<2>(0.1, 0);  // together: without stress
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
    model.analysis.scheme = scheme;
    Simulation simulation(model, flow(2));
    simulation.advance(20);
    const double dt = model.analysis.step.dt;
    Vec<2> v(0.1, -0.5 * 20 * dt);
    for (int n = 0; n < 20; ++n) v[0] += dt * 2.0 * std::sin(30 * (n * dt));
    const Frame end = simulation.frame();
    const FrameColumn* velocity = end.find("velocity");
    for (std::size_t i = 0; i < velocity->values.size(); ++i)
      CHECK(std::abs(velocity->values[i] - v[static_cast<int>(i % 2)]) < 1e-11);
    const HistoryRow row = simulation.history();
    double begin = 0;
    for (std::size_t p = 0; p < model.particles.x.size(); ++p)
      begin += 0.5 * 0.01 * model.particles.volume[p] *
               model.materials[model.particles.material[p]].density;
    CHECK(row.external == within(1e-6, row.kinetic - begin));
  }
}
