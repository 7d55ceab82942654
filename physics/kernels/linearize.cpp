/// \file The linear system of an implicit step: what particles give to it.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "physics/basis/any_basis.h"
#include "physics/kernels/contact_push.h"
#include "physics/kernels/implicit.h"
#include "physics/kernels/implicit_walls.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/law_fault.h"
#include "physics/kernels/matrix_pattern.h"
#include "physics/kernels/mean_gradients.h"
#include "physics/kernels/particle_forces.h"
#include "physics/kernels/rigid_contact.h"
#include "physics/kernels/ring.h"
#include "physics/kernels/stress_of_step.h"
#include "physics/kernels/stress_update.h"
#include "physics/materials/tangent_across.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_place.h"

namespace lahar {

namespace {

/// What the particles of one cell give to its nodes; rows and columns Dim i + a.
template <int Dim, int Nodes>
struct CellSystem {
  static constexpr int n = Dim * Dim, size = Nodes * Dim;
  double force[size];
  double matrix[size][size];

  void clear() {
    std::fill_n(force, size, 0.0);
    for (auto& row : matrix) std::fill_n(row, size, 0.0);
  }

  /// V P and V A of a particle with gradients g[d][i] of functions. `mean` (optional) are those of
  /// the cell, from which the volumetric strain is taken: H_ab = d_ia g_ib + d_ic (mean - g)_ic
  /// delta_ab / Dim.
  void add(const StressOfStep<Dim>& of, double V, const double (&g)[Dim][Nodes],
           const double (*mean)[Nodes]) {
    double T[n][size];  // derivatives of V P
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < Nodes; ++j)
        for (int c = 0; c < Dim; ++c) {
          double sum = 0;
          for (int d = 0; d < Dim; ++d) sum += of.A[k][Dim * c + d] * g[d][j];
          T[k][Dim * j + c] = V * sum;
        }
    if (mean) add_mean_strain(of, V, g, mean, T);
    for (int i = 0; i < Nodes; ++i) {
      bool any = false;  // functions of many nodes are zero at most particles
      for (int b = 0; b < Dim; ++b) any |= g[b][i] != 0.0;
      if (!any) continue;
      for (int a = 0; a < Dim; ++a)
        for (int b = 0; b < Dim; ++b) {
          force[Dim * i + a] += V * of.P[Dim * a + b] * g[b][i];
          add_row(g[b][i], T[Dim * a + b], matrix[Dim * i + a]);
        }
    }
    if (mean) add_mean_stress(of, V, g, mean, T);
  }

  /// The same of a ring, whose fifth component is H_across = sum_i u_i0 h_i (with h_i = N_i / r).
  /// `more`: what the gradients of the mean trace have beside the particle's own, zero without
  /// B-bar. Each normal component gets a third of it.
  void add_ring(const StressAcross& of, double V, const double (&g)[Dim][Nodes],
                const double (&h)[Nodes], const double (&more)[Dim][Nodes]) {
    constexpr int all = n + 1, normal[3] = {0, Dim + 1, n};
    double strain[all][size] = {}, T[all][size];  // derivatives of H and V P
    for (int j = 0; j < Nodes; ++j)
      for (int c = 0; c < Dim; ++c) {
        for (int d = 0; d < Dim; ++d) strain[Dim * c + d][Dim * j + c] = g[d][j];
        if (c == 0) strain[n][Dim * j] = h[j];
        for (const int k : normal) strain[k][Dim * j + c] += more[c][j] / 3;
      }
    const auto by = [&](int k, int l) {
      return k < n && l < n ? of.A[k][l] : k < n ? of.by_across[k] : l < n ? of.across[l] : of.own;
    };
    for (int k = 0; k < all; ++k) {
      std::fill_n(T[k], size, 0.0);
      for (int l = 0; l < all; ++l) add_row(V * by(k, l), strain[l], T[k]);
    }
    for (int k = 0; k < all; ++k) {
      add_row(V * (k < n ? of.P[k] : of.P_across), strain[k], force);
      for (int i = 0; i < size; ++i)
        if (strain[k][i] != 0.0) add_row(strain[k][i], T[k], matrix[i]);
    }
  }

  /// A force on a particle with these functions, and its stiffness.
  void add_contact(const ImplicitContact<Dim>& contact, const double (&N)[Nodes]) {
    for (int i = 0; i < Nodes; ++i) {
      if (N[i] == 0.0) continue;
      for (int a = 0; a < Dim; ++a) {
        force[Dim * i + a] -= N[i] * contact.force[a];
        for (int j = 0; j < Nodes; ++j)
          for (int b = 0; b < Dim; ++b)
            matrix[Dim * i + a][Dim * j + b] += N[i] * N[j] * contact.stiffness(a, b);
      }
    }
  }

  /// A force on node i.
  void add_force(int i, const Vec<Dim>& f) {
    for (int a = 0; a < Dim; ++a) force[Dim * i + a] -= f[a];
  }

  /// A force on node i that falls by `k` [N/m] with the motion along n of a particle with these
  /// functions.
  void add_stiffness(int i, const Vec<Dim>& k, const double (&N)[Nodes], const Vec<Dim>& n) {
    for (int a = 0; a < Dim; ++a)
      for (int j = 0; j < Nodes; ++j)
        for (int b = 0; b < Dim; ++b) matrix[Dim * i + a][Dim * j + b] += k[a] * N[j] * n[b];
  }

  /// A stiffness `k` [N m] against all gradients of displacement, without a force.
  void add_gradient_stiffness(double k, const double (&g)[Dim][Nodes]) {
    for (int i = 0; i < Nodes; ++i)
      for (int j = 0; j < Nodes; ++j) {
        double sum = 0;
        for (int d = 0; d < Dim; ++d) sum += g[d][i] * g[d][j];
        for (int a = 0; a < Dim; ++a) matrix[Dim * i + a][Dim * j + a] += k * sum;
      }
  }

  /// A stiffness `k` [N/m] against what displacements `d` in the step have beside an affine field,
  /// for the nodes that the particles of the cell reach (`used`; `x` are their places). Where few
  /// particles reach many nodes, there are motions that move particles and do not strain them, with
  /// nothing else to hold them under load.
  void add_least_stiffness(double k, const std::array<bool, Nodes>& used,
                           const std::array<Vec<Dim>, Nodes>& x, const double* d,
                           const Local* nodes) {
    const auto fields = affine_fields(used, x);
    for (std::size_t i = 0; i < Nodes; ++i) {
      if (!used[i]) continue;
      for (std::size_t j = 0; j < Nodes; ++j) {
        if (!used[j]) continue;
        double beside = i == j ? k : 0.0;
        for (const auto& field : fields) beside -= k * field[i] * field[j];
        const double* at = d + static_cast<std::ptrdiff_t>(nodes[j]) * node_width;
        for (std::size_t a = 0; a < Dim; ++a) {
          force[Dim * i + a] += beside * at[a];
          matrix[Dim * i + a][Dim * j + a] += beside;
        }
      }
    }
  }

 private:
  /// Orthonormal fields that span 1 and x at the used nodes; zero where these lie in one line.
  static std::array<std::array<double, Nodes>, Dim + 1> affine_fields(
      const std::array<bool, Nodes>& used, const std::array<Vec<Dim>, Nodes>& x) {
    constexpr double small = 1e-6;  // of a field's size before
    std::array<std::array<double, Nodes>, Dim + 1> fields{};
    for (std::size_t f = 0; f <= Dim; ++f) {
      auto& field = fields[f];
      for (std::size_t i = 0; i < Nodes; ++i)
        if (used[i]) field[i] = f == 0 ? 1.0 : x[i][static_cast<int>(f) - 1];
      const double before = std::sqrt(product(field, field));
      for (int twice = 0; twice < 2; ++twice)
        for (std::size_t g = 0; g < f; ++g) {
          const double part = product(field, fields[g]);
          for (std::size_t i = 0; i < Nodes; ++i) field[i] -= part * fields[g][i];
        }
      const double size = std::sqrt(product(field, field));
      const double scale = size > small * before ? 1.0 / size : 0.0;
      for (double& value : field) value *= scale;
    }
    return fields;
  }
  static double product(const std::array<double, Nodes>& a, const std::array<double, Nodes>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < Nodes; ++i) sum += a[i] * b[i];
    return sum;
  }

  LAHAR_INLINE static void add_row(double factor, const double (&from)[size], double (&to)[size]) {
    for (int k = 0; k < size; ++k) to[k] += factor * from[k];
  }

  /// The part of dH that comes from the mean gradients.
  static void add_mean_strain(const StressOfStep<Dim>& of, double V, const double (&g)[Dim][Nodes],
                              const double (*mean)[Nodes], double (&T)[n][size]) {
    for (int k = 0; k < n; ++k) {
      double trace = 0;
      for (int e = 0; e < Dim; ++e) trace += of.A[k][(Dim + 1) * e] * V / Dim;
      for (int j = 0; j < Nodes; ++j)
        for (int c = 0; c < Dim; ++c) T[k][Dim * j + c] += trace * (mean[c][j] - g[c][j]);
    }
  }

  /// The part of the force that works with it.
  void add_mean_stress(const StressOfStep<Dim>& of, double V, const double (&g)[Dim][Nodes],
                       const double (*mean)[Nodes], const double (&T)[n][size]) {
    double pressure = 0, change[size] = {};
    for (int e = 0; e < Dim; ++e) {
      pressure += of.P[(Dim + 1) * e] * V / Dim;
      add_row(1.0 / Dim, T[(Dim + 1) * e], change);
    }
    for (int i = 0; i < Nodes; ++i)
      for (int a = 0; a < Dim; ++a) {
        force[Dim * i + a] += pressure * (mean[a][i] - g[a][i]);
        add_row(mean[a][i] - g[a][i], change, matrix[Dim * i + a]);
      }
  }
};

/// Add what a cell gives to the blocks of a patch.
template <int Dim, int Nodes>
void add_to_system(NodalSystem<Dim>& system, const CellSystem<Dim, Nodes>& cell,
                   const Local* nodes) {
  for_each_block<Nodes>(system, nodes, [&](int i, int j, std::size_t k) {
    double* block = &system.blocks[static_cast<std::size_t>(system.block_size) * k];
    for (int a = 0; a < Dim; ++a)
      for (int c = 0; c < Dim; ++c) block[Dim * a + c] += cell.matrix[Dim * i + a][Dim * j + c];
  });
}

/// Stress and state of particle p at the beginning of the step.
template <int Dim>
struct Beginning {
  double stress[stress_components<Dim>], state[most_state] = {};

  Beginning(const Patch<Dim>& patch, const Law& law, Local p) {
    for (int k = 0; k < stress_components<Dim>; ++k)
      stress[k] = patch.particles.row(Column::stress, k)[p];
    const auto variables = state_variables(law);
    for (std::size_t k = 0; k < variables.size(); ++k)
      if (!variables[k].of_stress)
        state[k] = patch.particles.row(Column::state, static_cast<int>(k))[p];
  }
};

/// R_i of particle p of an axisymmetric model (ring.h).
template <class Basis>
void hoop_gradients(const Basis& basis, const Patch<2>& patch, Local p, const Local* nodes,
                    double (&h)[Basis::nodes]) {
  Scalar R[Basis::nodes];
  const double r = ring_functions<Scalar>(basis, patch, p, 1, nodes, R)[0];
  for (int i = 0; i < Basis::nodes; ++i) h[i] = R[i][0] / r;
}

/// The gradients of the trace at particle p of a ring [1/m]: those of dv_r/dr + v_r/r and dv_z/dz.
template <class Basis>
void trace_gradients(const Basis& basis, const Patch<2>& patch, Local p, const Local* nodes,
                     double (&t)[2][Basis::nodes]) {
  double h[Basis::nodes];
  gradients_at<2>(basis, p, t);
  hoop_gradients(basis, patch, p, nodes, h);
  for (int i = 0; i < Basis::nodes; ++i) t[0][i] += h[i];
}

/// The larger of the stiffnesses in simple and in pure shear [Pa]: one of them stays where a law
/// flows. It is that of bending, which a bulk modulus would hide.
template <int Dim>
double stiffness_in_shear(const StressOfStep<Dim>& of) {
  return std::max(of.A[1][1], 0.5 * (of.A[0][0] - of.A[0][Dim + 1]));
}

/// What a particle has of stiffness.
struct ParticleStiffness {
  double in_shear;  ///< [Pa] stiffness_in_shear()
  bool torn;        ///< it has next to none
};
template <int Dim>
ParticleStiffness stiffness_of(const StressOfStep<Dim>& of, double wave_modulus) {
  constexpr double least = 1e-3;
  double largest = 0;
  for (const auto& row : of.A)
    for (const double a : row) largest = std::max(largest, std::abs(a));
  return {stiffness_in_shear(of), largest < least * wave_modulus};
}

/// A cell in which all is torn: nodes that have no other would have no row, and could not even fall
/// onto what holds them. Its share of the matrix, not of forces, is a ten thousandth of the
/// stiffness of waves. Where anything else holds a node this would only keep Newton's method from
/// converging.
template <int Dim, class Cell, class Basis>
void hold_torn(Cell& cell, const Basis& basis, const Patch<Dim>& patch, const ParticleBin& bin,
               double wave_modulus) {
  constexpr double share = 1e-4;
  const double* V = patch.particles.row(Column::volume);
  for (Local p = bin.begin; p < bin.end; ++p) {
    double g[Dim][Basis::nodes];
    gradients_at<Dim>(basis, p, g);
    cell.add_gradient_stiffness(share * wave_modulus * V[p], g);
  }
}

/// Add what particle p of a bin gives after the increment H, with the gradients g of functions.
/// `mean` (optional): the mean of trace_gradients(). Returns its stiffness, or nothing where its
/// law has no stress.
template <class Basis, class Cell>
std::optional<ParticleStiffness> add_particle_across(Cell& cell, const Basis& basis,
                                                     Patch<2>& patch, const StepContext<2>& step,
                                                     const ParticleBin& bin, Local p,
                                                     const Local* nodes, const double (&H)[2][2],
                                                     const double (&g)[2][Basis::nodes],
                                                     const double (*mean)[Basis::nodes]) {
  const Analysis& analysis = step.model->analysis;
  const Law& law = step.model->materials[bin.material].law;
  const Beginning<2> before(patch, law, p);
  const bool ring = analysis.plane == Plane::axisymmetric;
  double all[3][3] = {{H[0][0], H[0][1], 0}, {H[1][0], H[1][1], 0}, {}}, h[Basis::nodes] = {};
  double more[2][Basis::nodes] = {}, volumetric = 0;  // what the mean trace has beside the own one
  if (ring) {
    hoop_gradients(basis, patch, p, nodes, h);
    const double* d = patch.implicit.increment.data();
    for (int i = 0; i < Basis::nodes; ++i) {
      const double* u = d + static_cast<std::ptrdiff_t>(nodes[i]) * node_width;
      all[2][2] += h[i] * u[0];
      if (!mean) continue;
      more[0][i] = mean[0][i] - g[0][i] - h[i];
      more[1][i] = mean[1][i] - g[1][i];
      volumetric += more[0][i] * u[0] + more[1][i] * u[1];
    }
    for (int k = 0; k < 3; ++k) all[k][k] += volumetric / 3;
  }
  StressChange<3> change;
  if (stress_change_across(law, !ring, all, step.dt, kinematics_of(analysis), before.stress,
                           before.state, change)
          .failed)
    return std::nullopt;
  StressAcross of_step(all, change, analysis.as_cbgeo);
  if (!ring) of_step.condense(wave_modulus(law));
  const double V = patch.particles.row(Column::volume)[p];
  patch.system.symmetric = patch.system.symmetric && of_step.is_symmetric();
  if (ring)
    cell.add_ring(of_step, V, g, h, more);
  else
    cell.add(of_step, V, g, nullptr);
  return stiffness_of(of_step, wave_modulus(law));
}

/// The same of models that do not deform across a plane. `mean` as in CellSystem::add().
template <int Dim, class Cell, int Nodes>
std::optional<ParticleStiffness> add_particle(Cell& cell, Patch<Dim>& patch,
                                              const StepContext<Dim>& step, const ParticleBin& bin,
                                              Local p, const double (&H)[Dim][Dim],
                                              const double (&g)[Dim][Nodes],
                                              const double (*mean)[Nodes]) {
  const Analysis& analysis = step.model->analysis;
  const Law& law = step.model->materials[bin.material].law;
  const Beginning<Dim> before(patch, law, p);
  StressChange<Dim> change;
  if (stress_change<Dim>(law, H, step.dt, kinematics_of(analysis), before.stress, before.state,
                         change)
          .failed)
    return std::nullopt;
  StressOfStep<Dim> of_step(H, change, analysis.as_cbgeo);
  patch.system.symmetric = patch.system.symmetric && of_step.is_symmetric();
  cell.add(of_step, patch.particles.row(Column::volume)[p], g, mean);
  return stiffness_of(of_step, wave_modulus(law));
}

/// What takes the pushes on a particle to the end of its material.
template <int Dim, class Cell, class Basis>
void add_couples(Cell& cell, const Basis& basis, Patch<Dim>& patch, Local p,
                 const ImplicitContact<Dim>& contact, const double (&N)[Basis::nodes]) {
  const double now = contact.share_of_now;
  if (now < 1.0) {
    const Particles<Dim>& particles = patch.particles;
    const auto rows = particles.template rows<contact_components<Dim>>(Column::contact_couple);
    give_couple<Dim>(basis, p, contact_force<Dim>(particles, p), contact_couple<Dim>(rows, p),
                     particles.row(Column::contact_extent)[p], [&](int i, const Vec<Dim>& f) {
                       cell.add_force(i, Vec<Dim>((1.0 - now) * f));
                     });
  }
  for (const auto& push : contact.pushes) {
    if (!(push.force > 0.0)) continue;
    patch.system.symmetric = false;  // it goes with the motion of the centre
    give_shift<Dim>(basis, p, {push.n, push.arm, push.extent}, [&](int i, const Vec<Dim>& w) {
      cell.add_force(i, Vec<Dim>(now * push.force * w));
      cell.add_stiffness(i, Vec<Dim>(now * push.stiffness * w), N, push.n);
    });
  }
}

/// Contact of the particles of a bin with rigid bodies.
template <int Dim, class Cell, class Basis>
void add_contact(Cell& cell, const Basis& basis, Patch<Dim>& patch, const StepContext<Dim>& step,
                 const ParticleBin& bin, const Local* nodes) {
  const double* const fields[1] = {patch.implicit.increment.data()};
  for (Local p = bin.begin; p < bin.end; ++p) {
    Scalar sum[1][Dim], functions[Basis::nodes];
    general::interpolate<Dim, 1, Scalar>(basis, p, fields, nodes, sum);
    Vec<Dim> move;
    for (int d = 0; d < Dim; ++d) move[d] = sum[0][d][0];
    const ImplicitContact<Dim> contact = contact_after(patch, step, bin, p, move);
    if (!contact.touches) continue;
    patch.system.symmetric = patch.system.symmetric && !contact.slides;
    basis.functions(p, functions);
    double N[Basis::nodes];
    for (int i = 0; i < Basis::nodes; ++i) N[i] = functions[i][0];
    cell.add_contact(contact, N);
    add_couples(cell, basis, patch, p, contact, N);
  }
}

}  // namespace

template <int Dim>
void clear_system(Patch<Dim>& patch, const StepContext<Dim>& step) {
  patch.contributes[static_cast<std::size_t>(step.step % 2)] = patch.count > 0;
  patch.unsolved = {};
  patch.system.symmetric = true;
  if (patch.active_nodes.empty()) return;
  // By slot: bins may have free ones, and begin beyond the number of particles.
  patch.implicit.support.resize(static_cast<std::size_t>(patch.particles.size()));
  close_walls(patch, step);
  patch.system.blocks.assign(patch.system.column.size() * NodalSystem<Dim>::block_size, 0.0);
  clear_sums(patch, step, NodeSum::residual);
}

/// Share of a cell's stiffness, in steps without inertia (CellSystem::add_least_stiffness()).
constexpr double least_share = 1e-4;

template <int Dim>
void linearize(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  double* sums = patch.own_sums(NodeSum::residual, step.step);
  const double* V = patch.particles.row(Column::volume);
  const bool as_cbgeo = step.model->analysis.as_cbgeo;
  const bool supports = step.model->analysis.implicit.quasi_static && !as_cbgeo;
  for_each_bin_with_basis(
      patch, bins, [](const ParticleBin&) { return true; },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        constexpr int n = std::decay_t<decltype(basis)>::nodes;
        static thread_local CellSystem<Dim, n> cell;
        cell.clear();
        std::array<bool, n> used{};
        double modulus = 0;
        bool torn = bin.begin < bin.end;
        double mean[Dim][n] = {};
        const bool takes_mean = step.model->analysis.mean_volume;
        const bool ring = Dim == 2 && step.model->analysis.plane == Plane::axisymmetric;
        if (takes_mean && !ring) mean_gradients<Dim>(basis, bin, V, mean);
        if constexpr (Dim == 2)
          if (takes_mean && ring)
            mean_gradients(bin, V, mean, [&](Local p, double(&t)[Dim][n]) {
              trace_gradients(basis, patch, p, nodes, t);
            });
        for (Local p = bin.begin; p < bin.end; ++p) {
          double g[Dim][n], H[Dim][Dim];
          gradients_at<Dim>(basis, p, g);
          gradient_of<Dim>(g, takes_mean && !ring ? mean : nullptr, patch.implicit.increment.data(),
                           nodes, H);
          std::optional<ParticleStiffness> stiffness;
          if constexpr (Dim == 2) {
            if (deforms_across(step.model->analysis))
              stiffness = add_particle_across(cell, basis, patch, step, bin, p, nodes, H, g,
                                              takes_mean ? mean : nullptr);
            else
              stiffness =
                  add_particle(cell, patch, step, bin, p, H, g, takes_mean ? mean : nullptr);
          } else {
            stiffness = add_particle(cell, patch, step, bin, p, H, g, takes_mean ? mean : nullptr);
          }
          if (!stiffness) {
            note_law_fault(patch.unsolved, patch, bin, p, [&](std::size_t k) {
              return patch.particles.row(Column::stress, static_cast<int>(k))[p];
            });
            continue;
          }
          modulus = std::max(modulus, stiffness->in_shear);
          torn = torn && stiffness->torn;
          for (std::size_t i = 0; i < n; ++i)
            for (std::size_t d = 0; d < Dim; ++d) used[i] = used[i] || g[d][i] != 0.0;
        }
        if (meets_bodies(patch, step, bin)) add_contact(cell, basis, patch, step, bin, nodes);
        if (torn && !as_cbgeo)
          hold_torn<Dim>(cell, basis, patch, bin,
                         wave_modulus(step.model->materials[bin.material].law));
        if (supports) {
          std::array<Vec<Dim>, n> x;
          const Vec<Dim> origin = place_of(patch, *step.model->mesh, nodes[0]);
          for (std::size_t i = 0; i < n; ++i)
            x[i] = place_of(patch, *step.model->mesh, nodes[i]) - origin;
          // Where a law begins to yield the stiffness jumps, and the forces with it: between two of
          // them Newton's method could go to and fro. So ImplicitSolver keeps it after a while.
          double& support = patch.implicit.support[static_cast<std::size_t>(bin.begin)];
          if (!patch.implicit.keeps_support) support = modulus;
          const double h = patch.cell_size[static_cast<std::size_t>(bin.cell)];
          const double depth =
              depth_at(step.model->analysis, patch.particles.row(Column::x)[bin.begin]);
          cell.add_least_stiffness(least_share * support * depth * std::pow(h, Dim - 2), used, x,
                                   patch.implicit.increment.data(), nodes);
        }
        for (int i = 0; i < n; ++i)
          for (int d = 0; d < Dim; ++d)
            sums[static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride + d] -= cell.force[Dim * i + d];
        add_to_system(patch.system, cell, nodes);
        if (has_particle_forces(patch, bin, *step.model))
          add_particle_forces<Dim>(basis, bin, nodes, sums, [&](Local p) {
            return applied_force_on(patch.particles, p, step);
          });
      });
}

#define LAHAR_INSTANTIATE(Dim)                                           \
  template void clear_system<Dim>(Patch<Dim>&, const StepContext<Dim>&); \
  template void linearize<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
