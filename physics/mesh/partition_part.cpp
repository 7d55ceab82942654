/// \file Parts of a partition: the cells of some patches, and what else these need of the mesh.
#include <algorithm>
#include <array>
#include <stdexcept>

#include "physics/base/byte_stream.h"
#include "physics/mesh/partition.h"
#include "physics/mesh/partition_common.h"

namespace lahar {
namespace {

/// Patches with their cells, as one process packs them for another.
struct PatchPiece {
  std::vector<Index> patches;  ///< ascending
  std::vector<Index> first;    ///< cells of patches[i] are cells[first[i]] .. cells[first[i + 1]]
  std::vector<Local> cells;
};

PatchPiece read_piece(std::span<const std::byte> bytes, Index n_patches, Index n_cells) {
  ByteReader reader(bytes);
  if (reader.array<Index>() != std::vector<Index>{n_patches, n_cells})
    throw std::invalid_argument("patches from another rank are not of the same partition");
  PatchPiece piece;
  piece.patches = reader.array<Index>();
  piece.first = reader.array<Index>();
  piece.cells = reader.array<Local>();
  reader.expect_end();
  const auto within = [](const auto& values, Index limit) {
    return std::all_of(values.begin(), values.end(), [&](Index i) { return i >= 0 && i < limit; });
  };
  const auto n = static_cast<Index>(piece.cells.size());
  if (piece.first.size() != piece.patches.size() + 1 || piece.first.front() != 0 ||
      piece.first.back() != n || !std::is_sorted(piece.first.begin(), piece.first.end()) ||
      !within(piece.patches, n_patches) || !within(piece.cells, n_cells))
    throw std::invalid_argument("patches from another rank are damaged");
  return piece;
}

}  // namespace

/// What all parts know of the whole.
template <int Dim>
Partition<Dim>::Partition(const Mesh<Dim>& mesh, const Partition& whole)
    : mesh_(&mesh),
      counts_(whole.counts_),
      bricks_(whole.bricks_),
      brick_to_patch_(whole.brick_to_patch_),
      patch_to_brick_(whole.patch_to_brick_),
      parts_(whole.parts_),
      n_patches_(whole.n_patches_) {}

template <int Dim>
Partition<Dim>::Partition(const Mesh<Dim>& mesh, Index n_patches, std::span<const Row> rows)
    : mesh_(&mesh), n_patches_(n_patches) {
  hold(rows);
}

template <int Dim>
Partition<Dim> Partition<Dim>::part(const Mesh<Dim>& mesh, std::span<const Index> patches,
                                    std::span<const std::vector<std::byte>> packed) const {
  Partition result(mesh, *this);
  if (mesh.is_structured()) return result;
  std::vector<PatchPiece> pieces;
  for (const auto& bytes : packed) pieces.push_back(read_piece(bytes, n_patches(), mesh.n_cells()));
  std::vector<Row> rows;
  for (Index patch : patches) rows.emplace_back(patch, row_of(patch));
  for (const PatchPiece& piece : pieces)
    for (std::size_t i = 0; i < piece.patches.size(); ++i)
      rows.emplace_back(piece.patches[i], std::span(piece.cells.data() + piece.first[i],
                                                    piece.cells.data() + piece.first[i + 1]));
  const auto id = [](const auto& row) { return row.first; };
  std::ranges::sort(rows, {}, id);
  const auto same = [](const Row& a, const Row& b) { return a.first == b.first; };
  rows.erase(std::unique(rows.begin(), rows.end(), same), rows.end());
  result.hold(rows);
  return result;
}

/// Hold the patches whose ids and cells are given, ascending, and nothing else.
template <int Dim>
void Partition<Dim>::hold(std::span<const Row> patches) {
  std::vector<Index> ids;
  first_cell_ = {0};
  for (const auto& [id, cells] : patches) {
    ids.push_back(id);
    first_cell_.push_back(first_cell_.back() + static_cast<Index>(cells.size()));
  }
  cells_.clear();
  cells_.reserve(first_cell_.back());
  for (const auto& [id, cells] : patches) cells_.insert(cells_.end(), cells.begin(), cells.end());
  std::vector<Index> all(cells_.begin(), cells_.end());
  std::sort(all.begin(), all.end());
  const bool whole = static_cast<Index>(all.size()) == mesh_->n_cells();
  patch_ids_ = whole ? IdMap::all(n_patches_) : IdMap::some(std::move(ids));
  cell_ids_ = whole ? IdMap::all(mesh_->n_cells()) : IdMap::some(std::move(all));
  note_patches();
}

template <int Dim>
std::vector<std::byte> Partition<Dim>::pack(std::span<const Index> patches) const {
  if (mesh_->is_structured()) return {};
  std::vector<Index> first = {0};
  std::vector<Local> cells;
  for (Index patch : patches) {
    const auto row = row_of(patch);
    cells.insert(cells.end(), row.begin(), row.end());
    first.push_back(static_cast<Index>(cells.size()));
  }
  const std::array<Index, 2> sizes = {n_patches(), mesh_->n_cells()};
  ByteWriter writer;
  writer.array<Index>(sizes);
  writer.array<Index>(patches);
  writer.array<Index>(first);
  writer.array<Local>(cells);
  return writer.take();
}

template <int Dim>
bool Partition<Dim>::holds(Index patch) const {
  if (mesh_->is_structured()) return patch >= 0 && patch < n_patches();
  return patch_ids_.row(patch) >= 0;
}

template <int Dim>
std::size_t Partition<Dim>::bytes() const {
  return (brick_to_patch_.capacity() + patch_to_brick_.capacity() + first_cell_.capacity()) *
             sizeof(Index) +
         (cells_.capacity() + patch_of_cell_.capacity()) * sizeof(Local) + patch_ids_.bytes() +
         cell_ids_.bytes();
}

template <int Dim>
std::vector<Index> surrounding_patches(const Partition<Dim>& partition,
                                       std::span<const Index> patches, int rings) {
  std::vector<Index> result(patches.begin(), patches.end());
  for (Index patch : patches) {
    const auto neighbours = partition.neighbours(patch, rings);
    result.insert(result.end(), neighbours.begin(), neighbours.end());
  }
  sort_unique(result);
  return result;
}

template <int Dim>
std::vector<Index> surrounding_cells(const Mesh<Dim>& mesh, const Partition<Dim>& partition,
                                     std::span<const Index> patches, int rings) {
  if (mesh.is_structured()) return {};
  std::vector<Index> result;
  for (Index patch : surrounding_patches(partition, patches, rings)) {
    const auto cells = partition.cells(patch);
    result.insert(result.end(), cells.begin(), cells.end());
  }
  result = mesh.widened(result, std::max(1, rings));
  std::vector<Index> own;
  for (Index patch : patches) {
    const auto cells = partition.cells(patch);
    own.insert(own.end(), cells.begin(), cells.end());
  }
  const auto near = mesh.cells_near(own);
  result.insert(result.end(), near.begin(), near.end());
  sort_unique(result);
  return result;
}

template class Partition<2>;
template class Partition<3>;
template std::vector<Index> surrounding_patches(const Partition<2>&, std::span<const Index>, int);
template std::vector<Index> surrounding_cells(const Mesh<2>&, const Partition<2>&,
                                              std::span<const Index>, int);
template std::vector<Index> surrounding_patches(const Partition<3>&, std::span<const Index>, int);
template std::vector<Index> surrounding_cells(const Mesh<3>&, const Partition<3>&,
                                              std::span<const Index>, int);

}  // namespace lahar
