// Every copy of a node runs this very code, so that all are equal to the last bit.
#include "physics/contact/contact_surface.h"

#include <algorithm>
#include <cmath>

#include "physics/base/simd.h"

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

  bool are_along_axes() const { return kind_ == Column::domain || kind_ == Column::volume; }

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

/// The least length of the sum of two normals of which their mean is one.
constexpr double least_sum_of_normals = 0.1;

/// Particles whose centres are no further from the axis through the node along the normal than this
/// many cells are near it. At least one of them is, where the body lies before the node and has one
/// particle per cell and direction.
constexpr double near_cells = 0.6;

}  // namespace

template <int Dim>
SurfaceDirections<Dim> surface_directions(const Patch<Dim>& patch, Local node) {
  SurfaceDirections<Dim> all;
  const auto add = [&](const SurfaceDirection<Dim>& direction) {
    if (all.count < node_width) all.of[static_cast<std::size_t>(all.count++)] = direction;
  };
  const auto bodies = static_cast<int>(patch.bodies());
  for (int b = 0; b < bodies; ++b) {
    const auto at = static_cast<std::ptrdiff_t>(node + b * patch.body_nodes) * node_width;
    const Vec<Dim> n = Eigen::Map<const Vec<Dim>>(patch.gradient.data() + at);
    if (!n.isZero(0.0)) add({n, b, -1});
  }
  const int own = all.count;
  for (int a = 0; a < own; ++a)
    for (int b = a + 1; b < own; ++b) {
      const SurfaceDirection<Dim> of_a = all.of[static_cast<std::size_t>(a)],
                                  of_b = all.of[static_cast<std::size_t>(b)];
      const Vec<Dim> sum = of_a.normal - of_b.normal;
      const double length = sum.norm();
      if (!(length > least_sum_of_normals)) continue;
      add({sum / length, of_a.from, of_b.from});
      int axis = 0;
      for (int d = 1; d < Dim; ++d)
        if (std::abs(sum[d]) > std::abs(sum[axis])) axis = d;
      Vec<Dim> along = Vec<Dim>::Zero();
      along[axis] = sum[axis] > 0.0 ? 1.0 : -1.0;
      add({along, of_a.from, of_b.from});
    }
  return all;
}

template <int Dim>
void set_normals(Patch<Dim>& patch) {
  patch.contact.between_bodies.resize(static_cast<std::size_t>(patch.body_nodes), 0);
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < std::min(range.end, patch.body_nodes); ++i) {
      int surfaces = 0;
      for (Local f = i; f < patch.n_nodes(); f += patch.body_nodes) {
        Eigen::Map<Vec<Dim>> gradient(patch.gradient.data() +
                                      static_cast<std::ptrdiff_t>(f) * node_width);
        const double length = gradient.norm();
        if (!(length > 0.0)) continue;
        gradient /= length;
        ++surfaces;
      }
      patch.contact.between_bodies[static_cast<std::size_t>(i)] = surfaces > 1;
    }
}

template <int Dim>
double surface_offset(const Model<Dim>& model) {
  const auto [low, high] = model.mesh->bounds();
  return 2.0 * (high - low).norm();
}

namespace {

/// The directions of a patch's nodes, each found once for many cells.
template <int Dim>
class DirectionsOfNodes {
 public:
  void begin(const Patch<Dim>& patch) {
    patch_ = &patch;
    found_.clear();
    number_.assign(static_cast<std::size_t>(patch.body_nodes), -1);
  }
  /// Number of those of a node.
  int at(Local node) {
    int& number = number_[static_cast<std::size_t>(node)];
    if (number < 0) {
      number = static_cast<int>(found_.size());
      found_.push_back(surface_directions(*patch_, node));
    }
    return number;
  }
  const SurfaceDirections<Dim>& operator[](int number) const {
    return found_[static_cast<std::size_t>(number)];
  }

 private:
  const Patch<Dim>* patch_ = nullptr;
  std::vector<SurfaceDirections<Dim>> found_;
  std::vector<int> number_;
};

/// A pack of particles: places, and halves of edges along the axes; of other shapes, edges.
template <int Dim>
struct Ends {
  Pack x[Dim], half[Dim];
  Local n;  ///< particles
};

/// Largest lane of values that are not negative.
double most_of(const Pack& value) {
  alignas(64) double lane[lanes<Pack>];
  store(value, lane);
  return *std::max_element(lane, lane + lanes<Pack>);
}

}  // namespace

template <int Dim>
void map_surface(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  struct Place {
    double *near, *around;  ///< where the body ends along the directions
    Vec<Dim> x;             ///< [m] of the node
    int directions;
  };
  static thread_local std::vector<Place> places;
  static thread_local std::vector<Ends<Dim>> ends;
  static thread_local std::vector<typename HalfEdges<Dim>::Matrix> edges;  // of shapes that turn
  static thread_local DirectionsOfNodes<Dim> directions;
  directions.begin(patch);
  double *near_ends = patch.own_sums(NodeSum::surface, step.step),
         *ends_around = patch.own_sums(NodeSum::surface_around, step.step);
  const double offset = surface_offset(*step.model);
  const auto x = patch.particles.template rows<Dim>(Column::x);
  for (const ParticleBin& bin : bins) {
    if (bin.begin == bin.end) continue;
    places.clear();
    int body = 0;
    for (const Local f : nodes_of(patch, bin.cell)) {
      const Local node = f % patch.body_nodes;
      body = f / patch.body_nodes;
      if (!patch.contact.between_bodies[static_cast<std::size_t>(node)]) continue;
      const auto line = static_cast<std::ptrdiff_t>(f) * sum_stride;
      places.push_back({near_ends + line, ends_around + line,
                        Eigen::Map<const Vec<Dim>>(patch.node_position.data() +
                                                   static_cast<std::ptrdiff_t>(f) * node_width),
                        directions.at(node)});
    }
    if (places.empty()) continue;
    const HalfEdges<Dim> half_edges(patch, bin.cell);
    const bool turned = !half_edges.are_along_axes();
    ends.clear();
    edges.clear();
    for (Local first = bin.begin; first < bin.end; first += lanes<Pack>) {
      Ends<Dim>& of = ends.emplace_back();
      of.n = std::min<Local>(bin.end - first, lanes<Pack>);
      alignas(64) double half[Dim][lanes<Pack>] = {};
      for (Local j = 0; j < of.n; ++j) {
        const auto r = half_edges.at(first + j);
        for (int d = 0; d < Dim; ++d) half[d][j] = r(d, d);
        if (turned) edges.push_back(r);
      }
      for (std::size_t d = 0; d < Dim; ++d) {
        of.x[d] = load_first<Pack>(x[d] + first, of.n);
        of.half[d] = load<Pack>(half[d]);
      }
    }
    const double near =
        near_cells * patch.cell_size[static_cast<std::size_t>(bin.cell) % patch.cell_size.size()];
    for (const Place& place : places) {
      const SurfaceDirections<Dim>& all = directions[place.directions];
      for (int k = 0; k < all.count; ++k) {
        const auto& direction = all.of[static_cast<std::size_t>(k)];
        if (direction.from != body && direction.to >= 0 && direction.to != body) continue;
        const Vec<Dim>& n = direction.normal;
        Pack most(0.0), most_near(0.0);
        auto turned_edges = edges.begin();
        for (const Ends<Dim>& of : ends) {
          Pack ahead(0.0), away(0.0), reach(0.0);
          for (int d = 0; d < Dim; ++d) {
            const Pack from_node = of.x[d] - Pack(place.x[d]);
            ahead += from_node * Pack(n[d]);
            away += from_node * from_node;
            const Pack along = of.half[d] * Pack(n[d]);
            reach += along * along;
          }
          reach = sqrt(reach);
          if (turned) {
            alignas(64) double along[lanes<Pack>] = {};
            for (Local j = 0; j < of.n; ++j) along[j] = ((turned_edges++)->transpose() * n).norm();
            reach = load<Pack>(along);
          }
          const Pack end = first_lanes(
              Pack((direction.from == body ? ahead : -ahead) + reach + Pack(offset)), of.n);
          const unsigned beside = greater(Pack(away - ahead * ahead), Pack(near * near));
          most = max(most, end);
          most_near = max(most_near, select(beside, Pack(0.0), end));
        }
        place.around[k] = std::max(place.around[k], most_of(most));
        place.near[k] = std::max(place.near[k], most_of(most_near));
      }
    }
  }
}

template <int Dim>
void add_meetings(Patch<Dim>& patch, Local node, std::span<const SurfaceEnds> ends, double offset) {
  const SurfaceDirections<Dim> directions = surface_directions(patch, node);
  const auto n_bodies = static_cast<int>(ends.size());
  for (int a = 0; a < n_bodies; ++a)
    for (int b = a + 1; b < n_bodies; ++b) {
      const SurfaceEnds &of_a = ends[static_cast<std::size_t>(a)],
                        &of_b = ends[static_cast<std::size_t>(b)];
      Meeting<Dim> meeting{.a = node + a * patch.body_nodes, .b = node + b * patch.body_nodes};
      bool found = false;
      double widest = 0.0;
      for (int k = 0; k < directions.count; ++k) {
        const auto& direction = directions.of[static_cast<std::size_t>(k)];
        const bool from_a = direction.from == a && (direction.to < 0 || direction.to == b);
        const bool from_b = direction.from == b && direction.to < 0;
        if (!from_a && !from_b) continue;
        if (of_a.around[k] == 0.0 || of_b.around[k] == 0.0) continue;  // one of them is not there
        const double apart = 2.0 * offset - of_a.around[k] - of_b.around[k];
        if (found && !(apart > widest)) continue;
        found = true;
        widest = apart;
        meeting.gap = 2.0 * offset - of_a.at(k) - of_b.at(k);
        meeting.normal = from_a ? direction.normal : Vec<Dim>(-direction.normal);
      }
      if (found) patch.contact.meetings.push_back(meeting);
    }
}

#define LAHAR_INSTANTIATE(Dim)                                                   \
  template SurfaceDirections<Dim> surface_directions(const Patch<Dim>&, Local);  \
  template void set_normals(Patch<Dim>&);                                        \
  template void map_surface(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template double surface_offset(const Model<Dim>&);                             \
  template void add_meetings(Patch<Dim>&, Local, std::span<const SurfaceEnds>, double);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
