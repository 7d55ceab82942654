#include "physics/model/rigid_body.h"

#include <Eigen/Geometry>

#include "physics/model/model.h"

namespace lahar {

template <int Dim>
Vec<Dim> Placement<Dim>::velocity_at(const Vec<Dim>& x) const {
  const Vec<Dim> arm = x - origin;
  Vec<Dim> v = velocity;
  if constexpr (Dim == 2)
    v += spin[2] * Vec<2>(-arm.y(), arm.x());
  else
    v += Vec<3>(spin).cross(arm);
  return v;
}

template <int Dim>
Eigen::Matrix<double, Dim, Dim> rotation_by(const Vec<3>& angle) {
  if constexpr (Dim == 2) {
    return Eigen::Rotation2Dd(angle[2]).toRotationMatrix();
  } else {
    const double turn = angle.norm();
    if (turn == 0) return Eigen::Matrix3d::Identity();
    return Eigen::AngleAxisd(turn, angle / turn).toRotationMatrix();
  }
}

template <int Dim>
Placement<Dim> placement_at(const RigidBody<Dim>& body, const std::vector<MathFunction>& functions,
                            double time, double dt) {
  Placement<Dim> at;
  at.origin = body.centre + body.moved;
  at.axes = body.turned;
  if (body.motion == RigidBody<Dim>::Motion::fixed) return at;
  double factor = 1, duration = time;
  if (body.function >= 0) {
    const MathFunction& f = functions[static_cast<std::size_t>(body.function)];
    factor = f.differentiated && dt > 0 ? f.mean(time - dt, dt) : f(time);
    duration = f.integral(time);
  }
  at.origin += duration * body.velocity;
  at.axes = rotation_by<Dim>(duration * body.spin) * body.turned;
  at.velocity = factor * body.velocity;
  at.spin = factor * body.spin;
  return at;
}

template <int Dim>
void Reaction::add(const Vec<Dim>& at, const Vec<Dim>& arm) {
  for (int d = 0; d < Dim; ++d) force[static_cast<std::size_t>(d)] += at[d];
  if constexpr (Dim == 2) {
    torque[2] += arm.x() * at.y() - arm.y() * at.x();
  } else {
    const Vec<3> moment = arm.cross(at);
    for (std::size_t d = 0; d < 3; ++d) torque[d] += moment[static_cast<int>(d)];
  }
}

#define LAHAR_INSTANTIATE(Dim)                                                                 \
  template struct Placement<Dim>;                                                              \
  template Eigen::Matrix<double, Dim, Dim> rotation_by<Dim>(const Vec<3>&);                    \
  template Placement<Dim> placement_at<Dim>(const RigidBody<Dim>&,                             \
                                            const std::vector<MathFunction>&, double, double); \
  template void Reaction::add<Dim>(const Vec<Dim>&, const Vec<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
