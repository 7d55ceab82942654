#include "runtime/program/safety_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "io/base/text.h"
#include "physics/base/error.h"
#include "physics/base/sort_unique.h"
#include "physics/kernels/imbalance.h"
#include "physics/materials/strength.h"
#include "physics/particles/loads.h"
#include "runtime/base/exit_codes.h"
#include "runtime/comm/rank_watch.h"
#include "runtime/program/case_run.h"
#include "runtime/program/run_description.h"
#include "runtime/program/signals.h"
#include "runtime/step/rest_test.h"
#include "runtime/step/restart.h"

namespace lahar {

namespace {

/// A body at rest. Where no equilibrium is left, a part of the body that slides has more out of
/// balance than this after the first moves.
constexpr UntilRest at_rest{.imbalance = 1e-4, .kinetic = 1e-8};
/// Cundall's factor: a body that is damped so comes to rest in few swings (Cundall 1987).
constexpr double local_damping = 0.7;
constexpr Index no_limit = 1'000'000'000'000;  ///< steps: FailureBounds::time ends a trial
constexpr double unlimited = std::numeric_limits<double>::infinity();
/// Of the stable step.
constexpr double step_share = 0.4;

/// Loads that depend on time keep the values of the end.
template <int Dim>
void freeze_loads(Model<Dim>& model, double end) {
  for (MathFunction& function : model.functions) {
    const double value = function(end);
    function = {};
    function.x = {0.0};
    function.f = {value};
  }
  for (auto& one : entries_of<NodeVelocity>(model)) one.velocity = 0;
  for (auto& body : model.rigid_bodies)
    if (body.motion == RigidBody<Dim>::Motion::prescribed) {
      body.velocity.setZero();
      body.spin.setZero();
    }
}

/// Explicit steps in place of quasi-static ones. They hold nodes by velocities.
template <int Dim>
void take_explicit_steps(Model<Dim>& model) {
  Analysis& analysis = model.analysis;
  analysis.scheme = Scheme::usl;
  analysis.step = {.adaptive = true, .dt = unlimited, .safety = step_share};
  analysis.damping = local_damping;
  auto& held = entries_of<NodeDisplacement>(model);
  auto& velocities = entries_of<NodeVelocity>(model);
  for (const NodeDisplacement& one : held)
    velocities.push_back({.node = one.node, .dir = one.dir, .velocity = 0});
  held.clear();
  std::stable_sort(velocities.begin(), velocities.end(),
                   [](const auto& a, const auto& b) { return a.node < b.node; });
}

template <int Dim>
void make_trial(Model<Dim>& model, double factor, double end) {
  reduce_strength(model, factor);
  freeze_loads(model, end);
  if (is_implicit(model.analysis)) take_explicit_steps(model);
  model.changes.removed.clear();
  model.changes.materials.clear();
  model.changes.reset_displacements = true;
  model.watchdog.action = Watchdog::Action::none;  // who fails need not keep energy
  Analysis& analysis = model.analysis;
  // Tests are made, and the trial decides: the first one sees stresses of full strength.
  analysis.until = {.imbalance = std::numeric_limits<double>::min()};
  analysis.first_step = 0;
  analysis.nsteps = no_limit;
  analysis.end_time = unlimited;
  OutputPlan& output = model.output;
  output.checkpoint_steps = 0;
  output.checkpoint_minutes = 0;
  output.frame_steps = 0;
  output.frame_dt = 0;
}

/// A trial is judged by the displacements of all particles.
void show_all(OutputPlan& output) {
  output.frame_fields.clear();
  output.frame_particles = nullptr;
}

/// After freeze_loads().
std::vector<double> gravity_of(const AnyModel& any) {
  return std::visit(
      [](const auto& model) {
        std::vector<double> g(model.gravity.data(), model.gravity.data() + model.gravity.size());
        for (double& component : g) component *= load_factor(model, model.gravity_function, 0.0);
        return g;
      },
      any);
}

/// Free rigid bodies, and where they are when a trial begins.
class FreeBodies {
 public:
  explicit FreeBodies(const AnyModel& model) {
    std::visit(
        [&](const auto& own) {
          using Motion = typename std::decay_t<decltype(own.rigid_bodies.front())>::Motion;
          for (const auto& body : own.rigid_bodies) free_.push_back(body.motion == Motion::free);
        },
        model);
  }
  bool any() const { return std::ranges::find(free_, true) != free_.end(); }
  void begin(std::vector<RigidBodyRow> at) { start_ = std::move(at); }
  /// So far [m] the furthest has moved.
  double way(const std::vector<RigidBodyRow>& now) const {
    double most = 0;
    for (std::size_t k = 0; k < std::min(now.size(), free_.size()); ++k) {
      if (!free_[k]) continue;
      double square = 0;
      for (std::size_t d = 0; d < 3; ++d)
        square += std::pow(now[k].place[d] - start_[k].place[d], 2);
      most = std::max(most, std::sqrt(square));
    }
    return most;
  }

 private:
  std::vector<RigidBodyRow> start_;
  std::vector<bool> free_;
};

/// Steps until it is known what comes of the trial. A body that fails moves on and on: twice as far
/// in twice the time, or further. One that consolidates moves with the root of time. One that rests
/// may have single particles that tremble; nodes do not feel them.
void follow(Simulation& simulation, const FailureBounds& bounds, const FreeBodies& bodies,
            bool has_pores, const Communicator& ranks, const std::function<bool()>& stopped,
            SafetyTrial& trial) {
  using End = SafetyTrial::End;
  const double ever_less = has_pores ? 1.5 : 1.25;  // times as far in twice the time
  // Who moves further than this without water to wait for has failed, though cells that lock hold
  // it.
  const double most = has_pores ? bounds.displacement : bounds.displacement / 3;
  double at_half = 0;  // [m] displacement after half of the time
  const auto decide = [&]() -> std::optional<End> {
    if (trial.displacement > bounds.displacement) return End::moved;
    if (is_at_rest(at_rest, simulation.info().rest)) return End::rest;
    if (simulation.time() <= bounds.time) return {};
    const bool settles = trial.displacement <= std::min(most, ever_less * at_half);
    return settles ? End::settles : End::restless;
  };
  std::optional<End> end;
  while (!end) {
    simulation.advance(rest_steps);
    if (ranks.any(stopped())) throw SafetyStopped{};
    trial.steps = simulation.step();
    trial.displacement = largest_displacement(simulation.frame_source(), ranks);
    if (bodies.any())
      trial.displacement = std::max(trial.displacement, bodies.way(simulation.history().bodies));
    if (simulation.time() <= 0.5 * bounds.time) at_half = trial.displacement;
    end = decide();
  }
  trial.end = *end;
}

}  // namespace

bool check_safety(const Scenario& scenario, const Communicator& ranks) {
  const ModelOutline model = outline_of(scenario.model);
  const Analysis& analysis = model.analysis;
  const auto refuse = [&](const char* where, std::string message, std::string hint) {
    throw InputError(
        {scenario.place({.where = where, .message = std::move(message), .hint = std::move(hint)})});
  };
  const bool quasi_static = is_implicit(analysis) && analysis.implicit.quasi_static;
  if (!quasi_static && !(analysis.until.on() && !begins_with_solve(analysis)))
    refuse("/analysis",
           "the factor of safety is looked for from an equilibrium with full strength on",
           "take quasi-static steps (\"mpm_scheme\": \"newmark\", \"scheme_settings\": "
           "{\"quasi_static\": true}), or explicit ones with \"until\" and \"damping\"; of a "
           "scenario with stages in the last one");
  if (!strength_of(scenario.model, ranks).any())
    refuse("/materials", "nothing has a strength that can be reduced",
           "the materials MohrCoulomb, DruckerPrager and VonMises have one, and so have friction "
           "and cohesion of rigid bodies, of walls, and of bodies in contact; \"rough\" has none");
  return !quasi_static;
}

StrengthOfModel strength_of(const AnyModel& model, const Communicator& ranks) {
  StrengthOfModel has = std::visit([](const auto& own) { return strength_of(own); }, model);
  has.walls = ranks.any(has.walls);
  return has;
}

std::string describe_strength(const AnyModel& any, const StrengthOfModel& has) {
  std::vector<std::string> parts;
  const auto add_names = [&](const char* one, const char* several, std::vector<std::string> names) {
    sort_unique(names);
    if (!names.empty())
      parts.push_back(
          fmt::format("{}{}", names.size() == 1 ? one : several, fmt::join(names, ", ")));
  };
  const auto quoted = [](const std::string& name) { return fmt::format("'{}'", printable(name)); };
  const auto add_owners = [&](const auto& model) {
    std::vector<std::string> materials, bodies;
    for (const Material& material : model.materials)
      if (Law law = material.law; reduce_strength(law, 2.0))
        materials.push_back(quoted(material.name));
    for (const auto& body : model.rigid_bodies)
      if (can_be_divided(body)) bodies.push_back(quoted(body.name));
    add_names("material ", "materials ", std::move(materials));
    add_names("friction and cohesion of rigid body ", "friction and cohesion of rigid bodies ",
              std::move(bodies));
  };
  std::visit(add_owners, any);
  if (has.walls) parts.emplace_back("friction of walls");
  if (has.contact) parts.emplace_back("friction of bodies in contact");
  return fmt::format("{}", fmt::join(parts, "; "));
}

SafetyResult find_factor(const SafetyBounds& bounds,
                         const std::function<SafetyTrial(double)>& trial, SafetyResult known) {
  SafetyResult result = std::move(known);
  while (!result.fails && result.stable < bounds.most)
    result.add(trial(std::min(bounds.most, 2 * result.stable)));
  while (result.fails && *result.fails - result.stable > bounds.tolerance * result.stable)
    result.add(trial(0.5 * (result.stable + *result.fails)));
  return result;
}

double trials_left(const SafetyBounds& bounds, const SafetyResult& known) {
  if (!known.fails && known.stable >= bounds.most) return 0;
  const double fails = known.fails.value_or(2 * known.stable);
  const double halvings =
      std::ceil(std::log2((fails - known.stable) / (bounds.tolerance * known.stable)));
  return (known.fails ? 0 : 1) + std::max(0.0, halvings);
}

SafetyTrials::SafetyTrials(const RunArguments& arguments, Read read,
                           std::unique_ptr<CheckpointReader> equilibrium)
    : arguments_(arguments), read_(std::move(read)), equilibrium_(std::move(equilibrium)) {}

Scenario SafetyTrials::scenario_of(double factor) const {
  Scenario scenario = read_();
  const double end = equilibrium_->header().run.time;
  std::visit([&](auto& model) { make_trial(model, factor, end); }, scenario.model);
  return scenario;
}

bool SafetyTrials::moves_as_whole(const SafetyTrial& trial) const {
  constexpr double hardly_more = 2;  // times as far
  using End = SafetyTrial::End;
  if (!whole_) whole_ = made(1);
  const bool goes_on = whole_->end == End::restless || whole_->end == End::settles;
  return goes_on && trial.displacement <= hardly_more * whole_->displacement;
}

SafetyTrial SafetyTrials::operator()(double factor) const {
  SafetyTrial trial = made(factor);
  if (trial.end == SafetyTrial::End::restless && moves_as_whole(trial))
    trial.end = SafetyTrial::End::settles;
  return trial;
}

SafetyTrial SafetyTrials::made(double factor) const {
  const Communicator& ranks = arguments_.execution.ranks;
  end_at_signals(ranks.rank() == 0
                     ? "between trials. To continue: the same command with --restart latest."
                     : "",
                 exit_stopped);
  Scenario scenario = scenario_of(factor);
  std::visit([](auto& model) { show_all(model.output); }, scenario.model);
  const SimulationState state = state_at_start(*equilibrium_, false);
  const ModelOutline model = outline_of(scenario.model);
  const std::vector<double> gravity = gravity_of(scenario.model);
  FreeBodies bodies(scenario.model);
  ask_at_signals();
  std::atomic<bool> unwanted = false;  // says RunArguments::on_step
  double longest = 0;                  // [s] FailureBounds::time, before there are steps
  const auto stopped = [&unwanted] { return unwanted || stop_signal() != 0; };
  RankWatch watch(ranks, stopped);
  Observer observer;
  observer.progress = [&](Index step, double time) {
    watch.steps_done(step);
    if (arguments_.on_step && !arguments_.on_step(step, time, std::min(1.0, time / longest)))
      unwanted = true;
    return !stopped();
  };
  Simulation simulation =
      make_simulation(scenario, arguments_.execution, std::move(observer), &state);
  const FailureBounds bounds =
      failure_bounds(simulation.frame_source(), model.materials, gravity, ranks);
  longest = bounds.time;
  SafetyTrial trial{.factor = factor};
  try {
    bodies.begin(simulation.history().bodies);
    follow(simulation, bounds, bodies, model.analysis.two_phase, ranks, stopped, trial);
  } catch (const SimulationError& error) {
    trial.end = SafetyTrial::End::broke;
    trial.problem = error.what();
    trial.steps = simulation.step();
  }
  return trial;
}

int SafetyTrials::write_run(const SafetyTrial& trial, const std::filesystem::path& folder) const {
  Scenario scenario = scenario_of(trial.factor);
  std::visit(
      [&](auto& model) {
        model.analysis.until = {};
        model.analysis.nsteps = trial.steps;
      },
      scenario.model);
  RunArguments arguments = arguments_;
  arguments.restart.clear();
  arguments.output = folder.string();
  arguments.overwrite = true;
  arguments.quiet = true;
  arguments.checkpoint_steps = arguments.checkpoint_minutes = {};
  Console console(Console::Voice::silent);
  CaseStage stage;
  stage.before = std::make_unique<CheckpointReader>(equilibrium_->file());
  return CaseRun(arguments, scenario, console, std::move(stage)).execute();
}

}  // namespace lahar
