/// \file The module that Python loads.
#include "lahar_version.h"
#include "runtime/python/bindings.h"

PYBIND11_MODULE(_engine, module) {
  module.doc() = "Lahar's engine; use the package lahar";
  module.attr("version") = LAHAR_VERSION;
  module.attr("commit") = LAHAR_COMMIT;
  lahar::python::bind_errors(module);
  lahar::python::bind_scenario(module);
  lahar::python::bind_run(module);
  lahar::python::bind_simulation(module);
}
