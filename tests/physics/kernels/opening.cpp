// Gaps between grains and drops: what opens at the limit of tension is not volume of the material.
#include "physics/kernels/opening.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "physics/kernels/stress_update.h"
#include "physics/materials/law.h"
#include "tests/physics/kernels/kernels_fixture.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double most = 1e3;  // opening that no test reaches

const MohrCoulomb dry_sand{.youngs_modulus = 1e6,
                           .poisson_ratio = 0.3,
                           .friction = 30,
                           .dilation = 0,
                           .cohesion = 0,
                           .tension_cutoff = 0};
const MohrCoulomb soil{.youngs_modulus = 1e6,
                       .poisson_ratio = 0.3,
                       .friction = 30,
                       .dilation = 5,
                       .cohesion = 2000,
                       .tension_cutoff = 500};
const DruckerPrager cone{.youngs_modulus = 1e6,
                         .poisson_ratio = 0.3,
                         .friction = 30,
                         .dilation = 0,
                         .cohesion = 0,
                         .tension_cutoff = 0};
const Newtonian water{.bulk_modulus = 1e6, .dynamic_viscosity = 0, .tension_limit = 0};
const Bingham mud{.youngs_modulus = 1e6,
                  .poisson_ratio = 0.3,
                  .tau0 = 0,
                  .mu = 0,
                  .critical_shear_rate = 1,
                  .tension_limit = 0};

/// One particle, whose volume is what update_stress() makes of it.
template <int Dim, class LawType>
struct Point {
  static constexpr int rows = stress_components<Dim>;
  decltype(prepare(std::declval<const LawType&>())) law;
  Scalar stress[rows], state[most_state];
  double dilates = 0, opening = 0, volume = 1, total = 1;  // total: of material and gaps

  explicit Point(const LawType& of) : law(prepare(of)), dilates(dilatancy(of)) {
    double begin[most_state] = {};
    const Voigt none{};
    initial_state(Law(of), none, begin);
    for (int k = 0; k < rows; ++k) stress[k] = Scalar(0.0);
    for (std::size_t k = 0; k < most_state; ++k) state[k] = Scalar(begin[k]);
  }

  /// The axes stretch by these.
  void stretch(const std::array<double, 3>& strain, double shear = 0) {
    constexpr double dt = 0.5;
    LawInput<Dim, Scalar> in;
    double e = 0;
    for (int k = 0; k < rows; ++k) in.rate[k] = Scalar(k == 3 ? shear / dt : 0.0);
    for (int a = 0; a < Dim; ++a) {
      e += strain[static_cast<std::size_t>(a)];
      in.rate[a] = Scalar(strain[static_cast<std::size_t>(a)] / dt);
      for (int b = 0; b < Dim; ++b) in.gradient[a][b] = a == b ? in.rate[a] : Scalar(0.0);
    }
    in.dt = dt;
    in.volumetric = Scalar(e);
    OpeningIncrement<Dim, Scalar, decltype(law)> gaps(law, dilates, Scalar(opening), Scalar(most));
    update(law, gaps.close(in, stress, state), stress, state);
    gaps.open(stress, state);
    opening = gaps.opening()[0];
    volume *= stretch_of(gaps.of_material())[0];
    total *= stretch_of(e);
  }
  void swell(double e) { stretch({e / Dim, e / Dim, Dim == 3 ? e / Dim : 0}); }
  double pressure() const { return -(stress[0][0] + stress[1][0] + stress[2][0]) / 3; }
};

/// Torn to twice its volume and pushed together again, with shear on the way.
template <int Dim, class LawType>
void tear_and_close(const LawType& law) {
  CAPTURE(LawType::name);
  CAPTURE(Dim);
  Point<Dim, LawType> p(law);
  const double K = [&] {
    if constexpr (requires { law.bulk_modulus(); })
      return law.bulk_modulus();
    else
      return law.bulk_modulus;
  }();
  std::mt19937 random(3);
  while (p.total < 2) {
    const double e = uniform(random, 0, 2e-3), d = uniform(random, -1e-3, 1e-3);
    p.stretch({0.5 * e + d, 0.5 * e - d, 0}, d);
    CHECK(std::abs(p.volume - 1 + p.pressure() / K) < 1e-6);
    CHECK(p.volume * (1 + p.opening) == within(1e-6, p.total));
  }
  CHECK(p.opening == within(0.01, 1));
  while (p.opening > 0) {
    CHECK(p.pressure() < 1e-6);
    p.swell(-uniform(random, 0, 2e-3));
  }
  // Its volume is the first one now, but for the increment that closed it.
  CHECK(p.total == within(2e-3, 1));
  for (int i = 0; i < 10; ++i) p.swell(-1e-3);
  CHECK(p.pressure() == within(1e-3, -K * std::log(p.total)));
  CHECK(p.volume == doctest::Approx(p.total).epsilon(1e-7));
}

}  // namespace

TEST_CASE("what was torn to twice its volume has its strength again at its first volume") {
  tear_and_close<2>(dry_sand);
  tear_and_close<3>(dry_sand);
  tear_and_close<2>(cone);
  tear_and_close<3>(cone);
  tear_and_close<2>(water);
  tear_and_close<3>(water);
  tear_and_close<2>(mud);
  tear_and_close<3>(mud);
}

TEST_CASE("soil with tension opens at its cut-off, and its tension goes before cracks close") {
  Point<3, MohrCoulomb> p(soil);
  const double K = soil.bulk_modulus();
  for (int i = 0; i < 100; ++i) p.swell(1e-4);
  CHECK(p.pressure() == doctest::Approx(-500));
  CHECK(p.volume == doctest::Approx(1 + 500 / K).epsilon(1e-7));
  CHECK(p.volume * (1 + p.opening) == within(1e-6, p.total));
  const double opening = p.opening;
  p.swell(-250 / K);  // half of the tension goes: cracks stay as they are
  CHECK(p.pressure() == doctest::Approx(-250));
  CHECK(p.opening == doctest::Approx(opening).epsilon(1e-9));
  p.swell(-0.5 * opening);  // the rest of it, then they close without resistance
  CHECK(std::abs(p.pressure()) < 1e-6);
  CHECK(p.volume == within(1e-6, 1));
  CHECK(p.opening > 0.4 * opening);
  CHECK(p.opening < 0.6 * opening);
}

TEST_CASE("dilation of sheared soil, elasticity and compression open nothing") {
  Point<3, MohrCoulomb> p(soil);
  p.swell(-0.01);  // a pressure of 8 kPa
  for (int i = 0; i < 50; ++i) {
    p.stretch({0, 0, 0}, 1e-3);
    CHECK(p.opening == 0);
  }
  CHECK(p.volume == doctest::Approx(p.total));
  CHECK(!can_open(Newtonian{.bulk_modulus = 1e6, .dynamic_viscosity = 1}));
  CHECK(can_open(water));
  CHECK(!can_open(LinearElastic{.youngs_modulus = 1e6, .poisson_ratio = 0.3}));
}

TEST_CASE("gaps and material of a particle are not larger than its space") {
  const auto law = prepare(dry_sand);
  Scalar stress[4], state[most_state];
  double begin[most_state] = {};
  initial_state(Law(dry_sand), Voigt{}, begin);
  for (int k = 0; k < 4; ++k) stress[k] = Scalar(0.0);
  for (std::size_t k = 0; k < most_state; ++k) state[k] = Scalar(begin[k]);
  LawInput<2, Scalar> in;
  for (int k = 0; k < 4; ++k) in.rate[k] = Scalar(k < 2 ? 1.0 : 0.0);
  in.dt = 1;
  in.volumetric = Scalar(2.0);
  OpeningIncrement<2, Scalar, decltype(law)> gaps(law, 0.0, Scalar(2.0), Scalar(3.0));
  update(law, gaps.close(in, stress, state), stress, state);
  gaps.open(stress, state);
  CHECK(gaps.opening()[0] == 3.0);
  CHECK(std::abs(gaps.of_material()[0]) < 1e-15);
}

namespace {

/// What density_around() finds in a mesh that is full of particles of the density 1.5, the largest
/// difference over the cells as a share of it.
template <int Dim>
double error_of_density(Mesh<Dim>&& mesh, ShapeFunctions functions, Plane plane = Plane::strain) {
  OnePatch<Dim> f(std::move(mesh), Natural::stored, functions, Affine::none, &dry_sand, true);
  f.model.analysis.plane = plane;
  f.patch.space = space_around_cells(f.patch.topology, f.model);
  std::mt19937 random(1);
  // Gauss's points, and where functions reach beyond the cell particles that fill it.
  constexpr int n = 4;
  const auto place = [&](int k) {
    Vec<Dim> xi;
    for (int d = 0; d < Dim; ++d, k /= n) xi[d] = (2 * (k % n) + 1.0) / n - 1.0;
    return xi;
  };
  auto at = gauss_points<Dim>(f.patch.element, 2);
  if (functions != ShapeFunctions::element) {
    at.clear();
    for (int k = 0; k < std::pow(n, Dim); ++k) at.push_back(place(k));
  }
  for (Index c = 0; c < f.model.mesh->n_cells(); ++c) {
    std::vector<Local> there;
    for (const Vec<Dim>& xi : at) {
      there.push_back(f.patch.particles.size());
      f.add(random, static_cast<Local>(c), xi, 0);
    }
    for (const Local p : there) {
      const double depth = depth_at(f.model.analysis, f.at(Column::x, p, 0));
      f.at(Column::mass, p) = 1.5 * depth * f.model.mesh->cell_volume(c) / there.size();
      if (f.patch.particles.layout().has(Column::domain))
        for (int d = 0; d < Dim; ++d)
          f.at(Column::domain, p, d) = f.model.mesh->geometry(c).length[d] / n;
    }
  }
  receive(f.patch);
  map_mass_momentum(f.patch, f.context(), f.patch.bins);
  nodal_velocity(f.patch, f.context());
  double worst = 0;
  for (const ParticleBin& bin : f.patch.bins)
    worst = std::max(worst, std::abs(density_around(f.patch, bin) / 1.5 - 1));
  return worst;
}

}  // namespace

TEST_CASE("the density around each cell of a full mesh is that of its material") {
  for (const auto functions : {ShapeFunctions::element, ShapeFunctions::gimp}) {
    CHECK(error_of_density(boxes<2>(), functions) < 1e-12);
    CHECK(error_of_density(boxes<3>(), functions) < 1e-12);
  }
  // A spline's function of the second node from a wall is smaller by 1/24 and 1/12.
  for (const auto& [functions, share] : {std::pair(ShapeFunctions::quadratic_spline, 1.0 / 24),
                                         std::pair(ShapeFunctions::cubic_spline, 1.0 / 12)}) {
    CHECK(error_of_density(boxes<2>(), functions) < 1.1 * (1 - std::pow(1 - share / 2, 2)));
    CHECK(error_of_density(boxes<3>(), functions) < 1.1 * (1 - std::pow(1 - share, 3)));
  }
  // Cells of unequal size give their nodes equal parts.
  CHECK(error_of_density(skewed<2>(), ShapeFunctions::element) < 0.03);
  CHECK(error_of_density(skewed<3>(), ShapeFunctions::element) < 0.03);
  const auto ring = [] { return Mesh<2>::structured({0, 0}, {0.5, 1}, {6, 3}); };
  CHECK(error_of_density(ring(), ShapeFunctions::element, Plane::axisymmetric) < 1e-12);
  CHECK(error_of_density(ring(), ShapeFunctions::gimp, Plane::axisymmetric) < 0.02);
  const auto check = [](auto dim, Element element) {
    constexpr int Dim = dim();
    std::array<Index, Dim> counts;
    counts.fill(3);
    const auto t = element_grid<Dim>(element, Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts);
    auto mesh = Mesh<Dim>::from_tables(t.nodes, t.element, t.cells, true);
    CHECK(error_of_density(std::move(mesh), ShapeFunctions::element) < 1e-12);
  };
  for_elements<2>(
      [&](Element element, std::mt19937&) { check(std::integral_constant<int, 2>(), element); });
  for_elements<3>(
      [&](Element element, std::mt19937&) { check(std::integral_constant<int, 3>(), element); });
}

TEST_CASE("sand without dilation and cohesion keeps its volume however it is sheared and shaken") {
  Point<2, MohrCoulomb> p(dry_sand);
  std::mt19937 random(5);
  for (int i = 0; i < 5000; ++i) {
    const double e = uniform(random, -1e-3, 1e-3), d = uniform(random, -3e-3, 3e-3);
    p.stretch({e + d, e - d, 0}, uniform(random, -3e-3, 3e-3));
    const double elastic = -p.pressure() / dry_sand.bulk_modulus();
    CHECK(std::abs(p.volume - std::exp(elastic)) < 1e-6);
  }
}

TEST_CASE("a pack of particles opens and closes as each of them alone") {
  std::mt19937 random(8);
  const auto law = prepare(dry_sand);
  double begin[most_state] = {};
  initial_state(Law(dry_sand), Voigt{}, begin);
  for (int round = 0; round < 200; ++round) {
    LawInput<3, Pack> in;
    LawInput<3, Scalar> one[lanes<Pack>];
    Pack stress[6], state[most_state], opening, most_of;
    in.dt = 0.01;
    for (std::size_t k = 0; k < most_state; ++k) state[k] = Pack(begin[k]);
    for (int lane = 0; lane < lanes<Pack>; ++lane) {
      double e = 0;
      for (int k = 0; k < 6; ++k) {
        const double rate = uniform(random, -1, 1);
        set_lane(in.rate[k], lane, rate);
        set_lane(stress[k], lane, k < 3 && lane % 2 ? -uniform(random, 900, 1000) : 0.0);
        if (k < 3) e += in.dt * rate;
      }
      set_lane(in.volumetric, lane, e);
      set_lane(opening, lane, lane % 3 ? uniform(random, 0, 0.05) : 0.0);
      set_lane(most_of, lane, 0.04);
    }
    Scalar alone[lanes<Pack>][2];
    for (int lane = 0; lane < lanes<Pack>; ++lane) {
      LawInput<3, Scalar>& of = one[lane];
      Scalar s[6], q[most_state];
      for (int k = 0; k < 6; ++k)
        of.rate[k] = Scalar(in.rate[k][lane]), s[k] = Scalar(stress[k][lane]);
      for (std::size_t k = 0; k < most_state; ++k) q[k] = Scalar(state[k][lane]);
      of.dt = in.dt;
      of.volumetric = Scalar(in.volumetric[lane]);
      OpeningIncrement<3, Scalar, decltype(law)> gaps(law, 0.0, Scalar(opening[lane]),
                                                      Scalar(0.04));
      update(law, gaps.close(of, s, q), s, q);
      gaps.open(s, q);
      alone[lane][0] = gaps.opening();
      alone[lane][1] = gaps.of_material();
    }
    OpeningIncrement<3, Pack, decltype(law)> gaps(law, 0.0, opening, most_of);
    update(law, gaps.close(in, stress, state), stress, state);
    gaps.open(stress, state);
    for (int lane = 0; lane < lanes<Pack>; ++lane) {
      CHECK(gaps.opening()[lane] == doctest::Approx(alone[lane][0][0]).epsilon(1e-9));
      CHECK(std::abs(gaps.of_material()[lane] - alone[lane][1][0]) < 1e-15);
    }
  }
}
