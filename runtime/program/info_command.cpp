// `lahar info`.
#include <fmt/format.h>

#include "graph/executor.h"
#include "io/schema/keys.h"
#include "physics/materials/materials.h"
#include "physics/mesh/element.h"
#include "runtime/program/commands.h"
#include "runtime/program/completion.h"
#include "runtime/terminal/console.h"
#include "runtime/terminal/version.h"

namespace lahar {

namespace {

std::string material_names() {
  return [&]<class... Laws>(const std::variant<Laws...>*) {
    std::string names;
    ((names += (names.empty() ? "" : ", ") + std::string(Laws::name)), ...);
    return names;
  }(static_cast<const Law*>(nullptr));
}

std::string element_names() {
  std::string names;
  for (int e = 0; e < n_elements; ++e)
    names += (e == 0 ? "" : ", ") + std::string(info(static_cast<Element>(e)).name);
  return names;
}

struct InfoArguments {
  bool schema = false, reference = false;
  std::string completion;  ///< shell; empty = none
};

int info_command(const InfoArguments& arguments, const CLI::App& program) {
  if (!arguments.completion.empty())
    fmt::print("{}", completion_script(program, arguments.completion));
  if (arguments.schema) fmt::print("{}\n", scenario_schema());
  if (arguments.reference) fmt::print("{}\n", scenario_reference());
  if (arguments.schema || arguments.reference || !arguments.completion.empty()) return exit_ok;
  std::string libraries;
  for (const auto& [name, version] : library_versions())
    libraries += fmt::format("{}{} {}", libraries.empty() ? "" : ", ", name, version);
  fmt::print(
      "Lahar {}\n"
      "build      {}\n"
      "libraries  {}\n"
      "threads    {} available\n"
      "elements   {}\n"
      "materials  {}\n"
      "schemes    usf, usl, musl, newmark (implicit, also quasi-static), projection; velocity "
      "update: flip, "
      "pic and their blend, apic, tpic, asflip, xpic, fmpm\n"
      "input      lahar info --reference (every key), lahar info --schema (JSON Schema)\n",
      version_line(), compiler_line(), libraries, available_threads(), element_names(),
      material_names());
  return exit_ok;
}

}  // namespace

Action add_info(CLI::App& command) {
  const auto arguments = std::make_shared<InfoArguments>();
  command.add_flag("--schema", arguments->schema, "Print the JSON Schema of scenario files");
  command.add_flag("--reference", arguments->reference,
                   "Print every key of scenario files, as Markdown");
  command
      .add_option("--completion", arguments->completion,
                  "Print the script by which a shell completes commands: bash, zsh or fish")
      ->check(CLI::IsMember({"bash", "zsh", "fish"}))
      ->type_name("SHELL");
  return [arguments, &command](const Words&) {
    return info_command(*arguments, *command.get_parent());
  };
}

}  // namespace lahar
