// The table of particles: whatever is appended, removed, permuted, a particle stays what it is.
#include "physics/particles/particles.h"

#include <doctest/doctest.h>

#include <map>

#include "tests/physics/mesh/mesh_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// All values of a particle.
template <int Dim>
std::vector<double> values_of(const Particles<Dim>& particles, Local p) {
  std::vector<double> values;
  for (const ColumnInfo& info : column_table)
    if (particles.layout().has(info.column))
      for (int k = 0; k < particles.layout().components(info); ++k)
        values.push_back(particles.row(info.column, k)[p]);
  const auto i = static_cast<std::size_t>(p);
  values.push_back(particles.cell[i]);
  values.push_back(particles.material[i]);
  if (!particles.loads.empty()) values.push_back(static_cast<double>(particles.loads[i]));
  return values;
}

template <int Dim>
using State = std::map<Index, std::vector<double>>;

template <int Dim>
State<Dim> state_of(const Particles<Dim>& particles) {
  State<Dim> state;
  for (Local p = 0; p < particles.size(); ++p)
    state[particles.id[static_cast<std::size_t>(p)]] = values_of(particles, p);
  CHECK(state.size() == static_cast<std::size_t>(particles.size()));
  return state;
}

template <int Dim>
void add(Particles<Dim>& particles, Index id, bool loads, std::mt19937& random) {
  const Local p = particles.size();
  particles.resize(p + 1);
  const auto i = static_cast<std::size_t>(p);
  if (loads) particles.loads.resize(i + 1);
  particles.id[i] = id;
  particles.cell[i] = static_cast<Local>(random() % 1000);
  particles.material[i] = static_cast<std::uint16_t>(random() % 7);
  if (loads) particles.loads[i] = random() % 4096;
  for (const ColumnInfo& info : column_table)
    if (particles.layout().has(info.column))
      for (int k = 0; k < particles.layout().components(info); ++k) {
        CHECK(particles.row(info.column, k)[p] == 0.0);  // new particles are zero
        particles.row(info.column, k)[p] = uniform(random, -1, 1);
      }
}

/// Take a particle out as locate() does: the last one takes its place.
template <int Dim>
void take_out(Particles<Dim>& particles, Local p) {
  const Local last = particles.size() - 1;
  const SlotCopy take_place{last, p};
  if (p != last) particles.copy({&take_place, 1}, particles);
  particles.resize(last);
}

/// Move blocks of particles to ascending slots, with at most one free slot between two blocks; then
/// drop the free slots, in which anything may be.
template <int Dim>
void shuffle_blocks(Particles<Dim>& particles, std::mt19937& random) {
  std::vector<SlotMove> moves;
  for (Local p = 0; p < particles.size();) {
    const Local n = std::min<Local>(particles.size() - p, static_cast<Local>(1 + random() % 20));
    moves.push_back({p, 0, n});
    p += n;
  }
  std::shuffle(moves.begin(), moves.end(), random);
  const auto before = particles.id;
  Local slot = 0;
  std::vector<char> used;
  for (SlotMove& move : moves) {
    const auto gap = static_cast<Local>(random() % 2);
    used.resize(used.size() + static_cast<std::size_t>(gap), 0);
    move.to = slot + gap;
    slot = move.to + move.n;
    used.resize(static_cast<std::size_t>(slot), 1);
  }
  const auto end = static_cast<Local>(random() % 2);
  particles.rearrange(moves, slot + end);
  used.resize(used.size() + static_cast<std::size_t>(end), 0);
  CHECK(particles.size() == slot + end);
  bool placed = true;
  for (const SlotMove& move : moves)
    for (Local k = 0; k < move.n; ++k)
      placed = placed && particles.id[static_cast<std::size_t>(move.to + k)] ==
                             before[static_cast<std::size_t>(move.from + k)];
  CHECK(placed);
  for (Local p = particles.size(); p-- > 0;)
    if (!used[static_cast<std::size_t>(p)]) take_out(particles, p);
}

template <int Dim>
void check_operations(ColumnNeeds needs, bool loads) {
  std::mt19937 random(21);
  Particles<Dim> a{ColumnLayout<Dim>(needs)}, b{ColumnLayout<Dim>(needs)};
  State<Dim> in_a, in_b;
  Index next = 0;
  for (int round = 0; round < 400; ++round) {
    const auto what = random() % 10;
    if (what < 4) {
      add(a, next, loads, random);
      in_a[next] = values_of(a, a.size() - 1);
      ++next;
    } else if (what < 6 && a.size() > 0) {
      const auto p = static_cast<Local>(random() % static_cast<unsigned>(a.size()));
      in_a.erase(a.id[static_cast<std::size_t>(p)]);
      take_out(a, p);
    } else if (what < 8 && a.size() > 0) {  // migrates
      const auto p = static_cast<Local>(random() % static_cast<unsigned>(a.size()));
      const Index id = a.id[static_cast<std::size_t>(p)];
      b.append(a, p);
      in_b[id] = in_a[id];
      in_a.erase(id);
      take_out(a, p);
    } else if (what < 9) {
      shuffle_blocks(a, random);
    } else if (random() % 20 == 0) {
      b.clear();
      in_b.clear();
    } else {
      std::swap(a, b);
      std::swap(in_a, in_b);
    }
  }
  CHECK(next > 100);
  CHECK(state_of(a) == in_a);
  CHECK(state_of(b) == in_b);
}

}  // namespace

TEST_CASE("particles stay intact however they are added, sent, removed and rearranged") {
  for (const ColumnNeeds needs :
       {ColumnNeeds{}, ColumnNeeds{.size = true}, ColumnNeeds{.state = 3, .strain = true},
        ColumnNeeds{.natural = true},
        ColumnNeeds{.size = true, .state = 3, .natural = true, .strain = true}})
    for (const bool loads : {false, true}) {
      check_operations<2>(needs, loads);
      check_operations<3>(needs, loads);
    }
}

TEST_CASE("a particle without loads has none in a slot of one that had some") {
  // Where no particle of a block has loads, the block has no list of them.
  Particles<2> with, without;
  with.resize(2);
  with.loads = {5, 9};
  without.resize(1);
  without.id[0] = 7;
  const SlotCopy takes_place{0, 1};
  with.copy({&takes_place, 1}, without);
  CHECK(with.id[1] == 7);
  CHECK(with.loads == std::vector<std::uint64_t>{5, 0});
  with.append(without, 0);
  CHECK(with.loads == std::vector<std::uint64_t>{5, 0, 0});
  without.append(without, 0);
  CHECK(without.loads.empty());
}

TEST_CASE("rows start on cache lines and may be read a vector beyond the last particle") {
  Particles<3> particles{
      ColumnLayout<3>({.size = true, .state = 3, .natural = true, .strain = true})};
  for (const Local n : {1, 7, 8, 56, 64, 1000, 4096}) {
    particles.resize(n);
    const double* last = particles.row(Column::state, 2);
    const double* first = particles.row(Column::x);
    for (const ColumnInfo& info : column_table)
      CHECK(reinterpret_cast<std::uintptr_t>(particles.row(info.column)) % 64 == 0);
    // The block ends at least eight doubles after the last particle of the last row.
    CHECK(last + n + 8 <= first + particles.bytes() / sizeof(double));
    // Consecutive rows do not fall on one set of the first-level cache.
    CHECK((particles.row(Column::x, 1) - first) % 64 != 0);
  }
}

TEST_CASE("columns that a model does not need take no memory") {
  const ColumnLayout<2> least;
  for (const Column c : {Column::size, Column::state, Column::xi, Column::strain})
    CHECK(!least.has(c));
  CHECK(least.rows() == 2 + 2 + 2 + 4 + 1 + 1);
  const ColumnLayout<3> most({.size = true, .state = 3, .natural = true, .strain = true});
  CHECK(most.rows() == 3 + 3 + 3 + 3 + 6 + 6 + 1 + 1 + 3 + 3);
}
