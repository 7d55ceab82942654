#include "io/scenario/particles_generator.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "io/scenario/region_parts.h"
#include "physics/mesh/locate_all.h"

namespace lahar {

namespace {

// Corners in file order: counter-clockwise per layer.
template <int Dim>
Vec<Dim> corner_xi(int k) {
  constexpr int sx[] = {-1, 1, 1, -1}, sy[] = {-1, -1, 1, 1};
  Vec<Dim> xi;
  xi[0] = sx[k % 4];
  xi[1] = sy[k % 4];
  if constexpr (Dim == 3) xi[2] = k < 4 ? -1 : 1;
  return xi;
}

}  // namespace

template <int Dim>
Vec<Dim> cell_point(const Mesh<Dim>& mesh, Index cell, const Vec<Dim>& xi) {
  if (!mesh.is_multilinear()) return mesh.element_geometry(cell).point(xi);
  const auto nodes = mesh.cell_nodes(cell);
  Vec<Dim> x = Vec<Dim>::Zero();
  for (int k = 0; k < corners<Dim>; ++k) {
    const Vec<Dim> s = corner_xi<Dim>(k);
    double N = 1;
    for (int d = 0; d < Dim; ++d) N *= 0.5 * (1 + s[d] * xi[d]);
    x += N * mesh.node(nodes[static_cast<std::size_t>(k)]);
  }
  return x;
}

template <int Dim>
NewParticles<Dim> fill_cells(const Mesh<Dim>& mesh, std::span<const Index> cells, int n) {
  const auto points = gauss_points<Dim>(mesh.element(), n);
  NewParticles<Dim> out;
  out.x.reserve(cells.size() * points.size());
  out.cell.reserve(cells.size() * points.size());
  for (const Index cell : cells)
    for (const auto& xi : points) {
      out.x.push_back(cell_point<Dim>(mesh, cell, xi));
      out.cell.push_back(cell);
    }
  out.volume.assign(out.x.size(), 0.0);
  return out;
}

namespace {

// Particles that go to the member that has their row of all.
template <int Dim>
class RowsOnTheirWay {
 public:
  /// [first, end): this member's rows.
  RowsOnTheirWay(Index first, Index end, const Team& team)
      : first_(first),
        total_(team.sum(end - first)),
        team_(team),
        to_(static_cast<std::size_t>(team.size())) {
    const auto n = static_cast<std::size_t>(end - first);
    out_.x.resize(n);
    out_.cell.resize(n);
    out_.volume.resize(n);
  }
  void add(Index row, const Vec<Dim>& x, Index cell, double volume) {
    auto& sent = to_[static_cast<std::size_t>(team_.member(row, total_))].emplace_back();
    sent = {row, cell, volume, {}};
    std::copy_n(x.data(), Dim, sent.x.begin());
  }
  /// Collective.
  void exchange() {
    for (const auto& part : team_.exchange(to_))
      for (const Sent& sent : part) {
        const auto at = static_cast<std::size_t>(sent.row - first_);
        out_.x[at] = Vec<Dim>(sent.x.data());
        out_.cell[at] = sent.cell;
        out_.volume[at] = sent.volume;
      }
    for (auto& part : to_) part.clear();
  }
  NewParticles<Dim> take() { return std::move(out_); }

 private:
  struct Sent {
    Index row, cell;
    double volume;
    std::array<double, static_cast<std::size_t>(Dim)> x;
  };
  Index first_, total_;
  const Team& team_;
  std::vector<std::vector<Sent>> to_;
  NewParticles<Dim> out_;
};

}  // namespace

namespace {

template <int Dim, class Parts>
NewParticles<Dim> fill_parts(const Mesh<Dim>& mesh, const Region<Dim>& region, const Parts& parts,
                             const Team& team, const ParticleLimit& limit) {
  // How many particles a cell has is not known before it has been looked at. So members first count
  // those of some blocks of cells each, and then look at the blocks that have their own particles.
  constexpr Index blocks_of_member = 64;
  const CellsNear<Dim> cells(mesh, region);
  const Index blocks = team.alone() ? 1 : blocks_of_member * team.size();
  const auto block_begin = [&](Index b) {
    return cells.size() / blocks * b + cells.size() % blocks * b / blocks;
  };
  Index first = 0, end = std::numeric_limits<Index>::max();
  std::vector<Index> counts(1, 1);  // particles of each block
  const double most = static_cast<double>(limit.of_member) * team.size();
  const auto check = [&](Index count) {
    if (static_cast<double>(count) > most) limit.too_many(count);
  };
  if (team.alone() &&
      static_cast<double>(cells.size()) * static_cast<double>(parts.size()) > most) {
    Index count = 0;  // where there may be too many, they are counted before they are kept
    cells.visit(0, cells.size(), [&](Index cell) {
      parts.visit(cell, [&](const auto&, auto&&) { ++count; });
      check(count);
    });
  }
  if (!team.alone()) {
    std::vector<Index> own(blocks_of_member, 0);
    all_or_none(team, [&] {
      Index all = 0;
      for (Index b = 0; b < blocks_of_member; ++b) {
        const Index block = team.index() * blocks_of_member + b;
        Index& count = own[static_cast<std::size_t>(b)];
        cells.visit(block_begin(block), block_begin(block + 1), [&](Index cell) {
          parts.visit(cell, [&](const auto&, auto&&) { ++count, ++all; });
          check(all);
        });
      }
    });
    counts.clear();
    for (const auto& member : team.gather(own))
      counts.insert(counts.end(), member.begin(), member.end());
    const Index total = std::accumulate(counts.begin(), counts.end(), Index{0});
    check(total);
    first = team.part(total, team.index());
    end = team.part(total, team.index() + 1);
  }
  NewParticles<Dim> out;
  if (mesh.is_share()) {
    // Nobody else has this member's cells: it makes their particles and sends them, block by block.
    RowsOnTheirWay<Dim> on_their_way(first, end, team);
    const Index own = team.index() * blocks_of_member;
    Index row = std::accumulate(counts.begin(), counts.begin() + own, Index{0});
    for (Index b = own; b < own + blocks_of_member; ++b) {
      cells.visit(block_begin(b), block_begin(b + 1), [&](Index cell) {
        parts.visit(cell, [&](const Vec<Dim>& x, auto&& volume) {
          on_their_way.add(row++, x, cell, volume());
        });
      });
      on_their_way.exchange();
    }
    return on_their_way.take();
  }
  Index row = 0;
  for (Index b = 0; b < blocks; ++b) {
    const Index next = row + counts[static_cast<std::size_t>(b)];
    if (next > first && row < end)
      cells.visit(block_begin(b), block_begin(b + 1), [&](Index cell) {
        parts.visit(cell, [&](const Vec<Dim>& x, auto&& volume) {
          if (row++ < first || row > end) return;
          out.x.push_back(x);
          out.cell.push_back(cell);
          out.volume.push_back(volume());
        });
      });
    row = next;
  }
  return out;
}

}  // namespace

template <int Dim>
NewParticles<Dim> fill_region(const Mesh<Dim>& mesh, const Region<Dim>& region, int n,
                              const Team& team, const ParticleLimit& limit, CutCells cut) {
  if (cut == CutCells::exact)
    return fill_parts<Dim>(mesh, region, CutParts<Dim>(mesh, region, n), team, limit);
  return fill_parts<Dim>(mesh, region, WholeParts<Dim>(mesh, region, n), team, limit);
}

template <int Dim>
std::vector<Index> place(const Mesh<Dim>& mesh, const std::vector<Index>& suggested,
                         ParticleTable<Dim>& particles) {
  for (std::size_t p = 0; p < suggested.size(); ++p)
    if (particles.cell[p] < 0 && suggested[p] >= 0 &&
        mesh.natural_coordinates(suggested[p], particles.x[p]))
      particles.cell[p] = suggested[p];
  locate_all<Dim>(mesh, particles.x, particles.cell);
  std::vector<Index> outside;
  for (std::size_t p = 0; p < particles.cell.size(); ++p)
    if (particles.cell[p] < 0) outside.push_back(static_cast<Index>(p));
  return outside;
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template Vec<Dim> cell_point<Dim>(const Mesh<Dim>&, Index, const Vec<Dim>&);               \
  template NewParticles<Dim> fill_cells<Dim>(const Mesh<Dim>&, std::span<const Index>, int); \
  template NewParticles<Dim> fill_region<Dim>(const Mesh<Dim>&, const Region<Dim>&, int,     \
                                              const Team&, const ParticleLimit&, CutCells);  \
  template std::vector<Index> place<Dim>(const Mesh<Dim>&, const std::vector<Index>&,        \
                                         ParticleTable<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
