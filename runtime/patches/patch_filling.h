/// \file The way of the initial particles from the model's table into their patches.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "physics/particles/patch.h"

namespace lahar {

/// Which rows of a particle table lie in which patch. Rows of a patch are in ascending order. Takes
/// one entry for all rows that follow each other and lie in one patch.
class RowsByPatch {
 public:
  struct Span {
    Index begin, end;  ///< rows [begin, end)
    Index patch;
  };

  template <int Dim>
  RowsByPatch(const std::vector<Index>& cell_of_row, const Partition<Dim>& partition);

  std::span<const Span> operator[](Index patch) const {
    const auto i = static_cast<std::size_t>(patch);
    return {spans_.data() + first_[i], spans_.data() + first_[i + 1]};
  }
  /// Patches that have rows, ascending.
  std::vector<Index> occupied() const;

 private:
  std::vector<Span> spans_;   ///< by patch
  std::vector<Index> first_;  ///< of each patch, and one more
};

/// Fill patches with the particles of the model's table (of several ranks: this one's), on up to
/// `threads` threads (0 = all); patches are the same for any number of them. Every particle is
/// written to memory once, by the thread that fills its patch. Columns of the table are released as
/// soon as they are not needed any more, so that table and patches are never in memory as a whole
/// together. Throws InputError for a particle that is not in its cell. Returns the smallest mass of
/// a particle [kg].
template <int Dim>
double fill_patches(std::span<const std::unique_ptr<Patch<Dim>>> patches, const RowsByPatch& rows,
                    Model<Dim>& model, int threads);

extern template RowsByPatch::RowsByPatch(const std::vector<Index>&, const Partition<2>&);
extern template RowsByPatch::RowsByPatch(const std::vector<Index>&, const Partition<3>&);
extern template double fill_patches(std::span<const std::unique_ptr<Patch<2>>>, const RowsByPatch&,
                                    Model<2>&, int);
extern template double fill_patches(std::span<const std::unique_ptr<Patch<3>>>, const RowsByPatch&,
                                    Model<3>&, int);

}  // namespace lahar
