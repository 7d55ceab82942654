#include "runtime/program/safety_run.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/base/error.h"
#include "physics/materials/law.h"
#include "physics/materials/strength.h"
#include "physics/particles/loads.h"
#include "runtime/program/case_run.h"
#include "runtime/program/run_description.h"
#include "runtime/step/restart.h"
#include "runtime/step/watchdog.h"

namespace lahar {

namespace {

/// Of Newton's method: near failure many particles begin to yield one after the other.
constexpr int most_iterations = 60;
/// Steps of a trial: the first with the change of strength, the second at rest.
constexpr Index trial_steps = 2;

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
  for (auto& one : entries_of<NodeDisplacement>(model)) one.displacement = 0;
}

template <int Dim>
void make_trial(Model<Dim>& model, double factor, double end) {
  for (Material& material : model.materials) reduce_strength(material.law, factor);
  freeze_loads(model, end);
  model.changes.removed.clear();
  model.changes.materials.clear();
  model.changes.reset_displacements = true;
  Analysis& analysis = model.analysis;
  analysis.until = {};
  analysis.nsteps = trial_steps;
  analysis.end_time = std::numeric_limits<double>::infinity();
  analysis.implicit.most_iterations = std::max(analysis.implicit.most_iterations, most_iterations);
  OutputPlan& output = model.output;
  output.checkpoint_steps = 0;
  output.checkpoint_minutes = 0;
  output.frame_steps = 0;
  output.frame_dt = 0;
}

double largest_displacement(const Frame& frame) {
  const auto width = static_cast<std::size_t>(frame.dim);
  const std::vector<double>& values = frame.find("displacement")->values;
  double most = 0;
  for (std::size_t i = 0; i + width <= values.size(); i += width) {
    double square = 0;
    for (std::size_t k = 0; k < width; ++k) square += values[i + k] * values[i + k];
    most = std::max(most, std::sqrt(square));
  }
  return most;
}

/// Extent of the particles along a direction [m].
double extent(const Frame& frame, const std::vector<double>& direction) {
  const auto width = static_cast<std::size_t>(frame.dim);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t i = 0; i + width <= frame.coordinates.size(); i += width) {
    double at = 0;
    for (std::size_t k = 0; k < width; ++k) at += frame.coordinates[i + k] * direction[k];
    low = std::min(low, at);
    high = std::max(high, at);
  }
  return std::max(high - low, 0.0);
}

/// Directions across gravity.
std::vector<std::vector<double>> across(const std::vector<double>& gravity) {
  if (gravity.size() == 2) {
    const double g = std::hypot(gravity[0], gravity[1]);
    return {{gravity[1] / g, -gravity[0] / g}};
  }
  const Vec<3> down = Vec<3>(gravity.data()).normalized();
  const Vec<3> first = down.unitOrthogonal(), second = down.cross(first);
  return {{first[0], first[1], first[2]}, {second[0], second[1], second[2]}};
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

}  // namespace

void check_safety(const Scenario& scenario) {
  const ModelOutline model = outline_of(scenario.model);
  const auto refuse = [&](const char* where, std::string message, std::string hint) {
    throw InputError(
        {scenario.place({.where = where, .message = std::move(message), .hint = std::move(hint)})});
  };
  if (!is_implicit(model.analysis) || !model.analysis.implicit.quasi_static)
    refuse("/analysis",
           "the factor of safety is looked for with quasi-static steps: with full strength they "
           "lead to the equilibrium from which strength falls",
           "\"mpm_scheme\": \"newmark\", \"scheme_settings\": {\"quasi_static\": true}; of a "
           "scenario with stages in the last one");
  const bool any =
      std::any_of(model.materials.begin(), model.materials.end(),
                  [](Material material) { return reduce_strength(material.law, 2.0); });
  if (!any)
    refuse("/materials", "no material has a strength that can be reduced",
           "MohrCoulomb, DruckerPrager and VonMises have");
}

double failure_displacement(const Frame& frame, const std::vector<Material>& materials,
                            const std::vector<double>& gravity) {
  constexpr double per_shear_modulus = 2.5;  // Young's modulus, about
  double shear = std::numeric_limits<double>::infinity(), volume = 0, mass = 0, g = 0;
  for (const Material& material : materials)
    if (const double G = shear_wave_modulus(material.law); G > 0) shear = std::min(shear, G);
  for (const double v : frame.find("volume")->values) volume += v;
  for (const double m : frame.find("mass")->values) mass += m;
  for (const double component : gravity) g += component * component;
  g = std::sqrt(g);
  if (!(g > 0) || !(volume > 0)) return std::numeric_limits<double>::infinity();
  double area = 1;
  for (const auto& direction : across(gravity)) area *= extent(frame, direction);
  const double thickness = volume / area;
  return mass / volume * g * thickness * thickness / (per_shear_modulus * shear);
}

SafetyResult find_factor(const SafetyBounds& bounds,
                         const std::function<SafetyTrial(double)>& trial) {
  SafetyResult result;
  const auto attempt = [&](double factor) {
    const SafetyTrial& made = result.trials.emplace_back(trial(factor));
    if (made.stable)
      result.stable = factor;
    else
      result.fails = factor;
  };
  while (!result.fails && result.stable < bounds.most)
    attempt(std::min(bounds.most, 2 * result.stable));
  while (result.fails && *result.fails - result.stable > bounds.tolerance * result.stable)
    attempt(0.5 * (result.stable + *result.fails));
  return result;
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

SafetyTrial SafetyTrials::operator()(double factor) const {
  Scenario scenario = scenario_of(factor);
  const SimulationState state = state_at_start(*equilibrium_, false);
  SafetyTrial made{.factor = factor, .stable = true};
  const std::vector<Material> materials = outline_of(scenario.model).materials;
  const std::vector<double> gravity = gravity_of(scenario.model);
  Simulation simulation = make_simulation(scenario, arguments_.execution, {}, &state);
  const double most = failure_displacement(simulation.frame(), materials, gravity);
  try {
    simulation.run();
    made.displacement = largest_displacement(simulation.frame());
    made.stable = made.displacement <= most;
  } catch (const SimulationError&) {
    made.stable = false;
  }
  made.iterations = simulation.solves().iterations;
  return made;
}

void SafetyTrials::write_run(double factor, const std::filesystem::path& folder) const {
  Scenario scenario = scenario_of(factor);
  RunArguments arguments = arguments_;
  arguments.output = folder.string();
  arguments.overwrite = true;
  arguments.quiet = true;
  arguments.checkpoint_steps = arguments.checkpoint_minutes = {};
  Console console(Console::Voice::quiet);
  CaseStage stage;
  stage.before = std::make_unique<CheckpointReader>(equilibrium_->file());
  CaseRun(arguments, scenario, console, std::move(stage)).execute();
}

}  // namespace lahar
