/// \file The side files with a row for each particle, read by a team: each member reads a part of
/// the file and keeps, or gets, what belongs to its own particles. Where anything is wrong with a
/// file, one member reads it again from its beginning, for the messages. All are collective.
#pragma once

#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "io/base/row_shares.h"
#include "io/base/side_files.h"

namespace lahar {

/// The count, then coordinates. Returns this member's part of the rows, which follows those of the
/// members before it; nothing if anything is wrong anywhere.
template <int Dim>
std::optional<std::vector<Vec<Dim>>> read_particle_file(const SideFile& file, const Team& team,
                                                        ProblemList& problems);

/// What a file says of a particle of this member, by its position among them.
template <class T>
using Take = std::function<void(Index local, const T& value)>;

/// The count, then six components per particle. Without `shares` (the particles are not known) the
/// rows are only checked; so below. False if anything is wrong anywhere: what was taken is useless.
bool read_stress_file(const SideFile& file, const RowShares* shares, const Team& team,
                      ProblemList& problems, const Take<Voigt>& take);

/// Rows `id value`, ids of particles that exist and each once; positive values only.
bool read_volume_file(const SideFile& file, const RowShares* shares, const Team& team,
                      ProblemList& problems, const Take<double>& take);

/// Rows `id value` with any values, for messages `what`.
bool read_particle_values(const SideFile& file, std::string_view what, const RowShares* shares,
                          const Team& team, ProblemList& problems, const Take<double>& take);

/// Rows `particle cell`.
bool read_particle_cell_file(const SideFile& file, const RowShares* shares, Index n_cells,
                             const Team& team, ProblemList& problems, const Take<Index>& take);

}  // namespace lahar
