/// \file Steps of soil laws on request, for comparison with transcriptions in another language.
/// A line of input: law, number of parameters, then each as `key value`; number of steps; stress
/// (6 numbers), state, strain increment of each step (6). A line of output: 1 if all converged,
/// stress, state.
#include <cstdio>
#include <iostream>
#include <sstream>
#include <string>

#include "physics/materials/modified_cam_clay.h"
#include "physics/materials/norsand.h"

namespace {

template <class Law>
bool set(Law& law, const std::string& key, double value) {
  for (const auto& parameter : Law::parameters) {
    if (parameter.key != key) continue;
    if (parameter.number)
      law.*parameter.number = value;
    else
      law.*parameter.flag = value != 0;
    return true;
  }
  return false;
}

template <class Law>
bool answer(std::istringstream& line) {
  Law law{};
  int parameters = 0, steps = 0;
  line >> parameters;
  for (int i = 0; i < parameters; ++i) {
    std::string key;
    double value = 0;
    line >> key >> value;
    if (!set(law, key, value)) return false;
  }
  lahar::Voigt stress, strain;
  std::array<double, Law::state.size()> state;
  line >> steps;
  for (double& x : stress) line >> x;
  for (double& x : state) line >> x;
  for (double& x : strain) line >> x;
  if (!line) return false;
  bool converged = true;
  for (int i = 0; i < steps; ++i) converged &= law.step(strain, stress, state.data());
  std::printf("%d", converged);
  for (const double x : stress) std::printf(" %.17g", x);
  for (const double x : state) std::printf(" %.17g", x);
  std::printf("\n");
  return true;
}

}  // namespace

int main() {
  std::string text;
  while (std::getline(std::cin, text)) {
    std::istringstream line(text);
    std::string law;
    line >> law;
    const bool read = law == "ModifiedCamClay" ? answer<lahar::ModifiedCamClay>(line)
                                               : law == "NorSand" && answer<lahar::NorSand>(line);
    if (!read) {
      std::fprintf(stderr, "cannot read this line: %s\n", text.c_str());
      return 2;
    }
  }
}
