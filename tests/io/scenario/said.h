/// \file What is said of a scenario that is read.
#pragma once

#include <string>

#include "io/scenario/scenario.h"
#include "physics/base/error.h"

namespace lahar::test {

/// The text of the InputError that read() throws; empty where it throws none.
template <class Read>
std::string refusal_of(Read read) {
  try {
    read();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// Messages of the warnings, one per line.
inline std::string warnings_of(const Scenario& scenario) {
  std::string text;
  for (const Problem& warning : scenario.warnings) text += warning.message + "\n";
  return text;
}

inline bool says(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

}  // namespace lahar::test
