/// \file What pictures of a run need to know of it besides its frames.
#pragma once

#include <filesystem>
#include <string>

#include "runtime/picture/placed_bodies.h"

namespace lahar {

struct RunFacts {
  std::string title;
  bool axisymmetric = false;
  PlacedBodies bodies;
};

/// Of a run folder, or of the one that a frame lies in; empty where there is none.
RunFacts run_facts(const std::filesystem::path& source);

/// Whether the model in a run folder is axisymmetric.
bool is_axisymmetric(const std::filesystem::path& run);

}  // namespace lahar
