/// \file Inputs made from others: by structure where they have one, by lines and bytes else.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/targets.h"

namespace lahar::fuzz {

using Random = std::mt19937_64;

/// Keys and words of the input, from its schema; numbers at which something may end.
class Mutator {
 public:
  Mutator();

  /// One change of `input`, or several; `others` lend parts of theirs.
  std::string mutate(const std::string& input, Form form, const std::vector<std::string>& others,
                     Random& random) const;

 private:
  std::string mutate_bundle(const std::string& input, const std::string& other,
                            Random& random) const;
  std::string mutate_sections(const std::string& input, const std::string& other,
                              Random& random) const;
  std::string mutate_formats(const std::string& input, const std::string& other,
                             Random& random) const;
  std::string mutate_file(const std::string& ending, std::string text, const std::string& other,
                          Random& random) const;
  std::string mutate_json(const std::string& text, const std::string& other, Random& random) const;
  std::string mutate_text(std::string text, Random& random) const;
  std::string mutate_words(std::string text, Random& random) const;
  std::string mutate_bytes(std::string text, Random& random) const;

  std::vector<std::string> keys_, words_;
};

}  // namespace lahar::fuzz
