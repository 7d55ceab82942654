#include "runtime/program/command_errors.h"

#include <fmt/format.h>

#include <string>

#include "io/base/problems.h"

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

/// What of `arguments` is an option, up to a "--".
std::vector<std::string> option_names(const std::vector<std::string>& arguments) {
  std::vector<std::string> names;
  for (const std::string& argument : arguments) {
    if (argument == "--") break;
    if (argument.size() > 1 && argument.front() == '-')
      names.push_back(argument.substr(0, argument.find('=')));
  }
  return names;
}

/// The first of `arguments` that is no option; empty if there is none.
std::string first_word(const std::vector<std::string>& arguments) {
  for (const std::string& argument : arguments)
    if (!argument.empty() && argument.front() != '-') return argument;
  return "";
}

}  // namespace

std::vector<Problem> argument_problems(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = command_of(app);
  const bool has_command = &command != &app;
  if (!has_command) {
    const std::string word = first_word(app.remaining());
    if (!word.empty())
      return {{.message = fmt::format("there is no command '{}'", word),
               .hint = suggest(word, commands_of(app), "commands")}};
  }
  std::vector<Problem> problems;
  const std::string help = fmt::format("see {} --help", name_of(command));
  const auto hint_for = [&](const CLI::App& of, const std::string& name) {
    const std::string near = nearest(name, options_of(of));
    if (!near.empty()) return fmt::format("did you mean '{}'?", near);
    if (&of != &command && !nearest(name, options_of(command)).empty())
      return fmt::format("options of {} come after it", name_of(command));
    return help;
  };
  const auto add_options = [&](const CLI::App& of) {
    for (const std::string& name : option_names(of.remaining()))
      problems.push_back({.message = fmt::format("{} has no option '{}'", name_of(of), name),
                          .hint = hint_for(of, name)});
  };
  add_options(app);
  // Who misspells an option shifts what follows it: words are not to blame then.
  if (has_command) add_options(command);
  if (!problems.empty()) return problems;
  const std::string word = first_word(command.remaining());
  if (!word.empty())
    return {{.message = fmt::format("'{}' is one argument too many for {}", word, name_of(command)),
             .hint = help}};
  if (!has_command && dynamic_cast<const CLI::RequiredError*>(&error) != nullptr)
    return {{.message = "a command is missing", .hint = suggest("", commands_of(app), "commands")}};
  return {{.message = error.what(), .hint = help}};
}

}  // namespace lahar
