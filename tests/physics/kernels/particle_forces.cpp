#include "physics/kernels/particle_forces.h"

#include <doctest/doctest.h>

#include <Eigen/Geometry>

#include "tests/physics/kernels/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Forces of their own that some particles have, by slot, and their couples.
template <int Dim>
struct OwnForces {
  std::vector<Vec<Dim>> force;
  Particles<Dim> couples{ColumnLayout<Dim>({.contact = true})};

  OwnForces(std::mt19937& random, Local slots) : force(static_cast<std::size_t>(slots)) {
    couples.resize(slots);
    const auto rows = couples.template rows<contact_components<Dim>>(Column::contact_couple);
    for (Local p = 0; p < slots; ++p) {
      Vec<Dim>& f = force[static_cast<std::size_t>(p)];
      f = random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
      if (random() % 3 == 0) f.setZero();
      couples.row(Column::contact_extent)[p] = uniform(random, 0.01, 0.3);
      if (random() % 2 == 0)
        for (double* row : rows) row[p] = uniform(random, -1, 1);
      else if (random() % 2 == 0)
        set_push(random, p);
    }
  }
  const Vec<Dim>& of(Local p) const { return force[static_cast<std::size_t>(p)]; }

 private:
  /// The push of a body whose normal is nearly an axis.
  void set_push(std::mt19937& random, Local p) {
    Vec<Dim> n = 0.2 * random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
    n[static_cast<int>(random() % Dim)] = random() % 2 == 0 ? 1 : -1;
    n.normalize();
    const double push = uniform(random, 0.5, 1), distance = uniform(random, 0, 0.3);
    for (int d = 0; d < Dim; ++d) couples.row(Column::contact_force, d)[p] = push * n[d];
    couples.row(Column::contact_extent)[p] = distance;
    set_contact_couple<Dim>(couples.template rows<contact_components<Dim>>(Column::contact_couple),
                            p, push * distance * n * n.transpose());
  }
};

/// What the definitions say, one particle and one node after the other.
template <int Dim, class Basis>
void add_one_by_one(const Basis& basis, const ParticleBin& bin, const Local* nodes, double* sums,
                    const OwnForces<Dim>& own) {
  const auto rows = own.couples.template rows<contact_components<Dim>>(Column::contact_couple);
  const auto of_node = [&](int i) {
    return sums + static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride;
  };
  for (Local p = bin.begin; p < bin.end; ++p) {
    Scalar N[Basis::nodes];
    basis.functions(p, N);
    for (int i = 0; i < Basis::nodes; ++i)
      for (int d = 0; d < Dim; ++d) of_node(i)[d] += N[i][0] * own.of(p)[d];
  }
  for (Local p = bin.begin; p < bin.end; ++p) {
    ContactCouple<Dim> C = contact_couple<Dim>(rows, p);
    if constexpr (TensorBasis<Basis>) {
      const SidePush<Dim> side(contact_force<Dim>(own.couples, p), C,
                               own.couples.row(Column::contact_extent)[p]);
      side.take_from(C);
      Scalar w[Dim][axis_nodes], s[Dim];
      basis.weights(p, w);
      basis.place(p, s);
      double W[axis_nodes];
      for (int k = 0; k < axis_nodes; ++k) W[k] = w[side.axis][k][0];
      if (side.share > 0.0)
        side_weights(basis, side.axis, p, s[side.axis][0], side.offset[side.axis], W);
      for (int i = 0; i < Basis::nodes; ++i) {
        double N = 1.0, at_side = 1.0;
        for (int d = 0; d < Dim; ++d) {
          const int k = i >> (2 * d) & 3;
          N *= w[d][k][0];
          at_side *= d == side.axis ? W[k] : w[d][k][0];
        }
        for (int d = 0; d < Dim; ++d) of_node(i)[d] += (at_side - N) * side.push[d];
      }
    }
    Scalar dN[Dim][Basis::nodes];
    basis.gradients(p, dN);
    for (int i = 0; i < Basis::nodes; ++i)
      for (int a = 0; a < Dim; ++a)
        for (int b = 0; b < Dim; ++b) of_node(i)[a] -= C(a, b) * dN[b][i][0];
  }
}

}  // namespace

TEST_CASE("nodes get the same bits of particles' own forces by packs as one by one") {
  std::mt19937 random(5);
  const auto check = [&](auto make) {
    auto f = make();
    constexpr int Dim = decltype(f)::dim;
    f.fill(random, Slots::with_free);
    const OwnForces<Dim> own(random, f.patch.particles.size());
    NodeArray sums(static_cast<std::size_t>(f.patch.n_nodes()) * sum_stride);
    for (double& sum : sums) sum = uniform(random, -1, 1);
    NodeArray expected = sums;
    for_each_bin_with_basis(
        f.patch, f.patch.bins, [](const ParticleBin&) { return true; },
        [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
          add_particle_forces<Dim>(basis, bin, nodes, sums.data(),
                                   [&](Local p) { return SurfaceForce<Dim>{.force = own.of(p)}; });
          add_contact_couples(basis, bin, nodes, sums.data(), own.couples);
          add_one_by_one(basis, bin, nodes, expected.data(), own);
        });
    CHECK(sums == expected);
  };
  with_every_kind(check);
  with_wide_functions(check);
  with_elements(check);
}

// With a moment of their own they would turn a disc that rolls, and nothing would have what it
// gets.
TEST_CASE("what takes pushes of rigid bodies to their surface gives no momentum, and no moment") {
  std::mt19937 random(6);
  const auto check = [&](auto make) {
    auto f = make();
    constexpr int Dim = decltype(f)::dim;
    f.fill(random, Slots::with_free);
    const OwnForces<Dim> own(random, f.patch.particles.size());
    NodeArray sums(static_cast<std::size_t>(f.patch.n_nodes()) * sum_stride);
    for_each_bin_with_basis(
        f.patch, f.patch.bins, [](const ParticleBin&) { return true; },
        [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
          add_contact_couples(basis, bin, nodes, sums.data(), own.couples);
        });
    Vec<3> force = Vec<3>::Zero(), moment = Vec<3>::Zero();
    double scale = 0;
    for (Local n = 0; n < f.patch.n_nodes(); ++n) {
      Vec<3> x = Vec<3>::Zero(), of_node = Vec<3>::Zero();
      x.template head<Dim>() = f.node(n);
      for (int d = 0; d < Dim; ++d)
        of_node[d] = sums[static_cast<std::size_t>(n) * sum_stride + static_cast<std::size_t>(d)];
      force += of_node;
      moment += x.cross(of_node);
      scale += of_node.norm();
    }
    REQUIRE(scale > 1);
    CHECK(force.norm() < 1e-11 * scale);
    CHECK(moment.norm() < 1e-11 * scale);
  };
  with_every_kind(check);
  with_wide_functions(check);
}
