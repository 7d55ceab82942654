#include <csignal>
#include <exception>
#include <string>

#include "io/base/problems.h"
#include "physics/base/error.h"
#include "runtime/python/bindings.h"

namespace lahar::python {

namespace {

py::object error_class(const char* name) {
  return py::module_::import("lahar.errors").attr(name);
}

void raise(const char* name, const std::string& message) {
  PyErr_SetObject(error_class(name).ptr(), error_class(name)(message).ptr());
}

void raise_invalid(const InputError& error) {
  std::string text = format_problems(error.problems());
  while (text.ends_with('\n')) text.pop_back();
  py::list problems;
  for (const Problem& one : error.problems())
    problems.append(error_class("Problem")(one.message, one.where, one.hint, one.file, one.line));
  PyErr_SetObject(error_class("InvalidInput").ptr(),
                  error_class("InvalidInput")(text, problems).ptr());
}

}  // namespace

void bind_errors(py::module_&) {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      raise_invalid(error);
    } catch (const IoError& error) {
      raise("FileError", error.what());
    } catch (const SimulationError& error) {
      raise("SimulationFailed", error.what());
    }
  });
}

void EngineCall::finish() {
  release_.reset();
  const int signal = stop_signal();
  signals_.reset();
  if (signal != 0) std::raise(signal);
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

}  // namespace lahar::python
