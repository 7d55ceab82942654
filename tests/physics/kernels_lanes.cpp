// Packs of particles against single particles, and runs whose length is no multiple of a pack.
#include <doctest/doctest.h>

#include <map>

#include "tests/physics/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Call with two patches of equal state, for each dimension and kind of cell.
template <class Check>
void on_every_twin(Check check) {
  const auto with = [&](auto make) {
    for (unsigned seed = 30; seed < 33; ++seed) {
      auto a = make(), b = make();
      for (auto* f : {&a, &b}) {
        std::mt19937 random(seed);
        f->fill(random);
        set_linear(*f, f->patch.velocity, random);
        set_linear(*f, f->patch.acceleration, random);
        for (double& v : f->patch.velocity) v += uniform(random, -0.1, 0.1);
        for (auto& sums : f->patch.total)
          for (double& s : sums) s = uniform(random, 1, 2);
        f->model.analysis.flip = 0.6;
      }
      check(a, b);
    }
  };
  with([] { return OnePatch<2>(boxes<2>()); });
  with([] { return OnePatch<2>(skewed<2>()); });
  with([] { return OnePatch<3>(boxes<3>()); });
  with([] { return OnePatch<3>(skewed<3>()); });
}

/// Every row of the particles, and the nodal sums.
template <int Dim>
std::vector<double> state_of(const Patch<Dim>& patch) {
  std::vector<double> all;
  const Particles<Dim>& particles = patch.particles;
  for (const ColumnInfo& info : column_table)
    if (particles.layout().has(info.column))
      for (int k = 0; k < ColumnLayout<Dim>::components(info); ++k) {
        const double* row = particles.row(info.column, k);
        all.insert(all.end(), row, row + particles.size());
      }
  for (const auto& sums : patch.partial) all.insert(all.end(), sums.begin(), sums.end());
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

TEST_CASE("kernels on packs do what kernels on single particles do, to rounding") {
  on_every_twin([](auto& packs, auto& singles) {
    constexpr int Dim = std::decay_t<decltype(packs)>::dim;
    const auto check = [&](const char* kernel, auto act) {
      CAPTURE(kernel);
      const auto before = state_of(singles.patch);
      act(packs.patch, packs.context(), Pack());
      act(singles.patch, singles.context(), Scalar());
      const auto after = state_of(singles.patch);
      CHECK(furthest(state_of(packs.patch), after) < 1e-13);
      CHECK(before != after);
    };
    using P = Patch<Dim>;
    using S = StepContext<Dim>;
    check("mass", []<class Real>(P& p, const S&, Real) { map_mass_momentum<Dim, Real>(p); });
    check("momentum", []<class Real>(P& p, const S&, Real) { map_momentum<Dim, Real>(p); });
    check("pressure", []<class Real>(P& p, const S& s, Real) { map_pressure<Dim, Real>(p, s); });
    check("force", []<class Real>(P& p, const S& s, Real) { map_force<Dim, Real>(p, s); });
    check("smooth", []<class Real>(P& p, const S& s, Real) { smooth_pressure<Dim, Real>(p, s); });
    check("stress", []<class Real>(P& p, const S& s, Real) {
      update_stress<Dim, Real>(p, s, StressPart::both);
    });
    check("G2P", []<class Real>(P& p, const S& s, Real) { update_particles<Dim, Real>(p, s); });
  });
}

TEST_CASE("locate on packs finds the same cells, coordinates and order, to the last bit") {
  on_every_twin([](auto& packs, auto& singles) {
    constexpr int Dim = std::decay_t<decltype(packs)>::dim;
    std::mt19937 random(2);
    std::vector<Local> before = packs.patch.particles.cell;
    for (Local p = 0; p < packs.size(); ++p) {
      Vec<Dim> x = random_point<Dim>(random, Vec<Dim>::Constant(-0.3), Vec<Dim>::Constant(0.3));
      for (int d = 0; d < Dim; ++d) x[d] += packs.at(Column::x, p, d);
      if (packs.model.mesh->locate(x).cell < 0) continue;
      for (auto* f : {&packs, &singles})
        for (int d = 0; d < Dim; ++d) f->at(Column::x, p, d) = x[d];
    }
    locate<Dim, Pack>(packs.patch, packs.context());
    locate<Dim, Scalar>(singles.patch, singles.context());
    CHECK(packs.patch.mark.kind == Mark::Kind::none);
    CHECK(packs.patch.particles.cell == singles.patch.particles.cell);
    CHECK(packs.patch.particles.cell != before);
    CHECK(packs.patch.particles.id == singles.patch.particles.id);
    double worst = 0;
    bool same = true;
    for (Local p = 0; p < packs.size(); ++p) {
      Vec<Dim> x, xi;
      for (int d = 0; d < Dim; ++d) {
        same = same && packs.at(Column::xi, p, d) == singles.at(Column::xi, p, d);
        x[d] = packs.at(Column::x, p, d);
        xi[d] = packs.at(Column::xi, p, d);
      }
      const Local cell = packs.patch.particles.cell[static_cast<std::size_t>(p)];
      worst = std::max(worst, (packs.physical(cell, xi) - x).norm());
    }
    CHECK(same);
    CHECK(worst < 1e-13);
  });
}

TEST_CASE("a run's last pack does not touch the particles of the next run") {
  on_every_twin([](auto& f, auto& reference) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    REQUIRE(f.patch.runs.size() > 4);
    // Only every other run is given to the kernels; the particles of the rest must stay.
    std::vector<Run> some;
    std::vector<char> given(static_cast<std::size_t>(f.size()), 0);
    for (std::size_t r = 0; r < f.patch.runs.size(); r += 2) {
      some.push_back(f.patch.runs[r]);
      for (Local p = some.back().begin; p < some.back().end; ++p)
        given[static_cast<std::size_t>(p)] = 1;
    }
    f.patch.runs = some;
    update_stress(f.patch, f.context(), StressPart::both);
    update_particles(f.patch, f.context());
    smooth_pressure(f.patch, f.context());
    locate(f.patch, f.context());
    // locate() may have moved particles to other places only if some left the mesh.
    bool kept = true, changed = true;
    for (Local p = 0; p < f.size(); ++p) {
      bool same = true;
      for (const ColumnInfo& info : column_table)
        for (int k = 0; k < ColumnLayout<Dim>::components(info); ++k)
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

TEST_CASE("what lies beyond the last particle has no influence and is not written") {
  on_every_twin([](auto& f, auto& reference) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    const auto beyond = [&](int k) -> std::vector<double*> {
      std::vector<double*> rows;
      for (const ColumnInfo& info : column_table)
        for (int c = 0; c < ColumnLayout<Dim>::components(info); ++c)
          rows.push_back(f.patch.particles.row(info.column, c) + f.size() + k);
      return rows;
    };
    for (int k = 0; k < 8; ++k)
      for (double* row : beyond(k)) *row = untouched;
    for (auto* fixture : {&f, &reference}) {
      map_mass_momentum(fixture->patch);
      map_momentum(fixture->patch);
      map_pressure(fixture->patch, fixture->context());
      map_force(fixture->patch, fixture->context());
      update_stress(fixture->patch, fixture->context(), StressPart::both);
      update_particles(fixture->patch, fixture->context());
      smooth_pressure(fixture->patch, fixture->context());
    }
    CHECK(state_of(f.patch) == state_of(reference.patch));
    bool kept = true;
    for (int k = 0; k < 8; ++k)
      for (const double* row : beyond(k)) kept = kept && *row == untouched;
    CHECK(kept);
  });
}

TEST_CASE("strain first and the law later is the same as both at once") {
  on_every_twin([](auto& f, auto& reference) {
    update_stress(reference.patch, reference.context(), StressPart::both);
    const double volume = f.at(Column::volume, 0), stress = f.at(Column::stress, 0);
    update_stress(f.patch, f.context(), StressPart::strain);
    CHECK(f.at(Column::volume, 0) != volume);
    CHECK(f.at(Column::stress, 0) == stress);
    update_stress(f.patch, f.context(), StressPart::law);
    CHECK(state_of(f.patch) == state_of(reference.patch));
  });
}

TEST_CASE("sorting into runs keeps every particle, and each run is of one cell and material") {
  on_every_twin([](auto& f, auto& reference) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    std::mt19937 random(4);
    // The same particles in another order.
    std::vector<Local> order(static_cast<std::size_t>(f.size()));
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<Local>(k);
    std::shuffle(order.begin(), order.end(), random);
    f.patch.particles.permute(order);
    f.patch.runs_valid = false;
    receive(f.patch);
    Local next = 0;
    std::map<std::pair<Local, int>, int> runs;
    for (const Run& run : f.patch.runs) {
      CHECK(run.begin == next);
      CHECK(run.end > run.begin);
      next = run.end;
      ++runs[{run.cell, run.material}];
      for (Local p = run.begin; p < run.end; ++p) {
        CHECK(f.patch.particles.cell[static_cast<std::size_t>(p)] == run.cell);
        CHECK(f.patch.particles.material[static_cast<std::size_t>(p)] == run.material);
      }
    }
    CHECK(next == f.size());
    CHECK(runs.size() == f.patch.runs.size());  // sorted: one run per cell and material
    const auto by_id = [](const auto& fixture) {
      std::map<Index, std::vector<double>> all;
      for (Local p = 0; p < fixture.size(); ++p) {
        auto& values = all[fixture.patch.particles.id[static_cast<std::size_t>(p)]];
        for (const ColumnInfo& info : column_table)
          for (int k = 0; k < ColumnLayout<Dim>::components(info); ++k)
            values.push_back(fixture.at(info.column, p, k));
        values.push_back(fixture.patch.particles.cell[static_cast<std::size_t>(p)]);
      }
      return all;
    };
    CHECK(by_id(f) == by_id(reference));
  });
}
