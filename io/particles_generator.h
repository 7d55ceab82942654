/// \file Where particles start: Gauss points, regions, and the cell and volume of each.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "io/regions.h"
#include "physics/mesh.h"
#include "physics/model.h"

namespace lahar {

/// Natural coordinates of n Gauss points per direction, in the reference's order: n = 2 counter-
/// clockwise, layer by layer; n = 3 in 2D corners, mid-sides (each counter-clockwise) and centre;
/// otherwise the last axis runs fastest. n is 1 to 4 in 2D, 1 to 3 in 3D.
template <int Dim>
std::vector<Vec<Dim>> gauss_points(int n);

/// Positions sum_i N_i(xi) X_i in one cell, corners in file order.
template <int Dim>
Vec<Dim> cell_point(const Mesh<Dim>& mesh, Index cell, const Vec<Dim>& xi);

/// Particles that know their cell and perhaps their volume.
template <int Dim>
struct NewParticles {
  std::vector<Vec<Dim>> x;
  std::vector<Index> cell;     ///< -1 = not yet known
  std::vector<double> volume;  ///< 0 = not yet known
};

/// Particles at the Gauss points of the cells, in the order given.
template <int Dim>
NewParticles<Dim> fill_cells(const Mesh<Dim>& mesh, const std::vector<Index>& cells, int n);

/// Each cell is cut into n^Dim equal parts of the natural coordinates; those whose centre lies in
/// the region get a particle with their volume (exact). The first axis runs fastest.
template <int Dim>
NewParticles<Dim> fill_region(const Mesh<Dim>& mesh, const Region<Dim>& region, int n);

/// Fill in the cells that are not known: the suggested one (-1 = none) if it contains the particle,
/// else the lowest that does. Returns the particles that no cell contains.
template <int Dim>
std::vector<Index> place(const Mesh<Dim>& mesh, const std::vector<Index>& suggested,
                         ParticleTable<Dim>& particles);

/// Fill in the volumes that are not known (0): cell volume / number of particles in the cell.
template <int Dim>
void share_volumes(const Mesh<Dim>& mesh, ParticleTable<Dim>& particles);

/// Two points at exactly the same place; {-1, -1} if there are none.
template <int Dim>
std::pair<Index, Index> find_coincident(const std::vector<Vec<Dim>>& points);

}  // namespace lahar
