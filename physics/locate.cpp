/// Which cell a particle is in after it moved, and the exchange of particles between patches.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "physics/cell_polynomial.h"
#include "physics/inverse_mapping.h"
#include "physics/kernels.h"
#include "physics/law.h"

namespace lahar {

namespace {

template <int Dim>
Vec<Dim> position(const Particles<Dim>& particles, Local p) {
  Vec<Dim> x;
  for (int d = 0; d < Dim; ++d) x[d] = particles.row(Column::x, d)[p];
  return x;
}

/// Natural coordinates in the present cell; particles outside of it are appended to `outside`.
/// The arithmetic is that of Mesh::natural_coordinates, so that both always agree.
template <int Dim, class Real>
void locate_run_cartesian(Patch<Dim>& patch, const Run& run, std::vector<Local>& outside) {
  Particles<Dim>& particles = patch.particles;
  const auto box = patch.box[static_cast<std::size_t>(run.cell)];
  const auto x = particles.template rows<Dim>(Column::x);
  const auto natural = particles.template rows<Dim>(Column::xi);
  for (Local p = run.begin; p < run.end; p += lanes<Real>) {
    const Local n = run.end - p;
    unsigned out = 0;
    for (int d = 0; d < Dim; ++d) {
      const Real xi = 2.0 * (load<Real>(x[d] + p) - box[d]) / box[Dim + d];
      out |= lahar::outside(xi, 1.0, n);
      store_first(clamp(xi, xi_max), natural[d] + p, n);
    }
    for (; out != 0; out &= out - 1) outside.push_back(p + std::countr_zero(out));
  }
}

/// Particles of the pack from p on whose bit is set, by the mesh's own map: it decides on faces,
/// and where the pack's iteration fails.
template <int Dim>
[[gnu::noinline]] void locate_singly(Patch<Dim>& patch, const CellGeometry<Dim>& cell, Local p,
                                     unsigned bits, std::vector<Local>& outside) {
  for (; bits != 0; bits &= bits - 1) {
    const Local q = p + std::countr_zero(bits);
    Vec<Dim> xi;
    if (!inverse_map<Dim>(cell, position(patch.particles, q), xi) || !in_closed_cell<Dim>(xi)) {
      outside.push_back(q);
      continue;
    }
    xi = clamp_to_cell<Dim>(xi);
    for (int d = 0; d < Dim; ++d) patch.particles.row(Column::xi, d)[q] = xi[d];
  }
}

/// As locate_run_cartesian. Packs start from the particles' natural coordinates before they moved.
template <int Dim, class Real>
void locate_run_isoparametric(Patch<Dim>& patch, const Run& run, const Mesh<Dim>& mesh,
                              std::vector<Local>& outside) {
  const auto c = static_cast<std::size_t>(run.cell);
  const CellPolynomial<Dim> cell(patch.node_position.data(), patch.topology.corner_nodes[c]);
  const auto x = patch.particles.template rows<Dim>(Column::x);
  const auto natural = patch.particles.template rows<Dim>(Column::xi);
  for (Local p = run.begin; p < run.end; p += lanes<Real>) {
    const Local n = run.end - p;
    Real at[Dim], xi[Dim];
    for (int d = 0; d < Dim; ++d) {
      at[d] = load<Real>(x[d] + p);
      xi[d] = load<Real>(natural[d] + p);
    }
    unsigned singly = inverse_map_pack(cell, at, xi, n);
    for (int d = 0; d < Dim; ++d) {
      singly |= lahar::outside(xi[d], pack_clear_of_faces, n);
      store_first(xi[d], natural[d] + p, n);
    }
    if (singly != 0)
      locate_singly(patch, mesh.geometry(patch.topology.cells[c]), p, singly, outside);
  }
}

template <int Dim>
void set_mark(Patch<Dim>& patch, Mark::Kind kind, Local p) {
  Mark& mark = patch.mark;
  ++mark.count;
  if (mark.kind != Mark::Kind::none) return;
  mark.kind = kind;
  mark.particle = patch.particles.id[static_cast<std::size_t>(p)];
  for (int d = 0; d < Dim; ++d) {
    mark.position[d] = patch.particles.row(Column::x, d)[p];
    mark.velocity[d] = patch.particles.row(Column::v, d)[p];
  }
}

/// Find the new cell of a particle outside its own. Returns true if it left the patch's arrays
/// (sent to a neighbour, or removed).
template <int Dim>
bool relocate(Patch<Dim>& patch, const StepContext<Dim>& step, Local p) {
  Particles<Dim>& particles = patch.particles;
  const Vec<Dim> x = position(particles, p);
  if (!x.allFinite()) {
    set_mark(patch, Mark::Kind::not_finite, p);
    return false;
  }
  const Local old = particles.cell[static_cast<std::size_t>(p)];
  const auto found =
      step.model->mesh->locate_from(x, patch.topology.cells[static_cast<std::size_t>(old)]);
  if (found.cell < 0) {
    if (step.model->analysis.remove_leaving_particles) {
      ++patch.removed;
      return true;
    }
    set_mark(patch, Mark::Kind::left_mesh, p);
    return false;
  }
  for (int d = 0; d < Dim; ++d) particles.row(Column::xi, d)[p] = found.xi[d];
  if (const auto local = patch.local_cell.find(found.cell); local != patch.local_cell.end()) {
    particles.cell[static_cast<std::size_t>(p)] = local->second;
    return false;
  }
  const Index target = step.partition->patch_of(found.cell);
  const auto& neighbours = patch.topology.neighbours;
  const auto at = std::lower_bound(neighbours.begin(), neighbours.end(), target);
  if (at == neighbours.end() || *at != target) {
    set_mark(patch, Mark::Kind::moved_too_far, p);
    return false;
  }
  auto& out = patch.outbox[static_cast<std::size_t>(at - neighbours.begin())];
  out.particles.append(particles, p);
  out.cell.push_back(found.cell);
  return true;
}

}  // namespace

template <int Dim, class Real>
void locate(Patch<Dim>& patch, const StepContext<Dim>& step) {
  for (auto& out : patch.outbox) {
    out.particles.clear();
    out.cell.clear();
  }
  auto& outside = patch.scratch;
  outside.clear();
  for (const Run& run : patch.runs) {
    if (patch.cartesian)
      locate_run_cartesian<Dim, Real>(patch, run, outside);
    else
      locate_run_isoparametric<Dim, Real>(patch, run, *step.model->mesh, outside);
  }
  if (outside.empty()) return;
  patch.runs_valid = false;
  std::size_t left = 0;
  for (const Local p : outside)
    if (relocate(patch, step, p)) outside[left++] = p;
  // From the last to the first, so that the particle that takes a place is never one that left.
  while (left > 0) patch.particles.remove(outside[--left]);
}

namespace {

/// Runs per occupied cell above which particles are sorted again. Small runs waste lanes and
/// repeat the sums' scatter; sorting moves every column once.
constexpr double runs_per_cell = 1.25;

template <int Dim>
void sort_by_cell(Patch<Dim>& patch) {
  const Particles<Dim>& particles = patch.particles;
  const auto n = static_cast<std::size_t>(particles.size());
  std::vector<Local> first(patch.topology.cells.size() + 1, 0), order(n);
  for (const Local cell : particles.cell) ++first[static_cast<std::size_t>(cell) + 1];
  for (std::size_t c = 1; c < first.size(); ++c) first[c] += first[c - 1];
  std::vector<Local> next(first.begin(), first.end() - 1);
  for (std::size_t p = 0; p < n; ++p)
    order[static_cast<std::size_t>(next[static_cast<std::size_t>(particles.cell[p])]++)] =
        static_cast<Local>(p);
  const auto& material = particles.material;
  for (std::size_t c = 0; c + 1 < first.size(); ++c)
    std::stable_sort(order.begin() + first[c], order.begin() + first[c + 1], [&](Local a, Local b) {
      return material[static_cast<std::size_t>(a)] < material[static_cast<std::size_t>(b)];
    });
  patch.particles.permute(order);
}

/// Runs in the present order; returns the number of different (cell, material) pairs.
template <int Dim>
std::size_t build_runs(Patch<Dim>& patch) {
  const Particles<Dim>& particles = patch.particles;
  auto& runs = patch.runs;
  auto& seen = patch.scratch;
  seen.assign(patch.topology.cells.size(), 0);
  runs.clear();
  std::size_t occupied = 0;
  for (Local p = 0; p < particles.size(); ++p) {
    const auto i = static_cast<std::size_t>(p);
    const Local cell = particles.cell[i];
    if (runs.empty() || runs.back().cell != cell || runs.back().material != particles.material[i]) {
      runs.push_back({cell, p, p, particles.material[i], false});
      const Local bit = 1 << (particles.material[i] % 31);
      Local& materials = seen[static_cast<std::size_t>(cell)];
      if (!(materials & bit)) ++occupied;
      materials |= bit;
    }
    runs.back().end = p + 1;
    if (!particles.loads.empty() && particles.loads[i]) runs.back().loaded = true;
  }
  return occupied;
}

}  // namespace

template <int Dim>
void receive(Patch<Dim>& patch) {
  for (const auto* in : patch.inbox) {
    for (Local p = 0; p < in->particles.size(); ++p) {
      patch.particles.append(in->particles, p);
      patch.particles.cell.back() = patch.local_cell.at(in->cell[static_cast<std::size_t>(p)]);
      patch.runs_valid = false;
    }
  }
  if (patch.runs_valid) return;
  const std::size_t occupied = build_runs(patch);
  if (static_cast<double>(patch.runs.size()) > runs_per_cell * static_cast<double>(occupied) + 1) {
    sort_by_cell(patch);
    build_runs(patch);
  }
  patch.runs_valid = true;
}

template <int Dim>
bool update_idle(Patch<Dim>& patch) {
  if (patch.particles.size() > 0) return patch.idle = false;
  if (!patch.idle)
    for (auto& values : patch.partial) std::fill(values.begin(), values.end(), 0.0);
  return patch.idle = true;
}

template <int Dim>
void check_finite(Patch<Dim>& patch) {
  const auto v = patch.particles.template rows<Dim>(Column::v);
  const auto stress = patch.particles.template rows<stress_components<Dim>>(Column::stress);
  const Local n = patch.particles.size();
  Pack zero(0.0);  // stays zero as long as everything is finite
  for (Local p = 0; p < n; p += lanes<Pack>) {
    for (const double* row : v) zero += 0.0 * load_first<Pack>(row + p, n - p);
    for (const double* row : stress) zero += 0.0 * load_first<Pack>(row + p, n - p);
  }
  if (reduce(zero) == 0.0) return;
  for (Local p = 0; p < n; ++p) {
    double sum = 0.0;  // not finite if one of its terms is not
    for (const double* row : v) sum += row[p];
    for (const double* row : stress) sum += row[p];
    if (!std::isfinite(sum)) set_mark(patch, Mark::Kind::not_finite, p);
  }
}

template <int Dim>
double max_speed(const Patch<Dim>& patch) {
  const auto v = patch.particles.template rows<Dim>(Column::v);
  const Local n = patch.particles.size();
  Pack largest(0.0);
  for (Local p = 0; p < n; p += lanes<Pack>) {
    Pack speed2(0.0);
    for (int d = 0; d < Dim; ++d) {
      const Pack component = load_first<Pack>(v[d] + p, n - p);
      speed2 += component * component;
    }
    largest = max(largest, speed2);
  }
  double most = 0.0;
  for (int lane = 0; lane < lanes<Pack>; ++lane) most = std::max(most, largest[lane]);
  return std::sqrt(most);
}

template <int Dim>
double time_step_limit(const Patch<Dim>& patch, const Model<Dim>& model, Local* limiting) {
  const Particles<Dim>& particles = patch.particles;
  const double* V = particles.row(Column::volume);
  const double* m = particles.row(Column::mass);
  double least = std::numeric_limits<double>::infinity();
  for (Local p = 0; p < particles.size(); ++p) {
    const auto i = static_cast<std::size_t>(p);
    const Law& law = model.materials[particles.material[i]].law;
    const double h = patch.cell_size[static_cast<std::size_t>(particles.cell[i])];
    const double density = m[p] / V[p];
    double speed2 = 0.0;
    for (int d = 0; d < Dim; ++d) {
      const double v = particles.row(Column::v, d)[p];
      speed2 += v * v;
    }
    double limit = h / (std::sqrt(wave_modulus(law) / density) + std::sqrt(speed2));
    if (const double mu = viscosity(law); mu > 0.0)
      limit = std::min(limit, h * h * density / (2.0 * Dim * mu));
    if (limit < least) {
      least = limit;
      if (limiting) *limiting = p;
    }
  }
  return least;
}

#define LAHAR_INSTANTIATE(Dim)                                             \
  template void locate<Dim, Pack>(Patch<Dim>&, const StepContext<Dim>&);   \
  template void locate<Dim, Scalar>(Patch<Dim>&, const StepContext<Dim>&); \
  template void receive<Dim>(Patch<Dim>&);                                 \
  template bool update_idle<Dim>(Patch<Dim>&);                             \
  template void check_finite<Dim>(Patch<Dim>&);                            \
  template double max_speed<Dim>(const Patch<Dim>&);                       \
  template double time_step_limit<Dim>(const Patch<Dim>&, const Model<Dim>&, Local*);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)

}  // namespace lahar
