#include "io/schema/cbgeo_deviations.h"

namespace lahar {

std::span<const CbgeoDeviation> cbgeo_deviations() {
  static constexpr CbgeoDeviation deviations[] = {
      {"`\"stress_update\"` in `analysis`", "ignored: USF is run",
       "the older spelling of `mpm_scheme`, which is run"},
      {"`\"mpm_scheme\": \"musl\"`", "USF is run", "MUSL is run"},
      {"`velocity_constraints` in implicit analyses", "ignored: displacement constraints act alone",
       "the displacement of a step is velocity times dt"},
      {"default of `beta` in `scheme_settings` of `MPMSemiImplicitNavierStokes2D`, `...3D`",
       "1: water at rest becomes restless after some seconds", "0"},
      {"`\"damping_ratio\"` in `analysis.damping`", "ignored, although documented: no damping",
       "the same as `damping_factor`"},
      {"`\"particles_cells\"` in `mesh`", "ignored, although documented",
       "the same as `particle_cells`"},
      {"number of cells or particles in the first row of a file, if the rows are not as many",
       "not looked at: all rows are read (Lahar warns)", "refused"},
      {"value that is missing at the end of a row of a file of constraints, forces or angles",
       "what the memory holds (Lahar takes 0, and warns)", "refused"},
      {"`friction_constraints` in 3D, at a node at rest, under a pull above the friction limit",
       "slowed by mu a_n a_t / (a_t - mu a_n), which grows without limit as the pull approaches mu "
       "a_n",
       "slowed by mu a_n, as in 2D"},
      {"`MohrCoulomb`, return to the yield surface",
       "stresses within 0.1 Pa of the surface, on either side, are taken as lying on it; what has "
       "not "
       "come so near in 100 steps is done in parts (there it is accepted)",
       "within rounding of it"},
      {"`Bingham`, shear stress",
       "none unless half the sum of squares of its normal components is at least tau0^2: none in "
       "simple shear",
       "wherever the shear rate is above the critical one"},
      {"`Bingham` in 2D, stress across the plane", "zero", "minus the pressure"},
      {"void ratio of `ModifiedCamClay` at the start, where `ocr` is above 1",
       "e_ref - lambda ln(pc0 / ocr / p_ref) - kappa ln(ocr): normal compression does not meet the "
       "line through e_ref",
       "e_ref - lambda ln(pc0 / p_ref) + kappa ln(ocr)"},
      {"void ratio of `ModifiedCamClay`",
       "changes in plastic increments only, by (1 + initial void ratio) d(eps_v)",
       "always, by (1 + void ratio) d(eps_v)"},
      {"`pressure_constraints` other than 0 in explicit steps",
       "particles take them where pore pressures are smoothed; they do not press on the ground",
       "they are those of water outside, which presses on the ground"},
      {"elastic moduli of `ModifiedCamClay` where p <= 0",
       "those of the previous increment; at first K and G from youngs_modulus, exchanged",
       "those of youngs_modulus and poisson_ratio for soil without stress; otherwise those at 0.1 "
       "% of pc0, as at any p below it"},
      {"increments of `NorSand`",
       "explicit, with the tangent at the beginning, even inside the yield surface; the tangent "
       "takes M_image as constant, so that p_image does not follow the hardening law",
       "implicit, divided if an increment is large"},
      {"hardening limit of `NorSand`", "p exp(-chi_image psi_image / M_tc)",
       "p exp(-chi_image psi_image / M_image_tc) (Jefferies and Been), which is its inner cap too"},
      {"void ratio of `NorSand`", "changes by (1 + initial void ratio) d(eps_v)",
       "by (1 + void ratio) d(eps_v)"},
      {"`pdstrain` of `NorSand`, by which bonds degrade",
       "of the sum of plastic strains: bonds heal when loading is reversed",
       "the sum of the norms of its increments"},
  };
  return deviations;
}

}  // namespace lahar
