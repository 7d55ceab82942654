// The test of equilibrium that ends a run.
#include "io/scenario/scenario_builder.h"

namespace lahar {

template <int Dim>
void ScenarioBuilder<Dim>::build_until(JsonValue& analysis) {
  JsonValue* given = analysis.find("until");
  if (!given || !given->is<JsonValue::Object>()) return;
  UntilRest& until = model_.analysis.until;
  until.imbalance = get_number(*given, "imbalance").value_or(0);
  until.kinetic = get_number(*given, "kinetic_energy").value_or(until.imbalance * until.imbalance);
  if (!is_implicit(model_.analysis)) set(*given, "kinetic_energy", until.kinetic);
}

template <int Dim>
void ScenarioBuilder<Dim>::check_until() {
  const Analysis& a = model_.analysis;
  const JsonValue* given = section("analysis").find("until");
  if (!given || !a.until.on()) return;
  if (is_projection(a) || (is_implicit(a) && !a.implicit.quasi_static))
    return in_.error(*given,
                     "'until' is for explicit and for quasi-static steps: others have no measure "
                     "of equilibrium",
                     "\"scheme_settings\": {\"quasi_static\": true}, or leave it out");
  const bool nodal = team_.any(!entries_of<NodeForce>(model_).empty());
  if (model_.gravity.isZero() && model_.tractions.empty() && !nodal && in_.problems.empty())
    in_.error(*given, "'until' measures unbalanced forces by the loads, and there are none",
              "gravity, tractions or forces at nodes; or end the run by end_time");
  if (a.two_phase)
    in_.warning(*given,
                "the test of equilibrium does not see that pore pressures still change: drag "
                "balances forces, so the run may end in the middle of consolidation",
                "end the run by end_time, and look whether pore pressures still change then");
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
