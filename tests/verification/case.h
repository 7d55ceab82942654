/// \file What every verification case needs: a model from text, and particle fields by name.
#pragma once

#include <string>
#include <utility>
#include <variant>

#include "io/scenario/scenario.h"
#include "runtime/step/simulation.h"
#include "tests/plain_defaults.h"

namespace lahar::verification {

/// The model of a scenario in a file of the repository ("examples/two-discs.json").
template <int Dim>
Model<Dim> model_of_file(const std::string& file) {
  Scenario scenario = read_scenario(std::string(LAHAR_SOURCE_DIR "/") + file);
  return std::get<Model<Dim>>(std::move(scenario.model));
}

/// The model of a scenario that is given as text.
template <int Dim>
Model<Dim> model_of_text(const std::string& text) {
  Scenario scenario = read_scenario_text(text, LAHAR_SOURCE_DIR, test::plain_defaults(text));
  return std::get<Model<Dim>>(std::move(scenario.model));
}

/// The same with the defaults that users have.
template <int Dim>
Model<Dim> model_by_default(const std::string& text) {
  return std::get<Model<Dim>>(read_scenario_text(text, LAHAR_SOURCE_DIR).model);
}

/// Particle states of a frame with the components of a column by index.
class State {
 public:
  explicit State(Frame frame) : frame_(std::move(frame)) {}
  Index size() const { return frame_.size(); }
  double time() const { return frame_.time; }
  double x(Index p, int d) const { return frame_.coordinates[at(p, frame_.dim, d)]; }
  double get(const char* column, Index p, int component = 0) const {
    const FrameColumn* c = frame_.find(column);
    return c->values[at(p, c->components, component)];
  }

 private:
  static std::size_t at(Index p, int components, int component) {
    return static_cast<std::size_t>(p * components + component);
  }
  Frame frame_;
};

/// Mean over the particles that `selected` accepts, of `value`; both take a particle.
template <class Selected, class Value>
double mean(const State& state, Selected selected, Value value) {
  double sum = 0;
  Index count = 0;
  for (Index p = 0; p < state.size(); ++p)
    if (selected(p)) {
      sum += value(p);
      ++count;
    }
  return sum / static_cast<double>(count);
}

}  // namespace lahar::verification
