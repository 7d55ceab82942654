/// \file Random scenarios of everything that Lahar can do, each from a list of choices.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "tests/properties/choices.h"

namespace lahar::test {

/// A scenario with its side files.
struct GeneratedCase {
  std::string text;                          ///< JSON
  std::map<std::string, std::string> files;  ///< by name: contents
  int dim = 2;
  int steps = 1;  ///< analysis.nsteps
};

/// Small, with some hundred particles that fly so fast that most change their cells, and many
/// their patches. What the reader would refuse is left out, as far as the rules are simple; what
/// the physics make of it does not matter: a run that fails is to fail everywhere alike.
GeneratedCase generate_case(Choices& choices);

/// Write case.json and the side files, into a folder that exists.
void write_case(const GeneratedCase& made, const std::filesystem::path& folder);

}  // namespace lahar::test
