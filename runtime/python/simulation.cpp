#include "runtime/step/simulation.h"

#include <pybind11/stl.h>

#include <atomic>
#include <string_view>

#include "runtime/program/run_description.h"
#include "runtime/python/bindings.h"

namespace lahar::python {

namespace {

/// A simulation that Python steps. Arrays of Python show its memory: they keep it alive, and it
/// takes no step while there are any.
class SteppedSimulation {
 public:
  SteppedSimulation(const ScenarioText& text, int threads)
      : simulation_(make(text, threads)), views_(std::make_shared<char>()) {}

  void advance(Index steps) {
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
      simulation_.advance(steps);
    } catch (const SimulationError& error) {
      failure_ = error.what();
      thrown = std::current_exception();
    } catch (...) {
      thrown = std::current_exception();
    }
    call.finish();
    if (thrown) std::rethrow_exception(thrown);
  }

  /// Particles by ascending id; other threads of Python go on meanwhile.
  Frame frame() {
    const Use use(busy_);
    const py::gil_scoped_release release;
    return simulation_.frame();
  }

  /// The simulation, of which nobody takes steps now; while the interpreter's lock is held.
  Simulation& at_rest() {
    const Use use(busy_);
    return simulation_;
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

  Simulation make(const ScenarioText& text, int threads) {
    const py::gil_scoped_release release;
    ExecutionOptions execution;
    execution.threads = threads;
    execution.memory = memory_limit(0, 1);
    Scenario scenario = text.read(0, execution.memory);
    if (!scenario.stages.empty())
      throw InputError({Problem{.file = text.name,
                                .where = "/stages",
                                .message = "a simulation in the process has no stages",
                                .hint = "use Scenario.run(), or leave out `stages`"}});
    for (const Problem& problem : scenario.warnings) warnings_.add(problem.message);
    std::visit(
        [&](const auto& model) {
          for (const Material& material : model.materials)
            material_ids_.push_back(static_cast<std::int32_t>(material.id));
        },
        scenario.model);
    Observer observer;
    observer.progress = [](Index, double) { return stop_signal() == 0; };
    observer.warning = [this](const std::string& warning) { warnings_.add(warning); };
    return make_simulation(scenario, execution, std::move(observer));
  }

  TextList warnings_;
  std::vector<std::int32_t> material_ids_;
  Simulation simulation_;
  std::shared_ptr<char> views_;  ///< shared by each array
  Index age_ = 0;                ///< calls of advance()
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
