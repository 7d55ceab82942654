// Runs a case and prints the kinetic energy at its end [J].
#include <cstdio>

#include "io/scenario/scenario.h"
#include "runtime/step/simulation.h"

int main(int, char** argv) {
  lahar::Scenario scenario = lahar::read_scenario(argv[1]);
  lahar::Simulation simulation(std::move(scenario.model));
  simulation.run();
  std::printf("%.17g\n", simulation.history().kinetic);
}
