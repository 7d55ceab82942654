/// \file The constitutive laws that there are. A new law is one file of physics/materials/ and one
/// line here; CONTRIBUTING.md has an example.
#pragma once

#include <algorithm>
#include <concepts>
#include <variant>

#include "physics/materials/bingham.h"
#include "physics/materials/drucker_prager.h"
#include "physics/materials/linear_elastic.h"
#include "physics/materials/modified_cam_clay.h"
#include "physics/materials/mohr_coulomb.h"
#include "physics/materials/neo_hookean.h"
#include "physics/materials/newtonian.h"
#include "physics/materials/norsand.h"
#include "physics/materials/von_mises.h"

namespace lahar {

using Law = std::variant<  //
    LinearElastic,         //
    Newtonian,             //
    Bingham,               //
    MohrCoulomb,           //
    ModifiedCamClay,       //
    NorSand,               //
    DruckerPrager,         //
    VonMises,              //
    NeoHookean>;

/// What every law has; besides, one of the functions that update() (law_input.h) calls. Optional:
/// `initial_state(const double* stress, double* state)` with the initial stress (Voigt, zero if
/// none was given), where not all state variables begin at zero; `derive(const double* stress,
/// double* state)` for state variables that follow from the stress; `follow_parameters(double*
/// state)` for those that follow from parameters; `prepared()`, what update()
/// takes instead of the law, where something can be computed once for many particles, with
/// `takes_long = true` where particles of several cells should fill its packs; `jumps =
/// true` there, if the stress is continuous in increments with LawInput::large alone; `native =
/// true` for a law that CB-Geo MPM does not have; `with_free_faces()`, see there;
/// `wave_moduli(const Voigt& stress, const double* state)`, if they follow the stress; `as_cbgeo`,
/// a flag that --as-cbgeo sets; `knows_rotation = true` for a law that turns its stress with the
/// material itself.
template <class T>
concept MaterialLaw = requires(const T law) {
  { T::name } -> std::convertible_to<std::string_view>;
  { T::help } -> std::convertible_to<std::string_view>;
  T::parameters.size();
  T::state.size();
  { law.problem() } -> std::same_as<std::string>;  // parameters that exclude each other
  { law.wave_modulus() } -> std::same_as<double>;  // [Pa] of longitudinal waves
  { law.viscosity() } -> std::same_as<double>;     // [Pa s] of shear; 0 for solids
};

template <class T>
inline constexpr bool all_are_laws = false;
template <class... Laws>
inline constexpr bool all_are_laws<std::variant<Laws...>> = (MaterialLaw<Laws> && ...);
static_assert(all_are_laws<Law>, "a member of Law lacks something that MaterialLaw lists");

template <class T>
inline constexpr std::size_t most_state_of = 0;
template <class... Laws>
inline constexpr std::size_t most_state_of<std::variant<Laws...>> =
    std::max({std::size_t{1}, Laws::state.size()...});
/// State variables that a law may have.
inline constexpr std::size_t most_state = most_state_of<Law>;

}  // namespace lahar
