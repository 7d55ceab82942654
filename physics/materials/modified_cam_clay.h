/// \file Modified Cam-Clay with bonds and a subloading surface.
#pragma once

#include <string>

#include "physics/materials/law_input.h"
#include "physics/materials/newton.h"
#include "physics/materials/soil_stress.h"
#include "physics/materials/table.h"

namespace lahar {

/// Modified Cam-Clay (Roscoe and Burland 1968), with the bonds and the subloading surface of
/// hydrate-bearing soil (Uchida, Soga and Yamamoto 2012; subloading: Hashiguchi 1989).
///
/// Pressures and p_v below are positive in compression, e the void ratio:
///   yield       F = (q / M)^2 + (p + pcc) (p - R (pc + pcd + pcc)) <= 0
///   flow        d(eps_v^p) = dphi dF/dp,  d(eps^p) radial, d(eps_q^p) = dphi 2 q / M^2
///   hardening   d(pc) / pc = (1 + e) / (lambda - kappa) d(eps_v^p)
///   elasticity  K = (1 + e) p / kappa, G = 3 K (1 - 2 nu) / (2 (1 + nu)) + m_shear chi s_h (then K
///               from G); youngs_modulus instead of (1 + e) p / kappa for the first stress
///   void ratio  d(e) = (1 + e) d(eps_v)
///   bonds       pcd = mc_a (chi s_h)^mc_b, pcc = mc_c (chi s_h)^mc_d, d(chi) = -m chi |d(e^p)|
///   subloading  loading: dR = -u (1 + (pcd + pcc) / pc) ln(R) |d(eps^p)|; else R from the stress
/// with |d(e^p)| = dphi sqrt(6) q / M^2, the norm of the deviatoric plastic strain, and
/// |d(eps^p)|^2 = d(eps_v^p)^2 + |d(e^p)|^2. Three invariants: M depends on theta
/// (strength_ratio()), m is that of triaxial compression; plastic flow stays radial in the
/// deviatoric plane.
///
/// A step is implicit (backward Euler) with the moduli of its beginning.
///
/// CB-Geo MPM solves the same equations of a step for plain Cam-Clay, but changes the void ratio in
/// plastic increments only, by (1 + e0) d(eps_v), and where p <= 0 keeps the moduli that it had, at
/// first with K and G exchanged: so also here with --as-cbgeo. Not reproduced are its errors in
/// - three invariants: the deviator of the trial stress is taken at the returned pressure, so that
///   the stress it ends with is not the one that it solved for;
/// - bonds: pcd is left out where p is returned, moduli grow in every step where p <= 0, and chi
///   falls in elastic increments too, by the plastic strain of the last plastic one;
/// - subloading: the flow is that of the yield surface, R begins without q and anew whenever it
///   reaches 1, and never falls. (Its unit test of it has q = 1e-6 Pa after shearing.)
struct ModifiedCamClay {
  double youngs_modulus;  ///< [Pa] of soil without stress
  double poisson_ratio;
  double p_ref;   ///< [Pa]
  double e_ref;   ///< void ratio at p_ref
  double pc0;     ///< [Pa]
  double ocr;     ///< over-consolidation ratio
  double m;       ///< slope of the critical state line in p, q
  double lambda;  ///< of virgin compression, e against ln p
  double kappa;   ///< of swelling
  bool three_invariants = false;
  bool subloading = false;
  double subloading_u = 0;
  bool bonding = false;
  bool as_cbgeo = false;  ///< see above
  double s_h = 0, mc_a = 0, mc_b = 1, mc_c = 0, mc_d = 1, m_degradation = 0, m_shear = 0;

  static constexpr std::string_view name = "ModifiedCamClay";
  static constexpr std::string_view help =
      "critical state model of clay, with bonds and a subloading surface";
  using Self = ModifiedCamClay;
  static constexpr auto parameters = std::to_array<Parameter<Self>>({
      {"youngs_modulus", "Pa", "Young's modulus of soil without stress, for its first increment",
       &Self::youngs_modulus, Bound::positive},
      {"poisson_ratio", "-", "Poisson's ratio", &Self::poisson_ratio, Bound::poisson},
      {"p_ref", "Pa", "pressure at which e_ref is given", &Self::p_ref, Bound::positive},
      {"e_ref", "-", "void ratio of normal consolidation at p_ref", &Self::e_ref, Bound::positive},
      {"pc0", "Pa", "preconsolidation pressure at the start", &Self::pc0, Bound::positive},
      {"ocr", "-", "over-consolidation ratio, at least 1", &Self::ocr, Bound::positive},
      {"m", "-", "slope q/p of the critical state line (three invariants: in triaxial compression)",
       &Self::m, Bound::positive},
      {"lambda", "-", "slope of virgin compression, void ratio against ln p", &Self::lambda,
       Bound::positive},
      {"kappa", "-", "slope of swelling, less than lambda", &Self::kappa, Bound::positive},
      {"three_invariants", "true: the strength depends on the Lode angle", &Self::three_invariants},
      {"subloading", "true: plastic strain inside of the yield surface too", &Self::subloading},
      {"subloading_u", "-", "rate at which the subloading surface approaches the yield surface",
       &Self::subloading_u, Bound::positive, no_default},
      {"bonding", "true: bonds between grains", &Self::bonding},
      {"s_h", "-", "saturation with the bonding agent at the start, 0 to 1", &Self::s_h,
       Bound::not_negative, no_default},
      {"mc_a", "Pa", "pcd = mc_a (chi s_h)^mc_b", &Self::mc_a, Bound::not_negative, no_default},
      {"mc_b", "-", "exponent of pcd", &Self::mc_b, Bound::positive, no_default},
      {"mc_c", "Pa", "pcc = mc_c (chi s_h)^mc_d", &Self::mc_c, Bound::not_negative, no_default},
      {"mc_d", "-", "exponent of pcc", &Self::mc_d, Bound::positive, no_default},
      {"m_degradation", "-", "loss of bonds per deviatoric plastic strain", &Self::m_degradation,
       Bound::not_negative, no_default},
      {"m_shear", "Pa", "shear modulus that whole bonds add", &Self::m_shear, Bound::not_negative,
       no_default},
  });
  enum State {
    bulk_modulus,
    shear_modulus,
    p,
    q,
    theta,
    pc,
    void_ratio,
    delta_phi,
    m_theta,
    f_function,
    dpvstrain,
    dpdstrain,
    pvstrain,
    pdstrain,
    chi,
    pcd,
    pcc,
    subloading_r,
    states
  };
  static constexpr auto state = std::to_array<StateVariable>({
      {"bulk_modulus", "Pa", "elastic bulk modulus of the last increment"},
      {"shear_modulus", "Pa", "elastic shear modulus of the last increment"},
      {"p", "Pa", "mean pressure", true},
      {"q", "Pa", "deviatoric stress", true},
      {"theta", "rad", "Lode angle: 0 in triaxial extension, pi/3 in compression", true},
      {"pc", "Pa", "preconsolidation pressure"},
      {"void_ratio", "-", "void ratio"},
      {"delta_phi", "1/Pa", "plastic multiplier of the last increment"},
      {"m_theta", "-", "slope of the critical state line at theta", true},
      {"f_function", "Pa^2", "yield function"},
      {"dpvstrain", "-", "plastic volumetric strain of the last increment"},
      {"dpdstrain", "-", "plastic deviatoric strain of the last increment"},
      {"pvstrain", "-", "plastic volumetric strain, positive in compression"},
      {"pdstrain", "-", "plastic deviatoric strain, the sum of its increments' norms"},
      {"chi", "-", "share of the bonds that is whole"},
      {"pcd", "Pa", "pressure by which bonds enlarge the yield surface"},
      {"pcc", "Pa", "strength in isotropic tension by bonds"},
      {"subloading_r", "-", "size of the subloading surface relative to the yield surface"},
  });

  /// pc is not less than this share of pc0, R not less than this: softened clay keeps a trace of
  /// strength, so that it can be compressed again.
  static constexpr double least_pc = 1e-6, least_r = 1e-5;

  std::string problem() const {
    if (kappa >= lambda) return "kappa must be less than lambda";
    if (ocr < 1) return "ocr must be at least 1";
    if (initial_void_ratio() <= 0)
      return "e_ref, lambda, kappa, pc0, p_ref and ocr give a void ratio that is not positive";
    if (three_invariants && m >= 3) return "m must be less than 3 with three_invariants";
    if (subloading && !(subloading_u > 0)) return "\"subloading\": true needs subloading_u";
    for (const auto& p : parameters)
      if (bonding && p.number && std::isnan(this->*p.number) && p.key != "subloading_u")
        return "\"bonding\": true needs " + std::string(p.key);
    if (bonding && !(s_h > 0 && s_h <= 1)) return "s_h must be more than 0 and at most 1";
    return "";
  }

  /// On the line of swelling that leaves the line of normal consolidation at pc0, where the
  /// pressure is pc0 / ocr. (CB-Geo MPM has the slopes the other way round.)
  double initial_void_ratio() const {
    if (as_cbgeo) return e_ref - lambda * std::log(pc0 / ocr / p_ref) - kappa * std::log(ocr);
    return e_ref - lambda * std::log(pc0 / p_ref) + kappa * std::log(ocr);
  }

  void initial_state(const double* stress, double* s) const {
    Voigt sigma;
    std::copy_n(stress, 6, sigma.begin());
    const SoilStress now = of(sigma);
    std::fill_n(s, states, 0.0);
    s[pc] = pc0;
    s[bulk_modulus] = youngs_modulus / (2 * (1 + poisson_ratio));  // as CB-Geo MPM has them
    s[shear_modulus] = 3 * youngs_modulus * (1 - 2 * poisson_ratio) / (2 * (1 + poisson_ratio));
    s[void_ratio] = initial_void_ratio();
    s[chi] = 1;
    set_bonds(s);
    set_moduli(sigma, s);
    s[subloading_r] = subloading ? ratio(now, slope(now), s) : 1;
    s[f_function] = yield_function(now, slope(now), s);
    derive(stress, s);
  }

  void derive(const double* stress, double* s) const {
    const SoilStress now = with_lode_angle(of(stress));
    s[p] = now.p;
    s[q] = now.q;
    s[theta] = now.theta;
    s[m_theta] = slope(now);
  }

  /// At the pressure pc0, the largest elastic one of the beginning.
  double wave_modulus() const {
    double s[states];
    const Voigt isotropic{-pc0, -pc0, -pc0, 0, 0, 0};
    initial_state(isotropic.data(), s);
    const double at_pc0 = s[bulk_modulus] + 4.0 / 3 * s[shear_modulus];
    set_moduli(Voigt{}, s);
    return std::max(at_pc0, s[bulk_modulus] + 4.0 / 3 * s[shear_modulus]);
  }
  /// Of elastic waves at a stress.
  WaveModuli wave_moduli(const Voigt& stress, const double* variables) const {
    double s[states];
    std::copy_n(variables, states, s);
    set_moduli(stress, s);
    return {s[bulk_modulus] + 4.0 / 3 * s[shear_modulus], s[shear_modulus]};
  }
  double viscosity() const { return 0; }

  template <class Number>
  bool update_one(const IncrementOf<Number>& increment, VoigtOf<Number>& sigma, Number* s) const {
    if (as_cbgeo) return step(increment.strain, sigma, s);
    set_moduli(sigma, s);
    const VoigtOf<Number> trial =
        elastic_trial(sigma, increment.strain, s[bulk_modulus], s[shear_modulus]);
    // What errors are compared with: the pressure, or a share of the strength where that is small.
    const double pressure = std::max(value_of(-(sigma[0] + sigma[1] + sigma[2]) / 3), 0.0) +
                            value_of(s[pcc]) + 0.01 * value_of(s[pc] + s[pcd]) +
                            least_pressure * pc0;
    // The first stress has moduli of its own: no steps are small enough there.
    const bool first = sigma == VoigtOf<Number>{};
    const double change = first ? 0 : distance(trial, sigma);
    const auto take = [this](const auto& strain, auto& stress, auto* state_variables) {
      return step(strain, stress, state_variables);
    };
    if (increment.large && !first)
      return smooth_steps<states>(take, increment.strain, pressure, sigma, s) ||
             land_in_steps(*this, increment, sigma, s);
    return accurate_step<states>(take, increment.strain, change, pressure, sigma, s);
  }

  /// An increment for which no step is small enough: an implicit step without an estimate of its
  /// error, or where that does not converge the elastic stress, drawn towards the centre of the
  /// yield surface, which hardens with the plastic volume change of a first estimate.
  template <class Number>
  void land(const IncrementOf<Number>& increment, VoigtOf<Number>& sigma, Number* s) const {
    VoigtOf<Number> stepped = sigma;
    std::array<Number, states> after;
    std::copy_n(s, std::size_t{states}, after.begin());
    if (step(increment.strain, stepped, after.data()) && all_finite(stepped, after)) {
      sigma = stepped;
      std::copy_n(after.begin(), std::size_t{states}, s);
      return;
    }
    using std::exp;
    set_moduli(sigma, s);
    const SoilStressOf<Number> trial = trial_stress(sigma, increment.strain, s);
    const Number M = slope(trial), before = s[pc];
    s[void_ratio] =
        (1 + s[void_ratio]) * exp(increment.strain[0] + increment.strain[1] + increment.strain[2]) -
        1;
    SoilStressOf<Number> now = drawn_inside(trial, M, s);
    const Number upsilon =
        std::min<Number>(1 + s[void_ratio], most_specific_volume) / (lambda - kappa);
    const Number volumetric = (trial.p - now.p) / s[bulk_modulus];
    s[pc] = std::max<Number>(least_pc * pc0,
                             before * exp(std::clamp<Number>(upsilon * volumetric, -1.0, 1.0)));
    s[subloading_r] = 1;
    now = drawn_inside(trial, M, s);
    s[delta_phi] = 0;
    s[dpvstrain] = (trial.p - now.p) / s[bulk_modulus];
    s[dpdstrain] = (trial.q - now.q) / (std::sqrt(6.0) * s[shear_modulus]);
    s[pvstrain] += s[dpvstrain];
    s[pdstrain] += s[dpdstrain];
    if (bonding) s[chi] *= exp(-m_degradation * s[dpdstrain]);
    set_bonds(s);
    now = drawn_inside(now, M, s);
    if (subloading) s[subloading_r] = ratio(now, M, s);
    s[f_function] = yield_function(now, M, s);
    sigma = stress_of(trial, now.p, now.q, trial.theta);
  }

  /// One implicit step, however large. Returns whether it converged.
  template <class Number>
  bool step(const VoigtOf<Number>& strain, VoigtOf<Number>& sigma, Number* s) const {
    using std::exp;
    set_moduli(sigma, s);
    const SoilStressOf<Number> trial = trial_stress(sigma, strain, s);
    const Number M = slope(trial);
    const Return<Number> r = {
        trial.p,
        trial.q,
        M,
        s[bulk_modulus],
        s[shear_modulus],
        std::min<Number>(1 + s[void_ratio], most_specific_volume) / (lambda - kappa),
        value_of(std::max({s[pc] + s[pcd] + 2 * s[pcc], abs_of(trial.p), trial.q / M})),
        s[pc],
        s[chi],
        s[subloading_r]};
    const Number volumetric = strain[0] + strain[1] + strain[2];
    if (!as_cbgeo) s[void_ratio] = (1 + s[void_ratio]) * exp(volumetric) - 1;
    s[delta_phi] = s[dpvstrain] = s[dpdstrain] = 0;
    const Number R = subloading ? s[subloading_r] : Number(1);
    const Number size = R * (s[pc] + s[pcd] + s[pcc]);
    const Number F = trial.q * trial.q / (M * M) + (trial.p + s[pcc]) * (trial.p - size);
    if (F <= newton_tolerance * r.scale * r.scale) {
      if (subloading) s[subloading_r] = ratio(trial, M, s);
      s[f_function] = yield_function(trial, M, s);
      sigma = stress_of(trial, trial.p, trial.q, trial.theta);
      return true;
    }
    std::array<Number, 2> x;
    if (!solve(r, x)) return false;
    const Plastic<Number> end = plastic(r, x);
    SoilStressOf<Number> now = trial;
    now.p = end.p;
    now.q = end.q;
    sigma = stress_of(trial, now.p, now.q, trial.theta);
    s[pc] = end.pc;
    s[chi] = end.chi;
    set_bonds(s);
    s[subloading_r] = end.R;
    s[delta_phi] = x[0] / r.scale;
    s[dpvstrain] = end.volumetric;
    s[dpdstrain] = end.deviatoric;
    if (as_cbgeo) s[void_ratio] += (1 + initial_void_ratio()) * volumetric;
    s[pvstrain] += s[dpvstrain];
    s[pdstrain] += s[dpdstrain];
    s[f_function] = yield_function(now, M, s);
    return true;
  }

 private:
  /// A stress, with its Lode angle where the law depends on it.
  template <class Number>
  SoilStressOf<Number> of(const VoigtOf<Number>& sigma) const {
    const SoilStressOf<Number> s = soil_stress(sigma);
    return three_invariants ? with_lode_angle(s) : s;
  }
  SoilStress of(const double* stress) const {
    Voigt sigma;
    std::copy_n(stress, 6, sigma.begin());
    return of(sigma);
  }
  /// The elastic stress of a step.
  template <class Number>
  SoilStressOf<Number> trial_stress(const VoigtOf<Number>& sigma, const VoigtOf<Number>& strain,
                                    const Number* s) const {
    VoigtOf<Number> trial = elastic_trial(sigma, strain, s[bulk_modulus], s[shear_modulus]);
    leave_axes<6>(trial.data(), value_of(s[bulk_modulus]), three_invariants);
    return of(trial);
  }

  template <class Number>
  static bool all_finite(const VoigtOf<Number>& sigma, const std::array<Number, states>& s) {
    // What follows from the stress is found where it is asked for: a law does not read it.
    bool finite = true;
    for (const Number& value : sigma) finite = finite && std::isfinite(value_of(value));
    for (std::size_t k = 0; k < states; ++k)
      finite = finite && (state[k].of_stress || std::isfinite(value_of(s[k])));
    return finite;
  }

  /// A stress on the line to the centre of the yield ellipse, not beyond it.
  template <class Number>
  SoilStressOf<Number> drawn_inside(const SoilStressOf<Number>& at, const Number& M,
                                    const Number* s) const {
    using std::hypot;
    const Number size = s[pc] + s[pcd], half = 0.5 * (size + 2 * s[pcc]), centre = half - s[pcc];
    const Number distance = hypot(at.p - centre, at.q / M);
    const Number keep = distance > half ? half / distance : Number(1);
    SoilStressOf<Number> inside = at;
    inside.p = centre + keep * (at.p - centre);
    inside.q = keep * at.q;
    return inside;
  }

  /// What the equations of a plastic step are made of.
  template <class Number>
  struct Return {
    Number p, q;  ///< of the elastic stress [Pa]
    Number M, K, G, upsilon;
    double scale;       ///< [Pa] of stresses in the equations
    Number pc, chi, R;  ///< at the beginning
  };
  template <class D>
  struct Plastic {
    std::array<D, 2> residual;
    D p, q, pc, chi, R, volumetric, deviatoric;
  };

  /// Unknowns of a plastic step; false if its equations do not converge.
  bool solve(const Return<double>& r, std::array<double, 2>& x) const {
    x = {0, 0};
    // pc changes at most e-fold in an iteration.
    const double most = r.K / (r.upsilon * r.scale);
    const auto residual = [&](const Duals<2>& unknown) { return plastic(r, unknown).residual; };
    return newton<2>(residual, x, {1e3, most}) && !(x[0] < 0);
  }
  template <std::size_t N>
  bool solve(const Return<Dual<N>>& r, std::array<Dual<N>, 2>& x) const {
    const Return<double> values = {
        value_of(r.p),       value_of(r.q), value_of(r.M),  value_of(r.K),   value_of(r.G),
        value_of(r.upsilon), r.scale,       value_of(r.pc), value_of(r.chi), value_of(r.R)};
    std::array<double, 2> root;
    if (!solve(values, root)) return false;
    const Duals<2> unknown{Dual<2>::unknown(root[0], 0), Dual<2>::unknown(root[1], 1)};
    const std::array<Dual<N>, 2> constant{root[0], root[1]};
    x = implicit_solution(root, plastic(values, unknown).residual, plastic(r, constant).residual);
    return true;
  }

  /// Equations of a step, in units of `scale`: flow and yield. Unknowns: scale * dphi and K
  /// d(eps_v^p) / scale. They, or what is known, may carry derivatives.
  template <class Number, class D>
  Plastic<D> plastic(const Return<Number>& r, const std::array<D, 2>& x) const {
    using std::exp, std::max, std::pow, std::sqrt;
    Plastic<D> e;
    const D phi = x[0] * (1 / r.scale);
    e.volumetric = x[1] * (r.scale / r.K);
    e.p = r.p - x[1] * r.scale;
    e.q = r.q / (1.0 + 6 * r.G / (r.M * r.M) * phi);
    e.deviatoric = std::sqrt(6.0) / (r.M * r.M) * phi * e.q;
    e.pc = max(D(least_pc * pc0), r.pc * exp(r.upsilon * e.volumetric));
    e.chi = D(r.chi);
    D pcd_end(0), pcc_end(0);
    if (bonding) {
      e.chi = r.chi * exp(-m_degradation * e.deviatoric);
      pcd_end = mc_a * pow(s_h * e.chi, mc_b);
      pcc_end = mc_c * pow(s_h * e.chi, mc_d);
    }
    e.R = D(1);
    if (subloading) {
      // The square root of nothing has no derivative; added is what no strain could show.
      const D strain = sqrt(e.volumetric * e.volumetric + e.deviatoric * e.deviatoric + 1e-40);
      e.R = grown(r.R, D(subloading_u * (1.0 + (pcd_end + pcc_end) / e.pc) * strain));
    }
    const D size = e.R * (e.pc + pcd_end + pcc_end);
    const D dF_dp = 2.0 * e.p + pcc_end - size;
    e.residual[0] = x[1] - (r.K / r.scale) * phi * dF_dp;
    const D F = e.q * e.q * (1 / (r.M * r.M)) + (e.p + pcc_end) * (e.p - size);
    e.residual[1] = F * (1 / (r.scale * r.scale));
    return e;
  }

  /// R at the end of a step: R + c ln R = R_n, c = u (1 + ...) |d(eps^p)|. The left side is concave
  /// and grows, so that Newton's method from R_n, which is below the root, does not pass it.
  template <class Number, class D>
  static D grown(const Number& begin, const D& c) {
    const double R_n = value_of(begin), factor = value_of(c);
    double R = R_n;
    if (R_n >= 1) return D(1);
    for (int i = 0; i < newton_iterations; ++i) {
      const double change = (R_n - R - factor * std::log(R)) / (1 + factor / R);
      R = std::min(R + change, 1.0);
      if (std::abs(change) <= 1e-15 * R) break;
    }
    if constexpr (is_dual<Number>)
      return implicit_root(R, D(c * std::log(R) - begin), 1 + factor / R);
    else if constexpr (is_dual<D>)
      return c.chain(R, -std::log(R) / (1 + factor / R));
    else
      return R;
  }

  /// R of the subloading surface through a stress.
  template <class Number>
  Number ratio(const SoilStressOf<Number>& now, const Number& M, const Number* s) const {
    const Number size = s[pc] + s[pcd] + s[pcc];
    const Number R = now.p + s[pcc] > 0
                         ? (now.q * now.q / (M * M) / (now.p + s[pcc]) + now.p) / size
                         : Number(0);
    return std::clamp<Number>(R, least_r, 1.0);
  }

  template <class Number>
  Number slope(const SoilStressOf<Number>& now) const {
    return three_invariants ? strength_ratio(m, now.theta) : Number(m);
  }
  template <class Number>
  static Number abs_of(const Number& value) {
    using std::abs;
    return abs(value);
  }

  /// Those of the stress at the beginning of a step.
  template <class Number>
  void set_moduli(const VoigtOf<Number>& sigma, Number* s) const {
    const Number before = -(sigma[0] + sigma[1] + sigma[2]) / 3;
    if (as_cbgeo && !(before > 0)) return;
    const double G_of_K = 3 * (1 - 2 * poisson_ratio) / (2 * (1 + poisson_ratio));
    Number K = as_cbgeo                     ? (1 + s[void_ratio]) / kappa * before
               : sigma == VoigtOf<Number>{} ? Number(youngs_modulus / (3 * (1 - 2 * poisson_ratio)))
                                            : swelling_modulus(s[void_ratio], kappa, before, pc0);
    if (bonding) K += m_shear * s[chi] * s_h / G_of_K;
    s[bulk_modulus] = K;
    s[shear_modulus] = G_of_K * K;
  }

  template <class Number>
  void set_bonds(Number* s) const {
    using std::pow;
    s[pcd] = bonding ? mc_a * pow(s[chi] * s_h, mc_b) : Number(0);
    s[pcc] = bonding ? mc_c * pow(s[chi] * s_h, mc_d) : Number(0);
  }

  template <class Number>
  Number yield_function(const SoilStressOf<Number>& now, const Number& M, const Number* s) const {
    return now.q * now.q / (M * M) +
           (now.p + s[pcc]) * (now.p - s[subloading_r] * (s[pc] + s[pcd] + s[pcc]));
  }
};

}  // namespace lahar
