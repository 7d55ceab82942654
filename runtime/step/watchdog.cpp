#include "runtime/step/watchdog.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "physics/kernels/kernels.h"
#include "physics/materials/law.h"
#include "runtime/exchange/failure.h"

namespace lahar {

namespace {

/// Energies of this strain in all of the material are too small to be judged [-].
constexpr double small_strain = 1e-3;
/// And those of a fall through this share of the mesh [-].
constexpr double small_fall = 1e-2;

/// The key that bounds it.
const char* key_of(WatchdogAlarm::Kind kind) {
  switch (kind) {
    case WatchdogAlarm::Kind::energy:
      return "energy";
    case WatchdogAlarm::Kind::speed:
      return "speed";
    case WatchdogAlarm::Kind::time_step:
      return "time_step";
    default:
      return "compression and analysis.watchdog.expansion";
  }
}

template <int Dim>
double largest_factor(const Model<Dim>& model, int function) {
  if (function < 0) return 1;
  return model.functions[static_cast<std::size_t>(function)].largest();
}

template <int Dim>
double relative_volume(const Particles<Dim>& particles, Local p, const Model<Dim>& model) {
  const double density = model.materials[particles.material[static_cast<std::size_t>(p)]].density;
  return particles.row(Column::volume)[p] * density / particles.row(Column::mass)[p];
}

template <int Dim>
double speed_of(const Particles<Dim>& particles, Local p) {
  double square = 0;
  for (int d = 0; d < Dim; ++d) {
    const double v = particles.row(Column::v, d)[p];
    square += v * v;
  }
  return std::sqrt(square);
}

/// Where an alarm comes from most likely, and what helps.
template <int Dim>
std::string advice(WatchdogAlarm::Kind kind, const Model<Dim>& model) {
  const Analysis& a = model.analysis;
  if (kind == WatchdogAlarm::Kind::volume)
    return "Likely causes: material that is too soft for its loads (are moduli in Pa?), or an "
           "unstable computation.";
  if (is_made_at_surface(a))
    return fmt::format(
        "Likely cause: the free surface. {} Check material parameters and loads, too.",
        help_at_surface);
  std::string text = "Likely cause: the computation is unstable.";
  if (a.affine != Affine::none && a.functions == ShapeFunctions::element)
    text += fmt::format(
        " \"velocity_update\": \"{}\" with the functions of elements makes energy where material "
        "comes apart: use \"flip\", or \"shape_functions\": \"gimp\".",
        a.transfer.separation > 0.0 ? "asflip"
        : a.affine == Affine::apic  ? "apic"
                                    : "tpic");
  text += a.step.adaptive
              ? fmt::format(" Try a \"safety\" below {:g} in \"time_step\"", a.step.safety)
              : fmt::format(" Try a time step below {:g} s", a.step.dt);
  if (a.scheme != Scheme::musl && !begins_with_solve(a)) text += ", or \"mpm_scheme\": \"musl\"";
  return text + "; and check material parameters and loads.";
}

}  // namespace

bool is_made_at_surface(const Analysis& analysis) {
  return is_projection(analysis) && !analysis.two_phase && analysis.projection.free_surface;
}

template <int Dim>
SpeedScales speed_scales(const Model<Dim>& model, const Communicator& ranks) {
  SpeedScales scales;
  for (const Material& material : model.materials)
    scales.waves = std::max(scales.waves, wave_speed(material));
  double prescribed = 0, acceleration = 0;
  for (const ParticleVelocity& given : model.particle_velocities)
    prescribed = std::max(prescribed, std::sqrt(Dim) * std::abs(given.velocity) *
                                          largest_factor(model, given.function));
  for (const auto& given : entries_of<NodeVelocity>(model)) {
    const bool integrated =
        given.function >= 0 && model.functions[static_cast<std::size_t>(given.function)].integrated;
    double& most = integrated ? acceleration : prescribed;
    most = std::max(
        most, std::sqrt(Dim) * std::abs(given.velocity) * largest_factor(model, given.function));
  }
  for (const Injection<Dim>& injection : model.injections)
    prescribed = std::max(prescribed, injection.velocity.norm());
  for (const auto& given : entries_of<NodeAcceleration>(model))
    acceleration = std::max(acceleration, std::sqrt(Dim) * std::abs(given.acceleration) *
                                              largest_factor(model, given.function));
  scales.prescribed = ranks.max(prescribed);
  scales.acceleration = ranks.max(acceleration);
  const auto [low, high] = model.mesh->bounds();
  scales.fall = std::sqrt(2 * largest_factor(model, model.gravity_function) *
                          model.gravity.cwiseAbs().dot(high - low));
  return scales;
}

std::optional<WatchdogAlarm> WatchdogJudge::judge(const HistoryRow& row, double kinetic_at_start,
                                                  bool strained) {
  state.put_in =
      std::max(state.put_in, state.stored + kinetic_at_start + std::max(0.0, row.external));
  if (!(row.mass > 0)) return {};
  if (auto alarm = judge_energy(row, kinetic_at_start)) return alarm;
  if (auto alarm = judge_speed(row)) return alarm;
  if (!strained) return {};
  return WatchdogAlarm{.kind = WatchdogAlarm::Kind::volume,
                       .step = row.step,
                       .time = row.time,
                       .text = fmt::format("a particle has less than {:g} or more than {:g} times "
                                           "the volume of its density at the start.",
                                           bounds_.compression, bounds_.expansion)};
}

double WatchdogJudge::energy_scale(double mass) const {
  return std::max(state.put_in, mass * (0.5 * std::pow(small_strain * scales_.waves, 2) +
                                        0.5 * small_fall * std::pow(scales_.fall, 2)));
}

std::optional<WatchdogAlarm> WatchdogJudge::judge_energy(const HistoryRow& row,
                                                         double kinetic_at_start) const {
  // What stresses gave cannot be more than what they held.
  const double made = row.kinetic - kinetic_at_start + row.damping - row.external +
                      std::max(row.internal, -state.stored);
  const double put_in = energy_scale(row.mass), ratio = made / put_in;
  if (bounds_.energy <= 0 || !(ratio > bounds_.energy)) return {};
  return WatchdogAlarm{
      .kind = WatchdogAlarm::Kind::energy,
      .step = row.step,
      .time = row.time,
      .value = ratio,
      .text = fmt::format("{:.3g} J of energy came out of nothing, {:.3g} times the {:.3g} J that "
                          "were put in; {:g} times are allowed.",
                          made, ratio, put_in, bounds_.energy)};
}

std::optional<WatchdogAlarm> WatchdogJudge::judge_speed(const HistoryRow& row) const {
  const double work = std::sqrt(2 * state.put_in / row.mass);
  const double meaningful = std::max({scales_.waves, state.speed, scales_.prescribed,
                                      scales_.acceleration * row.time, scales_.fall, work});
  const double ratio = row.max_speed / meaningful;
  if (bounds_.speed <= 0 || !(ratio > bounds_.speed)) return {};
  return WatchdogAlarm{
      .kind = WatchdogAlarm::Kind::speed,
      .step = row.step,
      .time = row.time,
      .value = ratio,
      .text = fmt::format(
          "the largest speed is {:.3g} m/s, {:.3g} times the largest of these: waves {:.3g} m/s, "
          "speeds at the start {:.3g} m/s, prescribed ones {:.3g} m/s, a fall through the mesh "
          "{:.3g} m/s, what the work from outside is good for {:.3g} m/s; {:g} times are allowed.",
          row.max_speed, ratio, scales_.waves, state.speed,
          std::max(scales_.prescribed, scales_.acceleration * row.time), scales_.fall, work,
          bounds_.speed)};
}

std::optional<WatchdogAlarm> WatchdogJudge::judge_step(Step step, double time, double dt) {
  if (!std::isfinite(dt)) return {};
  if (!(state.first_step > 0)) state.first_step = dt;
  const double share = dt / state.first_step;
  const bool stands = time + dt == time;
  if (!stands && !(share < bounds_.time_step)) return {};
  return WatchdogAlarm{
      .kind = WatchdogAlarm::Kind::time_step,
      .step = step,
      .time = time,
      .value = share,
      .text = stands
                  ? fmt::format("the time step of {:.3g} s does not change the time any more.", dt)
                  : fmt::format("the time step fell to {:.3g} s, {:.3g} times the first, {:.3g} "
                                "s; {:g} times are allowed.",
                                dt, share, state.first_step, bounds_.time_step)};
}

bool WatchdogJudge::allows(const WatchdogAlarm& alarm) const {
  switch (alarm.kind) {
    case WatchdogAlarm::Kind::energy:
      return bounds_.energy <= 0 || alarm.value <= bounds_.energy;
    case WatchdogAlarm::Kind::speed:
      return bounds_.speed <= 0 || alarm.value <= bounds_.speed;
    default:
      return true;  // found again in the next step, or when volumes are looked at
  }
}

template <int Dim>
double stored_energy(const Patch<Dim>& patch, const Model<Dim>& model) {
  // 1 / (2 E) and 1 / (4 G), as multiples of 1 / M, are less than this up to a Poisson ratio of
  // 0.49.
  constexpr double compliance = 10;
  double energy = 0;
  patch.for_each_particle([&](Local p) {
    double square = 0;
    for (int c = 0; c < stress_components<Dim>; ++c) {
      const double s = patch.particles.row(Column::stress, c)[p];
      square += s * s;
    }
    const auto material = patch.particles.material[static_cast<std::size_t>(p)];
    const double modulus = wave_modulus(model.materials[material].law);
    if (modulus > 0)  // else it has no elastic stress
      energy += patch.particles.row(Column::volume)[p] * square * compliance / modulus;
  });
  return energy;
}

template <int Dim>
bool is_strained(const Patch<Dim>& patch, const Model<Dim>& model) {
  const Watchdog& bounds = model.watchdog;
  const double largest =
      bounds.expansion > 0 ? bounds.expansion : std::numeric_limits<double>::infinity();
  bool strained = false;
  patch.for_each_particle([&](Local p) {
    const double J = relative_volume(patch.particles, p, model);
    strained = strained || J < bounds.compression || J > largest;
  });
  return strained;
}

template <int Dim>
WatchedParticle watched_particle(WatchdogAlarm::Kind kind, const Patch<Dim>& patch,
                                 const Model<Dim>& model) {
  WatchedParticle best;
  const auto look = [&](Local p, double measure) {
    const Index id = patch.particles.id[static_cast<std::size_t>(p)];
    if (measure < best.measure || (measure == best.measure && id > best.id)) return;
    best.measure = measure;
    best.id = id;
    best.text = describe_particle(patch.particles, p);
    if (kind == WatchdogAlarm::Kind::volume)
      best.text += fmt::format(", {:.3g} times its first volume",
                               relative_volume(patch.particles, p, model));
  };
  if (kind == WatchdogAlarm::Kind::time_step) {
    Local p = -1;
    const double limit = time_step_limit<Dim>(patch, model, patch.bins, &p);
    if (p >= 0) look(p, 1 / limit);
  } else {
    patch.for_each_particle([&](Local p) {
      if (kind == WatchdogAlarm::Kind::volume) {
        const double J = relative_volume(patch.particles, p, model);
        look(p, std::max(J / model.watchdog.expansion, model.watchdog.compression / J));
      } else {
        look(p, speed_of(patch.particles, p));
      }
    });
  }
  return best;
}

namespace {

std::string found(const WatchdogAlarm& alarm) {
  return fmt::format("step {} (t = {:.6g} s): {}", alarm.step, alarm.time, alarm.text);
}

}  // namespace

template <int Dim>
std::string watchdog_message(const WatchdogAlarm& alarm, Step at, const std::string& where,
                             const Model<Dim>& model) {
  const char* what = alarm.kind == WatchdogAlarm::Kind::volume ? "The most compressed or expanded"
                     : alarm.kind == WatchdogAlarm::Kind::time_step ? "The step is limited by the"
                                                                    : "The fastest";
  return fmt::format(
      "{} {} particle after step {}: {}. {} If the results are right nevertheless, change "
      "analysis.watchdog.{}, or set \"action\": \"warn\" there.",
      found(alarm), what, at, where, advice(alarm.kind, model), key_of(alarm.kind));
}

std::string watchdog_warning(const WatchdogAlarm& alarm) {
  return found(alarm) +
         " The run goes on (\"action\": \"stop\" in analysis.watchdog would end it).";
}

#define LAHAR_INSTANTIATE(Dim)                                                          \
  template SpeedScales speed_scales(const Model<Dim>&, const Communicator&);            \
  template double stored_energy(const Patch<Dim>&, const Model<Dim>&);                  \
  template bool is_strained(const Patch<Dim>&, const Model<Dim>&);                      \
  template WatchedParticle watched_particle(WatchdogAlarm::Kind, const Patch<Dim>&,     \
                                            const Model<Dim>&);                         \
  template std::string watchdog_message(const WatchdogAlarm&, Step, const std::string&, \
                                        const Model<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
