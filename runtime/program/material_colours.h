/// \file Colours of materials in pictures of a model.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "physics/materials/material.h"

namespace lahar {

/// One for each material of the scenario. Classes of a field (io/scenario/material_fields.h) are
/// shades of it, darker for larger values.
class MaterialColours {
 public:
  /// Of the entries of Model::materials; `used`: those that particles have.
  MaterialColours(std::span<const Material> materials, std::span<const std::uint16_t> used);

  std::size_t n_materials() const { return n_materials_; }  ///< of the scenario
  const std::string& of(int entry) const { return colour_[static_cast<std::size_t>(entry)]; }
  /// The first entry of the same colour: what looks alike is drawn together.
  int first(std::size_t entry) const { return first_[entry]; }
  bool has_shades(int entry) const { return shaded_[static_cast<std::size_t>(entry)] != 0; }

 private:
  std::size_t n_materials_ = 0;
  std::vector<std::string> colour_;
  std::vector<int> first_;
  std::vector<char> shaded_;
};

}  // namespace lahar
