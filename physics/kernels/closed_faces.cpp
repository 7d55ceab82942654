#include "physics/kernels/closed_faces.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "physics/particles/node_place.h"

namespace lahar {

namespace {

/// What is left of a unit vector, at most, where a node is held along it [-].
constexpr double held_tolerance = 1e-6;

/// Whether a node does not move along the unit vector n, or walls let it have none along +n.
template <int Dim>
bool is_held(const Patch<Dim>& patch, Local node, Vec<Dim> n) {
  const auto before = [](const auto& entry, Local at) { return entry.node < at; };
  auto fixed = std::lower_bound(patch.fixed.begin(), patch.fixed.end(), node, before);
  for (; fixed != patch.fixed.end() && fixed->node == node; ++fixed)
    if (fixed->velocity == 0.0) n[fixed->dir] = 0.0;
  const auto& displaced = patch.fixed_displacement;
  auto given = std::lower_bound(displaced.begin(), displaced.end(), node, before);
  for (; given != displaced.end() && given->node == node; ++given)
    if (given->displacement == 0.0) n[given->dir] = 0.0;
  const auto wall = std::lower_bound(patch.walls.begin(), patch.walls.end(), node, before);
  if (wall != patch.walls.end() && wall->node == node)
    for (std::size_t k = 0; k < Dim; ++k) {
      const Vec<Dim> axis = wall->axes.col(static_cast<int>(k));
      const double along = n.dot(axis);
      if (wall->velocity[k] == 0.0 && (wall->fixed[k] || wall->pushes[k] * along > 0.0))
        n -= along * axis;
    }
  return n.cwiseAbs().maxCoeff() < held_tolerance;
}

/// Local nodes of face 2 d + side of a box, or of a face of another element (element.h).
template <int Dim, class Each>
bool all_of_face(const Patch<Dim>& patch, Local cell, int face, Each each) {
  const auto c = static_cast<std::size_t>(cell);
  const int d = face / 2, side = face % 2;
  if (!patch.topology.corner_nodes.empty()) {
    const auto& corner = patch.topology.corner_nodes[c];
    for (int i = 0; i < corners<Dim>; ++i)
      if ((i >> d & 1) == side && !each(corner[static_cast<std::size_t>(i)])) return false;
    return true;
  }
  const auto nodes = patch.topology.support(c);
  const ElementInfo& about = info(patch.element);
  for (int a = 0; a < about.nodes; ++a) {
    const auto& place = detail::node_place(patch.element, a);
    bool on_face;
    if (about.simplex) {  // the barycentric coordinate of the corner opposite to it is zero
      int sum = 0;
      for (const signed char along : place) sum += along;
      on_face = face == 0 ? sum == 2 : place[static_cast<std::size_t>(face) - 1] == 0;
    } else {
      on_face = place[static_cast<std::size_t>(d)] == (side == 0 ? -1 : 1);
    }
    if (on_face && !each(nodes[static_cast<std::size_t>(a)])) return false;
  }
  return true;
}

template <int Dim>
bool is_closed(const Patch<Dim>& patch, Local cell, int face, const Vec<Dim>& outward) {
  return all_of_face(patch, cell, face,
                     [&](Local node) { return is_held<Dim>(patch, node, outward); });
}

/// Put particle i back by twice its distance beyond a face, and take its velocity towards it.
template <int Dim>
void reflect(Patch<Dim>& patch, Particles<Dim>& particles, Local i, const Vec<Dim>& outward,
             double beyond) {
  double speed = 0.0;
  for (int d = 0; d < Dim; ++d) speed += particles.row(Column::v, d)[i] * outward[d];
  const double taken = std::max(0.0, speed);
  for (int d = 0; d < Dim; ++d) {
    particles.row(Column::v, d)[i] -= taken * outward[d];
    for (const Column column : {Column::x, Column::u})
      particles.row(column, d)[i] -= 2.0 * beyond * outward[d];
  }
  patch.work.damping += 0.5 * particles.row(Column::mass)[i] * taken * taken;
}

/// Sides of a box beyond which x lies, -1, 0 or 1 by axis; none if it is more than a cell away.
template <int Dim>
std::array<int, Dim> sides_passed(const Patch<Dim>& patch, const Particles<Dim>& particles, Local i,
                                  Local cell) {
  const auto& box = patch.box[static_cast<std::size_t>(cell)];
  std::array<int, Dim> passed{};
  for (std::size_t d = 0; d < Dim; ++d) {
    const double xi = (particles.row(Column::x, static_cast<int>(d))[i] - box[d]) * box[Dim + d];
    if (!(std::abs(xi) < 3.0)) return {};
    passed[d] = xi > 1.0 ? 1 : xi < -1.0 ? -1 : 0;
  }
  return passed;
}

template <int Dim>
void reflect_at_box(Patch<Dim>& patch, Particles<Dim>& particles, Local i, Local cell,
                    std::size_t d, int side) {
  const auto& box = patch.box[static_cast<std::size_t>(cell)];
  const Vec<Dim> outward = side * Vec<Dim>::Unit(static_cast<int>(d));
  const double x = particles.row(Column::x, static_cast<int>(d))[i];
  reflect<Dim>(patch, particles, i, outward, side * (x - box[d]) - 1.0 / box[Dim + d]);
}

template <int Dim>
bool holds_nothing(const Patch<Dim>& patch) {
  return patch.fixed.empty() && patch.walls.empty();
}

}  // namespace

template <int Dim>
bool return_through_faces(Patch<Dim>& patch, Particles<Dim>& particles, Local i, Local old) {
  if (holds_nothing(patch) || !patch.cartesian) return false;
  const auto passed = sides_passed(patch, particles, i, old);
  bool any = false;
  for (std::size_t d = 0; d < Dim; ++d) {
    if (passed[d] == 0) continue;
    const int face = 2 * static_cast<int>(d) + (passed[d] > 0 ? 1 : 0);
    const Vec<Dim> outward = passed[d] * Vec<Dim>::Unit(static_cast<int>(d));
    if (!is_closed<Dim>(patch, old, face, outward)) continue;
    reflect_at_box(patch, particles, i, old, d, passed[d]);
    any = true;
  }
  return any;
}

template <int Dim>
bool return_through_edge(Patch<Dim>& patch, Particles<Dim>& particles, Local i, Local old,
                         Index found) {
  if (holds_nothing(patch) || !patch.cartesian) return false;
  const auto passed = sides_passed(patch, particles, i, old);
  if (Dim - std::count(passed.begin(), passed.end(), 0) < 2) return false;
  const auto local = patch.local_cell.find(found);
  if (local == patch.local_cell.end()) return false;
  const Local cell = patch.cell_of(local->second, particles.material[static_cast<std::size_t>(i)]);
  for (std::size_t d = 0; d < Dim; ++d) {  // every face through which it could have come is closed
    if (passed[d] == 0) continue;
    const int face = 2 * static_cast<int>(d) + (passed[d] > 0 ? 0 : 1);
    const Vec<Dim> inward = passed[d] * Vec<Dim>::Unit(static_cast<int>(d));
    if (!is_closed<Dim>(patch, cell, face, inward)) return false;
  }
  for (std::size_t d = 0; d < Dim; ++d)
    if (passed[d] != 0) reflect_at_box(patch, particles, i, old, d, passed[d]);
  return true;
}

template <int Dim>
bool return_to_mesh(Patch<Dim>& patch, const Mesh<Dim>& mesh, Particles<Dim>& particles, Local i,
                    Local old) {
  if (holds_nothing(patch)) return false;
  const ElementInfo& about = info(patch.element);
  const auto place = [&](Local node) -> Vec<Dim> { return place_of(patch, mesh, node); };
  Vec<Dim> inside = Vec<Dim>::Zero();
  for (int face = 0; face < about.faces; ++face) {
    Vec<Dim> sum = Vec<Dim>::Zero();
    int count = 0;
    all_of_face(patch, old, face, [&](Local node) { return sum += place(node), ++count, true; });
    inside += sum / count / about.faces;
  }
  bool any = false;
  for (int face = 0; face < about.faces; ++face) {
    std::array<Vec<Dim>, most_nodes<Dim>> X;
    std::size_t count = 0;
    all_of_face(patch, old, face, [&](Local node) { return X[count++] = place(node), true; });
    Vec<Dim> normal;  // of the plane through the face's first nodes, its corners
    if constexpr (Dim == 2) {
      const Vec<2> along = X[1] - X[0];
      normal = {along[1], -along[0]};
    } else {
      normal = (X[1] - X[0]).cross(X[2] - X[0]);
    }
    normal.normalize();
    if (normal.dot(X[0] - inside) < 0.0) normal = -normal;
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d) x[d] = particles.row(Column::x, d)[i];
    const double beyond = normal.dot(x - X[0]);
    if (!(beyond > 0.0) || !(beyond < normal.dot(X[0] - inside))) continue;
    if (!is_closed<Dim>(patch, old, face, normal)) continue;
    reflect<Dim>(patch, particles, i, normal, beyond);
    any = true;
  }
  return any;
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template bool return_through_faces<Dim>(Patch<Dim>&, Particles<Dim>&, Local, Local);       \
  template bool return_through_edge<Dim>(Patch<Dim>&, Particles<Dim>&, Local, Local, Index); \
  template bool return_to_mesh<Dim>(Patch<Dim>&, const Mesh<Dim>&, Particles<Dim>&, Local, Local);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
