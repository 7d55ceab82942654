/// \file A patch with random particles, for the tests of kernels.
#pragma once

#include <memory>

#include "physics/basis/cpdi_domain.h"
#include "physics/basis/support.h"
#include "physics/kernels/kernels.h"
#include "physics/particles/node_space.h"
#include "tests/physics/mesh/element_fixtures.h"

namespace lahar::test {

/// Which natural coordinates the particles of a Cartesian patch store (isoparametric ones always
/// do).
enum class Natural { computed, stored };
/// Where the slots of bins end: behind their particles, or one later.
enum class Slots { packed, with_free };

/// One patch that is the whole mesh.
template <int Dim>
struct OnePatch {
  static constexpr int dim = Dim;
  Model<Dim> model;
  Partition<Dim> partition;
  Patch<Dim> patch;
  double dt = 0.01, time = 0.0;

  explicit OnePatch(Mesh<Dim>&& mesh, Natural natural = Natural::computed,
                    ShapeFunctions functions = ShapeFunctions::element,
                    Affine affine = Affine::none, const MohrCoulomb* soil = nullptr,
                    bool gaps = false)
      : model(with(std::move(mesh))), partition(*model.mesh, model.mesh->n_cells()) {
    if (soil) model.materials = {{.id = 0, .name = "soil", .density = 1.5, .law = *soil}};
    const Mesh<Dim>& m = *model.mesh;
    model.analysis.functions = functions;
    model.analysis.affine = affine;
    patch.topology = make_topology(m, partition, 0);
    add_support(m, model.analysis, patch.topology);
    patch.basis = basis_kind(m, model.analysis);
    patch.element = m.element();
    std::vector<PatchTopology<Dim>*> alone{&patch.topology};
    connect(alone);
    patch.cartesian = m.is_cartesian();
    const ColumnLayout<Dim> layout(
        {.size = true,
         .state = soil ? static_cast<int>(MohrCoulomb::state.size()) : 1,
         .natural = !patch.cartesian || natural == Natural::stored,
         .affine = affine != Affine::none,
         .domain = patch.basis == BasisKind::gimp,
         .next_domain = functions == ShapeFunctions::gimp,
         .vectors = patch.basis == BasisKind::cpdi,
         .corners = patch.basis == BasisKind::cpdi2,
         .next_corners = patch.basis == BasisKind::cpdi2 && natural == Natural::stored,
         .strain = true,
         .opening = gaps});
    patch.particles = Particles<Dim>(layout);
    patch.movers = Particles<Dim>(layout);
    for (Index c = 0; c < m.n_cells(); ++c) {
      patch.local_cell[c] = static_cast<Local>(c);
      patch.cell_size.push_back(m.cell_size(c));
      if (!m.is_multilinear()) continue;
      auto& box = patch.box.emplace_back();
      for (int d = 0; d < Dim; ++d) {
        box[static_cast<std::size_t>(d)] = m.geometry(c).centre[d];
        box[static_cast<std::size_t>(Dim + d)] = 2.0 / m.geometry(c).length[d];
      }
    }
    if (gaps) patch.space = space_around_cells(patch.topology, model);
    const auto nodes = static_cast<std::size_t>(m.n_nodes());
    const NodeArray zero(nodes * node_width, 0.0);
    patch.node_position = patch.velocity = patch.acceleration = patch.damping = zero;
    for (Index n = 0; n < m.n_nodes(); ++n)
      for (int d = 0; d < Dim; ++d)
        patch.node_position[at(static_cast<Local>(n), d)] = m.node(n)[d];
    for (auto& copies : patch.sums) copies = {NodeArray(nodes * sum_stride, 0.0)};
    patch.active_nodes = {{0, static_cast<Local>(nodes), 0}};
    patch.pressure.assign(nodes, 0.0);
  }

  /// Place of a component in a node array.
  static std::size_t at(Local node, int component) {
    return static_cast<std::size_t>(node) * node_width + static_cast<std::size_t>(component);
  }
  Vec<Dim> node(Local n) const {
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d) x[d] = patch.node_position[at(n, d)];
    return x;
  }
  double sum(NodeSum which, Local n, int component) const {
    return patch.own_sums(
        which, 0)[static_cast<std::size_t>(n) * sum_stride + static_cast<std::size_t>(component)];
  }

  StepContext<Dim> context() const { return {&model, &partition, 0, time, dt}; }

  /// A particle of random state at natural coordinates xi of a cell.
  void add(std::mt19937& random, Local cell, const Vec<Dim>& xi, std::uint16_t material) {
    Particles<Dim>& p = patch.particles;
    const Local i = p.size();
    p.resize(i + 1);
    p.loads.resize(static_cast<std::size_t>(i) + 1);
    p.id.back() = 1000 + i;
    p.cell.back() = cell;
    p.material.back() = material;
    for (const ColumnInfo& info : column_table)
      if (p.layout().has(info.column))
        for (int k = 0; k < p.layout().components(info); ++k)
          p.row(info.column, k)[i] = uniform(random, -1, 1);
    for (const Column c : {Column::volume, Column::mass, Column::size})
      if (p.layout().has(c)) p.row(c)[i] = uniform(random, 0.5, 1.5);
    if (p.layout().has(Column::domain))
      for (int d = 0; d < Dim; ++d)  // a tenth of the cell to nearly two cells
        p.row(Column::domain, d)[i] =
            uniform(random, 0.1, 1.9) * model.mesh->geometry(cell).length[d];
    if (p.layout().has(Column::vectors))
      for (int k = 0; k < Dim; ++k)
        for (int d = 0; d < Dim; ++d)
          p.row(Column::vectors, Dim * k + d)[i] =
              (k == d ? uniform(random, 0.1, 0.5) : uniform(random, -0.2, 0.2)) *
              model.mesh->geometry(cell).length[d];
    if (p.layout().has(Column::corners)) add_corners(random, cell, i);
    const auto x = physical(cell, xi);
    for (int d = 0; d < Dim; ++d) {
      if (p.layout().has(Column::xi)) p.row(Column::xi, d)[i] = xi[d];
      p.row(Column::x, d)[i] = x[d];
    }
  }

  /// The corners of a parallelepiped of up to the cell's size, each moved at random, about their
  /// centroid.
  void add_corners(std::mt19937& random, Local cell, Local i) {
    const Vec<Dim> length = model.mesh->geometry(cell).length;
    Hexahedron<Dim, Scalar> domain;
    for (int d = 0; d < Dim; ++d) {
      double edge[Dim];
      for (int k = 0; k < Dim; ++k)
        edge[k] = k == d ? uniform(random, 0.1, 0.5) : uniform(random, -0.05, 0.05);
      for (int c = 0; c < corners<Dim>; ++c) {
        double at = uniform(random, -0.02, 0.02);
        for (int k = 0; k < Dim; ++k) at += corner_sign(c, k) * edge[k];
        domain.r[c][d] = at * length[d];
      }
    }
    Scalar w[corners<Dim>];
    domain.weights(w);
    for (int d = 0; d < Dim; ++d) {
      double centroid = 0;
      for (int c = 0; c < corners<Dim>; ++c) centroid += w[c][0] * domain.r[c][d][0];
      for (int c = 0; c < corners<Dim>; ++c)
        patch.particles.row(Column::corners, Dim * c + d)[i] = domain.r[c][d][0] - centroid;
    }
  }

  /// 0 to 21 particles in every cell (so that every length of a bin occurs), two materials, in
  /// random order; then sorted into bins.
  void fill(std::mt19937& random, Slots slots = Slots::packed) {
    std::vector<Local> cells;
    for (Index c = 0; c < model.mesh->n_cells(); ++c)
      cells.insert(cells.end(), static_cast<std::size_t>(c * 7 % 22), static_cast<Local>(c));
    std::shuffle(cells.begin(), cells.end(), random);
    for (const Local cell : cells)
      add(random, cell, inside(random),
          static_cast<std::uint16_t>(random() % model.materials.size()));
    patch.moving = slots == Slots::with_free;
    receive(patch);
  }

  /// Natural coordinates anywhere in a cell.
  Vec<Dim> inside(std::mt19937& random) const {
    Vec<Dim> xi = random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
    if (!info(patch.element).simplex) return xi;
    do {
      xi = random_point<Dim>(random, Vec<Dim>::Zero(), Vec<Dim>::Ones());
    } while (!in_closed_cell<Dim>(patch.element, xi));
    return xi;
  }

  Vec<Dim> physical(Local cell, const Vec<Dim>& xi) const {
    if (!model.mesh->is_multilinear()) return model.mesh->element_geometry(cell).point(xi);
    const CellGeometry<Dim> geometry = model.mesh->geometry(cell);
    Vec<Dim> x = Vec<Dim>::Zero();
    for (int a = 0; a < corners<Dim>; ++a) {
      double N = 1;
      for (int d = 0; d < Dim; ++d) N *= 0.5 * (1 + ((a >> d) & 1 ? xi[d] : -xi[d]));
      x += N * geometry.corner[static_cast<std::size_t>(a)];
    }
    return x;
  }

  double at(Column c, Local p, int k = 0) const { return patch.particles.row(c, k)[p]; }
  double& at(Column c, Local p, int k = 0) { return patch.particles.row(c, k)[p]; }
  Local size() const { return patch.count; }
  /// Slots of all particles, in the order of the bins.
  std::vector<Local> slots() const {
    std::vector<Local> all;
    patch.for_each_particle([&](Local p) { all.push_back(p); });
    return all;
  }
  std::vector<Index> ids() const {
    std::vector<Index> all;
    for (const Local p : slots()) all.push_back(patch.particles.id[static_cast<std::size_t>(p)]);
    return all;
  }
  Vec<Dim> vector(Column c, Local p) const {
    Vec<Dim> v;
    for (int d = 0; d < Dim; ++d) v[d] = at(c, p, d);
    return v;
  }
  Vec<Dim> natural(Local p) const {
    if (patch.particles.layout().has(Column::xi)) return vector(Column::xi, p);
    const auto& box =
        patch.box[static_cast<std::size_t>(patch.particles.cell[static_cast<std::size_t>(p)])];
    Vec<Dim> xi;
    for (int d = 0; d < Dim; ++d)
      xi[d] = (at(Column::x, p, d) - box[static_cast<std::size_t>(d)]) *
              box[static_cast<std::size_t>(Dim + d)];
    return xi;
  }

 private:
  static Model<Dim> with(Mesh<Dim>&& mesh) {
    Model<Dim> model;
    model.mesh = std::make_shared<const Mesh<Dim>>(std::move(mesh));
    model.materials = {{.id = 0,
                        .name = "solid",
                        .density = 1.5,
                        .law = LinearElastic{.youngs_modulus = 10, .poisson_ratio = 0.3}},
                       {.id = 1,
                        .name = "fluid",
                        .density = 0.7,
                        .law = Newtonian{.bulk_modulus = 20, .dynamic_viscosity = 0.4}}};
    return model;
  }
};

/// Boxes of unequal edges, and cells that are no boxes.
template <int Dim>
Mesh<Dim> boxes() {
  Vec<Dim> edge = Vec<Dim>::Ones();
  edge[0] = 0.5;
  edge[Dim - 1] = 2;
  std::array<Index, Dim> counts;
  counts.fill(Dim == 2 ? 6 : 3);
  return Mesh<Dim>::structured(Vec<Dim>::Constant(-1), edge, counts);
}
template <int Dim>
Mesh<Dim> skewed() {
  std::mt19937 random(3);
  std::array<Index, Dim> counts;
  counts.fill(Dim == 2 ? 6 : 3);
  return distorted<Dim>(grid_tables<Dim>(counts), 0.12, random).mesh(true);
}

/// Make nodal velocities (or accelerations) A x + b, with random A and b.
template <class Fixture>
auto set_linear(Fixture& f, NodeArray& field, std::mt19937& random) {
  constexpr int Dim = Fixture::dim;
  Eigen::Matrix<double, Dim, Dim> A;
  for (int i = 0; i < Dim * Dim; ++i) A.data()[i] = uniform(random, -1, 1);
  const Vec<Dim> b = random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
  for (Local n = 0; n < f.patch.n_nodes(); ++n) {
    const Vec<Dim> v = A * f.node(n) + b;
    for (int d = 0; d < Dim; ++d) field[f.at(n, d)] = v[d];
  }
  return std::pair(A, b);
}

/// Call make() for each dimension and kind of cell: `with` gets functions that make an empty patch.
void with_every_kind(auto with) {
  with([] { return OnePatch<2>(boxes<2>()); });
  with([] { return OnePatch<2>(boxes<2>(), Natural::stored); });
  with([] { return OnePatch<2>(skewed<2>()); });
  with([] { return OnePatch<3>(boxes<3>()); });
  with([] { return OnePatch<3>(boxes<3>(), Natural::stored); });
  with([] { return OnePatch<3>(skewed<3>()); });
}

/// The functions that reach beyond a cell.
inline constexpr ShapeFunctions wide_functions[] = {
    ShapeFunctions::gimp,  ShapeFunctions::uniform_gimp,     ShapeFunctions::cpdi,
    ShapeFunctions::cpdi2, ShapeFunctions::quadratic_spline, ShapeFunctions::cubic_spline};

/// The same for these functions.
void with_wide_functions(auto with, Affine affine = Affine::none) {
  for (const ShapeFunctions functions : wide_functions)
    for (const Natural natural : {Natural::computed, Natural::stored}) {
      with([=] { return OnePatch<2>(boxes<2>(), natural, functions, affine); });
      with([=] { return OnePatch<3>(boxes<3>(), natural, functions, affine); });
    }
}

/// A grid of cells of any element whose faces are bent.
template <int Dim>
Mesh<Dim> bent(Element element) {
  std::mt19937 random(3);
  std::array<Index, Dim> counts;
  counts.fill(Dim == 2 ? 6 : 3);
  auto t = element_grid<Dim>(element, Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts);
  for (auto& x : t.nodes)
    x += random_point<Dim>(random, Vec<Dim>::Constant(-0.06), Vec<Dim>::Constant(0.06));
  return Mesh<Dim>::from_tables(t.nodes, element, t.cells, true);
}

/// The same for the elements that have no kernels of their own.
void with_elements(auto with) {
  for (const Element element : elements_of(2))
    if (element != multilinear<2>) with([=] { return OnePatch<2>(bent<2>(element)); });
  for (const Element element : elements_of(3))
    if (element != multilinear<3>) with([=] { return OnePatch<3>(bent<3>(element)); });
}

/// The same for linear functions as a basis.
void with_affine_corners(auto with, Affine affine) {
  const auto functions = ShapeFunctions::element;
  for (const Natural natural : {Natural::computed, Natural::stored}) {
    with([=] { return OnePatch<2>(boxes<2>(), natural, functions, affine); });
    with([=] { return OnePatch<3>(boxes<3>(), natural, functions, affine); });
  }
  with([=] { return OnePatch<2>(skewed<2>(), Natural::stored, functions, affine); });
  with([=] { return OnePatch<3>(skewed<3>(), Natural::stored, functions, affine); });
}

/// Call with a filled patch of each dimension and kind of cell.
template <class Check>
void on_every_mesh(Check check) {
  std::mt19937 random(17);
  with_every_kind([&](auto make) {
    for (const Slots slots : {Slots::packed, Slots::with_free}) {
      auto patch = make();
      patch.fill(random, slots);
      check(patch, random);
    }
  });
}

}  // namespace lahar::test
