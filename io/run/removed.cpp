#include "io/run/removed.h"

#include "io/base/numbers.h"

namespace lahar {

std::string removed_header() {
  return "step,id,mass,x,y,z,velocity_x,velocity_y,velocity_z\n";
}

std::string removed_line(const RemovedParticle& particle) {
  std::string line;
  append_number(line, particle.step);
  const auto add = [&](auto value) { append_number(line += ',', value); };
  add(particle.id);
  add(particle.mass);
  for (const double x : particle.position) add(x);
  for (const double v : particle.velocity) add(v);
  return line + '\n';
}

}  // namespace lahar
