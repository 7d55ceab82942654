/// \file Commands that a shell runs.
#pragma once

#include <string>

namespace lahar {

/// One word of a shell command, whatever is in it.
inline std::string shell_word(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

}  // namespace lahar
