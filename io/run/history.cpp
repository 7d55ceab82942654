#include "io/run/history.h"

#include "io/base/numbers.h"

namespace lahar {

namespace {

/// A name as CSV has it: in quotes where it has commas, quotes or ends of lines.
std::string csv_text(const std::string& name) {
  if (name.find_first_of(",\"\n\r") == std::string::npos) return name;
  std::string quoted = "\"";
  for (const char c : name) {
    if (c == '"') quoted += '"';
    quoted += c == '\n' || c == '\r' ? ' ' : c;  // a row is a line
  }
  return quoted + '"';
}

}  // namespace

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

std::string rigid_bodies_header() {
  std::string line = "step,time,body";
  for (const char* name : {"", "rotation_", "velocity_", "spin_", "force_", "torque_"})
    for (const char* axis : {"x", "y", "z"}) line += std::string(",") + name + axis;
  return line + '\n';
}

std::string rigid_bodies_lines(const HistoryRow& row) {
  std::string lines;
  for (const RigidBodyRow& body : row.bodies) {
    append_number(lines, row.step);
    lines += ',';
    append_number(lines, row.time);
    lines += ',' + csv_text(body.name);
    for (const auto* values :
         {&body.place, &body.rotation, &body.velocity, &body.spin, &body.force, &body.torque})
      for (const double value : *values) {
        lines += ',';
        append_number(lines, value);
      }
    lines += '\n';
  }
  return lines;
}

}  // namespace lahar
