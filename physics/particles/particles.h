/// \file The particles of one patch: structure of arrays, aligned and padded.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "physics/particles/columns.h"

namespace lahar {

/// `n` particles from slot `from` on go to slot `to`.
struct SlotMove {
  Local from, to, n;
};

/// The particle in slot `from` is to be copied to slot `to`.
struct SlotCopy {
  Local from, to;
};

/// A block of particles. Rows of doubles (one per column component) with a common stride, so that
/// component k of column c of particle p is `row(c, k)[p]`. Reading one vector beyond the last
/// particle is always allowed. The particles of a patch lie in slots of which some are free
/// (Patch::bins). Order is canonical: it depends on the history of the patch only.
template <int Dim>
class Particles {
 public:
  explicit Particles(ColumnLayout<Dim> layout = ColumnLayout<Dim>());

  Local size() const { return size_; }
  Local capacity() const { return capacity_; }
  const ColumnLayout<Dim>& layout() const { return layout_; }

  double* row(Column c, int component = 0) {
    return block_.get() + static_cast<std::size_t>(layout_.row(c) + component) * stride_;
  }
  const double* row(Column c, int component = 0) const {
    return const_cast<Particles*>(this)->row(c, component);
  }

  /// First row of each component of a column: kernels take pointers once, before their loop.
  template <int Components>
  std::array<double*, Components> rows(Column c) {
    std::array<double*, Components> all;
    for (int k = 0; k < Components; ++k) all[static_cast<std::size_t>(k)] = row(c, k);
    return all;
  }
  template <int Components>
  std::array<const double*, Components> rows(Column c) const {
    std::array<const double*, Components> all;
    for (int k = 0; k < Components; ++k) all[static_cast<std::size_t>(k)] = row(c, k);
    return all;
  }

  std::vector<Index> id;                ///< global particle id
  std::vector<Local> cell;              ///< local cell of the patch
  std::vector<std::uint16_t> material;  ///< index into the model's materials
  std::vector<std::uint64_t> loads;     ///< bit k: load or constraint k acts; empty = none anywhere

  void reserve(Local capacity);
  void resize(Local size);  ///< new particles are zero
  void clear() { resize(0); }
  /// Append particle `i` of `other` (same layout).
  void append(const Particles& other, Local i);
  /// All rows of particle `i`, rows() of them, as append() takes them.
  void get(Local i, double* rows) const;
  void append(const double* rows, Index particle_id, std::uint16_t particle_material,
              std::uint64_t particle_loads);
  /// Slots `to` become copies, one after the other, of particles of `other` (same layout, may be
  /// this block itself). Of many at once the waits for memory overlap.
  void copy(std::span<const SlotCopy> copies, const Particles& other);
  /// Move particles to other slots, given in ascending order of `to` and without gaps of more than
  /// one slot; there are `slots` of them then. What lies between is undefined.
  void rearrange(std::span<const SlotMove> moves, Local slots);
  /// Bytes held.
  std::size_t bytes() const;

 private:
  struct Free {
    void* memory = nullptr;  ///< the block and what aligns it
    void operator()(double*) const;
  };
  using Block = std::unique_ptr<double[], Free>;
  static Block allocate_zeros(std::size_t bytes);
  Local add_slot();  ///< with room for a particle; returns its position

  ColumnLayout<Dim> layout_;
  Block block_;
  std::size_t stride_ = 0;
  Local size_ = 0, capacity_ = 0;
  Local touched_ = 0;  ///< rows are zero from here on: no particle has been there
};

extern template class Particles<2>;
extern template class Particles<3>;

}  // namespace lahar
