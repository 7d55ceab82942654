/// \file The parts of a generated scenario, one function each, and what they must know of each
/// other.
#pragma once

#include <array>
#include <cstddef>
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
  /// What steps solve systems for: "dynamics" or "equilibrium" (implicit steps), "pressure"
  /// (projections); empty = nothing, they are explicit.
  std::string solves;
  bool displaces = false;  ///< some nodes have prescribed displacements of implicit steps
  bool pressured = false;  ///< some nodes have a prescribed pressure other than 0
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
  bool shapes = false;                     ///< regions name surfaces, solids and polygons of files
  std::array<double, 2> map_origin{0, 0};  ///< [m] of maps
  bool fields = false;                     ///< parameters of materials differ from place to place
  bool pores = false;                      ///< the last material is the liquid in those before it
  bool k0 = false;                         ///< stresses at the beginning are those of the weight
  bool stages = false;
  bool gauges = false;
  bool ends_at_rest = false;  ///< a run may end by itself

  bool is_implicit() const { return solves == "dynamics" || solves == "equilibrium"; }
  bool projects() const { return solves == "pressure"; }
  /// Materials that bodies have.
  std::size_t solids() const { return materials.size() - (pores ? 1 : 0); }
  double extent(int d) const {
    return h[static_cast<std::size_t>(d)] * counts[static_cast<std::size_t>(d)];
  }
};

Outline outline_of(Choices& choices);
/// Sets what the outline says of them.
Json materials_of(Choices& choices, Outline& outline, GeneratedCase& made);
/// In place of a number of at least `least`, which the field has nowhere above 1.5 `least`.
Json field_of(Choices& choices, const std::string& of, const Outline& outline, double least,
              GeneratedCase& made);
/// What is named in `geometry`; empty without shapes.
Json geometry_of(Choices& choices, const Outline& outline, GeneratedCase& made);
/// A region that names shapes; some lie within `box`.
Json shape_region_of(Choices& choices, const std::string& of, const Outline& outline,
                     const Json& box);
/// "material" of a generator: with the liquid in its pores, where it has one.
Json material_of(const Outline& outline, int number);
/// Of all materials that the scenario has; empty without stages.
Json stages_of(Choices& choices, const Outline& outline, const GeneratedCase& made,
               const Json& materials);
void add_gauges(Choices& choices, const Outline& outline, double dt, Json& output, Json& sets);
Json mesh_of(Choices& choices, const Outline& outline, GeneratedCase& made);
Json boundary_of(Choices& choices, const Outline& outline, GeneratedCase& made, Json& sets);
Json bodies_of(Choices& choices, const Outline& outline, GeneratedCase& made, Json& sets);
/// Below all particles, from where some of them move up; empty as a rule.
Json rigid_bodies_of(Choices& choices, const Outline& outline);
Json loads_of(Choices& choices, const Outline& outline, Json& sets);
Json functions_of(Choices& choices, const Outline& outline);
Json analysis_of(Choices& choices, const Outline& outline, GeneratedCase& made);
Json output_of(Choices& choices, const Outline& outline, const GeneratedCase& made, double dt);

/// Scheme, time step and settings of steps that solve systems.
Json solving_steps_of(Choices& choices, const Outline& outline);
/// The same of explicit ones, for a stage of a scenario with implicit steps.
Json explicit_steps_of(Choices& choices, const std::string& of, const Outline& outline);

/// A fixed step that the waves bear [s].
double stable_step(const Outline& outline);

/// [m] `cells` cell edges from the lowest corner along each axis.
Json point(const Outline& outline, const std::vector<double>& cells);
/// Name of the decision `what` about thing number i.
std::string name(const char* thing, int i, const char* what);

}  // namespace lahar::test
