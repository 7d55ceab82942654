// Every copy of a node runs this very code, so that all are equal to the last bit.
#include "physics/contact/contact_surface.h"

#include <algorithm>
#include <cmath>

#include "physics/base/simd.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

/// Halves of the edges of a particle's domain, as columns. Without a domain of its own a particle
/// has a box of its volume, with the proportions of its cell.
template <int Dim>
class HalfEdges {
 public:
  using Matrix = Eigen::Matrix<double, Dim, Dim>;

  HalfEdges(const Patch<Dim>& patch, Local cell) : patch_(patch), particles_(patch.particles) {
    const auto& layout = particles_.layout();
    kind_ = layout.has(Column::corners)   ? Column::corners
            : layout.has(Column::vectors) ? Column::vectors
            : layout.has(Column::domain)  ? Column::domain
                                          : Column::volume;
    double cell_volume = 1.0;
    for (int d = 0; d < Dim; ++d) {
      edge_[d] = 1.0;
      if (patch.cartesian)
        edge_[d] =
            2.0 / patch.box[static_cast<std::size_t>(cell)][static_cast<std::size_t>(Dim + d)];
      cell_volume *= edge_[d];
    }
    per_volume_ = 1.0 / cell_volume;
  }

  /// Whether the ellipsoid is a ball.
  bool are_alike() const { return kind_ == Column::volume && edge_.maxCoeff() == edge_.minCoeff(); }

  Matrix at(Local p) const {
    Matrix r = Matrix::Zero();
    switch (kind_) {
      case Column::corners:
        for (int k = 0; k < Dim; ++k)
          for (int c = 0; c < corners<Dim>; ++c)
            for (int d = 0; d < Dim; ++d)
              r(d, k) += (c >> k & 1 ? 1.0 : -1.0) / corners<Dim> * value(Dim * c + d, p);
        break;
      case Column::vectors:
        for (int k = 0; k < Dim; ++k)
          for (int d = 0; d < Dim; ++d) r(d, k) = value(Dim * k + d, p);
        break;
      case Column::domain:
        for (int d = 0; d < Dim; ++d) r(d, d) = 0.5 * value(d, p);
        break;
      default: {
        const double part = value(0, p) * per_volume_;
        const double share = Dim == 2 ? std::sqrt(part) : std::cbrt(part);
        for (int d = 0; d < Dim; ++d) r(d, d) = 0.5 * share * edge_[d];
      }
    }
    return r;
  }

 private:
  double value(int component, Local p) const { return particles_.row(kind_, component)[p]; }

  const Patch<Dim>& patch_;
  const Particles<Dim>& particles_;
  Column kind_;
  Vec<Dim> edge_;
  double per_volume_;
};

template <int Dim>
std::span<const Local> nodes_of(const Patch<Dim>& patch, Local cell) {
  const auto c = static_cast<std::size_t>(cell);
  if (!patch.topology.support_nodes.empty()) return patch.topology.support(c);
  return patch.topology.corner_nodes[c];
}

/// The body that a cell is of, and the first of its nodes.
template <int Dim>
int body_of(const Patch<Dim>& patch, Local cell) {
  return cell / static_cast<Local>(patch.topology.cells.size() / patch.bodies());
}
template <int Dim>
Local first_node_of(const Patch<Dim>& patch, int body) {
  return body * patch.body_nodes;
}

/// The least length of the sum of two normals of which their mean is one, and of what is left of a
/// normal without the sides that bodies share.
constexpr double least_sum_of_normals = 0.1, least_of_normal = 0.05;

/// Particles whose centres are no further from the axis through the node along the normal than this
/// many cells are near it. At least one of them is, where the body lies before the node and has one
/// particle per cell and direction.
constexpr double near_cells = 0.6;

}  // namespace

template <int Dim>
void find_nodes_between(Patch<Dim>& patch, const StepContext<Dim>& step) {
  std::vector<int>& between = patch.contact.between;
  auto& nodes = patch.contact.nodes_between;
  between.assign(static_cast<std::size_t>(patch.body_nodes), 0);  // bodies that have mass there
  Local first = 0;                                                // of the nodes of a body
  for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::mass_momentum, step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  while (i >= first + patch.body_nodes) first += patch.body_nodes;
                  between[static_cast<std::size_t>(i - first)] += sum[mass_lane] > patch.least_mass;
                });
  nodes.clear();
  for (std::size_t i = 0; i < between.size(); ++i) {
    const bool several = between[i] > 1;
    between[i] = several ? static_cast<int>(nodes.size()) : -1;
    if (several) nodes.push_back({static_cast<Local>(i), {}});
  }
}

template <int Dim>
bool has_nodes_between(const Patch<Dim>& patch, Local cell) {
  if (patch.contact.nodes_between.empty()) return false;
  const int* between = patch.contact.between.data() - first_node_of(patch, body_of(patch, cell));
  const auto nodes = nodes_of(patch, cell);
  return std::any_of(nodes.begin(), nodes.end(), [&](Local f) { return between[f] >= 0; });
}

namespace {

/// Normals of two bodies without what both have along an axis: they end there side by side, as at a
/// wall of the mesh, and do not meet.
template <int Dim>
void leave_sides(Vec<Dim>& a, Vec<Dim>& b) {
  Vec<Dim> of_a = a, of_b = b;
  for (int d = 0; d < Dim; ++d)
    if (a[d] * b[d] > 0.0) of_a[d] = of_b[d] = 0.0;
  if (!(of_a.norm() > least_of_normal && of_b.norm() > least_of_normal)) return;
  a = of_a.normalized();
  b = of_b.normalized();
}

/// Add what the normals of bodies make two at a time.
template <int Dim>
void add_means(SurfaceDirections<Dim>& all) {
  const int own = all.count;
  for (int a = 0; a < own; ++a)
    for (int b = a + 1; b < own; ++b) {
      Vec<Dim> n_a = all.at(a), n_b = all.at(b);
      leave_sides<Dim>(n_a, n_b);
      const Vec<Dim> sum = n_a - n_b;
      const double length = sum.norm();
      if (!(length > least_sum_of_normals)) continue;
      const int of_a = all.from[static_cast<std::size_t>(a)],
                of_b = all.from[static_cast<std::size_t>(b)];
      all.add(sum / length, of_a, of_b);
      int axis = 0;
      for (int d = 1; d < Dim; ++d)
        if (std::abs(sum[d]) > std::abs(sum[axis])) axis = d;
      Vec<Dim> along = Vec<Dim>::Zero();
      along[axis] = sum[axis] > 0.0 ? 1.0 : -1.0;
      all.add(along, of_a, of_b);
    }
}

}  // namespace

template <int Dim>
void set_directions(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const SumOverPatches<Dim> sums(patch, NodeSum::gradient, step.step);
  double *near = patch.own_sums(NodeSum::surface, step.step),
         *around = patch.own_sums(NodeSum::surface_around, step.step);
  for (auto& [node, directions] : patch.contact.nodes_between) {
    int body = 0;
    for (Local f = node; f < patch.n_nodes(); f += patch.body_nodes, ++body) {
      double sum[node_width];
      store(sums.at(f), sum);
      const Vec<Dim> gradient = Eigen::Map<const Vec<Dim>>(sum);
      if (const double length = gradient.norm(); length > 0.0)
        directions.add(gradient / length, body, -1);
      store(NodeVector(0.0), near + static_cast<std::ptrdiff_t>(f) * sum_stride);
      store(NodeVector(0.0), around + static_cast<std::ptrdiff_t>(f) * sum_stride);
    }
    if (directions.count > 1)
      add_means(directions);
    else
      directions.count = 0;
  }
}

template <int Dim>
double surface_offset(const Model<Dim>& model) {
  const auto [low, high] = model.mesh->bounds();
  return 2.0 * (high - low).norm();
}

namespace {

/// Two nodes, a lane for each of their directions.
using TwoNodes = SumLine;

TwoNodes both(const NodeVector& a, const NodeVector& b) {
  return TwoNodes::of(__builtin_shufflevector(a.v, b.v, 0, 1, 2, 3, 4, 5, 6, 7));
}

/// A node of a cell, as its particles see it, and where its sums are. There is a lane for each of
/// its directions.
template <int Dim>
struct SurfacePlace {
  const double* x;        ///< [m]
  double *near, *around;  ///< where the body ends along the directions
  const SurfaceDirections<Dim>* directions;
  NodeVector sign;  ///< SurfaceDirections::sign() for the body of the particles

  NodeVector n(int d) const {
    return load<NodeVector>(directions->normal[static_cast<std::size_t>(d)].data());
  }
};

/// Adds the ends of the particles of a bin at the nodes of its cell. `reach` takes a particle and
/// directions, and returns half of its width along them.
template <int Dim, class Reach>
void add_ends(const Patch<Dim>& patch, const ParticleBin& bin,
              std::span<const SurfacePlace<Dim>> places, double offset, Reach reach) {
  const auto x = patch.particles.template rows<Dim>(Column::x);
  const double near_axis =
      near_cells * patch.cell_size[static_cast<std::size_t>(bin.cell) % patch.cell_size.size()];
  const TwoNodes furthest(near_axis * near_axis);
  for (std::size_t k = 0; k < places.size(); k += 2) {
    const SurfacePlace<Dim>&a = places[k], &b = places[std::min(k + 1, places.size() - 1)];
    TwoNodes n[Dim], node[Dim];
    for (int d = 0; d < Dim; ++d) {
      n[d] = both(a.n(d), b.n(d));
      node[d] = both(NodeVector(a.x[d]), NodeVector(b.x[d]));
    }
    const TwoNodes sign = both(a.sign, b.sign), used = sign * sign, base = used * TwoNodes(offset);
    TwoNodes near = both(load<NodeVector>(a.near), load<NodeVector>(b.near)),
             around = both(load<NodeVector>(a.around), load<NodeVector>(b.around));
    for (Local p = bin.begin; p < bin.end; ++p) {
      TwoNodes ahead(0.0), away(0.0);
      for (std::size_t d = 0; d < Dim; ++d) {
        const TwoNodes from_node = TwoNodes(x[d][p]) - node[d];
        ahead += from_node * n[d];
        away += from_node * from_node;
      }
      const TwoNodes end = TwoNodes(ahead * sign) + TwoNodes(reach(p, n) * used) + base;
      const unsigned beside = greater(TwoNodes(away - ahead * ahead), furthest);
      around = max(around, end);
      near = max(near, select(beside, TwoNodes(0.0), end));
    }
    store(first_of(near), a.near);
    store(first_of(around), a.around);
    store(second_of(near), b.near);
    store(second_of(around), b.around);
  }
}

}  // namespace

template <int Dim>
void map_surface(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  if (patch.contact.nodes_between.empty()) return;
  static thread_local std::vector<SurfacePlace<Dim>> places;
  static thread_local std::vector<typename HalfEdges<Dim>::Matrix> edges;
  double *near = patch.own_sums(NodeSum::surface, step.step),
         *around = patch.own_sums(NodeSum::surface_around, step.step);
  const double offset = surface_offset(*step.model);
  for (const ParticleBin& bin : bins) {
    if (bin.begin == bin.end) continue;
    const int body = body_of(patch, bin.cell);
    const int* between = patch.contact.between.data() - first_node_of(patch, body);
    places.clear();
    for (const Local f : nodes_of(patch, bin.cell)) {
      if (between[f] < 0) continue;
      const auto& directions =
          patch.contact.nodes_between[static_cast<std::size_t>(between[f])].directions;
      NodeVector sign(0.0);
      for (int k = 0; k < directions.count; ++k) sign.v[k] = directions.sign(k, body);
      const auto line = static_cast<std::ptrdiff_t>(f) * sum_stride;
      places.push_back({at(patch.node_position, f), near + line, around + line, &directions, sign});
    }
    if (places.empty()) continue;
    const HalfEdges<Dim> half_edges(patch, bin.cell);
    edges.clear();
    for (Local p = bin.begin; p < bin.end; ++p) edges.push_back(half_edges.at(p));
    const auto edges_of = [&](Local p) -> const auto& {
      return edges[static_cast<std::size_t>(p - bin.begin)];
    };
    const auto add = [&](auto reach) { add_ends<Dim>(patch, bin, places, offset, reach); };
    if (half_edges.are_alike())
      add([&](Local p, const TwoNodes*) { return TwoNodes(edges_of(p)(0, 0)); });
    else
      add([&](Local p, const TwoNodes* n) {
        const auto& r = edges_of(p);
        TwoNodes square(0.0);
        for (int k = 0; k < Dim; ++k) {
          TwoNodes along(0.0);
          for (int d = 0; d < Dim; ++d) along += TwoNodes(r(d, k)) * n[d];
          square += along * along;
        }
        return sqrt(square);
      });
  }
}

template <int Dim>
void add_meetings(Patch<Dim>& patch, const NodeBetween<Dim>& at, std::span<const SurfaceEnds> ends,
                  double offset) {
  const SurfaceDirections<Dim>& directions = at.directions;
  const auto n_bodies = static_cast<int>(ends.size());
  for (int a = 0; a < n_bodies; ++a)
    for (int b = a + 1; b < n_bodies; ++b) {
      const SurfaceEnds &of_a = ends[static_cast<std::size_t>(a)],
                        &of_b = ends[static_cast<std::size_t>(b)];
      Meeting<Dim> meeting{.a = at.node + first_node_of(patch, a),
                           .b = at.node + first_node_of(patch, b)};
      bool found = false;
      double widest = 0.0;
      for (int k = 0; k < directions.count; ++k) {
        const int from = directions.from[static_cast<std::size_t>(k)],
                  to = directions.to[static_cast<std::size_t>(k)];
        const bool from_a = from == a && (to < 0 || to == b), from_b = from == b && to < 0;
        if (!from_a && !from_b) continue;
        if (of_a.around[k] == 0.0 || of_b.around[k] == 0.0) continue;  // one of them is not there
        const double apart = 2.0 * offset - of_a.around[k] - of_b.around[k];
        if (found && !(apart > widest)) continue;
        found = true;
        widest = apart;
        meeting.gap = 2.0 * offset - of_a.at(k) - of_b.at(k);
        meeting.normal = from_a ? directions.at(k) : Vec<Dim>(-directions.at(k));
      }
      if (found) patch.contact.meetings.push_back(meeting);
    }
}

#define LAHAR_INSTANTIATE(Dim)                                                                   \
  template void find_nodes_between(Patch<Dim>&, const StepContext<Dim>&);                        \
  template bool has_nodes_between(const Patch<Dim>&, Local);                                     \
  template void set_directions(Patch<Dim>&, const StepContext<Dim>&);                            \
  template void map_surface(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);                 \
  template double surface_offset(const Model<Dim>&);                                             \
  template void add_meetings(Patch<Dim>&, const NodeBetween<Dim>&, std::span<const SurfaceEnds>, \
                             double);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
