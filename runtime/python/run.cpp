#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <chrono>
#include <exception>
#include <utility>

#include "runtime/program/safety_search.h"
#include "runtime/program/stages_run.h"
#include "runtime/python/bindings.h"

namespace lahar::python {

namespace {

/// Calls a function of Python some times a second, from whichever thread takes the steps.
class Progress {
 public:
  explicit Progress(py::object call) : call_(std::move(call)) {}

  /// False where the function returned False or raised an exception.
  bool operator()(Index step, double time, double share) {
    constexpr auto interval = std::chrono::milliseconds(100);
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < interval || thrown_) return !thrown_;
    last_ = now;
    const py::gil_scoped_acquire lock;
    try {
      return !call_(step, time, share).is(py::bool_(false));
    } catch (...) {
      thrown_ = std::current_exception();
    }
    return false;
  }
  void rethrow() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }

 private:
  py::object call_;
  std::chrono::steady_clock::time_point last_ = {};
  std::exception_ptr thrown_;
};

RunArguments arguments_of(const ScenarioText& scenario, const py::dict& options) {
  RunArguments run;
  run.scenario = scenario.name;
  run.quiet = true;
  run.output = options["output"].cast<std::string>();
  run.overwrite = options["overwrite"].cast<bool>();
  run.restart = options["restart"].cast<std::string>();
  run.wall_time = options["wall_time"].cast<double>();
  run.execution.threads = options["threads"].cast<int>();
  run.command = options["command"].cast<std::vector<std::string>>();
  return run;
}

/// Call `act(arguments, read, console)` as the program does; adds to `warnings`, whether it throws
/// or not. Returns what it returns, an exit status.
int with_engine(const ScenarioText& scenario, const py::dict& options, const py::object& on_step,
                py::list warnings, auto act) {
  RunArguments arguments = arguments_of(scenario, options);
  TextList said;
  arguments.listener = {.line = [](const std::string&) {},
                        .warn = [&](const std::string& text) { said.add(text); }};
  Progress progress(on_step);
  if (!on_step.is_none()) arguments.on_step = std::ref(progress);
  int code = 0;
  std::exception_ptr thrown;
  EngineCall call;
  try {
    arguments.execution.memory = memory_limit(0, 1);
    const auto read = [&](std::size_t stage) {
      return scenario.read(stage, arguments.execution.memory);
    };
    Console console(Console::Voice::quiet, arguments.listener);
    code = act(arguments, read, console);
  } catch (...) {
    thrown = std::current_exception();
  }
  call.finish();
  for (const std::string& text : said.take()) warnings.append(text);
  progress.rethrow();
  if (thrown) std::rethrow_exception(thrown);
  return code;
}

/// As `lahar run`: writes a run folder.
int run(const ScenarioText& scenario, const py::dict& options, const py::object& on_step,
        py::list warnings) {
  return with_engine(scenario, options, on_step, std::move(warnings),
                     [&](const RunArguments& arguments, const auto& read, Console& console) {
                       Scenario first =
                           scenario.read(0, arguments.execution.memory,
                                         [&](const std::string& folder, const auto& stages) {
                                           check_output(arguments, folder, stages);
                                         });
                       return run_scenario(arguments, read, std::move(first), console);
                     });
}

/// As `lahar safety`: writes its folder.
int safety(const ScenarioText& scenario, const py::dict& options, const py::object& on_step,
           py::list warnings) {
  const SafetyBounds bounds{.most = options["most"].cast<double>(),
                            .tolerance = options["tolerance"].cast<double>()};
  return with_engine(scenario, options, on_step, std::move(warnings),
                     [&](const RunArguments& arguments, const auto& read, Console& console) {
                       return find_safety(arguments, bounds, read, console);
                     });
}

}  // namespace

void bind_run(py::module_& module) {
  module.def("run", &run, py::arg("scenario"), py::arg("options"), py::arg("on_step"),
             py::arg("warnings"));
  module.def("safety", &safety, py::arg("scenario"), py::arg("options"), py::arg("on_step"),
             py::arg("warnings"));
}

}  // namespace lahar::python
