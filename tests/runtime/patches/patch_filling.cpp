// The way of the initial particles into their patches.
#include "runtime/patches/patch_filling.h"

#include <doctest/doctest.h>

#include <numeric>

#include "physics/base/error.h"
#include "runtime/patches/patch_set.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
Model<Dim> shuffled(Model<Dim> model) {
  ParticleTable<Dim>& table = model.particles;
  std::vector<std::size_t> order(table.x.size());
  std::iota(order.begin(), order.end(), 0);
  std::mt19937_64 random(5);
  std::shuffle(order.begin(), order.end(), random);
  table.velocity.resize(order.size(), Vec<Dim>::Zero());
  table.stress.resize(order.size());
  for (std::size_t p = 0; p < order.size(); ++p) {
    table.velocity[p][0] = static_cast<double>(p);
    table.stress[p][1] = -static_cast<double>(p);
  }
  const auto apply = [&](auto& column) {
    auto old = column;
    for (std::size_t p = 0; p < order.size(); ++p) column[p] = old[order[p]];
  };
  apply(table.x);
  apply(table.cell);
  apply(table.volume);
  apply(table.material);
  apply(table.velocity);
  apply(table.stress);
  return model;
}

template <int Dim>
void check_same(const Particles<Dim>& a, const Particles<Dim>& b) {
  CHECK(a.id == b.id);
  CHECK(a.cell == b.cell);
  CHECK(a.material == b.material);
  CHECK(a.loads == b.loads);
  bool same = true;
  for (const ColumnInfo& info : column_table)
    for (int k = 0; a.layout().has(info.column) && k < a.layout().components(info); ++k)
      same = same && std::equal(a.row(info.column, k), a.row(info.column, k) + a.size(),
                                b.row(info.column, k));
  CHECK(same);
}

template <int Dim>
void check_filling(const Model<Dim>& model) {
  Model<Dim> first = model;
  const PatchSet<Dim> one(first, 0, {}, 1);
  CHECK(first.particles.size() == 0);
  CHECK(one.particles() == model.particles.size());
  for (const int threads : {2, 5}) {
    Model<Dim> second = model;
    const PatchSet<Dim> several(second, 0, {}, threads);
    REQUIRE(several.size() == one.size());
    for (int i = 0; i < one.size(); ++i) check_same(one[i].particles, several[i].particles);
  }
  for (int i = 0; i < one.size(); ++i) {
    const Particles<Dim>& particles = one[i].particles;
    for (Local p = 0; p < particles.size(); ++p) {
      const auto at = static_cast<std::size_t>(p);
      const auto id = static_cast<std::size_t>(particles.id[at]);
      REQUIRE(one[i].topology.cells[static_cast<std::size_t>(particles.cell[at])] ==
              model.particles.cell[id]);
      REQUIRE(particles.row(Column::x, 1)[p] == model.particles.x[id][1]);
      REQUIRE(particles.row(Column::v)[p] == model.particles.velocity[id][0]);
      REQUIRE(particles.row(Column::stress, 1)[p] == model.particles.stress[id][1]);
      if (p > 0 && particles.cell[at] == particles.cell[at - 1] &&
          particles.material[at] == particles.material[at - 1])
        REQUIRE(particles.id[at] > particles.id[at - 1]);
    }
  }
}

}  // namespace

TEST_CASE("patches are filled with the same particles in the same order by any number of threads") {
  Model<2> discs = two_discs();
  check_filling(shuffled(distorted(discs, 0.012)));
  discs.tractions = {{.particles = {3, 5, 8}, .dir = 0, .traction = 1.0, .function = -1}};
  discs.particle_velocities = {{.particles = {5, 9}, .dir = 1, .velocity = 0.5}};
  check_filling(shuffled(discs));
  check_filling(shuffled(dam_break_3d()));
}

TEST_CASE("of several particles that are not in their cells, the first is named") {
  Model<2> model = shuffled(two_discs());
  std::swap(model.particles.cell[7], model.particles.cell[400]);
  REQUIRE(model.particles.cell[7] != model.particles.cell[400]);
  std::string message;
  try {
    PatchSet<2>(model, 0, {}, 3);
  } catch (const InputError& error) {
    message = error.what();
  }
  CHECK(message.find("particle 7 is not in its cell") != std::string::npos);
}
