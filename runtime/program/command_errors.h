/// \file What is wrong with a command line.
#pragma once

#include <CLI/CLI.hpp>
#include <vector>

#include "physics/base/error.h"

namespace lahar {

/// Problems of arguments that `app` could not parse, each with what is allowed or to be done.
std::vector<Problem> argument_problems(const CLI::App& app, const CLI::ParseError& error);

}  // namespace lahar
