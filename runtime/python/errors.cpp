#include <array>
#include <csignal>
#include <exception>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/base/problems.h"
#include "physics/base/error.h"
#include "runtime/python/bindings.h"

namespace lahar::python {

namespace {

py::object error_class(const char* name) {
  return py::module_::import("lahar.errors").attr(name);
}

/// Options of the command line are arguments of functions here.
std::string in_python(std::string text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 6> options{
      {{"--restart latest", "restart=\"latest\""},
       {"without --restart", "without restart"},
       {"--overwrite", "overwrite=True"},
       {"--output FOLDER", "run(folder)"},
       {"--output", "run(folder)"},
       {"--as-cbgeo", "as_cbgeo=True"}}};
  for (const auto& [option, argument] : options)
    for (std::size_t at = 0; (at = text.find(option, at)) != std::string::npos;
         at += argument.size())
      text.replace(at, option.size(), argument);
  return text;
}

void raise(const char* name, const std::string& message) {
  PyErr_SetObject(error_class(name).ptr(), error_class(name)(message).ptr());
}

void raise_invalid(const InputError& error) {
  std::vector<Problem> found = error.problems();
  for (Problem& one : found) one.hint = in_python(one.hint);
  std::string text = format_problems(found);
  while (text.ends_with('\n')) text.pop_back();
  py::list problems;
  for (const Problem& one : found)
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
