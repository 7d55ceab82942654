#include "runtime/step/simulation.h"

#include <pybind11/stl.h>

#include <atomic>
#include <functional>
#include <set>
#include <string_view>

#include "io/scenario/stages.h"
#include "runtime/program/run_description.h"
#include "runtime/python/bindings.h"
#include "runtime/step/restart.h"

namespace lahar::python {

namespace {

/// A simulation that Python steps, stage by stage where the scenario has stages. Arrays of Python
/// show its memory: they keep it alive, and it takes no step while there are any.
class SteppedSimulation {
 public:
  SteppedSimulation(ScenarioText text, int threads)
      : text_(std::move(text)), views_(std::make_shared<char>()) {
    const py::gil_scoped_release release;
    execution_.threads = threads;
    execution_.memory = memory_limit(0, 1);
    Scenario first = text_.read(0, execution_.memory);
    stages_ = first.stages;
    say(first.warnings);
    full_.push_back(first.full);
    check_later_stages(first);
    begin(first, nullptr);
  }

  void advance(Index steps) {
    work([&] { simulation_->advance(steps); });
  }

  /// The next stage, from the state at the end of this one.
  void begin_next_stage() {
    work([&] {
      Scenario next = text_.read(stage_ + 1, execution_.memory);
      const SimulationState state =
          state_at_start(simulation_->state(), goes_on_alike(full_[stage_], full_[stage_ + 1]));
      begin(next, &state);
      ++stage_;
    });
  }

  /// Particles by ascending id; other threads of Python go on meanwhile.
  Frame frame() {
    const Use use(busy_);
    const py::gil_scoped_release release;
    return simulation_->frame();
  }

  /// The simulation, of which nobody takes steps now; while the interpreter's lock is held.
  Simulation& at_rest() {
    const Use use(busy_);
    return *simulation_;
  }
  const std::vector<std::string>& stages() const { return stages_; }
  std::size_t stage() {
    const Use use(busy_);
    return stage_;
  }
  /// What gauges have measured in the present stage, as a run of it writes it.
  std::vector<GaugeRows> gauge_rows() {
    const Use use(busy_);
    return gauges_;
  }
  Index age() const { return age_; }
  std::shared_ptr<char> view() const { return views_; }
  std::vector<std::string> take_warnings() { return warnings_.take(); }
  const std::vector<std::int32_t>& material_ids() const { return material_ids_; }

 private:
  /// One thread at a time.
  class Use {
   public:
    explicit Use(std::atomic<bool>& busy) : busy_(busy) {
      if (busy_.exchange(true)) throw std::runtime_error("another thread uses this simulation");
    }
    ~Use() { busy_ = false; }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    std::atomic<bool>& busy_;
  };

  /// Do something with the engine, while other threads of Python go on.
  void work(const std::function<void()>& act) {
    if (views_.use_count() > 1)
      throw py::buffer_error(
          "arrays still show the particles where they lie in memory (patches()): a step would move "
          "them. Delete these arrays, or keep copies of them (numpy.array)");
    if (!failure_.empty()) throw SimulationError(failure_);
    const Use use(busy_);
    std::exception_ptr thrown;
    EngineCall call;
    try {
      ++age_;
      act();
      measure_end();
    } catch (const SimulationError& error) {
      failure_ = error.what();
      thrown = std::current_exception();
    } catch (...) {
      thrown = std::current_exception();
    }
    call.finish();
    if (thrown) std::rethrow_exception(thrown);
  }

  void say(const std::vector<Problem>& warnings) {
    for (const Problem& problem : warnings)
      if (said_.insert(problem.message).second) warnings_.add(problem.message);
  }

  /// Mistakes of all stages are found before any begins. Throws InputError.
  void check_later_stages(const Scenario& first) {
    if (stages_.empty()) return;
    StageBody before = body_of(first);
    for (std::size_t k = 1; k < stages_.size(); ++k) {
      const Scenario stage = text_.read(k, execution_.memory);
      check_body(before, stage);
      say(stage.warnings);
      say(changes_of_method(std::exchange(before, body_of(stage)), stage));
      full_.push_back(stage.full);
    }
  }

  /// The stage takes the place of the one before.
  void begin(Scenario& scenario, const SimulationState* state) {
    std::vector<std::int32_t> ids;
    bool measures = false;
    std::visit(
        [&](const auto& model) {
          for (const Material& material : model.materials)
            ids.push_back(static_cast<std::int32_t>(material.id));
          measures = model.output.measured.any();
        },
        scenario.model);
    Observer observer;
    observer.progress = [](Index, double) { return stop_signal() == 0; };
    observer.warning = [this](const std::string& warning) { warnings_.add(warning); };
    observer.gauges = [this](const GaugeRows& rows) { gauges_.push_back(rows); };
    auto next = std::make_unique<Simulation>(
        make_simulation(scenario, execution_, std::move(observer), state));
    simulation_ = std::move(next);
    material_ids_ = std::move(ids);
    measures_ = measures;
    gauges_.clear();
    if (measures_) gauges_.push_back(simulation_->gauges());
  }

  /// The end of a run has rows of gauges.
  void measure_end() {
    if (measures_ && simulation_->finished() && gauges_.back().step != simulation_->step())
      gauges_.push_back(simulation_->gauges());
  }

  ScenarioText text_;
  ExecutionOptions execution_;
  TextList warnings_;
  std::set<std::string> said_;              ///< warnings of the scenario
  std::vector<std::string> stages_, full_;  ///< names, and Scenario::full; no names without stages
  std::size_t stage_ = 0;
  std::vector<std::int32_t> material_ids_;
  bool measures_ = false;  ///< gauges of the present stage
  std::vector<GaugeRows> gauges_;
  std::unique_ptr<Simulation> simulation_;
  std::shared_ptr<char> views_;  ///< shared by each array
  Index age_ = 0;                ///< calls of advance() and begin_next_stage()
  std::atomic<bool> busy_ = false;
  std::string failure_;  ///< message of the step that could not be taken
};

using Shared = std::shared_ptr<SteppedSimulation>;

/// The particles of one patch, as arrays over its slots.
class PatchView {
 public:
  PatchView(Shared of, PatchParticles shown)
      : of_(std::move(of)), shown_(std::move(shown)), age_(of_->age()) {}

  py::array column(std::string_view name) const {
    for (const PatchColumn& column : shown().columns)
      if (column.name == name) return view(column);
    throw py::key_error(std::string(name));
  }
  std::vector<std::tuple<std::string, std::string, int>> columns() const {
    std::vector<std::tuple<std::string, std::string, int>> all;
    for (const PatchColumn& c : shown().columns) all.emplace_back(c.name, c.unit, c.components);
    return all;
  }
  py::array id() const {
    const auto n = static_cast<py::ssize_t>(shown().id.size());
    return read_only(py::array_t<Index>({n}, {sizeof(Index)}, shown().id.data(), owner()));
  }
  /// Slots in use, in the order in which the engine works on them; a copy.
  py::array_t<std::int64_t> used() const {
    py::array_t<std::int64_t> slots(count());
    std::int64_t* to = slots.mutable_data();
    for (const auto& [first, end] : shown().bins)
      for (Local p = first; p < end; ++p) *to++ = p;
    return slots;
  }
  /// Ids of materials by slot, a copy.
  py::array_t<std::int32_t> material() const {
    py::array_t<std::int32_t> ids(static_cast<py::ssize_t>(shown().material.size()));
    for (std::size_t p = 0; p < shown().material.size(); ++p)
      ids.mutable_data()[p] = of_->material_ids()[shown().material[p]];
    return ids;
  }
  Index patch() const { return shown_.patch; }
  py::ssize_t count() const {
    py::ssize_t n = 0;
    for (const auto& [first, end] : shown_.bins) n += end - first;
    return n;
  }

 private:
  const PatchParticles& shown() const {
    of_->at_rest();
    if (age_ != of_->age())
      throw std::runtime_error("these patches are of an earlier step: ask for patches() again");
    return shown_;
  }
  /// Keeps the memory alive and the simulation where it is.
  py::capsule owner() const {
    using Kept = std::pair<Shared, std::shared_ptr<char>>;
    return {new Kept(of_, of_->view()), [](void* kept) { delete static_cast<Kept*>(kept); }};
  }
  static py::array read_only(py::array array) {
    array.attr("setflags")(py::arg("write") = false);
    return array;
  }
  py::array view(const PatchColumn& column) const {
    const auto n = static_cast<py::ssize_t>(shown().id.size());
    constexpr auto number = static_cast<py::ssize_t>(sizeof(double));
    if (column.components == 1)
      return read_only(py::array_t<double>({n}, {number}, column.first, owner()));
    const auto stride = static_cast<py::ssize_t>(column.stride) * number;
    return read_only(py::array_t<double>({n, py::ssize_t{column.components}}, {number, stride},
                                         column.first, owner()));
  }

  Shared of_;
  PatchParticles shown_;
  Index age_;
};

py::list patches(const Shared& simulation) {
  py::list all;
  for (PatchParticles& one : simulation->at_rest().particles_in_place())
    all.append(PatchView(simulation, std::move(one)));
  return all;
}

/// {gauge: (names and units of columns, rows by columns)}; the first two are step and time.
py::dict gauges(SteppedSimulation& simulation) {
  const std::vector<GaugeRows> rows = simulation.gauge_rows();
  const std::vector<GaugeTable> tables = simulation.at_rest().gauge_tables();
  py::dict all;
  for (std::size_t k = 0; k < tables.size(); ++k) {
    std::vector<std::pair<std::string, std::string>> columns{{"step", "-"}, {"time", "s"}};
    for (const GaugeColumn& column : tables[k].columns)
      columns.emplace_back(column.name, column.unit);
    const std::size_t width = tables[k].columns.size();
    std::vector<double> values;
    for (const GaugeRows& at : rows)
      for (std::size_t first = 0; first + width <= at.values[k].size(); first += width) {
        values.insert(values.end(), {static_cast<double>(at.step), at.time});
        const auto from = at.values[k].begin() + static_cast<std::ptrdiff_t>(first);
        values.insert(values.end(), from, from + static_cast<std::ptrdiff_t>(width));
      }
    const auto count = static_cast<py::ssize_t>(values.size() / columns.size());
    const py::array_t<double> table({count, static_cast<py::ssize_t>(columns.size())},
                                    values.data());
    all[py::str(tables[k].name)] = py::make_tuple(columns, table);
  }
  return all;
}

py::dict info(SteppedSimulation& simulation) {
  const SimulationInfo now = simulation.at_rest().info();
  py::dict all;
  all["particles"] = now.particles;
  all["removed"] = now.removed;
  all["cells"] = now.cells;
  all["nodes"] = now.nodes;
  all["patches"] = now.patches;
  all["threads"] = now.threads;
  all["dt"] = now.dt;
  all["dt_limit"] = now.dt_limit;
  all["bytes"] = now.bytes;
  return all;
}

}  // namespace

void bind_simulation(py::module_& module) {
  py::class_<PatchView>(module, "Patch", "The particles of one patch, column by column")
      .def("__getitem__", &PatchView::column)
      .def("columns", &PatchView::columns, "Names, units and numbers of components of all columns.")
      .def_property_readonly("id", &PatchView::id, "Ids of particles by slot.")
      .def_property_readonly(
          "used", &PatchView::used,
          "Slots in use, in the order in which the engine works on them; a copy.")
      .def_property_readonly("material", &PatchView::material, "Ids of materials by slot; a copy.")
      .def_property_readonly("patch", &PatchView::patch, "The number of the patch.")
      .def("__len__", &PatchView::count);
  py::class_<SteppedSimulation, Shared>(module, "Simulation")
      .def(py::init<const ScenarioText&, int>(), py::arg("scenario"), py::arg("threads"))
      .def("advance", &SteppedSimulation::advance, py::arg("steps"))
      .def("begin_next_stage", &SteppedSimulation::begin_next_stage)
      .def_property_readonly("stages", &SteppedSimulation::stages)
      .def_property_readonly("stage", &SteppedSimulation::stage)
      .def("gauges", &gauges)
      .def("take_warnings", &SteppedSimulation::take_warnings)
      .def("patches", &patches)
      .def("info", &info)
      .def("frame", [](SteppedSimulation& of) { return dict_of(of.frame()); })
      .def("sums", [](SteppedSimulation& of) { return dict_of(of.at_rest().history()); })
      .def_property_readonly("step", [](SteppedSimulation& of) { return of.at_rest().step(); })
      .def_property_readonly("time", [](SteppedSimulation& of) { return of.at_rest().time(); })
      .def_property_readonly("finished",
                             [](SteppedSimulation& of) { return of.at_rest().finished(); });
}

}  // namespace lahar::python
