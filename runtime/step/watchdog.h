/// \file What ends a run whose results cannot be right any more: energy out of nothing, speeds and
/// volumes without a meaning, a time step that falls to nothing.
///
/// All ranks judge the same exact sums of the same steps, so that all find the same; the run ends
/// max_lead steps later, and nobody waits for anything.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "graph/stage.h"
#include "io/run/checkpoint_header.h"
#include "io/run/history.h"
#include "physics/base/error.h"
#include "physics/particles/patch.h"
#include "runtime/comm/communicator.h"

namespace lahar {

/// Steps between looks at sums, speeds and volumes. On one core a look costs about 1.5 ns per
/// particle, a step 12 and more.
inline constexpr Step watch_steps = 64;

/// The run ended after a whole step, because the watchdog said so or no next one was found: its
/// state can be kept.
class WholeStepError : public SimulationError {
  using SimulationError::SimulationError;
};
class WatchdogError : public WholeStepError {
  using WholeStepError::WholeStepError;
};

/// Speeds that mean something in a model [m/s].
struct SpeedScales {
  double waves = 0;         ///< fastest longitudinal waves of the materials
  double start = 0;         ///< of particles at the start
  double prescribed = 0;    ///< of particles and nodes, and of particles that are injected
  double acceleration = 0;  ///< [m/s^2] largest that nodes are given, which makes speeds with time
  double fall = 0;          ///< by gravity, through the whole mesh
};

/// Those of a model, but for `start`. Collective.
template <int Dim>
SpeedScales speed_scales(const Model<Dim>& model, const Communicator& ranks);

/// Judges a run, step by step and in order.
class WatchdogJudge {
 public:
  WatchdogJudge() = default;
  WatchdogJudge(const Watchdog& bounds, SpeedScales scales) : bounds_(bounds), scales_(scales) {}

  bool on() const { return bounds_.action != Watchdog::Action::none; }
  bool stops() const { return bounds_.action == Watchdog::Action::stop; }
  const Watchdog& bounds() const { return bounds_; }

  /// What is wrong with the sums after a step; `strained`: some volume is beyond its bounds.
  std::optional<WatchdogAlarm> judge(const HistoryRow& row, double kinetic_at_start, bool strained);
  /// With an adaptive step that begins at `time` [s]. May be called beside judge().
  std::optional<WatchdogAlarm> judge_step(Step step, double time, double dt);
  /// [J] What energies of a body of that mass [kg] are compared with: what was put in, or what
  /// makes small strains and falls.
  double energy_scale(double mass) const;
  /// Whether an alarm of an earlier run would not be one with these bounds.
  bool allows(const WatchdogAlarm& alarm) const;

  /// What a run has to remember.
  WatchdogState state;

 private:
  std::optional<WatchdogAlarm> judge_energy(const HistoryRow& row, double kinetic_at_start) const;
  std::optional<WatchdogAlarm> judge_speed(const HistoryRow& row) const;

  Watchdog bounds_{.action = Watchdog::Action::none};
  SpeedScales scales_;
};

/// The most elastic energy that the stresses of a patch may hold [J].
template <int Dim>
double stored_energy(const Patch<Dim>& patch, const Model<Dim>& model);

/// Whether the volume of some particle is beyond the bounds.
template <int Dim>
bool is_strained(const Patch<Dim>& patch, const Model<Dim>& model);

/// A particle that shows best what is wrong, of one patch: the larger `measure`, the better; of
/// equals the smaller id.
struct WatchedParticle {
  double measure = -1;
  Index id = -1;
  std::string text;
};
template <int Dim>
WatchedParticle watched_particle(WatchdogAlarm::Kind kind, const Patch<Dim>& patch,
                                 const Model<Dim>& model);

/// Whether a free surface that moves makes energy in each step, as cells become filled or empty for
/// the pressure: the more, the shorter steps are.
bool is_made_at_surface(const Analysis& analysis);
/// What helps there, as sentences.
inline constexpr std::string_view help_at_surface =
    "In a projection, a free surface that moves makes some energy and volume in each step, so that "
    "shorter steps make it worse. Take half the cell with the same step, longer steps, "
    "\"per_cell\": 3, or explicit steps (no \"mpm_scheme\"), whose energy closes.";

/// The message that ends a run: what is wrong, where, why most likely, and what to do. `at`: the
/// step after which the particle that `where` describes was looked for.
template <int Dim>
std::string watchdog_message(const WatchdogAlarm& alarm, Step at, const std::string& where,
                             const Model<Dim>& model);
/// The same where the run goes on.
std::string watchdog_warning(const WatchdogAlarm& alarm);

}  // namespace lahar
