#include "runtime/program/completion.h"

#include <fmt/format.h>

#include <vector>

namespace lahar {

namespace {

std::vector<const CLI::App*> subcommands_of(const CLI::App& program) {
  return program.get_subcommands([](const CLI::App*) { return true; });
}

/// --output -o ... of a command that can be written out.
std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

std::string words(const std::vector<std::string>& all) {
  std::string text;
  for (const std::string& word : all) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::string command_names(const CLI::App& program) {
  std::vector<std::string> names;
  for (const CLI::App* command : subcommands_of(program)) names.push_back(command->get_name());
  return words(names);
}

/// 'text', as shells quote it.
std::string quoted(const std::string& text) {
  std::string all = "'";
  for (const char c : text) {
    if (c == '\'') all += "'\\'";
    all += c == '\n' ? ' ' : c;
  }
  return all + "'";
}

std::string bash_script(const CLI::App& program) {
  std::string cases;
  for (const CLI::App* command : subcommands_of(program))
    cases += fmt::format("    {}) options='{}' ;;\n", command->get_name(),
                         words(option_names(*command)));
  return fmt::format(R"(# Completion of {0} for bash.
_{0}() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} options=
  case ${{COMP_WORDS[1]}} in
{2}  esac
  if [[ $COMP_CWORD == 1 ]]; then
    COMPREPLY=($(compgen -W '{1} --help --version' -- "$word"))
  elif [[ $word == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$word"))
  else
    COMPREPLY=()
  fi
}}
complete -o bashdefault -o default -F _{0} {0}
)",
                     program.get_name(), command_names(program), cases);
}

std::string zsh_script(const CLI::App& program) {
  std::string cases;
  for (const CLI::App* command : subcommands_of(program))
    cases += fmt::format("    {}) options=({}) ;;\n", command->get_name(),
                         words(option_names(*command)));
  return fmt::format(R"(#compdef {0}
# Completion of {0} for zsh.
_{0}() {{
  local -a options
  case $words[2] in
{2}  esac
  if (( CURRENT == 2 )); then
    compadd -- {1} --help --version
  elif [[ $words[CURRENT] == -* ]]; then
    compadd -- $options
  else
    _files
  fi
}}
if [[ $funcstack[1] == _{0} ]]; then _{0} "$@"; else compdef _{0} {0}; fi
)",
                     program.get_name(), command_names(program), cases);
}

std::string fish_script(const CLI::App& program) {
  const std::string& name = program.get_name();
  std::string script = fmt::format("# Completion of {} for fish.\n", name);
  for (const CLI::App* command : subcommands_of(program)) {
    script += fmt::format("complete -c {} -n __fish_use_subcommand -f -a {} -d {}\n", name,
                          command->get_name(), quoted(command->get_description()));
    for (const CLI::Option* option : command->get_options()) {
      if (option->get_lnames().empty() && option->get_snames().empty()) continue;
      script += fmt::format("complete -c {} -n '__fish_seen_subcommand_from {}'", name,
                            command->get_name());
      for (const std::string& one : option->get_lnames()) script += " -l " + one;
      for (const std::string& one : option->get_snames()) script += " -s " + one;
      if (option->get_items_expected_max() > 0) script += " -r";
      script += " -d " + quoted(option->get_description()) + "\n";
    }
  }
  return script;
}

}  // namespace

std::string completion_script(const CLI::App& program, const std::string& shell) {
  if (shell == "bash") return bash_script(program);
  return shell == "zsh" ? zsh_script(program) : fish_script(program);
}

}  // namespace lahar
