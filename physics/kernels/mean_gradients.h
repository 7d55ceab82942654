/// \file Gradients at particles of implicit steps, and their mean over a cell (B-bar).
#pragma once

#include "physics/basis/any_basis.h"

namespace lahar {

/// g[d][i] = dN_i/dx_d at a particle [1/m].
template <int Dim, class Basis>
void gradients_at(const Basis& basis, Local p, double (&g)[Dim][Basis::nodes]) {
  Scalar dN[Dim][Basis::nodes];
  basis.gradients(p, dN);
  for (int d = 0; d < Dim; ++d)
    for (int i = 0; i < Basis::nodes; ++i) g[d][i] = dN[d][i][0];
}

/// The mean over the particles of a bin of gradients at them, weighted by their volumes V.
/// `gradients(p, g)` finds those of particle p.
template <int Dim, int Nodes, class Gradients>
void mean_gradients(const ParticleBin& bin, const double* V, double (&mean)[Dim][Nodes],
                    Gradients gradients) {
  for (auto& row : mean) std::fill_n(row, Nodes, 0.0);
  double volume = 0;
  for (Local p = bin.begin; p < bin.end; ++p) {
    double g[Dim][Nodes];
    gradients(p, g);
    for (int d = 0; d < Dim; ++d)
      for (int i = 0; i < Nodes; ++i) mean[d][i] += V[p] * g[d][i];
    volume += V[p];
  }
  for (auto& row : mean)
    for (double& value : row) value /= volume;
}

/// That of gradients_at().
template <int Dim, class Basis>
void mean_gradients(const Basis& basis, const ParticleBin& bin, const double* V,
                    double (&mean)[Dim][Basis::nodes]) {
  mean_gradients(bin, V, mean,
                 [&](Local p, double(&g)[Dim][Basis::nodes]) { gradients_at<Dim>(basis, p, g); });
}

/// H[a][b] = sum_i d_ia g_b,i of a nodal field d. With `mean` (optional) its trace is that of the
/// mean gradients: the difference is shared by all axes (Hughes 1980).
template <int Dim, int Nodes>
void gradient_of(const double (&g)[Dim][Nodes], const double (*mean)[Nodes], const double* d,
                 const Local* nodes, double (&H)[Dim][Dim]) {
  for (auto& row : H) std::fill_n(row, Dim, 0.0);
  double more = 0;
  for (int i = 0; i < Nodes; ++i) {
    const double* at = d + static_cast<std::ptrdiff_t>(nodes[i]) * node_width;
    for (int a = 0; a < Dim; ++a) {
      for (int b = 0; b < Dim; ++b) H[a][b] += at[a] * g[b][i];
      if (mean) more += at[a] * (mean[a][i] - g[a][i]);
    }
  }
  for (int a = 0; a < Dim; ++a) H[a][a] += more / Dim;
}

}  // namespace lahar
