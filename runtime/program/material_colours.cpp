#include "runtime/program/material_colours.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace lahar {

namespace {

constexpr const char* colours[] = {"#d9b97c", "#8fbcd9", "#a9cf7f", "#e39b86", "#bda4dd",
                                   "#f0d56e", "#9aa5b5", "#d79ac0", "#7fc7b8", "#c7c27a"};
constexpr std::size_t shades = 8;  // of a material with fields

/// A colour `#rrggbb` that is mixed with black.
std::string darker(const std::string& colour, double share) {
  constexpr double most = 0.55;
  std::string text = "#";
  for (std::size_t k = 1; k < 7; k += 2)
    text += fmt::format("{:02x}", static_cast<int>(std::stoi(colour.substr(k, 2), nullptr, 16) *
                                                   (1 - most * share)));
  return text;
}

}  // namespace

MaterialColours::MaterialColours(std::span<const Material> materials,
                                 std::span<const std::uint16_t> used)
    : colour_(materials.size()), shaded_(materials.size(), 0) {
  std::map<std::pair<Index, int>, std::vector<std::size_t>> entries;  // by id and body
  std::set<Index> ids;
  std::vector<char> is_used(materials.size(), 0);  // bodies in contact leave copies without use
  for (const std::uint16_t m : used) is_used[m] = 1;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    if (is_used[m]) entries[{materials[m].id, materials[m].body}].push_back(m);
    ids.insert(materials[m].id);
  }
  n_materials_ = ids.size();
  const auto base = [&](Index id) {
    const auto number = static_cast<std::size_t>(std::distance(ids.begin(), ids.find(id)));
    return colours[number % std::size(colours)];
  };
  for (std::size_t m = 0; m < materials.size(); ++m) colour_[m] = base(materials[m].id);
  for (const auto& [of, list] : entries) {
    for (std::size_t k = 0; k < list.size(); ++k) {
      const auto shade = static_cast<double>(shades * k / list.size());
      colour_[list[k]] = darker(base(of.first), shade / shades);
      shaded_[list[k]] = list.size() > 1;
    }
  }
  for (const std::string& colour : colour_)
    first_.push_back(
        static_cast<int>(std::find(colour_.begin(), colour_.end(), colour) - colour_.begin()));
}

}  // namespace lahar
