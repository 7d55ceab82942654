/// \file One patch's own numbering of nodes, and the nodes that it shares with other patches.
#include <tsl/robin_map.h>

#include <algorithm>
#include <cassert>

#include "physics/mesh/partition.h"
#include "physics/mesh/partition_common.h"

namespace lahar {
namespace {

/// Nodes of a brick are a box of the grid's nodes; local numbers follow from the position in it.
template <int Dim>
void number_brick(const Mesh<Dim>& mesh, const typename Partition<Dim>::Brick& brick, int rings,
                  PatchTopology<Dim>& topology) {
  const auto counts = mesh.counts();
  std::array<Index, Dim> low, size;
  Index n_nodes = 1;
  for (int d = 0; d < Dim; ++d) {
    low[d] = std::max<Index>(brick.low[d] - rings, 0);
    size[d] = std::min(brick.high[d] + rings, counts[d]) - low[d] + 1;
    n_nodes *= size[d];
  }
  topology.nodes.resize(n_nodes);
  for (Index local = 0; local < n_nodes; ++local) {
    Index rest = local, id = 0, stride = 1;
    for (int d = 0; d < Dim; ++d) {
      id += stride * (low[d] + rest % size[d]);
      rest /= size[d];
      stride *= counts[d] + 1;
    }
    topology.nodes[local] = id;
  }
  topology.corner_nodes.resize(topology.cells.size());
  for (std::size_t c = 0; c < topology.cells.size(); ++c) {
    Index rest = topology.cells[c];
    std::array<Index, Dim> ijk;
    for (int d = 0; d < Dim; ++d) ijk[d] = rest % counts[d] - low[d], rest /= counts[d];
    for (int a = 0; a < corners<Dim>; ++a) {
      Index id = 0;
      for (int d = Dim - 1; d >= 0; --d) id = id * size[d] + ijk[d] + ((a >> d) & 1);
      topology.corner_nodes[c][a] = static_cast<Local>(id);
    }
  }
}

template <int Dim>
void number_cells(const Mesh<Dim>& mesh, int rings, PatchTopology<Dim>& topology) {
  topology.nodes = nodes_around<Dim>(mesh, topology.cells, rings);
  if (!mesh.is_multilinear()) return;
  const auto begin = topology.nodes.begin(), end = topology.nodes.end();
  topology.corner_nodes.resize(topology.cells.size());
  for (std::size_t c = 0; c < topology.cells.size(); ++c) {
    const auto nodes = mesh.cell_nodes_tensor(topology.cells[c]);
    for (int a = 0; a < corners<Dim>; ++a)
      topology.corner_nodes[c][a] =
          static_cast<Local>(std::lower_bound(begin, end, nodes[a]) - begin);
  }
}

/// A patch (position in the list given to connect) that holds a node, and the node's number there.
struct Holder {
  Local patch, node;
};

/// All holders of every node of the patches that are to be filled, in the order of the patches.
class Holders {
 public:
  template <int Dim>
  Holders(const std::vector<PatchTopology<Dim>*>& patches, const std::vector<char>& fill) {
    std::size_t total = 0;
    for (std::size_t p = 0; p < patches.size(); ++p)
      if (fill[p]) total += patches[p]->nodes.size();
    slot_.reserve(total);
    std::vector<Local> count;
    for (std::size_t p = 0; p < patches.size(); ++p) {
      if (!fill[p]) continue;
      for (Index node : patches[p]->nodes) {
        const auto [entry, is_new] = slot_.try_emplace(node, static_cast<Index>(count.size()));
        if (is_new) count.push_back(0);
        ++count[entry->second];
      }
    }
    const auto for_each_other = [&](std::size_t p, auto body) {
      const auto& nodes = patches[p]->nodes;
      for (std::size_t n = 0; n < nodes.size(); ++n)
        if (const auto entry = slot_.find(nodes[n]); entry != slot_.end())
          body(entry->second, static_cast<Local>(n));
    };
    for (std::size_t p = 0; p < patches.size(); ++p)
      if (!fill[p]) for_each_other(p, [&](Index slot, Local) { ++count[slot]; });
    first_.assign(count.size() + 1, 0);
    for (std::size_t s = 0; s < count.size(); ++s) first_[s + 1] = first_[s] + count[s];
    holders_.resize(static_cast<std::size_t>(first_.back()));
    std::vector<Index> next(first_.begin(), first_.end() - 1);
    for (std::size_t p = 0; p < patches.size(); ++p)
      for_each_other(p, [&](Index slot, Local n) {
        holders_[next[slot]++] = {static_cast<Local>(p), n};
      });
  }

  std::pair<const Holder*, const Holder*> operator[](Index node) const {
    const Index slot = slot_.at(node);
    return {holders_.data() + first_[slot], holders_.data() + first_[slot + 1]};
  }

 private:
  tsl::robin_map<Index, Index> slot_;
  std::vector<Index> first_;
  std::vector<Holder> holders_;
};

}  // namespace

template <int Dim>
PatchTopology<Dim> make_topology(const Mesh<Dim>& mesh, const Partition<Dim>& partition,
                                 Index patch, int rings) {
  PatchTopology<Dim> topology;
  topology.patch = patch;
  topology.cells = partition.cells(patch);
  topology.neighbours = partition.neighbours(patch, rings);
  if (mesh.is_structured()) {
    number_brick<Dim>(mesh, partition.brick(patch), rings, topology);
  } else {
    number_cells<Dim>(mesh, rings, topology);
  }
  return topology;
}

template <int Dim>
void connect(std::vector<PatchTopology<Dim>*>& patches) {
  connect(patches, std::vector<char>(patches.size(), 1));
}

template <int Dim>
void connect(std::vector<PatchTopology<Dim>*>& patches, const std::vector<char>& fill) {
  const Holders holders(patches, fill);
  // Position of each listed patch among the neighbours of the patch at hand; -1 = itself.
  std::vector<Local> position(patches.size(), -1);
  const auto by_id = [](const PatchTopology<Dim>* p, Index id) { return p->patch < id; };
  for (std::size_t own = 0; own < patches.size(); ++own) {
    if (!fill[own]) continue;
    PatchTopology<Dim>& patch = *patches[own];
    std::vector<Index> present;
    for (Index id : patch.neighbours) {
      const auto p = std::lower_bound(patches.begin(), patches.end(), id, by_id);
      if (p == patches.end() || (*p)->patch != id) continue;
      position[p - patches.begin()] = static_cast<Local>(present.size());
      present.push_back(id);
    }
    position[own] = -1;
    patch.neighbours = std::move(present);
    patch.shared_node.clear();
    patch.first.assign(1, 0);
    patch.shares.clear();
    patch.owned.assign(patch.nodes.size(), 1);
    for (std::size_t n = 0; n < patch.nodes.size(); ++n) {
      const auto [begin, end] = holders[patch.nodes[n]];
      if (end - begin == 1) continue;
      patch.shared_node.push_back(static_cast<Local>(n));
      for (const Holder* h = begin; h != end; ++h)
        patch.shares.push_back({position[h->patch], h->node});
      patch.first.push_back(static_cast<Local>(patch.shares.size()));
      patch.owned[n] = begin->patch == static_cast<Local>(own);
    }
  }
}

template PatchTopology<2> make_topology(const Mesh<2>&, const Partition<2>&, Index, int);
template PatchTopology<3> make_topology(const Mesh<3>&, const Partition<3>&, Index, int);
template void connect(std::vector<PatchTopology<2>*>&);
template void connect(std::vector<PatchTopology<3>*>&);
template void connect(std::vector<PatchTopology<2>*>&, const std::vector<char>&);
template void connect(std::vector<PatchTopology<3>*>&, const std::vector<char>&);

}  // namespace lahar
