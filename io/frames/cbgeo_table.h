/// \file Particle files of CB-Geo MPM, particlesNNN.h5: one compound table named `table`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// A row of the table. Vectors have three components in 2D too, the last 0; tensors are in Voigt
/// order xx yy zz xy yz xz, shear strains are engineering strains.
struct CbgeoParticle {
  static constexpr int max_states = 20;
  /// The last of svars, which no law has: Column::opening. CB-Geo MPM writes 0.
  static constexpr int opening = max_states - 1;
  std::int64_t id = 0;
  double mass = 0;    ///< [kg]
  double volume = 0;  ///< [m^3]
  double pressure = 0;
  double coord[3] = {}, displacement[3] = {};  ///< [m]
  double nsize[3] = {};                        ///< length in natural coordinates, for GIMP
  double velocity[3] = {};                     ///< [m/s]
  double stress[6] = {};                       ///< [Pa]
  double strain[6] = {};
  double epsilon_v = 0;  ///< volumetric strain at the cell's centre
  std::uint8_t status = 1;
  std::uint8_t padding[7] = {};  ///< no field: equal particles are equal bytes
  std::int64_t cell_id = -1;     ///< -1 = unknown
  std::uint32_t material_id = 0;
  std::uint32_t nstate_vars = 0;
  double svars[max_states] = {};  ///< state variables of the material's law, in its order
};

/// Rows of a table. Throws InputError where the file is not such a table, IoError where it cannot
/// be read.
Index count_cbgeo_rows(const std::filesystem::path& file);
/// Rows [first, first + n). Fields that older versions of CB-Geo MPM did not write are as in
/// CbgeoParticle.
std::vector<CbgeoParticle> read_cbgeo_rows(const std::filesystem::path& file, Index first, Index n);

/// Write a table with all fields, atomically; `rows(first, n)` gives rows [first, first + n).
/// Throws IoError.
void write_cbgeo_table(const std::filesystem::path& file, Index n,
                       const std::function<std::vector<CbgeoParticle>(Index first, Index n)>& rows);

/// particlesNNN.h5, with as many digits as CB-Geo MPM takes for a run of `nsteps` steps. Its steps
/// count from 0: this is the state after step `step`, when step + 1 updates are done.
std::string cbgeo_file_name(Index step, Index nsteps);

/// The files of a step in a folder: one, however many digits it has, or those of all ranks of a
/// parallel run (particles-RANK_SIZE-NNN.h5), ascending ranks. Empty: there is none, or ranks are
/// missing.
std::vector<std::filesystem::path> find_cbgeo_files(const std::filesystem::path& folder,
                                                    Index step);
/// Steps of which a folder has files, ascending.
std::vector<Index> cbgeo_steps(const std::filesystem::path& folder);

}  // namespace lahar
