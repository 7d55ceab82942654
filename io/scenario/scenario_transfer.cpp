// Velocity transfer between particles and nodes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "io/scenario/scenario_builder.h"
#include "physics/materials/law.h"

namespace lahar {

namespace {

// Share of a wave of wave number q that mapping to nodes and back takes, over q^2 h^2: half of the
// variance of both mappings together.
double smoothing(ShapeFunctions functions, int order) {
  switch (functions) {
    case ShapeFunctions::element:
      break;
    case ShapeFunctions::quadratic_spline:
      return 1.0 / 4.0;
    case ShapeFunctions::cubic_spline:
      return 1.0 / 3.0;
    default:  // domains of half a cell
      return 3.0 / 16.0;
  }
  return order > 1 ? 1.0 / 12.0 : 1.0 / 6.0;
}

/// A liquid's own viscosity matters where it is above this share of the transfer's.
constexpr double viscous_share = 0.1;

/// Kinematic viscosity [m^2/s] of the least viscous liquid that has one; 0 where there are others.
template <int Dim>
double least_viscosity(const Model<Dim>& model) {
  double least = std::numeric_limits<double>::infinity();
  for (const Material& material : model.materials) {
    double viscosity = 0;
    if (const auto* law = std::get_if<Newtonian>(&material.law)) viscosity = law->dynamic_viscosity;
    if (const auto* law = std::get_if<Bingham>(&material.law)) viscosity = law->mu;
    least = std::min(least, viscosity / material.density);
  }
  return std::isinf(least) ? 0.0 : least;
}

}  // namespace

bool is_elastic(const Law& law) {
  return std::holds_alternative<LinearElastic>(law) || std::holds_alternative<NeoHookean>(law);
}

template <int Dim>
void ScenarioBuilder<Dim>::build_velocity_update(const JsonValue& analysis) {
  const JsonValue* update = analysis.find("velocity_update");
  const JsonValue* settings = analysis.find("velocity_update_settings");
  const std::string name = !update               ? "flip"
                           : !update->is<bool>() ? update->as<std::string>()
                           : update->as<bool>()  ? "pic"
                                                 : "flip";
  VelocityTransfer& transfer = model_.analysis.transfer;
  const bool of_order = name == "xpic" || name == "fmpm", separates = name == "asflip";
  transfer.flip = name == "flip" || separates ? 1.0 : 0.0;
  transfer.order = of_order ? 2 : 1;
  transfer.filters_change = name == "fmpm";
  transfer.separation = separates ? 1.0 : 0.0;
  model_.analysis.affine = name == "apic" || separates ? Affine::apic
                           : name == "tpic"            ? Affine::tpic
                                                       : Affine::none;
  if (model_.analysis.affine == Affine::apic && mesh_ && info(mesh_->element()).order > 1)
    in_.error(*update,
              fmt::format("'velocity_update': \"{}\" does not go together with {} cells: their "
                          "functions reproduce second moments, so that particles have none",
                          name, info(mesh_->element()).name),
              "take \"tpic\", which gives nodes the velocity gradient, or linear elements");
  if (!settings) return;
  if (name == "pic")
    return in_.error(*settings, "'velocity_update_settings' does not apply to PIC",
                     "set velocity_update to \"flip\" to blend");
  const auto ratio = get_number(*settings, "blending_ratio");
  relaxation_ = get_number(*settings, "relaxation");
  relaxation_time_ = get_number(*settings, "relaxation_time");
  viscosity_ = get_number(*settings, "viscosity");
  viscosity_length_ = get_number(*settings, "viscosity_length");
  if (ratio.has_value() + (relaxation_ || viscosity_ || viscosity_length_) +
          relaxation_time_.has_value() >
      1)
    in_.error(*settings,
              "'blending_ratio', 'relaxation_time', and 'relaxation' with 'viscosity' all say how "
              "much of its own velocity a particle keeps",
              "leave one of them");
  if (ratio && in_.cbgeo_defaults)
    transfer.flip = *ratio;
  else if (ratio)
    relaxation_ = -std::log(*ratio);  // infinite where nothing is kept
  if (const auto share = get_number(*settings, "separation")) {
    if (!separates)
      in_.error(*settings->find("separation"),
                fmt::format("'separation' does not apply to \"{}\": its particles move with the "
                            "nodes",
                            name),
                "leave it out, or set velocity_update to \"asflip\"");
    transfer.separation = *share;
  }
  if (viscosity_ && separates)
    in_.error(*settings->find("viscosity"),
              "'viscosity' does not go together with \"asflip\": nodes have the gradients of its "
              "affine field, and what it takes is not that of a viscosity",
              "give 'relaxation' or 'relaxation_time'");
  if (viscosity_length_ && viscosity_)
    in_.error(*settings->find("viscosity_length"),
              "'viscosity_length' and 'viscosity' are two viscosities of one transfer",
              "leave one of them");
  if (const auto order = get_integer(*settings, "order")) {
    transfer.order = static_cast<int>(*order);
    if (model_.analysis.affine != Affine::none && transfer.order > 1)
      in_.error(*settings->find("order"),
                fmt::format("'order' {} does not go together with \"{}\": its affine field takes "
                            "the place of a higher order",
                            transfer.order, name),
                "leave it out, or set velocity_update to \"flip\"");
  }
  if (viscosity_length_.value_or(0) > 0 && (transfer.order == 1 || relaxation_.value_or(0) == 0))
    in_.error(*settings->find("viscosity_length"),
              "'viscosity_length' acts beside a filter of order 2 or more",
              "give 'relaxation', which the filter takes, and 'order' 3");
  if (viscosity_ && transfer.order > 1 && relaxation_.value_or(0) == 0)
    in_.error(
        *settings->find("viscosity"),
        fmt::format("'viscosity' alone leaves nothing to a filter of order {}", transfer.order),
        "give 'relaxation' as well, which is what the filter takes, or order 1");
}

// Sums of integers do not depend on who has which particles.
template <int Dim>
Depths ScenarioBuilder<Dim>::depths() const {
  const double g = model_.gravity.norm();
  const ParticleTable<Dim>& particles = model_.particles;
  if (g == 0 || !mesh_) return {};
  const double unit = 0x1p-20 * outer_cell().prod();  // [m^3]
  constexpr double most_units = 0x1p31;               // of a particle, 2048 cells: no sum overflows
  std::vector<double> box(2 * Dim, -std::numeric_limits<double>::infinity());
  Index volume = 0;
  for (std::size_t p = 0; p < particles.x.size(); ++p) {
    const double area = particles.volume[p] / depth_at(model_.analysis, particles.x[p][0]);
    volume += std::llround(std::min(area / unit, most_units));
    for (int d = 0; d < Dim; ++d) {
      const auto low = static_cast<std::size_t>(2 * d);
      box[low] = std::max(box[low], -particles.x[p][d]);
      box[low + 1] = std::max(box[low + 1], particles.x[p][d]);
    }
  }
  box = team_.most(std::move(box));
  volume = team_.sum(volume);
  const Index count = team_.sum(static_cast<Index>(particles.x.size()));
  if (volume <= 0) return {};
  const double total = unit * static_cast<double>(volume);
  const double spacing = std::pow(total / static_cast<double>(count), 1.0 / Dim);
  double seen = 0;  // area of the box's faces as gravity sees them
  for (int d = 0; d < Dim; ++d) {
    double face = std::abs(model_.gravity[d]) / g;
    for (int e = 0; e < Dim; ++e) {
      const auto low = static_cast<std::size_t>(2 * e);
      if (e != d) face *= box[low] + box[low + 1] + spacing;
    }
    seen += face;
  }
  const double depth = total / seen, width = Dim == 2 ? seen : std::sqrt(seen);
  return {depth, std::min(depth, std::sqrt(depth * width))};
}

// Elastic bodies alone turn and bend for long: APIC takes nothing of these motions, where
// relaxation stops them. With domains of particles affine velocities make energy at free surfaces,
// and FLIP makes little noise. Steps are those of default_scheme().
template <int Dim>
bool ScenarioBuilder<Dim>::is_of_elastic_bodies() const {
  return mesh_ && !is_implicit(model_.analysis) && liquids_.empty() &&
         info(mesh_->element()).order == 1 &&
         std::all_of(model_.materials.begin(), model_.materials.end(),
                     [](const Material& material) { return is_elastic(material.law); });
}

// What relaxes noise whatever the stiffness, and a viscosity that does not depend on the cells: a
// run-out then does not either, where they are fine enough for the viscosity to rule. Grains that
// part and meet again make noise for which a filter of order 3 needs hardly any viscosity.
// Particles that cross cells make noise with functions of elements: these need more of both.
// Relaxation of order 1 goes with the speed of waves and is a viscosity, too. It has a limit for
// materials that flow: else water with its own modulus and stiff clay would be too viscous.
template <int Dim>
void ScenarioBuilder<Dim>::build_default_transfer() {
  JsonValue* analysis = root_.find("analysis");
  if (!analysis) return;
  const JsonValue* update = analysis->find("velocity_update");
  const bool separates =
      update && update->is<std::string>() && update->as<std::string>() == "asflip";
  const bool relaxes = separates && !in_.cbgeo_defaults && !relaxation_ && !relaxation_time_;
  if (!default_transfer_ && !relaxes) return;
  const Depths of = separates ? Depths() : depths();
  const double fall = of.mean, depth = all_fluids() ? 0.0 : of.flow;
  const bool smooth = model_.analysis.functions != ShapeFunctions::element;
  if (default_transfer_ && smooth && is_of_elastic_bodies()) {
    const bool affine = row_of(model_.analysis.functions).domain == ParticleDomain::none;
    if (affine) {
      model_.analysis.affine = Affine::apic;
      model_.analysis.transfer.flip = 0.0;
    }
    return set(*analysis, "velocity_update", std::string(affine ? "apic" : "flip"));
  }
  const bool of_grains = depth > 0 && smooth && any_granular() && liquids_.empty();
  relaxation_ = of_grains ? 0.03 : depth > 0 && smooth ? 0.01 : 0.05;
  if (!of_grains && fall > 0) {
    constexpr double stiff = 15;  // waves over the speed of what has fallen by the depth [-]
    const double most = stiff * std::sqrt(2 * model_.gravity.norm() * fall);
    double c = most;  // of what flows
    for (const Material& material : model_.materials)
      if (!is_elastic(material.law)) c = std::max(c, speed_of(material));
    *relaxation_ *= most / c;
  }
  if (const double own = least_viscosity(model_); depth == 0 && own > 0 && mesh_) {
    // What a viscous liquid has itself calms it, too; what is added beside it should not slow it.
    constexpr double beside = 0.01;  // of its own viscosity
    double c = std::numeric_limits<double>::infinity();
    for (const Material& material : model_.materials) c = std::min(c, speed_of(material));
    const double h = outer_cell().minCoeff();
    const double added =
        *relaxation_ * c * h * smoothing(model_.analysis.functions, info(mesh_->element()).order);
    if (!(added > 0))
      relaxation_ = 0.0;  // a projection without gravity: there are no waves to relax
    else if (own > viscous_share * added)
      *relaxation_ *= std::max(added - own, std::min(added, beside * own)) / added;
  }
  const auto setting = [&](double value) {
    JsonValue json;
    json.data = value;
    return json;
  };
  if (relaxes) {
    if (!analysis->find("velocity_update_settings"))
      set(*analysis, "velocity_update_settings", JsonValue::Object());
    return set(*analysis->find("velocity_update_settings"), "relaxation", *relaxation_);
  }
  JsonValue::Object settings{{"relaxation", analysis->offset, setting(*relaxation_)}};
  if (depth > 0) {
    const double share = of_grains ? 0.001 : smooth ? 0.0075 : 0.015;
    viscosity_ = share * std::sqrt(model_.gravity.norm() * std::pow(depth, 3));
    settings.push_back({"viscosity", analysis->offset, setting(*viscosity_)});
  }
  if (of_grains) {
    model_.analysis.transfer.order = 3;
    settings.push_back({"order", analysis->offset, setting(3)});
  }
  set(*analysis, "velocity_update_settings", std::move(settings));
}

// Of waves that steps follow [m/s]: of a liquid that does not change its volume those of its
// surface, of soil with such a liquid those of the skeleton.
template <int Dim>
double ScenarioBuilder<Dim>::speed_of(const Material& material) const {
  if (!is_projection(model_.analysis)) return wave_speed(material);
  if (material.liquid) return std::sqrt(wave_modulus(material.law) / material.density);
  return std::sqrt(model_.gravity.norm() * depths().mean);
}

// Rates are those of bodies.
template <int Dim>
void ScenarioBuilder<Dim>::build_transfer_rates() {
  const bool relaxes = relaxation_.value_or(0) > 0;  // as it is written
  build_default_transfer();
  Analysis& a = model_.analysis;
  if (a.transfer.separation > 0.0 && any_granular())
    in_.warning(
        *root_.find("analysis")->find("velocity_update"),
        "\"asflip\" hardly damps what moves from particle to particle: loose grains run out "
        "too far, and may make energy, which ends the run (analysis.watchdog)",
        "of granular flows leave 'velocity_update' out; \"asflip\" is for fluids and solids");
  if (const JsonValue* asked = section("analysis").find("velocity_update");
      asked && !in_.cbgeo_defaults && a.affine != Affine::none &&
      row_of(a.functions).domain != ParticleDomain::none)
    in_.warning(
        *asked,
        fmt::format("affine velocities with \"{}\" functions make energy at the surfaces of "
                    "bodies, unless steps are short",
                    row_of(a.functions).key),
        "take \"flip\", or splines, or a 'safety' of 0.2 in time_step");
  if (!mesh_ || !(relaxation_ || relaxation_time_ || viscosity_)) return;
  const double h = outer_cell().minCoeff();
  constexpr double none = std::numeric_limits<double>::infinity();
  std::vector<double> slowest(static_cast<std::size_t>(a.contact.bodies), none);  // [m/s]
  for (const Material& material : model_.materials) {
    double& c = slowest[static_cast<std::size_t>(material.body)];
    c = std::min(c, speed_of(material));
  }
  const bool still = std::all_of(slowest.begin(), slowest.end(), [](double c) { return c == 0.0; });
  if (const JsonValue* settings = section("analysis").find("velocity_update_settings");
      relaxes && still && is_projection(a)) {
    const JsonValue* at = settings->find("relaxation");
    if (!at) at = settings->find("blending_ratio");
    in_.warning(at ? *at : *settings,
                "this has no effect: relaxation goes with the speed of waves, and in a projection "
                "without gravity there are none",
                "give \"relaxation_time\" [s] in its place");
  }
  const double per_rate = smoothing(a.functions, info(mesh_->element()).order) * h * h;  // [m^2]
  if (a.transfer.order == 1 && a.affine == Affine::none) a.transfer.smoothing = per_rate;
  a.transfer.viscosity = viscosity_.value_or(0);
  double least = a.transfer.viscosity / per_rate;                            // [1/s]
  if (a.transfer.order > 1) a.transfer.viscous = std::exchange(least, 0.0);  // beside the filter
  a.transfer.viscosity_length = viscosity_length_.value_or(0);
  a.transfer.per_viscosity = 1.0 / per_rate;
  for (const double c : slowest)
    a.transfer.rates.push_back(relaxation_time_ ? 1.0 / *relaxation_time_
                               : still          ? least
                                                : std::max(relaxation_.value_or(0) * c / h, least));
  constexpr double too_much = 0.2;  // of a liquid's own viscosity
  const double added = a.transfer.smoothing * a.transfer.rates.front(),
               own = least_viscosity(model_);
  if (own > viscous_share * added && added > too_much * own)
    in_.warning(root_,
                fmt::format("the velocity transfer has a viscosity of {:.3g} m^2/s beside the "
                            "{:.3g} m^2/s of the liquid: it will flow too slowly",
                            added, own),
                "take smaller cells, or a smaller 'relaxation' in velocity_update_settings");
  if (std::all_of(a.transfer.rates.begin(), a.transfer.rates.end(),
                  [](double rate) { return rate == 0.0; })) {
    const double separation = a.transfer.separation;
    a.transfer = {};  // FLIP
    a.transfer.separation = separation;
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
