/// \file Parts of a mesh from tables: some of its cells, taken from here and there.
#include <tsl/robin_set.h>

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <stdexcept>

#include "physics/base/byte_stream.h"
#include "physics/mesh/mesh_table.h"
#include "physics/mesh/partition_common.h"

namespace lahar {
namespace {

bool ascending_below(std::span<const Index> ids, Index limit) {
  return std::adjacent_find(ids.begin(), ids.end(), std::greater_equal<>()) == ids.end() &&
         (ids.empty() || (ids.front() >= 0 && ids.back() < limit));
}

template <int Dim>
TablePiece<Dim> read_piece(std::span<const std::byte> bytes, std::span<const Index> expected) {
  ByteReader reader(bytes);
  const auto sizes = reader.array<Index>();
  if (!std::ranges::equal(sizes, expected))
    throw std::invalid_argument("cells from another rank are not of the same mesh");
  TablePiece<Dim> piece;
  piece.cells = reader.array<Index>();
  piece.cell_nodes = reader.array<Local>();
  piece.nodes = reader.array<Index>();
  const auto x = reader.array<double>();
  reader.expect_end();
  const auto n = static_cast<Local>(piece.nodes.size());
  const auto [dim, element, n_nodes, n_cells] = std::array{sizes[0], sizes[1], sizes[2], sizes[3]};
  const auto per_cell = static_cast<std::size_t>(info(static_cast<Element>(element)).nodes);
  bool fits = piece.cell_nodes.size() == per_cell * piece.cells.size() &&
              x.size() == Dim * piece.nodes.size() && ascending_below(piece.cells, n_cells) &&
              ascending_below(piece.nodes, n_nodes);
  for (Local node : piece.cell_nodes) fits &= node >= 0 && node < n;
  if (!fits) throw std::invalid_argument("cells from another rank are damaged");
  piece.x.resize(piece.nodes.size());
  for (std::size_t i = 0; i < piece.x.size(); ++i)
    piece.x[i] = Eigen::Map<const Vec<Dim>>(&x[Dim * i]);
  return piece;
}

}  // namespace

template <int Dim>
TablePiece<Dim> CellTable<Dim>::piece(std::span<const Index> cells) const {
  TablePiece<Dim> piece;
  piece.cells.assign(cells.begin(), cells.end());
  std::vector<Local> position(nodes_.size(), -1);  // in the piece, of a row here
  for (Index cell : cells)
    for (Local node : nodes_of(cell_row(cell))) position[node] = 0;
  for (std::size_t row = 0; row < position.size(); ++row) {
    if (position[row] < 0) continue;
    position[row] = static_cast<Local>(piece.nodes.size());
    piece.nodes.push_back(node_ids_.id(row));
    piece.x.push_back(nodes_[row]);
  }
  piece.cell_nodes.reserve(cells.size() * static_cast<std::size_t>(info(element()).nodes));
  for (Index cell : cells)
    for (Local node : nodes_of(cell_row(cell))) piece.cell_nodes.push_back(position[node]);
  return piece;
}

/// Ids of the bins that the cells held touch, ascending.
template <int Dim>
std::vector<Index> CellTable<Dim>::touched_bins() const {
  tsl::robin_set<Index> touched;
  for (Index c = 0; c < cell_ids_.size(); ++c) {
    const auto [low, high] = padded_bounds_[c];
    for_each_position<Dim>(grid_.position(low), grid_.position(high),
                           [&](const Bins& p) { touched.insert(grid_.bin(p)); });
  }
  std::vector<Index> bins(touched.begin(), touched.end());
  std::sort(bins.begin(), bins.end());
  return bins;
}

/// Cells of `other`, and those of the pieces, of which one at a time is unpacked; what is known of
/// the whole mesh comes from `other`.
template <int Dim>
CellTable<Dim>::CellTable(const CellTable& other, std::span<const Index> own,
                          std::vector<std::vector<std::byte>> packed, bool connected)
    : whole_(other.whole_), connected_(connected) {
  std::vector<Index> cells, nodes;
  const auto note = [&](const TablePiece<Dim>& piece) {
    cells.insert(cells.end(), piece.cells.begin(), piece.cells.end());
    nodes.insert(nodes.end(), piece.nodes.begin(), piece.nodes.end());
  };
  note(other.piece(own));
  for (const auto& bytes : packed) note(read_piece<Dim>(bytes, identity()));
  const auto map = [](std::vector<Index>& ids) {
    sort_unique(ids);
    ids.shrink_to_fit();
    return IdMap::some(std::move(ids));
  };
  cell_ids_ = map(cells);
  node_ids_ = map(nodes);
  cells_.resize(static_cast<std::size_t>(cell_ids_.size() * info(element()).nodes));
  nodes_.resize(node_ids_.size());
  take(other.piece(own));
  for (auto& bytes : packed) {
    take(read_piece<Dim>(bytes, identity()));
    bytes = {};
  }
  grid_.low = other.grid_.low;
  grid_.high = other.grid_.high;
  grid_.bins_per_metre = other.grid_.bins_per_metre;
  grid_.counts = other.grid_.counts;
  build_bounds();
  if (!connected_) return;
  build_connectivity();
  grid_.bins = IdMap::some(touched_bins());
  fill_bins();
}

/// Put cells and nodes into their rows.
template <int Dim>
void CellTable<Dim>::take(const TablePiece<Dim>& piece) {
  const auto per_cell = static_cast<std::size_t>(info(element()).nodes);
  std::vector<Local> row(piece.nodes.size());
  for (std::size_t n = 0; n < row.size(); ++n) {
    row[n] = static_cast<Local>(node_ids_.row(piece.nodes[n]));
    nodes_[row[n]] = piece.x[n];
  }
  for (std::size_t c = 0; c < piece.cells.size(); ++c) {
    Local* cell = &cells_[static_cast<std::size_t>(cell_ids_.row(piece.cells[c])) * per_cell];
    for (std::size_t k = 0; k < per_cell; ++k) cell[k] = row[piece.cell_nodes[c * per_cell + k]];
  }
}

template <int Dim>
CellTable<Dim> CellTable<Dim>::part(std::span<const Index> cells,
                                    std::vector<std::vector<std::byte>> pieces,
                                    bool connected) const {
  return CellTable(*this, cells, std::move(pieces), connected);
}

/// A share whose whole is not yet known.
template <int Dim>
CellTable<Dim>::CellTable(TablePiece<Dim> own, Element element, Index n_nodes, Index n_cells,
                          bool isoparametric)
    : connected_(false),
      cell_ids_(IdMap::some(std::move(own.cells))),
      node_ids_(IdMap::some(std::move(own.nodes))),
      nodes_(std::move(own.x)),
      cells_(std::move(own.cell_nodes)) {
  whole_.n_nodes = n_nodes;
  whole_.n_cells = n_cells;
  whole_.element = element;
  whole_.cartesian = is_multilinear() && !isoparametric;
  check_share(isoparametric);
  build_bounds();
}

/// As tables of their own, some at a time. Ids in messages are not those of the mesh.
template <int Dim>
void CellTable<Dim>::check_share(bool isoparametric) const {
  constexpr std::size_t at_a_time = std::size_t{1} << 16;
  const auto per_cell = static_cast<std::size_t>(info(element()).nodes);
  std::vector<Index> ids;
  for (std::size_t begin = 0; begin < cells_.size(); begin += at_a_time * per_cell) {
    const std::size_t end = std::min(cells_.size(), begin + at_a_time * per_cell);
    ids.assign(cells_.begin() + begin, cells_.begin() + end);
    check_tables<Dim>(nodes_, CellList{element(), ids}, isoparametric);
  }
}

template <int Dim>
void CellTable<Dim>::add_to(CellSums<Dim>& sums) const {
  using Values = Eigen::Map<Point>;
  const auto add = [](const std::pair<Point, Point>& box, auto& low, auto& high, auto& size) {
    Values(low.data()) = Values(low.data()).cwiseMin(box.first);
    Values(high.data()) = Values(high.data()).cwiseMax(box.second);
    Values(size.data()) += box.second - box.first;
  };
  for (Index row = 0; row < cell_ids_.size(); ++row) {
    const auto bounds = cell_bounds(row);
    add(bounds, sums.low, sums.high, sums.size);
    add(padded(bounds), sums.padded_low, sums.padded_high, sums.padded_size);
    if (!is_multilinear() || is_cartesian() || !sums.boxes) continue;
    std::array<Point, corners<Dim>> corner;
    const auto nodes = nodes_of(row);
    for (std::size_t k = 0; k < corner.size(); ++k) corner[k] = nodes_[nodes[k]];
    sums.boxes = is_box<Dim>(corner, 0.0);
  }
}

/// Sums are those of all cells.
template <int Dim>
void CellTable<Dim>::complete(const CellSums<Dim>& sums) {
  const auto point = [](const auto& values) { return Point(values.data()); };
  whole_.bounds = {point(sums.low), point(sums.high)};
  whole_.mean_cell = point(sums.size) / static_cast<double>(n_cells());
  // Cells that are boxes to the last bit have the closed-form map whatever the file calls them.
  whole_.cartesian = whole_.cartesian || (is_multilinear() && sums.boxes);
  choose_bins(sums);
}

template <int Dim>
std::vector<std::byte> CellTable<Dim>::pack(std::span<const Index> cells) const {
  const TablePiece<Dim> packed = piece(cells);
  std::vector<double> x;
  x.reserve(Dim * packed.x.size());
  for (const Point& point : packed.x) x.insert(x.end(), point.data(), point.data() + Dim);
  ByteWriter writer;
  writer.array<Index>(identity());
  writer.array<Index>(packed.cells);
  writer.array<Local>(packed.cell_nodes);
  writer.array<Index>(packed.nodes);
  writer.array<double>(x);
  return writer.take();
}

template <int Dim>
std::size_t CellTable<Dim>::bytes() const {
  return cell_ids_.bytes() + node_ids_.bytes() + nodes_.capacity() * sizeof(Point) +
         cells_.capacity() * sizeof(Local) + node_cells_.bytes() +
         (curved_bounds_.capacity() + padded_bounds_.capacity()) * sizeof(padded_bounds_[0]) +
         face_neighbour_.capacity() * sizeof(face_neighbour_[0]) + grid_.bins.bytes() +
         grid_.cells.bytes();
}

template <int Dim>
std::vector<Index> CellTable<Dim>::marked_cells(const std::vector<char>& marked) const {
  std::vector<Index> cells;
  for (std::size_t row = 0; row < marked.size(); ++row)
    if (marked[row]) cells.push_back(cell_ids_.id(row));
  return cells;
}

template <int Dim>
std::vector<Index> CellTable<Dim>::widened(std::span<const Index> cells, int layers) const {
  std::vector<char> cell(cell_ids_.size(), 0), node(nodes_.size(), 0);
  for (Index c : cells) cell[cell_row(c)] = 1;
  for (int layer = 0; layer < layers; ++layer) {
    for (std::size_t c = 0; c < cell.size(); ++c)
      if (cell[c])
        for (Local n : nodes_of(static_cast<Index>(c))) node[n] = 1;
    for (std::size_t n = 0; n < node.size(); ++n)
      if (node[n])
        for (Local c : node_cells_[n]) cell[c] = 1;
  }
  return marked_cells(cell);
}

/// All cells of the bins that the reach of some cell touches: those in which locate() looks.
template <int Dim>
std::vector<Index> CellTable<Dim>::cells_near(std::span<const Index> cells) const {
  std::vector<char> bin(grid_.bins.size(), 0), near(cell_ids_.size(), 0);
  for (Index cell : cells) {
    const auto [low, high] = reach(cell_row(cell));
    for_each_position<Dim>(grid_.position(low), grid_.position(high), [&](const Bins& p) {
      if (const Index row = grid_.bins.row(grid_.bin(p)); row >= 0) bin[row] = 1;
    });
  }
  for (std::size_t row = 0; row < bin.size(); ++row)
    if (bin[row])
      for (Local c : grid_.cells[row]) near[c] = 1;
  return marked_cells(near);
}

/// By the boxes around the cells of each node, which a share can tell as well: reach().
template <int Dim>
std::vector<Index> CellTable<Dim>::bins_near(std::span<const Index> cells) const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const std::pair<Point, Point> nothing{Point::Constant(infinity), Point::Constant(-infinity)};
  const auto widen = [](std::pair<Point, Point>& box, const std::pair<Point, Point>& by) {
    box.first = box.first.cwiseMin(by.first);
    box.second = box.second.cwiseMax(by.second);
  };
  std::vector<std::pair<Point, Point>> around(nodes_.size(), nothing);
  for (Index row = 0; row < cell_ids_.size(); ++row)
    for (Local node : nodes_of(row)) widen(around[node], cell_bounds(row));
  const auto reach_of = [&](Index cell) {
    const auto own = cell_bounds(cell_row(cell));
    auto box = own;
    for (Local node : nodes_of(cell_row(cell))) widen(box, around[node]);
    const Point beyond = own.second - own.first;
    return std::pair(grid_.position(box.first - beyond), grid_.position(box.second + beyond));
  };
  Bins low, high;  // of the box of bins around them
  low.fill(std::numeric_limits<Index>::max());
  high.fill(-1);
  for (Index cell : cells) {
    const auto [first, last] = reach_of(cell);
    for (int d = 0; d < Dim; ++d) {
      low[d] = std::min(low[d], first[d]);
      high[d] = std::max(high[d], last[d]);
    }
  }
  std::vector<Index> bins;
  if (cells.empty()) return bins;
  const auto in_box = [&](const Bins& p) {
    Index at = 0;
    for (int d = Dim - 1; d >= 0; --d) at = at * (high[d] - low[d] + 1) + p[d] - low[d];
    return at;
  };
  std::vector<char> near(in_box(high) + 1, 0);
  for (Index cell : cells) {
    const auto [first, last] = reach_of(cell);
    for_each_position<Dim>(first, last, [&](const Bins& p) { near[in_box(p)] = 1; });
  }
  for_each_position<Dim>(low, high, [&](const Bins& p) {
    if (near[in_box(p)]) bins.push_back(grid_.bin(p));
  });
  return bins;  // ascending, as positions were
}

template <int Dim>
Index CellTable<Dim>::n_bins() const {
  Index n = 1;
  for (Index count : grid_.counts) n *= count;
  return n;
}

template <int Dim>
Index CellTable<Dim>::bin_of(const Point& x) const {
  return grid_.contains(x) ? grid_.bin(grid_.position(x)) : -1;
}

template <int Dim>
std::vector<Index> CellTable<Dim>::bins_of(Index cell) const {
  std::vector<Index> bins;
  const auto [low, high] = padded(cell_bounds(cell_row(cell)));
  for_each_position<Dim>(grid_.position(low), grid_.position(high),
                         [&](const Bins& p) { bins.push_back(grid_.bin(p)); });
  return bins;
}

template class CellTable<2>;
template class CellTable<3>;

}  // namespace lahar
