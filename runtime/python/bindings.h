/// \file The module lahar._engine: what Python needs of the engine, without convenience. The
/// package beside it (runtime/python/lahar) is what users import.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "io/frames/frame.h"
#include "io/run/history.h"
#include "io/scenario/scenario.h"
#include "runtime/program/signals.h"

namespace lahar::python {

namespace py = pybind11;

void bind_errors(py::module_& module);
void bind_scenario(py::module_& module);
void bind_run(py::module_& module);
void bind_simulation(py::module_& module);

/// A scenario as Python gives it.
struct ScenarioText {
  std::string text;    ///< JSON
  std::string folder;  ///< that file names are relative to
  std::string name;    ///< of the file that it is from
  bool as_cbgeo = false;

  /// Throws InputError. Needs no lock of the interpreter.
  Scenario read(std::size_t stage, const MemoryLimit& memory,
                decltype(ScenarioOptions::planned) planned = {}) const;
};

/// {"step", "time", "dim", "id", "material", "coordinates", "columns": [(name, unit, values)]}; the
/// arrays take over the memory of the frame.
py::dict dict_of(Frame&& frame);
/// Names of history.csv, and "bodies".
py::dict dict_of(const HistoryRow& row);

/// Steps are taken while it lives: other threads of Python go on, and Ctrl-C asks the run to stop.
class EngineCall {
 public:
  /// Back in Python, whose handlers then get the signal that has stopped the call. Throws
  /// KeyboardInterrupt, or what else they raise.
  void finish();

 private:
  std::unique_ptr<SignalWatch> signals_ = std::make_unique<SignalWatch>();
  std::unique_ptr<py::gil_scoped_release> release_ = std::make_unique<py::gil_scoped_release>();
};

/// Texts that any thread adds.
class TextList {
 public:
  void add(const std::string& text) {
    const std::lock_guard lock(mutex_);
    texts_.push_back(text);
  }
  std::vector<std::string> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(texts_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> texts_;
};

}  // namespace lahar::python
