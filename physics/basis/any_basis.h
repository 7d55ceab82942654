/// \file Bins with the functions of their cells as a basis, whatever these are: for kernels that
/// few particles need.
#pragma once

#include "physics/basis/basis.h"
#include "physics/basis/linear_basis.h"
#include "physics/basis/support.h"

namespace lahar {

/// Call body(basis, bin, nodes) for every bin that is not empty and for which takes(bin) is true,
/// with the local nodes of the basis.
template <int Dim, class Takes, class Body>
void for_each_bin_with_basis(const Patch<Dim>& patch, ParticleBins bins, Takes takes, Body body) {
  const auto with = [&](const auto& cells, auto nodes_of) {
    for (const ParticleBin& bin : bins)
      if (bin.begin < bin.end && takes(bin))
        body(cells[bin.cell], bin, nodes_of(static_cast<std::size_t>(bin.cell)).data());
  };
  if (general::is(patch)) {
    with_bases(patch, [&](const auto& cells) {
      with(cells, [&](std::size_t cell) { return patch.topology.support(cell); });
    });
    return;
  }
  const auto corners_of = [&](std::size_t cell) {
    return std::span<const Local>(patch.topology.corner_nodes[cell]);
  };
  if (patch.cartesian)
    with(LinearCells<Dim, CartesianCells<Dim>>(patch), corners_of);
  else
    with(LinearCells<Dim, IsoparametricCells<Dim>>(patch), corners_of);
}

/// Call take(p, n, value) for packs of the particles of these bins, n of them from p on, with the
/// nodal field `nodal` there.
template <class Real, int Dim, class Takes, class Take>
void interpolate_bins(const Patch<Dim>& patch, ParticleBins bins, const double* nodal, Takes takes,
                      Take take) {
  for_each_bin_with_basis(patch, bins, takes,
                          [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
                            constexpr int n_nodes = std::decay_t<decltype(basis)>::nodes;
                            for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
                              Real N[n_nodes], value(0.0);
                              basis.functions(p, N);
                              LAHAR_UNROLL
                              for (int i = 0; i < n_nodes; ++i)
                                value = multiply_add(value, N[i], &nodal[nodes[i]]);
                              take(p, bin.end - p, value);
                            }
                          });
}

}  // namespace lahar
