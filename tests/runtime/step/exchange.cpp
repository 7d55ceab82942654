// The exchange of nodal sums between patches, for any width of the shared layer.
#include <doctest/doctest.h>

#include <array>
#include <cstdint>
#include <map>

#include "physics/kernels/kernels.h"
#include "tests/runtime/step/by_hand.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A value that depends on patch, node and component; sums of these depend on their order.
double dummy(Index patch, Index node, int component) {
  std::uint64_t bits = 0;  // mixed as SplitMix64 does: a generator per value takes half a minute
  for (const Index part : {patch, node, static_cast<Index>(component)}) {
    bits += static_cast<std::uint64_t>(part) + 0x9e3779b97f4a7c15;
    bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9;
    bits = (bits ^ bits >> 27) * 0x94d049bb133111eb;
    bits ^= bits >> 31;
  }
  constexpr std::array<double, 13> size{1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1,
                                        1e1,  1e2,  1e3,  1e4,  1e5,  1e6};
  return (static_cast<double>(bits >> 11) * 0x1p-52 - 1.0) * size[bits % size.size()];
}

constexpr std::size_t at(Local node, int component) {
  return static_cast<std::size_t>(node) * node_width + static_cast<std::size_t>(component);
}

constexpr std::size_t sum_at(Local node, int component) {
  return static_cast<std::size_t>(node) * sum_stride + static_cast<std::size_t>(component);
}

/// As if particles were all over the patch.
template <int Dim>
void make_sums(Patch<Dim>& patch) {
  patch.contributes = {1, 1};
  for (auto& copies : patch.sums)
    for (NodeArray& sums : copies)
      sums.assign(static_cast<std::size_t>(patch.n_nodes()) * sum_stride, 0.0);
}

/// Every kind of sum, and every copy, is what a patch and its neighbours hold of it.
template <int Dim>
void check_sums(Model<Dim> model, int rings) {
  NodeSumCopies copies;
  copies.of.fill(1);
  copies.of[0] = 2;
  PatchSet<Dim> patches(model, rings, copies);
  REQUIRE(patches.size() > 8);
  Index nodes = 0;
  for (int i = 0; i < patches.size(); ++i) {
    make_sums(patches[i]);
    for (const Index node : patches[i].topology.nodes) nodes = std::max(nodes, node + 1);
  }
  for (int k = 0; k < n_node_sums; ++k)
    for (int step = 0; step < copies.of[sum_array(static_cast<NodeSum>(k))]; ++step) {
      const auto which = static_cast<NodeSum>(k);
      // As a wider shape function would: every patch contributes to its ring too.
      std::vector<std::array<double, node_width>> expected(static_cast<std::size_t>(nodes));
      std::vector<int> holders(static_cast<std::size_t>(nodes));
      for (int i = 0; i < patches.size(); ++i) {
        Patch<Dim>& patch = patches[i];
        for (Local n = 0; n < patch.n_nodes(); ++n) {
          const Index node = patch.topology.nodes[static_cast<std::size_t>(n)];
          auto& sum = expected[static_cast<std::size_t>(node)];
          ++holders[static_cast<std::size_t>(node)];
          for (int c = 0; c < node_width; ++c) {
            const double value = dummy(patch.topology.patch, 2 * node + step, c);
            patch.own_sums(which, step)[sum_at(n, c)] = value;
            sum[static_cast<std::size_t>(c)] += value;
          }
        }
      }
      bool same = true;
      int most = 0;
      for (int i = 0; i < patches.size(); ++i) {
        Patch<Dim>& patch = patches[i];
        const auto& topology = patch.topology;
        for (std::size_t s = 0; s < topology.shared_node.size(); ++s) {
          const auto node = static_cast<std::size_t>(
              topology.nodes[static_cast<std::size_t>(topology.shared_node[s])]);
          most = std::max(most, holders[node]);
          same = same && topology.first[s + 1] - topology.first[s] == holders[node];
          for (int c = 0; c < node_width; ++c) {
            double sum = 0;
            for (Local e = topology.first[s]; e < topology.first[s + 1]; ++e) {
              const auto& share = topology.shares[static_cast<std::size_t>(e)];
              const double* from =
                  patch.all_sums(which, step)[share.neighbour + 1] + sum_offset(which);
              sum += from[sum_at(share.node, c)];
            }
            same = same && sum == expected[node][static_cast<std::size_t>(c)];
          }
        }
      }
      CHECK(same);
      CHECK(most >= 1 << Dim);
    }
}

/// What nodal_velocity() and so on compute is the sum of all patches in ascending order.
template <int Dim>
void check_velocities(Model<Dim> model, int rings) {
  NodeSumCopies copies;
  copies.of.fill(1);
  PatchSet<Dim> patches(model, rings, copies);
  const StepContext<Dim> context{&model, &patches.partition(), 0, 0, 1};
  std::map<Index, std::array<std::array<double, node_width>, n_node_sums>> expected;
  for (int i = 0; i < patches.size(); ++i) {
    Patch<Dim>& patch = patches[i];
    patch.pressure.assign(static_cast<std::size_t>(patch.n_nodes()), 0.0);
    patch.active_nodes = {{0, patch.n_nodes(), 0}};
    make_sums(patch);
    for (Local n = 0; n < patch.n_nodes(); ++n)
      for (int k = 0; k < n_node_sums; ++k)
        for (int c = 0; c < node_width; ++c) {
          const Index node = patch.topology.nodes[static_cast<std::size_t>(n)];
          double value = dummy(patch.topology.patch, 7 * node + k, c);
          if (c == mass_lane) value = std::abs(value);
          patch.own_sums(static_cast<NodeSum>(k), 0)[sum_at(n, c)] = value;
          expected[node][static_cast<std::size_t>(k)][static_cast<std::size_t>(c)] += value;
        }
  }
  const auto near = [](double found, double value) {
    return std::abs(found - value) <= 1e-14 * (std::abs(value) + 1e-300);
  };
  bool good = true;
  for (int i = 0; i < patches.size(); ++i) {
    Patch<Dim>& patch = patches[i];
    const auto check = [&](NodeSum which, const NodeArray& values) {
      for (Local n = 0; n < patch.n_nodes(); ++n) {
        const auto& sum = expected[patch.topology.nodes[static_cast<std::size_t>(n)]];
        const double m = sum[0][mass_lane];
        good = good && patch.velocity[at(n, mass_lane)] == m;
        for (int d = 0; d < Dim; ++d) {
          const bool fixed = std::any_of(patch.fixed.begin(), patch.fixed.end(),
                                         [&](const auto& f) { return f.node == n && f.dir == d; });
          if (fixed) continue;
          const double q = sum[static_cast<std::size_t>(which)][static_cast<std::size_t>(d)];
          good = good && near(values[at(n, d)], q / m);
        }
      }
    };
    nodal_velocity(patch, context);
    check(NodeSum::mass_momentum, patch.velocity);
    nodal_pressure(patch, context);
    for (Local n = 0; n < patch.n_nodes(); ++n) {
      const auto& sum = expected[patch.topology.nodes[static_cast<std::size_t>(n)]];
      good = good && near(patch.pressure[static_cast<std::size_t>(n)],
                          sum[static_cast<std::size_t>(NodeSum::pressure)][0] / sum[0][mass_lane]);
    }
    const NodeArray before = patch.velocity;
    integrate(patch, context);
    const NodeArray v = patch.velocity, a = patch.acceleration;
    check(NodeSum::force, a);
    // The same in one pass, to the last bit.
    velocity_and_integrate(patch, context);
    CHECK(patch.velocity == v);
    CHECK(patch.acceleration == a);
    nodal_velocity_again(patch, context);
    check(NodeSum::momentum, patch.velocity);
  }
  CHECK(good);
}

}  // namespace

TEST_CASE("sums of shared nodes are those of all patches in ascending order, ring included") {
  for (const int rings : {0, 1, 2}) {
    CAPTURE(rings);
    check_sums(two_discs(), rings);
    check_sums(dam_break_3d(), rings);
    check_sums(distorted(two_discs(), 0.012), rings);
    check_sums(distorted(dam_break_3d(), 0.03), rings);
  }
}

TEST_CASE("nodal velocities, accelerations and pressures are of the sums over all patches") {
  for (const int rings : {0, 1}) {
    CAPTURE(rings);
    check_velocities(two_discs(), rings);
    Model<3> water = dam_break_3d();
    water.gravity = {0, 0, 0};
    check_velocities(water, rings);
  }
}

namespace {

/// Steps by hand and compares all copies of every node after each phase with a nodal stage.
template <int Dim>
void check_copies(Model<Dim> model, int rings, int steps) {
  ByHand<Dim> hand(std::move(model), rings);
  int compared = 0;
  bool same = true;
  hand.after = [&](const Phase& phase, const std::vector<int>& active) {
    const bool integrated = phase.task.name.find("integrate") != std::string::npos;
    if (!integrated && phase.task.name.find("velocity") == std::string::npos) return;
    std::map<Index, std::vector<double>> copies;
    for (const int i : active) {
      const Patch<Dim>& patch = hand.patches[i];
      for (Local n = 0; n < patch.n_nodes(); ++n) {
        if (!patch.node_is_active[static_cast<std::size_t>(n)]) continue;
        std::vector<double> state;
        for (int c = 0; c < node_width; ++c) {
          state.push_back(patch.velocity[at(n, c)]);  // and mass
          if (integrated) state.push_back(patch.acceleration[at(n, c)]);
        }
        const Index node = patch.topology.nodes[static_cast<std::size_t>(n)];
        const auto [copy, is_new] = copies.try_emplace(node, state);
        if (is_new) continue;
        ++compared;
        same = same && same_bits(copy->second, state);
      }
    }
  };
  for (int step = 0; step < steps; ++step) hand.step();
  CHECK(same);
  CHECK(compared > 500);
}

}  // namespace

namespace {

/// Which nodes are active, and the sums at the others, after every phase.
template <int Dim>
void check_active_nodes(Model<Dim> model, int steps) {
  ByHand<Dim> hand(std::move(model), 0);
  bool particles_have_nodes = true, others_are_zero = true, ranges_are_nodes = true;
  int inactive = 0, changed = 0;
  std::map<int, std::vector<char>> before;
  hand.after = [&](const Phase& phase, const std::vector<int>& active) {
    for (const int i : active) {
      const Patch<Dim>& patch = hand.patches[i];
      std::vector<char> in_ranges(patch.node_is_active.size(), 0);
      for (const NodeRange& range : patch.active_nodes)
        for (Local n = range.begin; n < range.end; ++n) in_ranges[static_cast<std::size_t>(n)] = 1;
      ranges_are_nodes = ranges_are_nodes && in_ranges == patch.node_is_active;
      if (auto& old = before[i]; old != in_ranges) changed += !old.empty(), old = in_ranges;
      // Particles that changed cells in a phase are mapped, with their nodes, in the next one.
      if (phase.first == 0)
        patch.for_each_particle([&](Local p) {
          const auto cell =
              static_cast<std::size_t>(patch.particles.cell[static_cast<std::size_t>(p)]);
          for (const Local n : patch.topology.corner_nodes[cell])
            particles_have_nodes =
                particles_have_nodes && patch.node_is_active[static_cast<std::size_t>(n)];
        });
      for (std::size_t n = 0; n < in_ranges.size(); ++n) {
        if (in_ranges[n]) continue;
        ++inactive;
        for (const auto& copies : patch.sums)
          for (const NodeArray& sums : copies)
            for (int c = 0; c < sum_stride && !sums.empty(); ++c)
              others_are_zero = others_are_zero && sums[sum_at(static_cast<Local>(n), c)] == 0.0;
      }
    }
  };
  for (int step = 0; step < steps; ++step) hand.step();
  CHECK(ranges_are_nodes);
  CHECK(particles_have_nodes);
  CHECK(others_are_zero);
  CHECK(inactive > 100);
  CHECK(changed > 10);
}

}  // namespace

TEST_CASE("nodes of cells with particles are active, the sums at all others are zero") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
    CAPTURE(static_cast<int>(scheme));
    Model<2> discs = two_discs();
    discs.analysis.scheme = scheme;
    check_active_nodes(discs, 200);
    Model<3> water = dam_break_3d();
    water.analysis.scheme = scheme;
    check_active_nodes(water, 100);
  }
}

TEST_CASE("all copies of a shared node have the same mass, velocity and acceleration") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl})
    for (const int rings : {0, 1}) {
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(rings);
      Model<2> discs = two_discs();
      discs.analysis.scheme = scheme;
      discs.analysis.damping = 0.05;
      entries_of<NodeForce>(discs) = {{.node = 210, .dir = 0, .force = 2.0, .function = -1}};
      check_copies(discs, rings, 20);
      Model<3> water = dam_break_3d();
      water.analysis.scheme = scheme;
      check_copies(water, rings, 10);
      check_copies(distorted(discs, 0.012), rings, 10);
    }
}

TEST_CASE("a patch set holds every particle once, in the patch of its cell") {
  const Model<2> model = two_discs();
  Model<2> used = model;
  PatchSet<2> patches(used, 0, node_sum_copies(model.analysis));
  for (int i = 0; i < patches.size(); ++i) receive(patches[i]);
  CHECK(patches.particles() == model.particles.size());
  std::vector<int> seen(static_cast<std::size_t>(model.particles.size()), 0);
  for (int i = 0; i < patches.size(); ++i) {
    const Patch<2>& patch = patches[i];
    patch.for_each_particle([&](Local p) {
      const auto id = static_cast<std::size_t>(patch.particles.id[static_cast<std::size_t>(p)]);
      ++seen[id];
      const auto cell = patch.particles.cell[static_cast<std::size_t>(p)];
      CHECK(patch.topology.cells[static_cast<std::size_t>(cell)] == model.particles.cell[id]);
      CHECK(patch.particles.row(Column::mass)[p] ==
            model.particles.volume[id] * model.materials[model.particles.material[id]].density);
    });
  }
  CHECK(std::count(seen.begin(), seen.end(), 1) == static_cast<long>(seen.size()));
}

TEST_CASE("particles have the columns that their own materials, mesh, scheme and loads need") {
  const auto columns = [](Model<2> model) {
    PatchSet<2> patches(model, 0, node_sum_copies(model.analysis));
    const auto& layout = patches[0].particles.layout();
    std::string names;
    for (const ColumnInfo& info : column_table)
      if ((info.need || info.column == Column::state) && layout.has(info.column))
        names += std::string(info.name) + " ";
    return names;
  };
  CHECK(columns(two_discs()) == "");
  CHECK(columns(dam_break()) == "strain state opening ");
  CHECK(columns(distorted(two_discs(), 0.012)) == "natural ");
  Model<2> musl = two_discs();
  musl.analysis.scheme = Scheme::musl;
  CHECK(columns(musl) == "natural ");
  Model<2> stressed = two_discs();
  stressed.particles.stress.resize(static_cast<std::size_t>(stressed.particles.size()));
  CHECK(columns(stressed) == "strain ");
  Model<2> pulled = two_discs();
  pulled.tractions = {{.particles = {0}, .dir = 0, .traction = 1, .function = -1}};
  CHECK(columns(pulled) == "size ");
  Model<2> unused = two_discs();  // a fluid that no particle is made of
  unused.materials.push_back(dam_break().materials[0]);
  CHECK(columns(unused) == "");
  Model<2> mixed = unused;
  mixed.particles.material[5] = 2;
  CHECK(columns(mixed) == "strain state ");
}
