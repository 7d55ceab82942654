/// \file Rows of removed.csv: the particles that left the mesh, ascending by step and then by id.
///
/// `step` is the number of updates after which a particle is missing, as in history.csv. The file
/// exists where particles were removed.
#pragma once

#include <string>

#include "physics/particles/removed_particle.h"

namespace lahar {

inline constexpr const char* removed_file = "removed.csv";

std::string removed_header();                      ///< with newline
std::string removed_line(const RemovedParticle&);  ///< with newline

}  // namespace lahar
