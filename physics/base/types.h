/// \file Basic types shared by every folder.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace lahar {

/// Global identity of a node, cell or particle; -1 = none.
using Index = std::int64_t;
/// Position of a cell, node or particle inside one patch; -1 = none.
using Local = std::int32_t;

/// A point, velocity or force in Dim dimensions.
template <int Dim>
using Vec = Eigen::Matrix<double, Dim, 1>;

/// Stress or strain in Voigt order xx yy zz xy yz xz (engineering shear for strain).
using Voigt = std::array<double, 6>;

/// Corners of a linear element (Q4, H8).
template <int Dim>
inline constexpr int corners = 1 << Dim;

/// Independent in-plane Voigt components that a strain has: 2D xx yy xy, 3D all six.
template <int Dim>
inline constexpr int strain_components = Dim == 2 ? 3 : 6;

/// Voigt components that a stress has: 2D (plane strain) xx yy zz xy, 3D all six.
template <int Dim>
inline constexpr int stress_components = Dim == 2 ? 4 : 6;

}  // namespace lahar
