/// \file Completion of the command line by shells.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace lahar {

/// The script that makes a shell complete the commands and options of a program: "bash", "zsh" or
/// "fish". Where an option or a name of a file may stand, files are completed.
std::string completion_script(const CLI::App& program, const std::string& shell);

}  // namespace lahar
