/// \file Fields of nodes that a run may write beside its frames of particles.
#pragma once

#include <array>
#include <string_view>

namespace lahar {

enum class NodeField { mass, velocity, acceleration };

struct NodeFieldInfo {
  NodeField field;
  std::string_view name;  ///< in post_processing.node_fields and in files
  std::string_view unit;
  bool is_vector;
  std::string_view help;
};

inline constexpr auto node_field_table = std::to_array<NodeFieldInfo>({
    {NodeField::mass, "mass", "kg", false, "of the particles around the node, by its functions"},
    {NodeField::velocity, "velocity", "m/s", true, "after the update of the last step"},
    {NodeField::acceleration, "acceleration", "m/s^2", true, "of the last step"},
});

}  // namespace lahar
