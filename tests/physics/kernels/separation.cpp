// ASFLIP: which particles move with velocities of their own, and how far.
#include "physics/kernels/separation.h"

#include <doctest/doctest.h>

#include "physics/kernels/velocity_transfer.h"
#include "tests/physics/kernels/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double kept = 0.6, share = 0.7;

/// Three patches of equal particles: where they are, where they get with the nodes, and where with
/// velocities of their own.
template <int Dim>
struct Triple {
  OnePatch<Dim> before, with_nodes, apart;

  template <class Make>
  Triple(Make make, unsigned seed) : before(make()), with_nodes(make()), apart(make()) {
    for (OnePatch<Dim>* f : all()) {
      std::mt19937 random(seed);
      f->fill(random, Slots::with_free);
      f->model.analysis.transfer.flip = kept;
      for (double& a : f->patch.acceleration) a = uniform(random, -1, 1);
    }
    apart.model.analysis.transfer.separation = share;
  }
  std::array<OnePatch<Dim>*, 3> all() { return {&before, &with_nodes, &apart}; }

  /// Nodal velocities A x.
  void set_velocity(const Eigen::Matrix<double, Dim, Dim>& A) {
    for (OnePatch<Dim>* f : all())
      for (Local i = 0; i < f->patch.n_nodes(); ++i)
        for (int d = 0; d < Dim; ++d) f->patch.velocity[f->at(i, d)] = Vec<Dim>(A * f->node(i))[d];
  }
  void update() {
    for (OnePatch<Dim>* f : {&with_nodes, &apart}) {
      velocities_before_forces(f->patch, f->context());
      find_held_nodes(f->patch, f->context());
      update_particles(f->patch, f->context(), f->patch.bins);
    }
  }
  /// How far its own velocity moved a particle along d, and how far it would move it.
  double moved(Local p, int d) {
    return apart.at(Column::x, p, d) - with_nodes.at(Column::x, p, d);
  }
  double free(Local p, int d) {
    const double by_nodes = with_nodes.at(Column::u, p, d) - before.at(Column::u, p, d);
    return share * (apart.dt * apart.at(Column::v, p, d) - by_nodes);
  }
};

/// Call with a triple of every kind of functions and mesh.
template <class Check>
void on_every_triple(Check check) {
  const auto with = [&](auto make) {
    constexpr int Dim = decltype(make())::dim;
    if (make().patch.basis == BasisKind::cpdi2) return;
    Triple<Dim> triple(make, 51);
    CAPTURE(static_cast<int>(triple.apart.model.analysis.functions));
    CAPTURE(Dim);
    check(triple, make);
  };
  with_wide_functions(with, Affine::apic);
  with_affine_corners(with, Affine::apic);
}

/// A uniform gradient, whose determinant det(I + dt L) is above or below 1 by more than rounding.
template <int Dim>
Eigen::Matrix<double, Dim, Dim> gradient(double expansion) {
  Eigen::Matrix<double, Dim, Dim> A = Eigen::Matrix<double, Dim, Dim>::Zero();
  A(0, 1) = 3.0;  // shear
  A(1, 0) = -1.0;
  A(0, 0) = 2.0;
  A(1, 1) = expansion - 2.0;
  return A;
}

}  // namespace

TEST_CASE("particles that expand move with a share of their own velocities") {
  on_every_triple([](auto& triple, auto /*make*/) {
    constexpr int Dim = std::decay_t<decltype(triple.apart)>::dim;
    triple.set_velocity(gradient<Dim>(0.5));
    triple.update();
    double most = 0;
    for (const Local p : triple.apart.slots())
      for (int d = 0; d < Dim; ++d) {
        CHECK(std::abs(triple.apart.at(Column::v, p, d) - triple.with_nodes.at(Column::v, p, d)) <
              1e-14);
        CHECK(std::abs(triple.moved(p, d) - triple.free(p, d)) < 1e-14);
        CHECK(std::abs(triple.apart.at(Column::u, p, d) - triple.with_nodes.at(Column::u, p, d) -
                       triple.free(p, d)) < 1e-14);
        most = std::max(most, std::abs(triple.moved(p, d)));
      }
    CHECK(most > 1e-3);  // dt times velocities of 1 m/s
  });
}

TEST_CASE("particles that are compressed move with the nodes, to rounding") {
  on_every_triple([](auto& triple, auto /*make*/) {
    constexpr int Dim = std::decay_t<decltype(triple.apart)>::dim;
    triple.set_velocity(gradient<Dim>(-0.5));
    triple.update();
    for (const Local p : triple.apart.slots())
      for (const Column column : {Column::x, Column::u, Column::v, Column::affine})
        for (int d = 0; d < Dim; ++d)
          CHECK(std::abs(triple.apart.at(column, p, d) - triple.with_nodes.at(column, p, d)) <
                1e-13 * (1 + std::abs(triple.apart.at(column, p, d))));
  });
}

TEST_CASE("along a direction in which a node is held those that reach it move with the nodes") {
  on_every_triple([](auto& triple, auto make) {
    constexpr int Dim = std::decay_t<decltype(triple.apart)>::dim;
    const Local fixed = triple.apart.patch.n_nodes() / 2, wall = 0;
    triple.set_velocity(gradient<Dim>(0.5));
    for (auto* f : {&triple.with_nodes, &triple.apart}) {
      f->patch.fixed = {{fixed, 1, 0.0}};
      f->patch.walls.resize(1);
      f->patch.walls[0].node = wall;
    }
    triple.update();
    // Whether a particle reaches a node: its velocity in a field that is 1 at the node.
    const auto function_of = [&](Local node) {
      Triple<Dim> other(make, 51);
      auto& one = other.before;
      one.model.analysis.transfer.flip = 0.0;
      std::fill(one.patch.velocity.begin(), one.patch.velocity.end(), 0.0);
      one.patch.velocity[one.at(node, 0)] = 1.0;
      std::fill(one.patch.acceleration.begin(), one.patch.acceleration.end(), 0.0);
      velocities_before_forces(one.patch, one.context());
      update_particles(one.patch, one.context(), one.patch.bins);
      std::vector<double> N;
      for (const Local p : one.slots()) N.push_back(one.at(Column::v, p));
      return N;
    };
    const std::vector<double> of_fixed = function_of(fixed), of_wall = function_of(wall);
    int held = 0, free = 0;
    for (std::size_t k = 0; const Local p : triple.apart.slots()) {
      for (int d = 0; d < Dim; ++d)
        if (of_wall[k] > 1e-12 || (of_fixed[k] > 1e-12 && d == 1)) {
          CHECK(std::abs(triple.moved(p, d)) < 1e-14);
          ++held;
        } else {
          CHECK(std::abs(triple.moved(p, d) - triple.free(p, d)) < 1e-14);
          ++free;
        }
      ++k;
    }
    CHECK(held > 10);
    CHECK(free > 10);
  });
}

TEST_CASE("what holds a node in a step does so no longer in the next") {
  OnePatch<2> f(boxes<2>(), Natural::computed, ShapeFunctions::quadratic_spline, Affine::apic);
  const auto held = [&](Local i) {
    std::array<double, 3> along{};
    for (int d = 0; d < 2; ++d) along[static_cast<std::size_t>(d)] = f.patch.held[f.at(i, d)];
    along[2] = f.patch.held[f.at(i, mass_lane)];
    return along;
  };
  f.patch.contact.meetings = {{.a = 3, .b = 5}};
  f.patch.driven.resize(1);
  f.patch.driven[0].node = 7;
  f.patch.driven[0].driven = {false, true};
  auto& absorbing = std::get<std::vector<ActingNode<2, NodeAbsorption>>>(f.patch.acting);
  absorbing.resize(1);
  absorbing[0].node = 9;
  find_held_nodes(f.patch, f.context());
  const std::array<double, 3> all{1, 1, 1}, second{0, 1, 1}, none{0, 0, 0};
  CHECK(held(3) == all);
  CHECK(held(5) == all);
  CHECK(held(7) == second);
  CHECK(held(9) == all);
  CHECK(held(4) == none);
  f.patch.contact.meetings.clear();
  f.patch.driven.clear();
  absorbing.clear();
  find_held_nodes(f.patch, f.context());
  for (const Local i : {3, 5, 7, 9}) CHECK(held(i) == none);
}

TEST_CASE("a kernel on packs of particles moves them as one on single particles, on every basis") {
  const auto with = [](auto make) {
    constexpr int Dim = decltype(make())::dim;
    if (make().patch.basis == BasisKind::cpdi2) return;
    for (const double expansion : {0.5, -0.5}) {
      Triple<Dim> triple(make, 53);
      triple.set_velocity(gradient<Dim>(expansion));
      triple.with_nodes.model.analysis.transfer.separation = share;
      for (OnePatch<Dim>* f : {&triple.with_nodes, &triple.apart}) {
        f->patch.fixed = {{f->patch.n_nodes() / 2, 1, 0.0}};
        velocities_before_forces(f->patch, f->context());
        find_held_nodes(f->patch, f->context());
      }
      update_particles<Dim, Pack>(triple.apart.patch, triple.apart.context(),
                                  triple.apart.patch.bins);
      update_particles<Dim, Scalar>(triple.with_nodes.patch, triple.with_nodes.context(),
                                    triple.with_nodes.patch.bins);
      for (const Local p : triple.apart.slots())
        for (int d = 0; d < Dim; ++d) CHECK(std::abs(triple.moved(p, d)) < 1e-12);
    }
  };
  with_wide_functions(with, Affine::apic);
  with_affine_corners(with, Affine::apic);
}
