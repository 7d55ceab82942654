/// \file The parts of a generated scenario, one function each, and what they must know of each
/// other.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "tests/properties/scenario_generator.h"

namespace lahar::test {

using Json = nlohmann::ordered_json;

/// What is decided first, because rules that parts have to keep depend on it.
struct Outline {
  int dim = 2;
  bool cbgeo = false;  ///< preset
  std::string element, functions, scheme, update;
  std::string plane = "strain";
  bool table = false;  ///< the mesh is a file
  bool second_order = false;
  std::vector<double> h;  ///< [m] edges of a cell
  std::vector<int> counts;
  int bodies = 1;
  bool contact = false;
  bool accelerates = false;  ///< some nodes have a prescribed acceleration
  std::vector<std::string> materials;
  bool opens = false;     ///< some material has a limit of tension
  bool has_soil = false;  ///< some material has no stiffness without pressure
  double wave = 0;        ///< [m/s] fastest wave, about
  double speed = 3;       ///< [m/s] largest speed of bodies along an axis
  int functions_of_time = 0;

  double extent(int d) const {
    return h[static_cast<std::size_t>(d)] * counts[static_cast<std::size_t>(d)];
  }
};

Outline outline_of(Choices& choices);
Json materials_of(Choices& choices, Outline& outline);  ///< sets what the outline says of them
Json mesh_of(Choices& choices, const Outline& outline, GeneratedCase& made);
Json boundary_of(Choices& choices, const Outline& outline, GeneratedCase& made, Json& sets);
Json bodies_of(Choices& choices, const Outline& outline, GeneratedCase& made, Json& sets);
/// Below all particles, from where some of them move up; empty as a rule.
Json rigid_bodies_of(Choices& choices, const Outline& outline);
Json loads_of(Choices& choices, const Outline& outline, Json& sets);
Json functions_of(Choices& choices, const Outline& outline);
Json analysis_of(Choices& choices, const Outline& outline, GeneratedCase& made);
Json output_of(Choices& choices, const Outline& outline, const GeneratedCase& made, double dt);

/// A fixed step that the waves bear [s].
double stable_step(const Outline& outline);

/// [m] `cells` cell edges from the lowest corner along each axis.
Json point(const Outline& outline, const std::vector<double>& cells);
/// Name of the decision `what` about thing number i.
std::string name(const char* thing, int i, const char* what);

}  // namespace lahar::test
