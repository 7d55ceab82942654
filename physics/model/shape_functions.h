/// \file The shape functions that there are: one row each. What a basis computes is a type of
/// physics/basis, which with_bases() (basis.h) finds by its kind.
#pragma once

#include <array>
#include <string_view>
#include <vector>

namespace lahar {

/// Functions that map between particles and nodes: those of the mesh's elements, or functions that
/// reach beyond the cell, for structured meshes.
enum class ShapeFunctions {
  element,
  gimp,          ///< domains of particles stretch with them (contiguous particles)
  uniform_gimp,  ///< domains keep their size
  cpdi,          ///< domains are parallelograms or parallelepipeds that deform with the particle
  cpdi2,         ///< domains are quadrilaterals or hexahedra whose corners move with the nodes
  quadratic_spline,
  cubic_spline
};

/// Shape functions as kernels see them: linear ones of Q4 and H8, or a basis (basis.h); `corners`
/// are linear ones as a basis, `element` those of other elements.
enum class BasisKind {
  linear,
  corners,
  element,
  gimp,
  cpdi,
  cpdi2,
  quadratic_spline,
  cubic_spline
};

/// The domain that functions average over, which is state of the particle.
enum class ParticleDomain { none, box, vectors, corners };

struct ShapeFunctionsRow {
  ShapeFunctions functions;
  std::string_view key;   ///< of the input, `analysis.shape_functions`
  BasisKind basis;        ///< on Q4 and H8
  int rings;              ///< layers of cells around a patch whose nodes its particles reach
  bool products;          ///< of one function per axis (tensor basis)
  ParticleDomain domain;  ///< columns of the particle
  bool stretches;         ///< a box changes with the particle
};

inline constexpr auto shape_functions_table = std::to_array<ShapeFunctionsRow>({
    {ShapeFunctions::element, "element", BasisKind::linear, 0, false, ParticleDomain::none, false},
    {ShapeFunctions::gimp, "gimp", BasisKind::gimp, 1, true, ParticleDomain::box, true},
    {ShapeFunctions::uniform_gimp, "uniform_gimp", BasisKind::gimp, 1, true, ParticleDomain::box,
     false},
    {ShapeFunctions::cpdi, "cpdi", BasisKind::cpdi, 1, false, ParticleDomain::vectors, false},
    {ShapeFunctions::cpdi2, "cpdi2", BasisKind::cpdi2, 1, false, ParticleDomain::corners, false},
    {ShapeFunctions::quadratic_spline, "quadratic_spline", BasisKind::quadratic_spline, 1, true,
     ParticleDomain::none, false},
    {ShapeFunctions::cubic_spline, "cubic_spline", BasisKind::cubic_spline, 1, true,
     ParticleDomain::none, false},
});

/// The row of some functions: the table is in the order of the enumeration.
constexpr const ShapeFunctionsRow& row_of(ShapeFunctions functions) {
  return shape_functions_table[static_cast<std::size_t>(functions)];
}
static_assert([] {
  for (std::size_t k = 0; k < shape_functions_table.size(); ++k)
    if (shape_functions_table[k].functions != static_cast<ShapeFunctions>(k)) return false;
  return shape_functions_table.back().functions == ShapeFunctions::cubic_spline;
}());

/// Keys of the input, in the order of the table.
inline std::vector<std::string_view> shape_function_keys() {
  std::vector<std::string_view> keys;
  for (const ShapeFunctionsRow& row : shape_functions_table) keys.push_back(row.key);
  return keys;
}

}  // namespace lahar
