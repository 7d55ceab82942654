#include "runtime/command_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "io/problems.h"

namespace lahar {

namespace {

/// The command that was found, or `app` where none was.
const CLI::App& command_of(const CLI::App& app) {
  const auto found = app.get_subcommands();
  return found.empty() ? app : *found.front();
}

/// "lahar", "lahar run"
std::string name_of(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  return parent == nullptr ? command.get_name() : parent->get_name() + " " + command.get_name();
}

std::vector<std::string> options_of(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

bool is_option(const std::string& argument) {
  return argument.size() > 1 && argument.front() == '-';
}

/// What of `--name=value` is the name.
std::string option_name(const std::string& argument) {
  return argument.substr(0, argument.find('='));
}

}  // namespace

std::vector<Problem> argument_problems(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = command_of(app);
  const std::string help = fmt::format("see {} --help", name_of(command));
  const std::vector<std::string> unknown = app.remaining(true);
  std::vector<Problem> problems;
  // Who misspells an option shifts what follows it: words are not to blame then.
  for (const std::string& argument : unknown)
    if (is_option(argument)) {
      const std::string name = option_name(argument), near = nearest(name, options_of(command));
      problems.push_back({.message = fmt::format("{} has no option '{}'", name_of(command), name),
                          .hint = near.empty() ? help : fmt::format("did you mean '{}'?", near)});
    }
  if (!problems.empty()) return problems;
  if (&command == &app)
    return {
        {.message = unknown.empty() ? "a command is missing"
                                    : fmt::format("there is no command '{}'", unknown.front()),
         .hint = suggest(unknown.empty() ? "" : unknown.front(), commands_of(app), "commands")}};
  if (!unknown.empty())
    return {{.message = fmt::format("'{}' is one argument too many for {}", unknown.front(),
                                    name_of(command)),
             .hint = help}};
  return {{.message = error.what(), .hint = help}};
}

}  // namespace lahar
