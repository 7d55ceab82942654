#include "runtime/verify/verify_command.h"

#include <fmt/format.h>

#include "io/base/problems.h"
#include "physics/base/error.h"
#include "runtime/base/exit_codes.h"

namespace lahar {

namespace {

constexpr VerificationCase cases[] = {
    {"plate-with-hole",
     "stress at a hole in a pulled plate against Howland (1930); time by threads",
     verify_plate_with_hole},
    {"manufactured", "convergence of every kind of shape function to manufactured solutions",
     verify_manufactured},
};

}  // namespace

int verify_command(const VerifyArguments& arguments) {
  if (arguments.name.empty()) {
    fmt::print("Cases with a solution in the literature; run one with lahar verify CASE:\n\n");
    for (const auto& known : cases) fmt::print("  {:<18} {}\n", known.name, known.what);
    return exit_ok;
  }
  std::vector<std::string> names;
  for (const auto& known : cases) {
    if (arguments.name == known.name) return known.run(arguments) ? exit_ok : exit_internal;
    names.emplace_back(known.name);
  }
  const std::string close = nearest(arguments.name, names);
  throw InputError(fmt::format("there is no verification case \"{}\".{} lahar verify lists them.",
                               arguments.name,
                               close.empty() ? "" : fmt::format(" Did you mean \"{}\"?", close)));
}

}  // namespace lahar
