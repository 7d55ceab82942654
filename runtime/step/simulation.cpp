#include "runtime/step/simulation.h"

#include "runtime/step/simulation_driver.h"

namespace lahar {

namespace {

using Driver =
    std::variant<std::unique_ptr<SimulationDriver<2>>, std::unique_ptr<SimulationDriver<3>>>;

Driver make_driver(AnyModel&& any, ExecutionOptions&& options, Observer&& observer,
                   const SimulationState* state = nullptr) {
  return std::visit(
      [&]<int Dim>(Model<Dim>& model) -> Driver {
        return std::make_unique<SimulationDriver<Dim>>(std::move(model), std::move(options),
                                                       std::move(observer), state);
      },
      any);
}

/// What `call` returns for the driver of the model's dimension.
template <class Call>
decltype(auto) with(const Driver& driver, Call call) {
  return std::visit([&](const auto& of_dim) -> decltype(auto) { return call(*of_dim); }, driver);
}

}  // namespace

Simulation::Simulation(AnyModel model, ExecutionOptions options, Observer observer)
    : driver_(make_driver(std::move(model), std::move(options), std::move(observer))) {}

Simulation::Simulation(AnyModel model, ExecutionOptions options, Observer observer,
                       const SimulationState& state)
    : driver_(make_driver(std::move(model), std::move(options), std::move(observer), &state)) {}

Simulation::Simulation(Simulation&&) noexcept = default;
Simulation::~Simulation() = default;

void Simulation::advance(Index steps) {
  return with(driver_, [&](auto& driver) { return driver.advance(steps); });
}

void Simulation::run() {
  return with(driver_, [](auto& driver) { return driver.run(); });
}

Frame Simulation::frame() const {
  return with(driver_, [](auto& driver) { return driver.frame(); });
}

FrameSource Simulation::frame_source() const {
  return with(driver_, [](auto& driver) { return driver.frame_source(); });
}

std::optional<FramePieces> Simulation::nodes() const {
  return with(driver_, [](auto& driver) { return driver.nodes(); });
}

std::vector<PatchParticles> Simulation::particles_in_place() const {
  return with(driver_, [](auto& driver) { return driver.particles_in_place(); });
}

void Simulation::poll() {
  return with(driver_, [](auto& driver) { return driver.poll(); });
}

HistoryRow Simulation::history() const {
  return with(driver_, [](auto& driver) { return driver.history(); });
}

std::vector<GaugeTable> Simulation::gauge_tables() const {
  return with(driver_, [](auto& driver) { return driver.gauge_tables(); });
}

GaugeRows Simulation::gauges() const {
  return with(driver_, [](auto& driver) { return driver.gauges(); });
}

std::vector<double> Simulation::maps() const {
  return with(driver_, [](auto& driver) { return driver.maps(); });
}

SimulationState Simulation::state() const {
  return with(driver_, [](auto& driver) { return driver.state(); });
}

Index Simulation::step() const {
  return with(driver_, [](auto& driver) { return driver.step(); });
}

double Simulation::time() const {
  return with(driver_, [](auto& driver) { return driver.time(); });
}

bool Simulation::finished() const {
  return with(driver_, [](auto& driver) { return driver.finished(); });
}

SimulationInfo Simulation::info() const {
  return with(driver_, [](auto& driver) { return driver.info(); });
}

SolveCounts Simulation::solves() const {
  return with(driver_, [](auto& driver) { return driver.solves(); });
}

BalanceReport Simulation::balance() const {
  return with(driver_, [](auto& driver) { return driver.balance(); });
}

std::vector<StageTiming> Simulation::timings() const {
  return with(driver_, [](auto& driver) { return driver.timings(); });
}

const TaskGraph& Simulation::graph() const {
  return with(driver_, [](auto& driver) -> const TaskGraph& { return driver.graph(); });
}

std::vector<std::string> Simulation::patch_names() const {
  return with(driver_, [](auto& driver) { return driver.patch_names(); });
}

PatchGraph Simulation::patch_graph() const {
  return with(driver_, [](auto& driver) { return driver.patch_graph(); });
}

std::vector<Index> Simulation::patch_counts() const {
  return with(driver_, [](auto& driver) { return driver.patch_counts(); });
}

std::vector<StageLoop> Simulation::loops() const {
  return with(driver_, [](auto& driver) { return driver.loops(); });
}

std::string Simulation::trace_graph() const {
  return with(driver_, [](auto& driver) { return driver.trace_graph(); });
}

}  // namespace lahar
