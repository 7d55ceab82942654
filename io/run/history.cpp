#include "io/run/history.h"

#include "io/base/numbers.h"

namespace lahar {

std::span<const HistoryColumn> history_columns() {
  static constexpr HistoryColumn columns[] = {
      {"step", "-", "updates done"},
      {"time", "s", "simulated time"},
      {"dt", "s", "last time step"},
      {"particles", "-", "number of particles"},
      {"mass", "kg", "total mass"},
      {"momentum_x", "kg m/s", "total momentum"},
      {"momentum_y", "kg m/s", "total momentum"},
      {"momentum_z", "kg m/s", "total momentum"},
      {"kinetic", "J", "kinetic energy"},
      {"internal", "J", "work of the stresses since the start"},
      {"external", "J", "work of gravity, loads and prescribed velocities since the start"},
      {"damping", "J",
       "energy taken by damping, contact, friction and the velocity transfer since the start"},
      {"friction", "J",
       "part of damping: energy taken by friction at walls and between bodies since the start"},
      {"balance", "J", "kinetic + internal + damping - external - kinetic at the start"},
      {"max_speed", "m/s", "largest particle speed"},
      {"divided", "-", "increments that materials could only do in parts, since the start"},
  };
  return columns;
}

std::string history_header() {
  std::string line;
  for (const HistoryColumn& column : history_columns()) {
    if (!line.empty()) line += ',';
    line += column.name;
  }
  return line + '\n';
}

std::string history_line(const HistoryRow& row) {
  std::string line;
  const auto add = [&](auto value) {
    if (!line.empty()) line += ',';
    append_number(line, value);
  };
  add(row.step);
  add(row.time);
  add(row.dt);
  add(row.particles);
  add(row.mass);
  for (const double p : row.momentum) add(p);
  add(row.kinetic);
  add(row.internal);
  add(row.external);
  add(row.damping);
  add(row.friction);
  add(row.balance);
  add(row.max_speed);
  add(row.divided);
  return line + '\n';
}

}  // namespace lahar
