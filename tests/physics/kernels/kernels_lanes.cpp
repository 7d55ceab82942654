// Packs of particles against single particles, and bins whose length a pack does not divide.
#include <doctest/doctest.h>

#include <map>

#include "physics/kernels/packed_bins.h"
#include "physics/kernels/velocity_transfer.h"
#include "tests/physics/kernels/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Call with two patches of equal state, for each dimension and kind of cell.
enum class Functions { linear, all };
template <class Check>
void on_every_twin(Check check, Functions functions = Functions::linear) {
  const auto with = [&](auto make) {
    for (unsigned seed = 30; seed < 34; ++seed) {
      auto a = make(), b = make();
      for (auto* f : {&a, &b}) {
        std::mt19937 random(seed);
        f->fill(random, seed % 2 == 0 ? Slots::packed : Slots::with_free);
        set_linear(*f, f->patch.velocity, random);
        set_linear(*f, f->patch.acceleration, random);
        for (double& v : f->patch.velocity) v += uniform(random, -0.1, 0.1);
        velocities_before_forces(f->patch, f->context());
        for (double& p : f->patch.pressure) p = uniform(random, 1, 2);
        f->model.analysis.transfer.flip = 0.6;
      }
      check(a, b);
    }
  };
  with_every_kind(with);
  if (functions == Functions::linear) return;
  with_wide_functions(with);
  with_elements(with);
  for (const Affine affine : {Affine::apic, Affine::tpic}) {
    with_wide_functions(with, affine);
    with_affine_corners(with, affine);
  }
}

/// Every row of the particles.
template <int Dim>
std::vector<double> particles_of(const Patch<Dim>& patch) {
  std::vector<double> all;
  const Particles<Dim>& particles = patch.particles;
  for (const ColumnInfo& info : column_table)
    if (particles.layout().has(info.column))
      for (int k = 0; k < particles.layout().components(info); ++k)
        patch.for_each_particle(
            [&, row = particles.row(info.column, k)](Local p) { all.push_back(row[p]); });
  return all;
}

/// The same, and the nodal sums.
template <int Dim>
std::vector<double> state_of(const Patch<Dim>& patch) {
  std::vector<double> all = particles_of(patch);
  for (const auto& copies : patch.sums)
    for (const auto& sums : copies) all.insert(all.end(), sums.begin(), sums.end());
  all.push_back(patch.work.internal);
  return all;
}

double furthest(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    worst = std::max(worst, std::abs(a[i] - b[i]) / (1 + std::abs(b[i])));
  return worst;
}

/// A value that no kernel computes.
constexpr double untouched = -1234.5;

}  // namespace

// Sums over particles are made lane by lane first: their order is that of the pack's width.
TEST_CASE("a particle gets the same bits in a pack and alone, sums over particles are rounded") {
  on_every_twin(
      [](auto& packs, auto& singles) {
        constexpr int Dim = std::decay_t<decltype(packs)>::dim;
        const auto check = [&](const char* kernel, auto act) {
          CAPTURE(kernel);
          const auto before = state_of(singles.patch);
          act(packs.patch, packs.context(), Pack());
          act(singles.patch, singles.context(), Scalar());
          const auto after = state_of(singles.patch);
          // APIC divides by moments, which are small near nodes at walls and of linear functions.
          // CPDI divides differences by the size of domains, smaller than a cell.
          const BasisKind basis = singles.patch.basis;
          const bool domains = basis == BasisKind::cpdi || basis == BasisKind::cpdi2;
          const double tolerance = singles.model.analysis.affine != Affine::none ? 1e-9
                                   : domains                                     ? 1e-12
                                                                                 : 1e-13;
          CHECK(furthest(state_of(packs.patch), after) < tolerance);
          CHECK(particles_of(packs.patch) == particles_of(singles.patch));
          CHECK(before != after);
        };
        using P = Patch<Dim>;
        using S = StepContext<Dim>;
        check("mass", []<class Real>(P& p, const S& s, Real) {
          map_mass_momentum<Dim, Real>(p, s, p.bins);
        });
        check("momentum",
              []<class Real>(P& p, const S& s, Real) { map_momentum<Dim, Real>(p, s, p.bins); });
        check("pressure",
              []<class Real>(P& p, const S& s, Real) { map_pressure<Dim, Real>(p, s, p.bins); });
        check("force",
              []<class Real>(P& p, const S& s, Real) { map_force<Dim, Real>(p, s, p.bins); });
        check("smooth",
              []<class Real>(P& p, const S& s, Real) { smooth_pressure<Dim, Real>(p, s, p.bins); });
        check("stress", []<class Real>(P& p, const S& s, Real) {
          update_stress<Dim, Real>(p, s, p.bins, StressPart::both);
        });
        check("smoothed",
              []<class Real>(P& p, const S& s, Real) { map_smoothed<Dim, Real>(p, s, p.bins, 2); });
        check("G2P", []<class Real>(P& p, const S& s, Real) {
          update_particles<Dim, Real>(p, s, p.bins);
        });
        CHECK(packs.patch.max_speed == doctest::Approx(singles.patch.max_speed).epsilon(1e-14));
      },
      Functions::all);
}

namespace {

/// Bins of several particles become two, the second one behind all others.
template <int Dim>
void split_bins(Patch<Dim>& patch) {
  const std::size_t count = patch.bins.size();
  for (std::size_t r = 0; r < count; ++r) {
    ParticleBin& bin = patch.bins[r];
    const Local middle = bin.begin + (bin.end - bin.begin) / 2;
    if (middle == bin.begin) continue;
    ParticleBin second = bin;
    second.begin = middle;
    bin.end = bin.limit = middle;
    bin.next = static_cast<Local>(patch.bins.size());
    patch.bins.push_back(second);
  }
}

/// Small stresses, none, and gaps that are open or closed, some as wide as cells have room for.
template <class Fixture>
void set_loose_soil(Fixture& f, std::mt19937& random) {
  f.patch.for_each_particle([&](Local p) {
    const double size = random() % 4 == 0 ? 0.0 : uniform(random, 0, 0.1);
    f.at(Column::volume, p) *= 0.07;
    for (int k = 0; k < static_cast<int>(stress_components<Fixture::dim>); ++k)
      f.at(Column::stress, p, k) *= size;
    if (f.patch.particles.layout().has(Column::opening))
      f.at(Column::opening, p) = std::max(0.0, uniform(random, -0.5, 0.5));
  });
}

}  // namespace

TEST_CASE("a law that takes long gives the same bits to particles of several bins side by side") {
  MohrCoulomb soil{};
  soil.youngs_modulus = 10;
  soil.poisson_ratio = 0.3;
  soil.friction = 30;
  const auto check = [&](auto dim, ShapeFunctions functions, Slots slots, bool gaps) {
    constexpr int Dim = dim();
    CAPTURE(Dim);
    CAPTURE(static_cast<int>(functions));
    soil.cohesion = gaps ? 0.0 : 0.01;
    soil.dilation = gaps ? 0.0 : 5.0;
    auto make = [&] {
      OnePatch<Dim> f(boxes<Dim>(), Natural::computed, functions, Affine::none, &soil, gaps);
      std::mt19937 random(7);
      f.fill(random, slots);
      set_linear(f, f.patch.velocity, random);
      for (double& v : f.patch.velocity) v += uniform(random, -0.1, 0.1);
      for (Local n = 0; n < f.patch.n_nodes(); ++n)
        f.patch.velocity[f.at(n, mass_lane)] = uniform(random, 0.1, 2);
      set_loose_soil(f, random);
      do split_bins(f.patch);
      while (lanes < Pack >> 1 && !packing_pays<Pack>(f.patch.bins));
      return f;
    };
    auto packs = make(), singles = make();
    update_stress<Dim, Pack>(packs.patch, packs.context(), packs.patch.bins, StressPart::both);
    update_stress<Dim, Scalar>(singles.patch, singles.context(), singles.patch.bins,
                               StressPart::both);
    CHECK(particles_of(packs.patch) == particles_of(singles.patch));
    CHECK(particles_of(packs.patch) != particles_of(make().patch));
    CHECK(furthest({packs.patch.work.internal}, {singles.patch.work.internal}) < 1e-13);
  };
  for (const ShapeFunctions functions : wide_functions)
    for (const Slots slots : {Slots::packed, Slots::with_free})
      for (const bool gaps : {false, true}) {
        check(std::integral_constant<int, 2>(), functions, slots, gaps);
        check(std::integral_constant<int, 3>(), functions, slots, gaps);
      }
}

namespace {

bool same(const std::vector<ParticleBin>& a, const std::vector<ParticleBin>& b) {
  return std::equal(
      a.begin(), a.end(), b.begin(), b.end(), [](const ParticleBin& x, const ParticleBin& y) {
        return x.cell == y.cell && x.begin == y.begin && x.end == y.end && x.limit == y.limit &&
               x.next == y.next && x.material == y.material && x.loaded == y.loaded;
      });
}

}  // namespace

TEST_CASE("locate on packs finds the same cells, coordinates and order, to the last bit") {
  on_every_twin([](auto& packs, auto& singles) {
    constexpr int Dim = std::decay_t<decltype(packs)>::dim;
    std::mt19937 random(2);
    std::map<Index, Local> before;
    for (const Local p : packs.slots()) {
      const auto i = static_cast<std::size_t>(p);
      before[packs.patch.particles.id[i]] = packs.patch.particles.cell[i];
      Vec<Dim> x = random_point<Dim>(random, Vec<Dim>::Constant(-0.3), Vec<Dim>::Constant(0.3));
      x += packs.vector(Column::x, p);
      if (packs.model.mesh->locate(x).cell < 0) continue;
      for (auto* f : {&packs, &singles})
        for (int d = 0; d < Dim; ++d) f->at(Column::x, p, d) = x[d];
    }
    locate<Dim, Pack>(packs.patch, packs.context(), packs.patch.bins);
    locate<Dim, Scalar>(singles.patch, singles.context(), singles.patch.bins);
    CHECK(packs.patch.movers.size() > 10);
    CHECK(packs.patch.movers.id == singles.patch.movers.id);
    CHECK(packs.patch.count + packs.patch.movers.size() == static_cast<Local>(before.size()));
    place_movers(packs.patch, packs.context());
    place_movers(singles.patch, singles.context());
    CHECK(packs.patch.movers.size() == 0);
    CHECK(packs.patch.count == static_cast<Local>(before.size()));
    CHECK(packs.patch.fault.kind == ParticleFault::Kind::none);
    CHECK(same(packs.patch.bins, singles.patch.bins));
    CHECK(same(packs.patch.unmapped, singles.patch.unmapped));
    CHECK(packs.ids() == singles.ids());
    const bool stored = packs.patch.particles.layout().has(Column::xi);
    // Functions of other elements are rounded as the compiler sees fit.
    const double rounding = packs.patch.basis == BasisKind::element ? 1e-14 : 0.0;
    CAPTURE(info(packs.patch.element).name);
    CAPTURE(static_cast<int>(packs.patch.basis));
    CAPTURE(packs.patch.cartesian);
    double worst = 0;
    bool equal = true;
    int moved = 0;
    for (const Local p : packs.slots()) {
      const auto i = static_cast<std::size_t>(p);
      const Local cell = packs.patch.particles.cell[i];
      equal = equal && cell == singles.patch.particles.cell[i] &&
              (!stored ||
               (packs.vector(Column::xi, p) - singles.vector(Column::xi, p)).norm() <= rounding);
      moved += cell != before.at(packs.patch.particles.id[i]);
      const Vec<Dim> xi = packs.natural(p);
      for (int d = 0; d < Dim; ++d) CHECK(std::abs(xi[d]) <= 1 + 1e-14);
      worst = std::max(worst, (packs.physical(cell, xi) - packs.vector(Column::x, p)).norm());
    }
    CHECK(equal);
    CHECK(moved > 10);
    CHECK(worst < 1e-13);
  });
}

TEST_CASE("a bin's last pack does not touch the particles of the next bin") {
  on_every_twin([](auto& f, auto& reference) {
    REQUIRE(f.patch.bins.size() > 4);
    // Only every other bin is given to the kernels; the particles of the rest must stay.
    std::vector<ParticleBin> bins;
    std::vector<char> given(static_cast<std::size_t>(f.patch.particles.size()), 0);
    for (std::size_t r = 0; r < f.patch.bins.size(); r += 2) {
      bins.push_back(f.patch.bins[r]);
      for (Local p = bins.back().begin; p < bins.back().end; ++p)
        given[static_cast<std::size_t>(p)] = 1;
    }
    update_stress(f.patch, f.context(), bins, StressPart::both);
    update_particles(f.patch, f.context(), bins);
    smooth_pressure(f.patch, f.context(), bins);
    locate(f.patch, f.context(), bins);
    // locate() may have moved particles within their bins.
    bool kept = true, changed = true;
    for (const Local p : reference.slots()) {
      bool same = true;
      for (const ColumnInfo& info : column_table)
        for (int k = 0; f.patch.particles.layout().has(info.column) &&
                        k < f.patch.particles.layout().components(info);
             ++k)
          same = same && f.at(info.column, p, k) == reference.at(info.column, p, k);
      if (given[static_cast<std::size_t>(p)])
        changed = changed && !same;
      else
        kept = kept && same;
    }
    CHECK(kept);
    CHECK(changed);
  });
}

TEST_CASE("what lies in free slots or beyond the last has no influence and is not written") {
  on_every_twin([](auto& f, auto& reference) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    Particles<Dim>& particles = f.patch.particles;
    std::vector<char> used(static_cast<std::size_t>(particles.size()) + 8, 0);
    f.patch.for_each_particle([&](Local p) { used[static_cast<std::size_t>(p)] = 1; });
    std::vector<double*> unused;
    for (const ColumnInfo& info : column_table)
      for (int c = 0;
           particles.layout().has(info.column) && c < particles.layout().components(info); ++c)
        for (std::size_t p = 0; p < used.size(); ++p)
          if (!used[p]) unused.push_back(particles.row(info.column, c) + p);
    for (double* value : unused) *value = untouched;
    for (auto* fixture : {&f, &reference}) {
      auto& patch = fixture->patch;
      map_mass_momentum(patch, fixture->context(), patch.bins);
      map_momentum(patch, fixture->context(), patch.bins);
      map_pressure(patch, fixture->context(), patch.bins);
      map_force(patch, fixture->context(), patch.bins);
      update_stress(patch, fixture->context(), patch.bins, StressPart::both);
      update_particles(patch, fixture->context(), patch.bins);
      smooth_pressure(patch, fixture->context(), patch.bins);
      check_finite(patch);
    }
    CHECK(state_of(f.patch) == state_of(reference.patch));
    CHECK(f.patch.max_speed == reference.patch.max_speed);
    CHECK(time_step_limit(f.patch, f.model, f.patch.bins) ==
          time_step_limit(reference.patch, reference.model, reference.patch.bins));
    CHECK(std::all_of(unused.begin(), unused.end(),
                      [](const double* value) { return *value == untouched; }));
  });
}

namespace {

/// Call with twins of which G2P finds velocity gradients, for every transfer.
template <class Check>
void on_every_twin_with_gradients(Check check) {
  for (const double flip : {0.6, 0.0})
    on_every_twin(
        [&](auto& a, auto& b) {
          if (!gives_gradients(a.model.analysis)) return;
          CAPTURE(static_cast<int>(a.patch.basis));
          CAPTURE(static_cast<int>(a.model.analysis.affine));
          a.model.analysis.transfer.flip = b.model.analysis.transfer.flip = flip;
          check(a, b);
        },
        Functions::all);
}

/// G2P, and stress with the gradients that it found, in one call or as many as there are bins.
template <class Real = Pack, class Fixture>
void move_and_strain(Fixture& f, std::size_t calls = 1) {
  constexpr int Dim = Fixture::dim;
  VelocityGradients<Dim> gradients;
  const ParticleBins all(f.patch.bins);
  for (std::size_t k = 0; k < calls; ++k) {
    const ParticleBins bins = calls == 1 ? all : all.subspan(k, 1);
    update_particles<Dim, Real>(f.patch, f.context(), bins, &gradients);
    update_stress<Dim, Real>(f.patch, f.context(), bins, StressPart::both, &gradients);
  }
}

}  // namespace

TEST_CASE("G2P that finds velocity gradients does what stress and G2P do, to rounding") {
  for (const bool one_by_one : {false, true})
    on_every_twin_with_gradients([&](auto& joined, auto& reference) {
      constexpr int Dim = std::decay_t<decltype(joined)>::dim;
      if (one_by_one)
        move_and_strain<Scalar>(joined);
      else
        move_and_strain(joined);
      update_stress<Dim>(reference.patch, reference.context(), reference.patch.bins,
                         StressPart::both);
      update_particles<Dim>(reference.patch, reference.context(), reference.patch.bins);
      // As between packs and single particles: moments are small near nodes at walls.
      const double tolerance = joined.model.analysis.affine != Affine::none ? 1e-9 : 1e-13;
      CHECK(furthest(state_of(joined.patch), state_of(reference.patch)) < tolerance);
      CHECK(joined.patch.max_speed == doctest::Approx(reference.patch.max_speed).epsilon(1e-13));
    });
}

TEST_CASE(
    "G2P that finds velocity gradients gives the same bits for any number of bins at a time") {
  on_every_twin_with_gradients([](auto& f, auto& reference) {
    f.patch.work.internal = reference.patch.work.internal = 0;
    move_and_strain(f, f.patch.bins.size());
    move_and_strain(reference);
    // Work is a sum over packs, whose order is that of calls.
    CHECK(f.patch.work.internal == doctest::Approx(reference.patch.work.internal).epsilon(1e-12));
    f.patch.work.internal = reference.patch.work.internal = 0;
    CHECK(state_of(f.patch) == state_of(reference.patch));
    CHECK(f.patch.max_speed == reference.patch.max_speed);
  });
}

TEST_CASE("nodes get the same bits of particles for any number of bins at a time") {
  on_every_twin(
      [](auto& f, auto& reference) {
        const auto map = [](auto& to, ParticleBins bins) {
          map_mass_momentum(to.patch, to.context(), bins);
          map_pressure(to.patch, to.context(), bins);
          map_force(to.patch, to.context(), bins);
        };
        for (std::size_t k = 0; k < f.patch.bins.size(); ++k)
          map(f, ParticleBins(f.patch.bins).subspan(k, 1));
        map(reference, reference.patch.bins);
        CHECK(state_of(f.patch) == state_of(reference.patch));
      },
      Functions::all);
}

TEST_CASE("G2P that finds velocity gradients leaves other bins and free slots alone") {
  on_every_twin_with_gradients([](auto& f, auto& reference) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    REQUIRE(f.patch.bins.size() > 4);
    std::vector<ParticleBin> bins;
    std::vector<char> given(static_cast<std::size_t>(f.patch.particles.size()), 0);
    for (std::size_t r = 0; r < f.patch.bins.size(); r += 2) {
      bins.push_back(f.patch.bins[r]);
      for (Local p = bins.back().begin; p < bins.back().end; ++p)
        given[static_cast<std::size_t>(p)] = 1;
    }
    VelocityGradients<Dim> gradients;
    update_particles<Dim>(f.patch, f.context(), bins, &gradients);
    update_stress<Dim>(f.patch, f.context(), bins, StressPart::both, &gradients);
    bool kept = true, changed = true;
    for (Local p = 0; p < f.patch.particles.size(); ++p) {
      bool same = true;
      for (const ColumnInfo& info : column_table)
        for (int k = 0; f.patch.particles.layout().has(info.column) &&
                        k < f.patch.particles.layout().components(info);
             ++k)
          same = same && f.at(info.column, p, k) == reference.at(info.column, p, k);
      if (given[static_cast<std::size_t>(p)])
        changed = changed && !same;
      else
        kept = kept && same;
    }
    CHECK(kept);
    CHECK(changed);
  });
}

TEST_CASE("strain first and the law later is the same as both at once") {
  on_every_twin([](auto& f, auto& reference) {
    update_stress(reference.patch, reference.context(), reference.patch.bins, StressPart::both);
    const double volume = f.at(Column::volume, 0), stress = f.at(Column::stress, 0);
    update_stress(f.patch, f.context(), f.patch.bins, StressPart::strain);
    CHECK(f.at(Column::volume, 0) != volume);
    CHECK(f.at(Column::stress, 0) == stress);
    update_stress(f.patch, f.context(), f.patch.bins, StressPart::law);
    CHECK(state_of(f.patch) == state_of(reference.patch));
  });
}

TEST_CASE("sorting into bins keeps every particle, and each bin is of one cell and material") {
  on_every_twin([](auto& f, auto& reference) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    std::mt19937 random(4);
    // The same particles in another order.
    std::vector<Local> order = f.slots();
    std::shuffle(order.begin(), order.end(), random);
    Particles<Dim> shuffled(f.patch.particles.layout());
    for (const Local p : order) shuffled.append(f.patch.particles, p);
    f.patch.particles = std::move(shuffled);
    f.patch.sorted = false;
    receive(f.patch);
    const Local free_slots = f.patch.moving ? 1 : 0;
    Local next = 0;
    std::map<std::pair<Local, int>, int> seen;
    for (const ParticleBin& bin : f.patch.bins) {
      CHECK(bin.begin == next);
      CHECK(bin.end > bin.begin);
      CHECK(bin.limit == bin.end + free_slots);
      next = bin.limit;
      ++seen[{bin.cell, bin.material}];
      for (Local p = bin.begin; p < bin.end; ++p) {
        CHECK(f.patch.particles.cell[static_cast<std::size_t>(p)] == bin.cell);
        CHECK(f.patch.particles.material[static_cast<std::size_t>(p)] == bin.material);
      }
    }
    CHECK(next == f.patch.particles.size());
    CHECK(f.patch.unmapped.empty());
    CHECK(seen.size() == f.patch.bins.size());  // sorted: one bin per cell and material
    const auto by_id = [](const auto& fixture) {
      std::map<Index, std::vector<double>> all;
      for (const Local p : fixture.slots()) {
        auto& values = all[fixture.patch.particles.id[static_cast<std::size_t>(p)]];
        for (const ColumnInfo& info : column_table)
          for (int k = 0; fixture.patch.particles.layout().has(info.column) &&
                          k < fixture.patch.particles.layout().components(info);
               ++k)
            values.push_back(fixture.at(info.column, p, k));
        values.push_back(fixture.patch.particles.cell[static_cast<std::size_t>(p)]);
      }
      return all;
    };
    CHECK(by_id(f) == by_id(reference));
  });
}
