#include "runtime/patches/patch_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <type_traits>

#include "physics/base/error.h"
#include "physics/kernels/kernels.h"
#include "runtime/patches/patch_state_layout.h"

namespace lahar {

namespace {

/// Bins stay loaded when their loaded particles have left.
template <int Dim>
bool any_loads(const Patch<Dim>& patch) {
  return std::any_of(patch.bins.begin(), patch.bins.end(),
                     [](const ParticleBin& bin) { return bin.loaded; });
}

template <int Dim>
Index count_active_nodes(const Patch<Dim>& patch) {
  Index n = 0;
  for (const NodeRange& range : patch.active_nodes) n += range.end - range.begin;
  return n;
}

/// Sums, one of each array, that are mapped for the next step at the end of a step.
template <int Dim>
std::vector<NodeSum> mapped_sums(const Patch<Dim>& patch) {
  std::vector<NodeSum> sums{NodeSum::mass_momentum};
  if (patch.takes_means()) sums.push_back(NodeSum::displacement);
  if (!patch.sums[sum_array(NodeSum::prescribed_mass)].empty())  // nodes are driven
    sums.push_back(NodeSum::prescribed_mass);
  if (!patch.liquid.velocity.empty()) {
    sums.push_back(NodeSum::liquid_mass_momentum);
    sums.push_back(NodeSum::drag);
    if (!patch.liquid.advection.empty()) sums.push_back(NodeSum::advection);
  }
  return sums;
}

template <int Dim>
StateHead head_of(const Patch<Dim>& patch) {
  return {.dim = Dim,
          .patch = patch.topology.patch,
          .cells = static_cast<Index>(patch.topology.cells.size()),
          .nodes = patch.n_nodes(),
          .rows = patch.particles.layout().rows(),
          .slots = patch.particles.size(),
          .bins = static_cast<Index>(patch.bins.size()),
          .particles = patch.count,
          .active_nodes = count_active_nodes(patch),
          .added_bins = patch.added_bins,
          .moving = patch.moving,
          .loads = any_loads(patch),
          .sums = static_cast<Index>(mapped_sums(patch).size()),
          .impulses = static_cast<Index>(patch.impulses.size())};
}

/// Call body(row, column, component) for each row of a particle, in the order of the table.
template <int Dim>
void for_each_particle_row(const ColumnLayout<Dim>& layout, auto&& body) {
  for (const ColumnInfo& info : column_table)
    for (int k = 0; layout.has(info.column) && k < layout.components(info); ++k)
      body(info.column, k);
}

[[noreturn]] void refuse(Index patch, const std::string& what) {
  throw IoError(fmt::format("the stored state of patch {} cannot be used: {}", patch, what));
}

template <int Dim>
StateHead read_head(std::span<const std::byte> bytes, const Patch<Dim>& patch, bool sums) {
  const Index id = patch.topology.patch;
  if (bytes.size() < sizeof(StateHead))
    refuse(id, fmt::format("it has {} bytes only", bytes.size()));
  const StateHead head = StateReader(bytes.data()).get<StateHead>();
  if (head.marker != state_marker)
    refuse(id,
           "it was written by another version of Lahar, or on a machine with another order of "
           "bytes");
  const auto expect = [id](const char* what, Index found, Index expected) {
    if (found != expected)
      refuse(id, fmt::format("{} is {} there, {} here", what, found, expected));
  };
  expect("the number of dimensions", head.dim, Dim);
  expect("the patch", head.patch, id);
  expect("the number of cells", head.cells, static_cast<Index>(patch.topology.cells.size()));
  expect("the number of nodes", head.nodes, patch.n_nodes());
  if (sums)
    expect("the number of arrays of nodal sums", head.sums,
           static_cast<Index>(mapped_sums(patch).size()));
  expect("the number of values of a particle", head.rows, patch.particles.layout().rows());
  constexpr Index most = std::numeric_limits<Local>::max();
  for (const Index n :
       {head.slots, head.bins, head.particles, head.active_nodes, head.added_bins, head.impulses})
    if (n < 0 || n > most) refuse(id, fmt::format("{} is not a number of anything", n));
  if (bytes.size() != bytes_of(head))
    refuse(id, fmt::format("it has {} bytes instead of {}", bytes.size(), bytes_of(head)));
  return head;
}

/// Bins and what follows from them.
template <int Dim>
void read_bins(StateReader& in, const StateHead& head, Patch<Dim>& patch, std::size_t materials) {
  const Index id = patch.topology.patch;
  patch.first_bin.assign(patch.topology.cells.size(), -1);
  patch.bins.clear();
  Index particles = 0;
  for (Index r = 0; r < head.bins; ++r) {
    const auto bin = in.get<PackedBin>();
    const Local free_from = patch.bins.empty() ? 0 : patch.bins.back().limit;
    if (bin.cell < 0 || bin.cell >= head.cells || bin.begin < free_from || bin.end < bin.begin ||
        bin.limit < bin.end || bin.limit > head.slots || bin.material < 0 ||
        static_cast<std::size_t>(bin.material) >= materials)
      refuse(id, fmt::format("run {} is not one", r));
    Local& first = patch.first_bin[static_cast<std::size_t>(bin.cell)];
    patch.bins.push_back({.cell = bin.cell,
                          .begin = bin.begin,
                          .end = bin.end,
                          .limit = bin.limit,
                          .next = first,  // as place() and the sorting chain them
                          .material = static_cast<std::uint16_t>(bin.material),
                          .loaded = bin.loaded != 0});
    first = static_cast<Local>(r);
    particles += bin.end - bin.begin;
  }
  if (particles != head.particles)
    refuse(id, fmt::format("its runs hold {} particles, not {}", particles, head.particles));
}

template <int Dim>
void read_particles(StateReader& in, const StateHead& head, Patch<Dim>& patch) {
  patch.particles = Particles<Dim>(patch.particles.layout());
  Particles<Dim>& to = patch.particles;
  to.resize(static_cast<Local>(head.slots));
  if (head.loads != 0) to.loads.assign(static_cast<std::size_t>(head.slots), 0);
  const auto fill = [&](auto* values) {
    for (const ParticleBin& bin : patch.bins)
      in.get(values + bin.begin, static_cast<std::size_t>(bin.end - bin.begin));
  };
  fill(to.id.data());
  if (head.loads != 0) fill(to.loads.data());
  for_each_particle_row(to.layout(), [&](Column column, int k) { fill(to.row(column, k)); });
  for (const ParticleBin& bin : patch.bins) {
    std::fill(to.cell.begin() + bin.begin, to.cell.begin() + bin.end, bin.cell);
    std::fill(to.material.begin() + bin.begin, to.material.begin() + bin.end, bin.material);
  }
  patch.count = static_cast<Local>(head.particles);
}

/// Sums for `step`, which were mapped at the end of the one before: whole lines of nodes.
template <int Dim>
void read_sums(StateReader& in, const StateHead& head, Patch<Dim>& patch, Index step) {
  find_active_nodes(patch);
  if (count_active_nodes(patch) != head.active_nodes)
    refuse(patch.topology.patch, fmt::format("it has sums of {} nodes, not of the {} of its runs",
                                             head.active_nodes, count_active_nodes(patch)));
  if (head.active_nodes == 0) return;
  for (const NodeSum which : mapped_sums(patch)) {
    double* lines = patch.own_lines(which, step);
    for (const NodeRange& range : patch.active_nodes)
      in.get(lines + static_cast<std::ptrdiff_t>(range.begin) * sum_stride,
             static_cast<std::size_t>(range.end - range.begin) * sum_stride);
  }
}

}  // namespace

template <int Dim>
std::size_t packed_bytes(const Patch<Dim>& patch) {
  return bytes_of(head_of(patch));
}

/// Cells and materials of particles, the chains of bins, active nodes and whether the patch is idle
/// follow from the bins. Sums of other steps and kinds are cleared before anybody reads them, nodal
/// state is computed anew, and so is the limit of the time step: what of it is still to be used is
/// the simulation's.
template <int Dim>
void pack(const Patch<Dim>& patch, Index step, std::byte* to) {
  const StateHead head = head_of(patch);
  StateWriter out(to);
  out.put(head);
  for (const double work : {patch.work.internal, patch.work.external, patch.work.damping,
                            patch.work.friction, patch.work.divided})
    out.put(work);
  out.put(patch.impulses.data(), patch.impulses.size());
  for (const ParticleBin& bin : patch.bins)
    out.put(PackedBin{bin.cell, bin.begin, bin.end, bin.limit, bin.material, bin.loaded});
  const auto add = [&](const auto* values) {
    for (const ParticleBin& bin : patch.bins)
      out.put(values + bin.begin, static_cast<std::size_t>(bin.end - bin.begin));
  };
  const Particles<Dim>& particles = patch.particles;
  add(particles.id.data());
  if (head.loads != 0) add(particles.loads.data());
  for_each_particle_row(particles.layout(),
                        [&](Column column, int k) { add(particles.row(column, k)); });
  if (head.active_nodes == 0) return;
  for (const NodeSum which : mapped_sums(patch)) {
    const double* lines = patch.own_lines(which, step);
    for (const NodeRange& range : patch.active_nodes)
      out.put(lines + static_cast<std::ptrdiff_t>(range.begin) * sum_stride,
              static_cast<std::size_t>(range.end - range.begin) * sum_stride);
  }
}

template <int Dim>
std::vector<std::byte> pack(const Patch<Dim>& patch, Index step) {
  std::vector<std::byte> bytes(packed_bytes(patch));
  pack(patch, step, bytes.data());
  return bytes;
}

void change_ids(std::span<std::byte> bytes, const std::function<void(std::span<Index>)>& change) {
  const StateHead head = StateReader(bytes.data()).get<StateHead>();
  std::vector<Index> ids(static_cast<std::size_t>(head.particles));
  std::byte* const at = bytes.data() + ids_offset(head);
  StateReader(at).get(ids.data(), ids.size());
  change(ids);
  StateWriter(at).put(ids.data(), ids.size());
}

template <int Dim>
void unpack(std::span<const std::byte> bytes, Patch<Dim>& patch, Index step,
            const StateBounds& bounds) {
  const StateHead head = read_head(bytes, patch, bounds.sums);
  StateReader in(bytes.data() + sizeof(StateHead));
  for (double* work : {&patch.work.internal, &patch.work.external, &patch.work.damping,
                       &patch.work.friction, &patch.work.divided})
    *work = in.get<double>();
  std::vector<Reaction> impulses(static_cast<std::size_t>(head.impulses));
  in.get(impulses.data(), impulses.size());
  // Gauges of another scenario, or of another stage, begin anew.
  if (patch.has_conditions && impulses.size() != patch.impulses.size())
    impulses.assign(patch.impulses.size(), {});
  patch.impulses = std::move(impulses);
  const double slots = static_cast<double>(head.slots) * static_cast<double>(head.rows + 2);
  if (slots * sizeof(double) > bounds.memory)
    refuse(head.patch,
           fmt::format("its {} slots for particles take more memory than there is", head.slots));
  read_bins(in, head, patch, bounds.materials);
  read_particles(in, head, patch);
  if (bounds.sums)
    read_sums(in, head, patch, step);
  else
    find_active_nodes(patch);
  const bool filled = patch.count > 0;
  patch.added_bins = static_cast<int>(head.added_bins);
  patch.moving = head.moving != 0;
  patch.sorted = true;
  patch.idle = !filled;
  patch.clear_sums = filled ? 0 : 2;
  patch.contributes = {};
  patch.contributes[static_cast<std::size_t>(step % 2)] = filled;
}

template <int Dim>
std::string column_text(const ColumnLayout<Dim>& layout) {
  std::string text;
  for (const ColumnInfo& info : column_table)
    if (layout.has(info.column))
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", info.name, layout.components(info));
  return text;
}

#define LAHAR_INSTANTIATE(Dim)                                                              \
  template std::vector<std::byte> pack(const Patch<Dim>&, Index);                           \
  template void pack(const Patch<Dim>&, Index, std::byte*);                                 \
  template std::size_t packed_bytes(const Patch<Dim>&);                                     \
  template void unpack(std::span<const std::byte>, Patch<Dim>&, Index, const StateBounds&); \
  template std::string column_text(const ColumnLayout<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
