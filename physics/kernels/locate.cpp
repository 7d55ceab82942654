/// \file Which cell a particle is in after it moved, and the exchange of particles between patches.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>
#include <utility>

#include "physics/basis/lagrange_basis.h"
#include "physics/kernels/closed_faces.h"
#include "physics/kernels/kernels.h"
#include "physics/materials/law.h"
#include "physics/mesh/cell_polynomial.h"
#include "physics/mesh/inverse_mapping.h"
#include "physics/particles/liquid_content.h"
#include "physics/particles/removal_in_time.h"

namespace lahar {

namespace {

template <int Dim>
Vec<Dim> position(const Particles<Dim>& particles, Local p) {
  Vec<Dim> x;
  for (int d = 0; d < Dim; ++d) x[d] = particles.row(Column::x, d)[p];
  return x;
}

/// What is read and written to locate particles.
template <int Dim>
struct PlaceRows {
  std::array<const double*, Dim> x;
  bool stored;                         ///< natural coordinates are
  std::array<double*, Dim> natural{};  ///< if they are stored

  explicit PlaceRows(Particles<Dim>& particles)
      : x(std::as_const(particles).template rows<Dim>(Column::x)),
        stored(particles.layout().has(Column::xi)) {
    if (stored) natural = particles.template rows<Dim>(Column::xi);
  }
  /// For the particles from p on.
  template <class Real>
  LAHAR_INLINE void load(Local p, Real (&at)[Dim], Real (&xi)[Dim]) const {
    LAHAR_UNROLL
    for (std::size_t d = 0; d < Dim; ++d) {
      at[d] = lahar::load<Real>(x[d] + p);
      xi[d] = lahar::load<Real>(natural[d] + p);
    }
  }
};

/// Natural coordinates in the present cell; bits of `outside` for those that have left it.
template <int Dim, class Real, class Outside>
LAHAR_INLINE void locate_bin_cartesian(const Patch<Dim>& patch, const PlaceRows<Dim>& rows,
                                       const ParticleBin& bin, Outside outside) {
  const auto& box = patch.box[static_cast<std::size_t>(bin.cell)];
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = bin.end - p;
    unsigned out = 0;
    LAHAR_UNROLL
    for (std::size_t d = 0; d < Dim; ++d) {
      const Real xi = (load<Real>(rows.x[d] + p) - box[d]) * box[Dim + d];
      out |= lahar::outside(xi, 1.0, n);
      if (rows.stored) store_first(clamp(xi, xi_max), rows.natural[d] + p, n);
    }
    if (out != 0) outside(p, out);
  }
}

/// Particles of the pack from p on whose bit is set, by the mesh's own map: it decides on faces,
/// and where the pack's iteration fails. Returns the bits of those outside.
template <int Dim>
[[gnu::noinline]] unsigned locate_singly(Patch<Dim>& patch, const CellGeometry<Dim>& cell, Local p,
                                         unsigned bits) {
  unsigned out = 0;
  for (; bits != 0; bits &= bits - 1) {
    const Local q = p + std::countr_zero(bits);
    Vec<Dim> xi;
    if (!inverse_map<Dim>(cell, position(patch.particles, q), xi) || !in_closed_cell<Dim>(xi)) {
      out |= bits & -bits;
      continue;
    }
    xi = clamp_to_cell<Dim>(xi);
    for (int d = 0; d < Dim; ++d) patch.particles.row(Column::xi, d)[q] = xi[d];
  }
  return out;
}

/// As locate_bin_cartesian. Packs start from the particles' natural coordinates before they moved.
template <int Dim, class Real, class Outside>
LAHAR_INLINE void locate_bin_isoparametric(Patch<Dim>& patch, const PlaceRows<Dim>& rows,
                                           const ParticleBin& bin, const Mesh<Dim>& mesh,
                                           Outside outside) {
  const auto c = static_cast<std::size_t>(bin.cell);
  const CellPolynomial<Dim> cell(patch.node_position.data(), patch.topology.corner_nodes[c]);
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = bin.end - p;
    Real at[Dim], xi[Dim];
    rows.load(p, at, xi);
    const unsigned open = inverse_map_pack(cell, at, xi, n);
    LAHAR_UNROLL
    for (std::size_t d = 0; d < Dim; ++d)
      store_lanes(first_bits<Real>(n) & ~open, xi[d], rows.natural[d] + p);
    Real reach = abs(xi[0]);
    LAHAR_UNROLL
    for (int d = 1; d < Dim; ++d) reach = max(reach, abs(xi[d]));
    const unsigned singly = open | lahar::outside(reach, pack_clear_of_faces, n);
    if (singly == 0) continue;
    if (const unsigned out =
            locate_singly(patch, mesh.geometry(patch.topology.cells[c]), p, singly))
      outside(p, out);
  }
}

/// As locate_bin_isoparametric, in cells of other elements.
template <int Dim, class Real, class Cells, class Outside>
LAHAR_INLINE void locate_bin_element(Patch<Dim>& patch, const PlaceRows<Dim>& rows,
                                     const Cells& cells, const ParticleBin& bin,
                                     const Mesh<Dim>& mesh, Outside outside) {
  const auto cell = cells[bin.cell];
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = bin.end - p;
    Real at[Dim], xi[Dim];
    rows.load(p, at, xi);
    unsigned singly = cell.inverse_map(at, xi, n);
    singly |= cell.near_faces(xi, n);
    LAHAR_UNROLL
    for (std::size_t d = 0; d < Dim; ++d) store_first(xi[d], rows.natural[d] + p, n);
    unsigned out = 0;
    for (; singly != 0; singly &= singly - 1) {
      const Local q = p + std::countr_zero(singly);
      const auto found = mesh.natural_coordinates(
          patch.topology.cells[static_cast<std::size_t>(bin.cell)], position(patch.particles, q));
      if (!found) out |= singly & -singly;
      for (std::size_t d = 0; d < Dim && found; ++d)
        rows.natural[d][q] = (*found)[static_cast<Eigen::Index>(d)];
    }
    if (out != 0) outside(p, out);
  }
}

/// Take a particle out of its bin; the bin's last one is to take its place: move_out().
template <int Dim>
void take_out(Patch<Dim>& patch, ParticleBin& bin, Local p) {
  patch.leaving.push_back({p, patch.movers.size() + static_cast<Local>(patch.leaving.size())});
  --bin.end;
  --patch.count;
  if (p != bin.end) patch.filling.push_back({bin.end, p});
}

/// Copy those that take_out() found to Patch::movers, and others to their places.
template <int Dim>
void move_out(Patch<Dim>& patch) {
  if (patch.leaving.empty()) return;
  patch.movers.resize(patch.movers.size() + static_cast<Local>(patch.leaving.size()));
  patch.movers.copy(patch.leaving, patch.particles);
  patch.particles.copy(patch.filling, patch.particles);
  patch.leaving.clear();
  patch.filling.clear();
}

template <int Dim>
void record_fault(Patch<Dim>& patch, ParticleFault::Kind kind, const Particles<Dim>& particles,
                  Local p) {
  ParticleFault& fault = patch.fault;
  ++fault.count;
  if (fault.kind != ParticleFault::Kind::none) return;
  fault.kind = kind;
  fault.particle = particles.id[static_cast<std::size_t>(p)];
  for (int d = 0; d < Dim; ++d) {
    fault.position[static_cast<std::size_t>(d)] = particles.row(Column::x, d)[p];
    fault.velocity[static_cast<std::size_t>(d)] = particles.row(Column::v, d)[p];
  }
}

/// Free slots of a bin that is added for a cell whose other bins are full: as many as are computed
/// with together anyway.
constexpr Local added_slots = 8;

/// A bin of the cell and material that has a free slot.
template <int Dim>
ParticleBin& bin_with_room(Patch<Dim>& patch, Local cell, std::uint16_t material) {
  Local& first = patch.first_bin[static_cast<std::size_t>(cell)];
  for (Local r = first; r >= 0; r = patch.bins[static_cast<std::size_t>(r)].next) {
    ParticleBin& bin = patch.bins[static_cast<std::size_t>(r)];
    if (bin.material == material && bin.end < bin.limit) return bin;
  }
  const Local begin = patch.particles.size();
  patch.particles.resize(begin + added_slots);
  patch.bins.push_back({.cell = cell,
                        .begin = begin,
                        .end = begin,
                        .limit = begin + added_slots,
                        .next = first,
                        .material = material,
                        .loaded = false});
  if (first < 0) patch.cells_to_activate.push_back(cell);
  first = static_cast<Local>(patch.bins.size()) - 1;
  ++patch.added_bins;
  return patch.bins.back();
}

/// Find a slot in a bin of the cell for particle `i` of `from`, which is still to be copied there,
/// by move_in(), and to be mapped.
template <int Dim>
void place(Patch<Dim>& patch, const Particles<Dim>& from, Local i, Local cell) {
  const auto at = static_cast<std::size_t>(i);
  ParticleBin& bin = bin_with_room(patch, cell, from.material[at]);
  if (bin.begin == bin.end && !patch.halo_edge_cells.empty() &&
      patch.halo_edge_cells[static_cast<std::size_t>(cell)])
    patch.needs_surroundings = true;
  const Local slot = bin.end++;
  patch.placing.push_back({i, slot});
  patch.placing_cell.push_back(cell);
  const bool loaded = !from.loads.empty() && from.loads[at] != 0;
  bin.loaded = bin.loaded || loaded;
  ++patch.count;
  if (!patch.unmapped.empty() && patch.unmapped.back().end == slot &&
      patch.unmapped.back().limit == bin.limit) {
    ++patch.unmapped.back().end;
    patch.unmapped.back().loaded = patch.unmapped.back().loaded || loaded;
  } else {
    patch.unmapped.push_back({.cell = cell,
                              .begin = slot,
                              .end = slot + 1,
                              .limit = bin.limit,
                              .material = bin.material,
                              .loaded = loaded});
  }
}

/// Copy the particles for which place() found slots.
template <int Dim>
void move_in(Patch<Dim>& patch, const Particles<Dim>& from) {
  patch.particles.copy(patch.placing, from);
  for (std::size_t k = 0; k < patch.placing.size(); ++k)
    patch.particles.cell[static_cast<std::size_t>(patch.placing[k].to)] = patch.placing_cell[k];
  patch.placing.clear();
  patch.placing_cell.clear();
}

/// The cell of a grid that a particle went to from `old`, if it is a neighbour and the particle is
/// not so near to a face that rounding decides; else -1.
template <int Dim>
Index adjacent_cell(const Patch<Dim>& patch, const Mesh<Dim>& mesh, const Vec<Dim>& x, Local old) {
  constexpr double clear_of_faces = 1.0 - 1e-9;
  const auto& box = patch.box[static_cast<std::size_t>(old)];
  const auto counts = mesh.counts();
  const Index id = patch.topology.cells[static_cast<std::size_t>(old)];
  Index shift = 0, stride = 1, rest = id;
  for (std::size_t d = 0; d < Dim; ++d) {
    const double xi = (x[static_cast<Eigen::Index>(d)] - box[d]) * box[Dim + d];
    const Index step = xi > 1.0 ? 1 : xi < -1.0 ? -1 : 0;
    const Index position = rest % counts[d] + step;
    if (!(std::abs(xi - 2.0 * static_cast<double>(step)) < clear_of_faces)) return -1;
    if (position < 0 || position >= counts[d]) return -1;
    shift += step * stride;
    rest /= counts[d];
    stride *= counts[d];
  }
  return id + shift;
}

/// Where a particle is that was in the local cell `old`.
template <int Dim>
typename Mesh<Dim>::Found find_cell(const Patch<Dim>& patch, const Mesh<Dim>& mesh,
                                    const Vec<Dim>& x, Local old, bool needs_natural) {
  if (!needs_natural && mesh.is_structured())
    if (const Index cell = adjacent_cell(patch, mesh, x, old); cell >= 0)
      return {cell, Vec<Dim>::Zero()};
  return mesh.locate_from(x, patch.topology.cells[static_cast<std::size_t>(old)]);
}

/// Mass and volume of the particles of a bin that go (removal_in_time.h), at the end of the step.
/// Those that are then gone keep what they had, and are added to `gone`, ascending.
template <int Dim>
void let_go(Patch<Dim>& patch, const StepContext<Dim>& step, const ParticleBin& bin,
            std::vector<Local>& gone) {
  Particles<Dim>& particles = patch.particles;
  for (Local p = bin.begin; p < bin.end; ++p) {
    const double before = share_left(*step.model, particles, p, step.time),
                 after = share_left(*step.model, particles, p, step.time + step.dt);
    if (after <= 0) {
      gone.push_back(p);
      continue;
    }
    if (after == before) continue;
    for (const Column column : {Column::mass, Column::volume})
      particles.row(column)[p] *= after / before;
  }
}

/// Add particles to those that leave a bin, which may be the same: each once, ascending.
void add_leaving(std::vector<std::pair<Local, unsigned>>& packs, const std::vector<Local>& gone) {
  std::set<Local> all(gone.begin(), gone.end());
  for (const auto& [first, bits] : packs)
    for (unsigned rest = bits; rest != 0; rest &= rest - 1)
      all.insert(first + std::countr_zero(rest));
  packs.clear();
  for (const Local p : all) packs.emplace_back(p, 1u);
}

/// A stage lets a particle go (removal_in_time.h), and it is gone at the end of the step. In a step
/// without a length, after a failure, it stays.
template <int Dim>
bool is_gone(const Particles<Dim>& movers, Local i, const StepContext<Dim>& step) {
  return share_left(*step.model, movers, i, step.time + step.dt) <= 0;
}

template <int Dim>
void remove(Patch<Dim>& patch, const Particles<Dim>& movers, Local i,
            const StepContext<Dim>& step) {
  RemovedParticle& removed = patch.removed.emplace_back();
  removed.step = step.step + 1;
  removed.id = movers.id[static_cast<std::size_t>(i)];
  removed.material = movers.material[static_cast<std::size_t>(i)];
  removed.as_planned = is_gone(movers, i, step);
  double share =
      share_left(*step.model, movers, i, removed.as_planned ? step.time : step.time + step.dt);
  if (!(share > 0)) share = 1.0;  // the step failed
  const auto& liquid = step.model->materials[static_cast<std::size_t>(removed.material)].liquid;
  removed.mass = movers.row(Column::mass)[i] / share;
  removed.liquid_mass = compressed_mass_of(liquid, movers, i) / share;
  for (int d = 0; d < Dim; ++d) {
    removed.position[static_cast<std::size_t>(d)] = movers.row(Column::x, d)[i];
    removed.velocity[static_cast<std::size_t>(d)] = movers.row(Column::v, d)[i];
  }
}

/// Find the new cell of a mover and bring it there.
template <int Dim>
void relocate(Patch<Dim>& patch, const StepContext<Dim>& step, Local i) {
  Particles<Dim>& movers = patch.movers;
  const Local old = movers.cell[static_cast<std::size_t>(i)];
  const auto stays = [&](ParticleFault::Kind kind) {  // the step fails, but nothing gets lost
    record_fault(patch, kind, movers, i);
    place(patch, movers, i, old);
  };
  Vec<Dim> x = position(movers, i);
  if (!x.allFinite()) return stays(ParticleFault::Kind::not_finite);
  if (is_gone(movers, i, step)) return remove(patch, movers, i, step);
  const bool has_natural = movers.layout().has(Column::xi);
  const bool closed = step.model->analysis.closed_faces;
  if (closed && return_through_faces(patch, movers, i, old)) x = position(movers, i);
  auto found = find_cell(patch, *step.model->mesh, x, old, has_natural);
  if (closed && (found.cell < 0 ? return_to_mesh(patch, *step.model->mesh, movers, i, old)
                                : return_through_edge(patch, movers, i, old, found.cell))) {
    x = position(movers, i);
    found = find_cell(patch, *step.model->mesh, x, old, has_natural);
  }
  if (found.cell < 0) {
    // A part of a mesh cannot tell what is far away: no mesh may, or ranks would make a difference.
    if (!step.model->mesh->is_near(x, patch.topology.cells[static_cast<std::size_t>(old)]))
      return stays(ParticleFault::Kind::moved_too_far);
    if (!step.model->analysis.remove_leaving_particles)
      return stays(ParticleFault::Kind::left_mesh);
    return remove(patch, movers, i, step);
  }
  if (has_natural)
    for (int d = 0; d < Dim; ++d) movers.row(Column::xi, d)[i] = found.xi[d];
  if (const auto local = patch.local_cell.find(found.cell); local != patch.local_cell.end())
    return place(patch, movers, i,
                 patch.cell_of(local->second, movers.material[static_cast<std::size_t>(i)]));
  const Index target = step.partition->patch_of(found.cell);
  const auto& neighbours = patch.topology.neighbours;
  const auto at = std::lower_bound(neighbours.begin(), neighbours.end(), target);
  if (at == neighbours.end() || *at != target) return stays(ParticleFault::Kind::moved_too_far);
  auto& out = patch.outbox[static_cast<std::size_t>(at - neighbours.begin())];
  if (out.cell.empty()) {
    patch.filled_outboxes.push_back(static_cast<Local>(at - neighbours.begin()));
    *out.filled = 1;
  }
  out.particles.append(movers, i);
  out.cell.push_back(found.cell);
}

}  // namespace

template <int Dim>
void clear_outboxes(Patch<Dim>& patch) {
  for (const Local filled : patch.filled_outboxes) {
    auto& out = patch.outbox[static_cast<std::size_t>(filled)];
    out.particles.clear();
    out.cell.clear();
    *out.filled = 0;
  }
  patch.filled_outboxes.clear();
}

/// The first particle of a bin whose domain reaches further than a cell from its middle, so that it
/// may go beyond the cells around; -1 = none.
template <int Dim>
Local too_large(const Patch<Dim>& patch, const ParticleBin& bin) {
  const Particles<Dim>& particles = patch.particles;
  const auto& box = patch.box[static_cast<std::size_t>(bin.cell)];
  const bool vectors = particles.layout().has(Column::vectors),
             corners_move = particles.layout().has(Column::corners);
  for (Local p = bin.begin; p < bin.end; ++p)
    for (int d = 0; d < Dim; ++d) {
      double reach = 0.0;
      if (vectors)
        for (int k = 0; k < Dim; ++k)
          reach += std::abs(particles.row(Column::vectors, Dim * k + d)[p]);
      else if (corners_move)
        for (int c = 0; c < corners<Dim>; ++c)
          reach = std::max(reach, std::abs(particles.row(Column::corners, Dim * c + d)[p]));
      else
        reach = 0.5 * particles.row(Column::domain, d)[p];
      if (!(reach * box[static_cast<std::size_t>(Dim + d)] <= 2.0)) return p;
    }
  return -1;
}

/// All functions of the step have been used: domains become those that its strain left.
template <int Dim>
void adopt_domains(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const auto& layout = patch.particles.layout();
  const auto adopt = [&](Column from, Column to, int components) {
    for (const ParticleBin& bin : bins)
      for (int k = 0; k < components; ++k) {
        const double* row = patch.particles.row(from, k);
        std::copy(row + bin.begin, row + bin.end, patch.particles.row(to, k) + bin.begin);
      }
  };
  if (layout.has(Column::next_domain)) adopt(Column::next_domain, Column::domain, Dim);
  if (layout.has(Column::next_vectors)) adopt(Column::next_vectors, Column::vectors, Dim * Dim);
  if (layout.has(Column::next_corners))
    adopt(Column::next_corners, Column::corners, Dim * corners<Dim>);
  if (!step.model->analysis.refuse_large_domains) return;
  for (const ParticleBin& bin : bins)
    if (const Local p = too_large(patch, bin); p >= 0)
      record_fault(patch, ParticleFault::Kind::domain, patch.particles, p);
}

template <int Dim, class Real>
void locate(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  std::vector<std::pair<Local, unsigned>> left;
  if (patch.particles.layout().has(Column::next_domain) ||
      patch.particles.layout().has(Column::next_vectors) ||
      patch.particles.layout().has(Column::corners))
    adopt_domains(patch, step, bins);
  const PlaceRows<Dim> rows(patch.particles);
  const Mesh<Dim>& mesh = *step.model->mesh;
  const auto outside = [&](Local p, unsigned bits) { left.emplace_back(p, bits); };
  const bool some_go = step.model->changes.takes_time();
  std::vector<Local> gone;
  const auto in_all = [&](auto locate_bin) __attribute__((always_inline)) {
    for (ParticleBin& bin : bins) {
      if (bin.begin == bin.end) continue;
      locate_bin(bin);
      if (some_go && bin.loaded) {
        let_go(patch, step, bin, gone);
        if (!gone.empty()) add_leaving(left, std::exchange(gone, {}));
      }
      // From the last to the first, so that the particle that takes a place is never one that left.
      for (; !left.empty(); left.pop_back())
        for (unsigned bits = left.back().second; bits != 0;) {
          const int lane = std::bit_width(bits) - 1;
          bits &= ~(1u << lane);
          take_out(patch, bin, left.back().first + lane);
        }
    }
  };
  if (patch.basis == BasisKind::element)
    with_lagrange(patch, [&](const auto& cells) {
      in_all([&](const ParticleBin& bin) __attribute__((always_inline)) {
        locate_bin_element<Dim, Real>(patch, rows, cells, bin, mesh, outside);
      });
    });
  else if (patch.cartesian)
    in_all([&](const ParticleBin& bin) __attribute__((always_inline)) {
      locate_bin_cartesian<Dim, Real>(patch, rows, bin, outside);
    });
  else
    in_all([&](const ParticleBin& bin) __attribute__((always_inline)) {
      locate_bin_isoparametric<Dim, Real>(patch, rows, bin, mesh, outside);
    });
  move_out(patch);
}

template <int Dim>
void place_movers(Patch<Dim>& patch, const StepContext<Dim>& step) {
  for (Local i = 0; i < patch.movers.size(); ++i) relocate(patch, step, i);
  move_in(patch, patch.movers);
  patch.movers.clear();
}

namespace {

/// Sort bins by cell and material, join those of the same, and pack their particles. Bins of a
/// patch whose particles move get a free slot, so that they need not be sorted again soon.
template <int Dim>
void sort_bins(Patch<Dim>& patch) {
  auto& bins = patch.bins;
  std::erase_if(bins, [](const ParticleBin& bin) { return bin.begin == bin.end; });
  std::stable_sort(bins.begin(), bins.end(), [](const ParticleBin& a, const ParticleBin& b) {
    return std::tie(a.cell, a.material) < std::tie(b.cell, b.material);
  });
  std::vector<ParticleBin> joined;
  std::vector<SlotMove> moves;
  joined.reserve(bins.size());
  moves.reserve(bins.size());
  const Local free_slots = patch.moving ? 1 : 0;
  Local slot = 0;
  for (const ParticleBin& bin : bins) {
    if (joined.empty() || joined.back().cell != bin.cell ||
        joined.back().material != bin.material) {
      slot += joined.empty() ? 0 : free_slots;
      joined.push_back(bin);
      joined.back().begin = slot;
    }
    ParticleBin& to = joined.back();
    moves.push_back({bin.begin, slot, bin.end - bin.begin});
    slot += bin.end - bin.begin;
    to.end = slot;
    to.limit = slot + free_slots;
    to.loaded = to.loaded || bin.loaded;
  }
  patch.particles.rearrange(moves, slot + (joined.empty() ? 0 : free_slots));
  bins = std::move(joined);
  patch.first_bin.assign(patch.topology.cells.size(), -1);
  for (std::size_t r = 0; r < bins.size(); ++r) {
    Local& first = patch.first_bin[static_cast<std::size_t>(bins[r].cell)];
    bins[r].next = first;
    first = static_cast<Local>(r);
  }
  patch.added_bins = 0;
  find_active_nodes(patch);
}

/// Bins of particles in the order in which they are, before they are sorted for the first time.
template <int Dim>
void find_bins(Patch<Dim>& patch) {
  const Particles<Dim>& particles = patch.particles;
  auto& bins = patch.bins;
  bins.clear();
  for (Local p = 0; p < particles.size(); ++p) {
    const auto i = static_cast<std::size_t>(p);
    const Local cell = particles.cell[i];
    if (bins.empty() || bins.back().cell != cell || bins.back().material != particles.material[i])
      bins.push_back({.cell = cell,
                      .begin = p,
                      .end = p,
                      .limit = p,
                      .material = particles.material[i],
                      .loaded = false});
    bins.back().end = p + 1;
    if (!particles.loads.empty() && particles.loads[i]) bins.back().loaded = true;
  }
  patch.count = particles.size();
}

/// One added bin to so many others is the share above which particles are sorted: an added bin
/// costs about what half a full one does, sorting about what one step does.
constexpr int bins_per_added_bin = 4;

}  // namespace

template <int Dim>
void receive(Patch<Dim>& patch) {
  if (!patch.sorted) {
    find_bins(patch);
    sort_bins(patch);
    patch.sorted = true;
  }
  for (std::size_t k = 0; k < patch.arrived.size(); ++k) {
    if (patch.arrived[k] == 0) continue;
    const auto& in = *patch.inbox[k];
    for (Local i = 0; i < in.particles.size(); ++i) {
      const auto row = static_cast<std::size_t>(i);
      place(patch, in.particles, i,
            patch.cell_of(patch.local_cell.at(in.cell[row]), in.particles.material[row]));
    }
    move_in(patch, in.particles);
  }
}

template <int Dim>
void place_new(Patch<Dim>& patch, const Particles<Dim>& from, Local cell) {
  for (Local i = 0; i < from.size(); ++i) place(patch, from, i, cell);
  move_in(patch, from);
}

/// Particles that come back to a patch find it as those do that come to a new one: whether it has
/// been dropped in between, which depends on when others caused a rebuild, changes no bit.
template <int Dim>
void forget_bins(Patch<Dim>& patch) {
  patch.bins.clear();
  patch.first_bin.assign(patch.topology.cells.size(), -1);
  patch.particles = Particles<Dim>(patch.particles.layout());
  patch.added_bins = 0;
  patch.moving = false;
  find_active_nodes(patch);
}

template <int Dim>
void sort_if_scattered(Patch<Dim>& patch) {
  if (patch.count == 0) {
    if (!patch.bins.empty()) forget_bins(patch);
    return;
  }
  const auto sorted_bins = static_cast<int>(patch.bins.size()) - patch.added_bins;
  if (patch.added_bins <= 1 + sorted_bins / bins_per_added_bin) return;
  patch.moving = true;
  sort_bins(patch);
}

template <int Dim>
void join_bins(Patch<Dim>& patch) {
  const auto shares_its_cell = [&](const ParticleBin& added) {
    int all = 0;
    for (Local b = patch.first_bin[static_cast<std::size_t>(added.cell)]; b >= 0;
         b = patch.bins[static_cast<std::size_t>(b)].next) {
      const ParticleBin& bin = patch.bins[static_cast<std::size_t>(b)];
      all += bin.material == added.material && bin.begin < bin.end;
    }
    return all > 1;
  };
  const auto added = std::span(patch.bins).last(static_cast<std::size_t>(patch.added_bins));
  if (std::none_of(added.begin(), added.end(), shares_its_cell)) return;
  patch.moving = true;
  sort_bins(patch);
}

template <int Dim>
void check_finite(Patch<Dim>& patch) {
  const auto v = patch.particles.template rows<Dim>(Column::v);
  const auto stress = patch.particles.template rows<stress_components<Dim>>(Column::stress);
  Pack zero(0.0);  // stays zero as long as everything is finite
  for (const ParticleBin& bin : patch.bins)
    for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
      for (const double* row : v) zero += 0.0 * load_first<Pack>(row + p, bin.end - p);
      for (const double* row : stress) zero += 0.0 * load_first<Pack>(row + p, bin.end - p);
    }
  if (reduce(zero) == 0.0) return;
  patch.for_each_particle([&](Local p) {
    double sum = 0.0;  // not finite if one of its terms is not
    for (const double* row : v) sum += row[p];
    for (const double* row : stress) sum += row[p];
    if (!std::isfinite(sum))
      record_fault(patch, ParticleFault::Kind::not_finite, patch.particles, p);
  });
}

namespace {

/// Squares of the inverse of the time step limit of particles [1/s^2]: (c + |v|)^2 of waves takes
/// one square root.
template <int Dim>
class LimitRate {
 public:
  LimitRate(const Patch<Dim>& patch, const Model<Dim>& model)
      : patch_(patch),
        model_(model),
        V_(patch.particles.row(Column::volume)),
        m_(patch.particles.row(Column::mass)),
        v_(patch.particles.template rows<Dim>(Column::v)) {
    if (patch.particles.layout().has(Column::liquid_v))
      liquid_v_ = patch.particles.template rows<Dim>(Column::liquid_v);
  }

  void enter(const ParticleBin& bin) {
    if (bin.material != material_) {
      const Law& law = model_.materials[bin.material].law;
      material_ = bin.material;
      modulus_ = wave_modulus(law);
      viscosity_ = viscosity(law);
      const auto& liquid = model_.materials[bin.material].liquid;
      liquid_ = liquid ? &*liquid : nullptr;
      // In a projection no liquid has waves: a fluid has none, and soil has those of its skeleton.
      if (is_projection(model_.analysis) && !liquid_) modulus_ = 0;
    }
    const double h = patch_.cell_size[static_cast<std::size_t>(bin.cell)];
    per_area_ = 1.0 / (h * h);
    diffusion_ = 2.0 * Dim * viscosity_ * per_area_;
  }
  /// Those of the particles from p on. The particles belong to the bin entered.
  template <class Real>
  Real at(Local p) const {
    const Real specific_volume = load<Real>(V_ + p) / load<Real>(m_ + p);
    Real speed2(0.0);
    for (const double* row : v_) speed2 += load<Real>(row + p) * load<Real>(row + p);
    Real c2 = modulus_ * specific_volume, diffusion = diffusion_ * specific_volume;
    if (liquid_) at_liquid(p, specific_volume, c2, speed2, diffusion);
    const Real waves2 = (c2 + speed2 + 2.0 * lahar::sqrt(Real(c2 * speed2))) * per_area_;
    return max(waves2, diffusion * diffusion);
  }

 private:
  /// With a liquid in the pores. Drag that is explicit in time is a diffusion of its own.
  template <class Real>
  [[gnu::noinline]] void at_liquid(Local p, const Real& specific_volume, Real& c2, Real& speed2,
                                   Real& diffusion) const {
    if (!is_projection(model_.analysis))
      c2 = wave_speed_squared(*liquid_, modulus_, specific_volume);
    Real liquid2(0.0);
    for (const double* row : liquid_v_) liquid2 += load<Real>(row + p) * load<Real>(row + p);
    speed2 = max(speed2, liquid2);
    if (!model_.analysis.explicit_drag) return;
    const Pores pores(*liquid_);
    const Real m = load<Real>(m_ + p), V = load<Real>(V_ + p);
    const auto& resistance = liquid_->resistance;
    const double most = *std::max_element(resistance.begin(), resistance.begin() + Dim);
    const Real per_mass = Real(1.0) / m + Real(1.0) / pores.liquid_mass(m, V);
    diffusion = max(diffusion, Real(0.5 * most * (pores.drag_volume(m, V) * per_mass)));
  }

  const Patch<Dim>& patch_;
  const Model<Dim>& model_;
  const double *V_, *m_;
  std::array<const double*, Dim> v_, liquid_v_{};
  const PoreLiquid* liquid_ = nullptr;
  int material_ = -1;
  double modulus_ = 0, viscosity_ = 0, per_area_ = 0, diffusion_ = 0;
};

}  // namespace

template <int Dim>
double time_step_limit(const Patch<Dim>& patch, const Model<Dim>& model,
                       std::span<const ParticleBin> bins, Local* limiting) {
  Pack rates(0.0);
  LimitRate<Dim> rate(patch, model);
  for (const ParticleBin& bin : bins) {
    rate.enter(bin);
    for (Local p = bin.begin; p < bin.end; p += lanes<Pack>)
      rates = max(rates, first_lanes(rate.template at<Pack>(p), bin.end - p));
  }
  double largest = 0.0;
  for (int lane = 0; lane < lanes<Pack>; ++lane) largest = std::max(largest, rates[lane]);
  if (limiting) {
    double most = -1.0;
    for (const ParticleBin& bin : bins) {
      rate.enter(bin);
      for (Local p = bin.begin; p < bin.end; ++p)
        if (const double r = rate.template at<Scalar>(p)[0]; r > most) most = r, *limiting = p;
    }
  }
  return 1.0 / std::sqrt(largest);
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template void clear_outboxes<Dim>(Patch<Dim>&);                                            \
  template void locate<Dim, KernelReal>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template void place_movers<Dim>(Patch<Dim>&, const StepContext<Dim>&);                     \
  template void receive<Dim>(Patch<Dim>&);                                                   \
  template void place_new<Dim>(Patch<Dim>&, const Particles<Dim>&, Local);                   \
  template void sort_if_scattered<Dim>(Patch<Dim>&);                                         \
  template void join_bins<Dim>(Patch<Dim>&);                                                 \
  template void check_finite<Dim>(Patch<Dim>&);                                              \
  template double time_step_limit<Dim>(const Patch<Dim>&, const Model<Dim>&,                 \
                                       std::span<const ParticleBin>, Local*);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)

}  // namespace lahar
