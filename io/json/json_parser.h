/// \file The parser behind JsonDocument; the only place that sees the JSON library.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "io/json/json_source.h"

namespace lahar {

struct JsonParse {
  JsonValue root;     ///< invalid if `error` is set
  std::string error;  ///< syntax error; empty if there is none
  std::string hint;   ///< what to do about it
  std::size_t error_offset = 0;
  struct Duplicate {
    std::string key;
    std::size_t offset, first;  ///< of this key and of the one that counts
  };
  std::vector<Duplicate> duplicates;
};

/// Parse JSON with comments; values get `source` and their offset in `text`.
JsonParse parse_json(std::string_view text, std::uint32_t source);

/// Add `by` to the offsets of a whole tree.
void shift(JsonValue& value, std::uint32_t by);

}  // namespace lahar
