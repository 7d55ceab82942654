// Particles that walk about over cells and patches: none gets lost, each is in a bin of its cell,
// and the nodes get what they should.
#include <doctest/doctest.h>

#include <cmath>
#include <map>

#include "graph/executor.h"
#include "physics/mesh/inverse_mapping.h"
#include "tests/runtime/step/by_hand.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// All values of a particle but those that follow from its place.
template <int Dim>
std::vector<double> belongings(const Particles<Dim>& particles, Local p) {
  std::vector<double> values;
  for (const ColumnInfo& info : column_table)
    for (int k = 0; info.column != Column::xi && particles.layout().has(info.column) &&
                    k < particles.layout().components(info);
         ++k)
      values.push_back(particles.row(info.column, k)[p]);
  const auto i = static_cast<std::size_t>(p);
  values.push_back(particles.material[i]);
  if (!particles.loads.empty()) values.push_back(static_cast<double>(particles.loads[i]));
  return values;
}

template <int Dim>
std::map<Index, std::vector<double>> all_belongings(const PatchSet<Dim>& patches) {
  std::map<Index, std::vector<double>> all;
  for (int i = 0; i < patches.size(); ++i) {
    const Particles<Dim>& particles = patches[i].particles;
    patches[i].for_each_particle([&](Local p) {
      all[particles.id[static_cast<std::size_t>(p)]] = belongings(particles, p);
    });
  }
  return all;
}

/// Natural coordinates in a cell, which a particle on its edge may have left by rounding.
template <int Dim>
Vec<Dim> natural(const Mesh<Dim>& mesh, Index cell, const Vec<Dim>& x) {
  const CellGeometry<Dim> geometry = mesh.geometry(cell);
  Vec<Dim> xi = Vec<Dim>::Constant(std::nan(""));
  if (mesh.is_cartesian())
    xi = 2 * (x - geometry.centre).cwiseQuotient(geometry.length);
  else
    inverse_map<Dim>(geometry, x, xi);
  return xi;
}

/// The first thing wrong with the bins of a patch, empty if they are consistent.
template <int Dim>
std::string wrong_with(const Patch<Dim>& patch, const Mesh<Dim>& mesh) {
  const Particles<Dim>& particles = patch.particles;
  std::vector<char> taken(static_cast<std::size_t>(particles.size()), 0);
  Local count = 0;
  for (const ParticleBin& bin : patch.bins) {
    if (bin.begin < 0 || bin.begin > bin.end || bin.end > bin.limit) return "order of slots";
    if (bin.limit > particles.size()) return "slots that do not exist";
    for (Local p = bin.begin; p < bin.limit; ++p)
      if (std::exchange(taken[static_cast<std::size_t>(p)], 1)) return "a slot of two bins";
    count += bin.end - bin.begin;
    const Index cell = patch.topology.cells[static_cast<std::size_t>(bin.cell)];
    for (Local p = bin.begin; p < bin.end; ++p) {
      const auto i = static_cast<std::size_t>(p);
      if (particles.cell[i] != bin.cell) return "a particle of another cell";
      if (particles.material[i] != bin.material) return "a particle of another material";
      if (!particles.loads.empty() && particles.loads[i] && !bin.loaded) return "a load not known";
      Vec<Dim> x;
      for (int d = 0; d < Dim; ++d) x[d] = particles.row(Column::x, d)[p];
      const auto xi = natural(mesh, cell, x);
      for (int d = 0; d < Dim; ++d)
        if (!(std::abs(xi[d]) < 1 + 1e-12)) return "a particle outside of its cell";
      for (int d = 0; d < Dim && particles.layout().has(Column::xi); ++d)
        if (std::abs(xi[d] - particles.row(Column::xi, d)[p]) > 1e-12)
          return "natural coordinates of another place";
    }
  }
  if (count != patch.count) return "the count of particles";
  std::vector<char> chained(patch.bins.size(), 0);
  for (std::size_t c = 0; c < patch.topology.cells.size(); ++c)
    for (Local r = patch.first_bin.at(c); r >= 0;
         r = patch.bins[static_cast<std::size_t>(r)].next) {
      if (patch.bins.at(static_cast<std::size_t>(r)).cell != static_cast<Local>(c))
        return "a bin in the chain of another cell";
      if (std::exchange(chained[static_cast<std::size_t>(r)], 1)) return "a bin twice in a chain";
    }
  if (std::count(chained.begin(), chained.end(), 0) > 0) return "a bin in no chain";
  if (patch.movers.size() > 0) return "particles that are nowhere";
  return "";
}

/// What happened in a walk.
struct Events {
  int added = 0, sorted = 0, joined = 0, changed_patch = 0, unmapped = 0;
};

/// Particles that jump by up to `reach` along every axis in each step, and are located and mapped
/// as in a step: chunk by chunk, then those that changed their cell or patch.
template <int Dim>
class Walk {
 public:
  Walk(Model<Dim> model, double reach, unsigned seed)
      : model_(std::move(model)),
        n_(model_.particles.size()),
        patches_(model_, 0, {{2, 0}}),
        reach_(reach),
        random_(seed) {
    for (int i = 0; i < patches_.size(); ++i) receive(patches_[i]);
    for (int i = 0; i < patches_.size(); ++i) spread(patches_[i]);
  }

  void step() {
    for (int i = 0; i < patches_.size(); ++i) jump(patches_[i]);
    const auto before = all_belongings(patches_);
    REQUIRE(static_cast<Index>(before.size()) == n_);
    for (int i = 0; i < patches_.size(); ++i) locate_and_map(patches_[i]);
    for (int i = 0; i < patches_.size(); ++i) {
      Patch<Dim>& patch = patches_[i];
      for (const auto& out : patch.outbox) events.changed_patch += out.particles.size();
      arrive(patch);
    }
    for (int i = 0; i < patches_.size(); ++i) clear_outboxes(patches_[i]);
    CHECK(patches_.particles() == n_);
    CHECK(all_belongings(patches_) == before);
    check_sums();
    rebuild_where_needed();
  }

  Events events;

 private:
  StepContext<Dim> context(Index step) const {
    return {&model_, &patches_.partition(), step, 0, 1};
  }

  double uniform(double low, double high) {
    return std::uniform_real_distribution<>(low, high)(random_);
  }

  /// Random values, so that none can be mistaken for another's.
  void spread(Patch<Dim>& patch) {
    patch.for_each_particle([&](Local p) {
      for (int d = 0; d < Dim; ++d) patch.particles.row(Column::v, d)[p] = uniform(-1, 1);
      for (int k = 0; k < stress_components<Dim>; ++k)
        patch.particles.row(Column::stress, k)[p] = uniform(-1, 1);
    });
  }

  void jump(Patch<Dim>& patch) {
    patch.for_each_particle([&](Local p) {
      Vec<Dim> x;
      for (int d = 0; d < Dim; ++d)
        x[d] = patch.particles.row(Column::x, d)[p] + uniform(-reach_, reach_);
      if (model_.mesh->locate(x).cell < 0) return;
      for (int d = 0; d < Dim; ++d) patch.particles.row(Column::x, d)[p] = x[d];
    });
  }

  void locate_and_map(Patch<Dim>& patch) {
    clear_sums(patch, context(0), NodeSum::mass_momentum);
    clear_sums(patch, context(0), NodeSum::force);
    const ParticleBins all(patch.bins);
    for (std::size_t from = 0; from < all.size();) {
      const std::size_t n = std::min<std::size_t>(all.size() - from, 1 + random_() % 9);
      const ParticleBins bins = all.subspan(from, n);
      locate(patch, context(0), bins);
      map_mass_momentum(patch, context(0), bins);
      map_force(patch, context(0), bins);
      from += n;
    }
    place_movers(patch, context(0));
    CHECK(patch.fault.kind == ParticleFault::Kind::none);
  }

  void arrive(Patch<Dim>& patch) {
    receive(patch);
    activate_nodes(patch);
    CHECK(wrong_with(patch, *model_.mesh) == "");
    for (const ParticleBin& bin : patch.unmapped) events.unmapped += bin.end - bin.begin;
    events.added = std::max(events.added, patch.added_bins);
    map_mass_momentum(patch, context(0), patch.unmapped);
    map_force(patch, context(0), patch.unmapped);
    patch.unmapped.clear();
    const int added = patch.added_bins;
    sort_if_scattered(patch);
    if (patch.count == 0) {
      CHECK(patch.bins.empty());
      CHECK(patch.active_nodes.empty());
      CHECK(!patch.moving);
    } else if (patch.added_bins < added) {
      ++events.sorted;
      CHECK(patch.added_bins == 0);
      CHECK(patch.moving);
      std::map<std::pair<Local, int>, int> seen;
      for (const ParticleBin& bin : patch.bins) {
        ++seen[{bin.cell, bin.material}];
        CHECK(bin.limit == bin.end + 1);
        CHECK(bin.end > bin.begin);
      }
      CHECK(seen.size() == patch.bins.size());  // one bin per cell and material
    }
    CHECK(wrong_with(patch, *model_.mesh) == "");
    if (model_.analysis.mean_volume) check_joined(patch);
  }

  /// With means over cells, a cell has one bin of each material.
  void check_joined(Patch<Dim>& patch) {
    const auto bins_of = [&] {
      std::map<std::pair<Local, int>, int> filled;
      for (const ParticleBin& bin : patch.bins)
        if (bin.begin < bin.end) ++filled[{bin.cell, bin.material}];
      return filled;
    };
    const auto before = bins_of();
    const Local count = patch.count;
    join_bins(patch);
    const auto after = bins_of();
    CHECK(after.size() == before.size());
    CHECK(patch.count == count);
    for (const auto& [cell, n] : after) CHECK(n == 1);
    events.joined += after != before;
    CHECK(wrong_with(patch, *model_.mesh) == "");
  }

  /// Against all particles at once, where they are now; and against the sums of the particles.
  void check_sums() {
    double mass = 0, particles = 0, worst = 0, scale = 0;
    for (int i = 0; i < patches_.size(); ++i) {
      Patch<Dim>& patch = patches_[i];
      if (patch.active_nodes.empty()) continue;  // has no sums, and no particles
      for (const NodeSum which : {NodeSum::mass_momentum, NodeSum::force})
        clear_sums(patch, context(1), which);
      map_mass_momentum(patch, context(1), patch.bins);
      map_force(patch, context(1), patch.bins);
      for (const NodeSum which : {NodeSum::mass_momentum, NodeSum::force})
        for (Local k = 0; k < patch.n_nodes() * node_width; ++k) {
          const Local at = k / node_width * sum_stride + k % node_width;
          const double chunks = patch.own_sums(which, 0)[at];
          const double at_once = patch.own_sums(which, 1)[at];
          worst = std::max(worst, std::abs(chunks - at_once));
          scale = std::max(scale, std::abs(at_once));
        }
      for (Local n = 0; n < patch.n_nodes(); ++n)
        mass += patch.own_sums(NodeSum::mass_momentum, 0)[n * sum_stride + mass_lane];
      patch.for_each_particle([&](Local p) { particles += patch.particles.row(Column::mass)[p]; });
    }
    CHECK(scale > 0);
    CHECK(worst < 1e-14 * scale);
    CHECK(mass == doctest::Approx(particles).epsilon(1e-13));
  }

  void rebuild_where_needed() {
    bool needed = false;
    for (int i = 0; i < patches_.size(); ++i) needed = needed || patches_[i].needs_surroundings;
    if (!needed) return;
    patches_.rebuild();
    for (int i = 0; i < patches_.size(); ++i) receive(patches_[i]);
    CHECK(patches_.particles() == n_);
  }

  Model<Dim> model_;
  Index n_;
  PatchSet<Dim> patches_;
  double reach_;
  std::mt19937_64 random_;
};

/// Loads on some particles, so that bins know of them.
template <int Dim>
Model<Dim> loaded(Model<Dim> model) {
  ParticleTraction push{.particles = {}, .dir = 0, .traction = 1, .function = -1};
  for (Index p = 0; p < model.particles.size(); p += 7) push.particles.push_back(p);
  model.tractions = {push};
  return model;
}

}  // namespace

TEST_CASE("particles that jump about at random are in one bin each, and in all nodal sums") {
  const auto check = [](auto model, double reach, unsigned seed, int steps) {
    Walk walk(std::move(model), reach, seed);
    for (int step = 0; step < steps; ++step) walk.step();
    CHECK(walk.events.added > 2);
    CHECK(walk.events.sorted > 5);
    CHECK(walk.events.changed_patch > 100);
    CHECK(walk.events.unmapped > 500);
  };
  for (const double reach : {0.01, 0.045}) {  // of cells of 0.05 m
    CAPTURE(reach);
    check(two_discs(), reach, 1, 120);
    check(loaded(two_discs()), reach, 2, 40);
    check(distorted(two_discs(), 0.012), std::min(reach, 0.03), 3, 40);
  }
  Model<2> musl = two_discs();  // natural coordinates are stored in boxes, too
  musl.analysis.scheme = Scheme::musl;
  check(musl, 0.02, 4, 40);
  check(dam_break_3d(), 0.15, 5, 30);
  check(distorted(loaded(dam_break_3d()), 0.03), 0.1, 6, 15);
}

TEST_CASE("where means over cells are taken, the particles of a cell and material are in one bin") {
  const auto check = [](auto model, double reach) {
    model.analysis.mean_volume = true;
    Walk walk(std::move(model), reach, 8);
    for (int step = 0; step < 40; ++step) walk.step();
    CHECK(walk.events.joined > 5);
  };
  check(two_discs(), 0.01);
  check(loaded(two_discs()), 0.045);
  check(dam_break_3d(), 0.1);
}

namespace {

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

/// A model whose patches add bins and sort them within `steps` steps, in every scheme.
template <int Dim>
void check_chunks(Model<Dim> model, Index steps) {
  model.analysis.nsteps = steps;
  model.output.frame_steps = 0;
  Simulation simulation(model, serial());
  simulation.run();
  const Frame reference = simulation.frame();
  REQUIRE(reference.step == steps);
  double internal = 0;
  for (const Local chunk : {1, 7, 40, static_cast<Local>(chunk_slots), 1000000}) {
    CAPTURE(chunk);
    ByHand<Dim> hand(model);
    hand.chunk = chunk;
    int added = 0;
    double mass = 0;
    hand.after = [&](const Phase& phase, const std::vector<int>&) {
      if (phase.first > 0) return;
      double now = 0;  // all particles are mapped once, wherever they are
      for (int p = 0; p < hand.patches.size(); ++p) {
        const Patch<Dim>& patch = hand.patches[p];
        CHECK(wrong_with(patch, *hand.model.mesh) == "");
        added = std::max(added, patch.added_bins);
        if (patch.active_nodes.empty()) continue;
        for (Local n = 0; n < patch.n_nodes(); ++n)
          now += patch.own_sums(NodeSum::mass_momentum, hand.steps)[n * sum_stride + mass_lane];
      }
      if (hand.steps == 0) mass = now;
      CHECK(now == doctest::Approx(mass).epsilon(1e-13));
    };
    for (Index step = 0; step < steps; ++step) hand.step();
    CHECK(same_bits(hand.frame(), reference));
    int sorted = 0;
    double work = 0;
    for (int p = 0; p < hand.patches.size(); ++p) {
      sorted += hand.patches[p].moving;
      work += hand.patches[p].work.internal;
    }
    CHECK(added > 0);
    CHECK(sorted > 0);
    // Work is summed chunk by chunk: to rounding.
    if (chunk == 1) internal = work;
    CHECK(work == doctest::Approx(internal).epsilon(1e-11));
  }
  // The ways of executing, on this case of which we know that bins were added and sorted.
  for (const ExecutionOptions& way : other_ways()) {
    CAPTURE(describe(way));
    Simulation other(model, way), in_parts(model, way);
    other.run();
    CHECK(same_bits(other.frame(), reference));
    for (Index part = 1; !in_parts.finished(); part = part % 3 + 1) in_parts.advance(part);
    CHECK(same_bits(in_parts.frame(), reference));
  }
}

}  // namespace

TEST_CASE("chunks of any size, threads and pieces of a run give the same bits as bins grow") {
  for (const Scheme scheme : schemes) {
    CAPTURE(static_cast<int>(scheme));
    Model<2> discs = two_discs();
    discs.analysis.scheme = scheme;
    discs.analysis.damping = 0.02;
    const Index steps = scheme == Scheme::usl ? 25 : 30;  // then a cell collapses
    check_chunks(discs, steps);
    check_chunks(distorted(discs, 0.012), steps);
    Model<2> water = dam_break();
    water.analysis.scheme = scheme;
    water.analysis.pressure_smoothing = true;
    water.particles.velocity.assign(static_cast<std::size_t>(water.particles.size()), {3, 0});
    check_chunks(water, 15);
    Model<3> block = dam_break_3d();
    block.analysis.scheme = scheme;
    block.particles.velocity.assign(static_cast<std::size_t>(block.particles.size()), {1.5, 0, 0});
    check_chunks(block, 18);
    block = distorted(block, 0.03);
    block.analysis.step.dt = 5e-3;
    check_chunks(block, 18);
  }
}

TEST_CASE("a phase whose rest is done later gives the bits of one that is done in one go") {
  for (const Scheme scheme : schemes)
    for (const bool smoothing : {false, true}) {
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(smoothing);
      Model<2> model = distorted(two_discs(), 0.012);
      model.analysis.scheme = scheme;
      model.analysis.pressure_smoothing = smoothing;
      model.analysis.step.adaptive = true;  // gives limits, which are not used by hand
      model.analysis.patch_particles = 16;
      ByHand<2> whole(model), cut(model, 0, true);
      REQUIRE(cut.phases.size() == whole.phases.size() + 1);
      for (Index step = 0; step < 40; ++step) {
        whole.step();
        cut.step();
        REQUIRE(same_bits(whole.frame(), cut.frame()));
        for (int p = 0; p < whole.patches.size(); ++p)
          REQUIRE(whole.patches[p].time_step_limit == cut.patches[p].time_step_limit);
      }
    }
}

TEST_CASE("patches that run ahead of others give the bits of those that do not") {
  for (const Scheme scheme : schemes)
    for (const bool smoothing : {false, true}) {
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(smoothing);
      Model<2> model = distorted(two_discs(), 0.012);  // of which all patches exist
      model.analysis.scheme = scheme;
      model.analysis.pressure_smoothing = smoothing;
      model.analysis.patch_particles = 16;
      const Index steps = 12;
      ByHand<2> serial(model);
      for (Index step = 0; step < steps; ++step) serial.step();
      Index lead = 0, lead_of_neighbour = 0;
      for (std::uint64_t seed = 1; seed <= 30; ++seed) {
        CAPTURE(seed);
        ByHand<2> hand(model);
        const auto neighbours = hand.patches.neighbours();
        std::vector<Index> done(neighbours.size(), 0);
        const auto run = [&](int phase, int p, Step step) {
          hand.task(hand.phases[static_cast<std::size_t>(phase)], p, step);
          done[static_cast<std::size_t>(p)] = step * static_cast<Index>(hand.phases.size()) + phase;
        };
        const auto executor = make_random_executor(
            make_task_graph(tasks_of(hand.phases), neighbours),
            {[&](int phase, int p, Step step) {
               run(phase, p, step);
               const auto [least, most] = std::minmax_element(done.begin(), done.end());
               lead = std::max(lead, (*most - *least) / static_cast<Index>(hand.phases.size()));
               for (const int q : neighbours[static_cast<std::size_t>(p)])
                 lead_of_neighbour =
                     std::max(lead_of_neighbour, done[static_cast<std::size_t>(p)] -
                                                     done[static_cast<std::size_t>(q)]);
             },
             [](Step) {}, [](Step) {}},
            seed);
        REQUIRE(executor->run(0, steps) == steps);
        hand.steps = steps;
        CHECK(same_bits(hand.frame(), serial.frame()));
      }
      CHECK(lead >= 2);               // steps
      CHECK(lead_of_neighbour >= 1);  // tasks
    }
}

TEST_CASE("strain that is stored and strain that follows from stress are the same to rounding") {
  const auto check = [](auto model) {
    auto stored = model;
    stored.particles.stress.assign(static_cast<std::size_t>(model.particles.size()), {});
    const Outcome a = run(model, serial()), b = run(stored, serial());
    REQUIRE(a.error == "");
    REQUIRE(a.frames.size() == b.frames.size());
    REQUIRE(a.frames.size() > 2);
    for (std::size_t f = 0; f < a.frames.size(); ++f) {
      CHECK(same_bits(a.frames[f].coordinates, b.frames[f].coordinates));
      REQUIRE(a.frames[f].columns.size() == b.frames[f].columns.size());
      for (std::size_t c = 0; c < a.frames[f].columns.size(); ++c) {
        const FrameColumn &x = a.frames[f].columns[c], &y = b.frames[f].columns[c];
        CAPTURE(x.name);
        CHECK(x.name == y.name);
        CHECK(x.components == y.components);
        double worst = 0, largest = 0;
        REQUIRE(x.values.size() == y.values.size());
        for (std::size_t k = 0; k < x.values.size(); ++k) {
          worst = std::max(worst, std::abs(x.values[k] - y.values[k]));
          largest = std::max(largest, std::abs(y.values[k]));
        }
        if (x.name == "strain")
          CHECK(worst < 1e-12 * largest);
        else
          CHECK(worst == 0);
      }
    }
  };
  for (const Scheme scheme : schemes) {
    Model<2> discs = two_discs();
    discs.analysis.scheme = scheme;
    discs.analysis.nsteps = 35;
    discs.output.frame_steps = 7;
    check(discs);
    check(distorted(discs, 0.012));
    Model<3> block = dam_break_3d();
    block.materials[0].law = LinearElastic{.youngs_modulus = 1e5, .poisson_ratio = 0.35};
    block.analysis.scheme = scheme;
    block.analysis.step.dt = 2e-3;
    check(block);
  }
}
