#include "physics/kernels/rigid_contact.h"

#include <doctest/doctest.h>

#include "tests/physics/kernels/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Particles on a slope and on a ball that moves; a third of them were in contact before.
template <int Dim>
OnePatch<Dim> on_bodies(ShapeFunctions functions, std::mt19937& random) {
  OnePatch<Dim> f(boxes<Dim>(), Natural::computed, functions);
  for (Particles<Dim>* particles : {&f.patch.particles, &f.patch.movers})
    *particles = Particles<Dim>(ColumnLayout<Dim>({.size = true, .state = 1, .contact = true}));
  f.model.analysis.rigid_bodies = true;
  Vec<Dim> up = Vec<Dim>::Unit(Dim - 1);
  up[0] = 0.3;
  const auto Motion = RigidBody<Dim>::Motion::prescribed;
  f.model.rigid_bodies.resize(2);
  f.model.rigid_bodies[0] = {.name = "slope",
                             .solid = half_space<Dim>(Vec<Dim>::Zero(), up.normalized()),
                             .friction = 0.4};
  f.model.rigid_bodies[1] = {.name = "ball",
                             .solid = ball<Dim>(Vec<Dim>::Ones(), 0.7),
                             .friction = 0.2,
                             .cohesion = 1,
                             .motion = Motion,
                             .centre = Vec<Dim>::Ones(),
                             .velocity = -Vec<Dim>::Ones()};
  f.fill(random, Slots::with_free);
  for (const Local p : f.slots())
    if (random() % 3 != 0)
      for (const Column c : {Column::contact_force, Column::contact_shear})
        for (int d = 0; d < Dim; ++d) f.at(c, p, d) = 0;
  set_linear(f, f.patch.velocity, random);
  set_linear(f, f.patch.acceleration, random);
  return f;
}

template <int Dim>
void check_packs(ShapeFunctions functions) {
  std::mt19937 random(7), again(7);
  auto together = on_bodies<Dim>(functions, random), alone = on_bodies<Dim>(functions, again);
  std::vector<ParticleBin> single;
  for (const ParticleBin& bin : alone.patch.bins)
    for (Local p = bin.begin; p < bin.end; ++p) {
      single.push_back(bin);
      single.back().begin = p;
      single.back().end = p + 1;
    }
  const auto act = [](auto& f, ParticleBins bins) {
    const auto step = f.context();
    begin_contact(f.patch, step);
    touch_bodies(f.patch, step, bins);
    count_couples(f.patch, step, bins);
    keep_outside(f.patch, step, bins);
  };
  act(together, together.patch.bins);
  act(alone, single);
  int touched = 0;
  for (const Local p : together.slots()) {
    for (const ColumnInfo& info : column_table)
      if (together.patch.particles.layout().has(info.column))
        for (int k = 0; k < together.patch.particles.layout().components(info); ++k)
          CHECK(together.at(info.column, p, k) == alone.at(info.column, p, k));
    touched += together.vector(Column::contact_force, p).isZero(0.0) ? 0 : 1;
  }
  CHECK(touched > 10);
  CHECK(together.patch.reactions == alone.patch.reactions);
  CHECK(together.patch.work.internal == alone.patch.work.internal);
  CHECK(together.patch.work.friction == alone.patch.work.friction);
}

}  // namespace

TEST_CASE("a particle touches rigid bodies beside others in a pack as it does alone") {
  for (const auto functions :
       {ShapeFunctions::element, ShapeFunctions::quadratic_spline, ShapeFunctions::cubic_spline}) {
    check_packs<2>(functions);
    check_packs<3>(functions);
  }
}
