/// \file Meshes with named sets from the files of mesh generators: Gmsh (2.2 and 4.1) and VTU.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/base/side_files.h"
#include "physics/mesh/element.h"

namespace lahar {

/// A kind of cell in such files.
struct ElementKind {
  std::string_view name;  ///< plural
  int dim, nodes;
  int gmsh, vtk;                   ///< its numbers; -1 = has none
  std::optional<Element> element;  ///< what Lahar computes with, if it does
};

const std::vector<ElementKind>& element_kinds();
/// The position in element_kinds() of a kind by its number; -1 = unknown.
int kind_of_gmsh(int number);
int kind_of_vtk(int number);
/// For each node in the order of Lahar, its position in that of VTK.
std::vector<int> vtk_order(const ElementKind& kind);

/// Elements of all kinds as a file has them, in Lahar's order of nodes.
struct FileElements {
  struct Set {
    std::string name;  ///< empty: it has a number only
    Index id = -1;
    int dim = -1;  ///< of its elements; -1: a set of points by their ids
  };
  struct Kind {
    std::vector<Local> nodes;                      ///< of one element after the other
    std::vector<std::pair<Local, Local>> members;  ///< set, element of this kind
  };
  std::vector<Vec<3>> points;
  std::vector<Set> sets;
  std::vector<Kind> kinds;                          ///< by the position in element_kinds()
  std::vector<std::pair<Local, Local>> point_sets;  ///< set, point

  FileElements();
};

/// Whether a file begins like one of these.
bool is_element_file(const SideFile& file);

/// About how much memory reading takes [bytes], where that may be much more than the file has, as
/// of compressed ones; else 0. Throws InputError.
double bytes_to_read(const SideFile& file);

/// Reads it; throws InputError with the place of the first mistake.
FileElements read_element_file(const SideFile& file);

// The formats.
FileElements read_gmsh(const SideFile& file);
FileElements read_vtu(const SideFile& file);
double vtu_bytes(const SideFile& file);  ///< as bytes_to_read()

/// A mesh of one element with sets of its nodes and cells.
template <int Dim>
struct ElementMesh {
  struct Set {
    std::string name;
    Index id;                    ///< where it has no name
    std::vector<Index> members;  ///< ascending
  };
  Element element{};
  std::vector<Vec<Dim>> nodes;
  std::vector<Index> cells;  ///< the nodes of each cell, one cell after the other
  std::vector<Set> node_sets, cell_sets;
};

/// The elements of dimension Dim as cells: nodes of none are left out. Elements of lower dimension
/// give sets of nodes, those of dimension Dim sets of cells. Cells that are turned over are mended,
/// with a warning. Throws InputError.
template <int Dim>
ElementMesh<Dim> mesh_of(FileElements tables, const std::string& file, ProblemList& problems);

extern template ElementMesh<2> mesh_of(FileElements, const std::string&, ProblemList&);
extern template ElementMesh<3> mesh_of(FileElements, const std::string&, ProblemList&);

}  // namespace lahar
