#include <array>
#include <cstdint>
#include <memory>

#include "runtime/python/bindings.h"

namespace lahar::python {

namespace {

/// Values that were a vector; `components` of each particle.
template <class T>
py::array array_of(std::vector<T>&& values, int components = 1) {
  auto kept = std::make_unique<std::vector<T>>(std::move(values));
  const T* data = kept->data();
  const auto n = static_cast<py::ssize_t>(kept->size());
  std::vector<py::ssize_t> shape{n};
  if (components > 1) shape = {n / components, components};
  const py::capsule owner(kept.release(),
                          [](void* vector) { delete static_cast<std::vector<T>*>(vector); });
  return py::array_t<T>(shape, data, owner);
}

}  // namespace

py::dict dict_of(Frame&& frame) {
  py::list columns;
  for (FrameColumn& column : frame.columns)
    columns.append(py::make_tuple(column.name, column.unit,
                                  array_of(std::move(column.values), column.components)));
  py::dict all;
  all["step"] = frame.step;
  all["time"] = frame.time;
  all["dim"] = frame.dim;
  all["id"] = array_of(std::move(frame.id));
  all["material"] = array_of(std::move(frame.material));
  all["coordinates"] = array_of(std::move(frame.coordinates), frame.dim);
  all["columns"] = columns;
  return all;
}

namespace {

py::tuple tuple_of(const std::array<double, 3>& values) {
  return py::make_tuple(values[0], values[1], values[2]);
}

}  // namespace

py::dict dict_of(const HistoryRow& row) {
  py::dict all;
  all["step"] = row.step;
  all["time"] = row.time;
  all["dt"] = row.dt;
  all["particles"] = row.particles;
  all["mass"] = row.mass;
  all["momentum"] = tuple_of(row.momentum);
  all["kinetic"] = row.kinetic;
  all["internal"] = row.internal;
  all["external"] = row.external;
  all["damping"] = row.damping;
  all["friction"] = row.friction;
  all["balance"] = row.balance;
  all["max_speed"] = row.max_speed;
  py::dict bodies;
  for (const RigidBodyRow& body : row.bodies) {
    py::dict one;
    one["place"] = tuple_of(body.place);
    one["rotation"] = tuple_of(body.rotation);
    one["velocity"] = tuple_of(body.velocity);
    one["spin"] = tuple_of(body.spin);
    one["force"] = tuple_of(body.force);
    one["torque"] = tuple_of(body.torque);
    bodies[py::str(body.name)] = one;
  }
  all["bodies"] = bodies;
  return all;
}

}  // namespace lahar::python
