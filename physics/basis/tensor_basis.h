/// \file Bases that are products of functions of one axis, on Cartesian cells: B-splines and GIMP.
#pragma once

#include <array>
#include <cstdint>

#include "physics/basis/axis_functions.h"
#include "physics/basis/cell_map.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Nodes of a tensor basis: four per axis.
template <int Dim>
inline constexpr int tensor_nodes = Dim == 2 ? 16 : 64;

/// Fold the weights of nodes beyond the mesh, of a cell with this PatchTopology::support_border.
template <int Dim, class Real>
LAHAR_INLINE void fold_at_border(unsigned border, Real (&w)[Dim][axis_nodes]) {
  if (border == 0) return;
  LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) {
    // On a mesh of one cell both nodes beyond it follow from the two of the cell.
    const bool first = border >> (2 * d) & 1, last = border >> (2 * d + 1) & 1;
    if (first && last) {
      const Real before = w[d][0], after = w[d][3];
      w[d][1] += 2.0 * before - after;
      w[d][2] += 2.0 * after - before;
      w[d][0] = w[d][3] = Real(0.0);
    } else if (first) {
      fold_first(w[d]);
    } else if (last) {
      fold_last(w[d]);
    }
  }
}

/// What bases of one cell have in common. `Axis` gives the functions of one axis.
template <int Dim, class Axis>
struct TensorProduct {
  static constexpr int per_axis = axis_nodes;
  static constexpr int nodes = tensor_nodes<Dim>;
  static constexpr int per_particle = Axis::per_particle;
  static constexpr bool volume_at_centre = Axis::volume_at_centre;

  CartesianMap<Dim> map;
  unsigned border;  ///< PatchTopology::support_border
  Axis axis;

  template <class Real>
  LAHAR_INLINE void weights(Local p, Real (&w)[Dim][per_axis]) const {
    Real xi[Dim];
    map.natural(p, xi);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) axis.at(d, p, 0.5 + 0.5 * xi[d], w[d]);
    fold_at_border<Dim>(border, w);
  }
  template <class Real>
  LAHAR_INLINE void weights(Local p, Real (&w)[Dim][per_axis], Real (&dw)[Dim][per_axis]) const {
    Real xi[Dim];
    map.natural(p, xi);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      const Real s = 0.5 + 0.5 * xi[d];
      axis.at(d, p, s, w[d]);
      axis.slopes(d, p, s, dw[d]);
      LAHAR_UNROLL
      for (int k = 0; k < per_axis; ++k) dw[d][k] *= map.per_length[d];
    }
    fold_at_border<Dim>(border, w);
    fold_at_border<Dim>(border, dw);
  }
  template <class Real>
  LAHAR_INLINE void place(Local p, Real (&s)[Dim]) const {
    map.natural(p, s);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) s[d] = 0.5 + 0.5 * s[d];
  }
  double cell_length(int d) const { return 1.0 / map.per_length[d]; }

  /// D_dd = sum_k w_k (x_k - x_p)^2 of APIC (Jiang et al. 2015): D is diagonal because each axis
  /// reproduces linear fields. At a node on which only one function is not zero, as at walls, D is
  /// zero; moments become slopes there, which they are where functions are linear.
  template <class Real>
  LAHAR_INLINE void moments(Local p, const Real (&w)[Dim][per_axis],
                            const Real (&dw)[Dim][per_axis], Real (&m)[Dim][per_axis]) const {
    Real s[Dim];
    place(p, s);
    if (border == 0 && Axis::spread > 0.0) {
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) LAHAR_UNROLL
      for (int k = 0; k < per_axis; ++k)
        m[d][k] = w[d][k] * (map.per_length[d] / Axis::spread * ((k - 1.0) - s[d]));
      return;
    }
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      Real spread(0.0), moment[per_axis];
      LAHAR_UNROLL
      for (int k = 0; k < per_axis; ++k) {
        const Real away = (k - 1.0) - s[d];
        moment[k] = w[d][k] * away;
        spread += moment[k] * away;
      }
      const unsigned wide = outside(spread, least_spread, lanes<Real>);
      const Real factor = map.per_length[d] / max(spread, Real(least_spread));
      LAHAR_UNROLL
      for (int k = 0; k < per_axis; ++k) m[d][k] = select(wide, moment[k] * factor, dw[d][k]);
    }
  }

  template <class Real>
  LAHAR_INLINE void functions(Local p, Real (&N)[nodes]) const {
    Real w[Dim][per_axis];
    weights(p, w);
    for (int i = 0; i < nodes; ++i) N[i] = product(w, i);
  }
  template <class Real>
  LAHAR_INLINE void gradients(Local p, Real (&dN)[Dim][nodes]) const {
    Real w[Dim][per_axis], dw[Dim][per_axis], mixed[Dim][per_axis];
    weights(p, w, dw);
    for (int d = 0; d < Dim; ++d) {
      for (int e = 0; e < Dim; ++e)
        for (int k = 0; k < per_axis; ++k) mixed[e][k] = e == d ? dw[e][k] : w[e][k];
      for (int i = 0; i < nodes; ++i) dN[d][i] = product(mixed, i);
    }
  }
  /// The functions at `by` cells from the particles along the first axis, still in their cell. Of
  /// functions of the place alone.
  template <class Real>
  LAHAR_INLINE void functions_beside(Local p, const Real& by, Real (&N)[nodes]) const
      requires(Axis::of_place) {
    Real w[Dim][per_axis], s[Dim];
    place(p, s);
    s[0] += by;
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) axis.at(d, p, s[d], w[d]);
    fold_at_border<Dim>(border, w);
    for (int i = 0; i < nodes; ++i) N[i] = product(w, i);
  }

 private:
  /// [-] D over the cell's length squared, below which rounding of the weights is felt.
  static constexpr double least_spread = 1e-7;

  static constexpr int digit(int i, int d) { return i >> (2 * d) & 3; }
  template <class Real>
  static Real product(const Real (&w)[Dim][per_axis], int i) {
    Real value = w[0][digit(i, 0)] * w[1][digit(i, 1)];
    if constexpr (Dim == 3) value *= w[2][digit(i, 2)];
    return value;
  }
};

/// Makes the bases of a patch's cells, with functions that depend on the place alone.
template <int Dim, class Function>
class SplineCells {
 public:
  struct Axis {
    static constexpr bool volume_at_centre = false;
    static constexpr bool of_place = true;  ///< functions do not depend on the particle
    static constexpr double spread = Function::spread;
    static constexpr int per_particle = Function::per_particle;
    template <class Real>
    LAHAR_INLINE void at(int, Local, const Real& s, Real (&w)[axis_nodes]) const {
      Function::at(s, w);
    }
    template <class Real>
    LAHAR_INLINE void slopes(int, Local, const Real& s, Real (&dw)[axis_nodes]) const {
      Function::slopes(s, dw);
    }
  };

  explicit SplineCells(const Patch<Dim>& patch)
      : cells_(patch), border_(patch.topology.support_border.data()) {}
  LAHAR_INLINE TensorProduct<Dim, Axis> operator[](Local cell) const {
    return {cells_[cell], border_[cell], {}};
  }

 private:
  CartesianCells<Dim> cells_;
  const std::uint8_t* border_;
};

/// The same with particles that have a domain, an axis-aligned box of edges Column::domain.
template <int Dim>
class GimpCells {
 public:
  struct Axis {
    static constexpr bool volume_at_centre = true;
    static constexpr bool of_place = false;
    static constexpr double spread = 0.0;  // differs
    static constexpr int per_particle = axis_nodes;
    std::array<const double*, Dim> edge;  ///< [m]
    double half_per_length[Dim];          ///< half a domain's edge in lengths of the cell [1/m]

    template <class Real>
    LAHAR_INLINE Real reach(int d, Local p) const {
      // Domains longer than two cells are cut there. Lanes without a particle may hold zero, by
      // which nothing is to be divided.
      const Real half = half_per_length[d] * load<Real>(edge[static_cast<std::size_t>(d)] + p);
      return max(Real(1e-9), clamp(half, 1.0));
    }
    template <class Real>
    LAHAR_INLINE void at(int d, Local p, const Real& s, Real (&w)[axis_nodes]) const {
      GimpFunction::at(s, reach<Real>(d, p), w);
    }
    template <class Real>
    LAHAR_INLINE void slopes(int d, Local p, const Real& s, Real (&dw)[axis_nodes]) const {
      GimpFunction::slopes(s, reach<Real>(d, p), dw);
    }
  };

  explicit GimpCells(const Patch<Dim>& patch)
      : cells_(patch),
        border_(patch.topology.support_border.data()),
        edge_(patch.particles.template rows<Dim>(Column::domain)) {}
  LAHAR_INLINE TensorProduct<Dim, Axis> operator[](Local cell) const {
    TensorProduct<Dim, Axis> basis{cells_[cell], border_[cell], {edge_, {}}};
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) basis.axis.half_per_length[d] = 0.5 * basis.map.per_length[d];
    return basis;
  }

 private:
  CartesianCells<Dim> cells_;
  const std::uint8_t* border_;
  std::array<const double*, Dim> edge_;
};

}  // namespace lahar
