// Meshes of VTU files: unstructured grids of VTK, with arrays of integers as sets.
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "io/mesh/element_file.h"
#include "io/mesh/vtu_arrays.h"

namespace lahar {

namespace {

VtuHead plausible_head(const SideFile& file) {
  VtuHead head = read_vtu_head(file);
  // Each needs a byte in the file at least, or a bit of it if compressed.
  const Index most = std::max(head.n_points, head.n_cells);
  if (most > best_compression * file.size || most > std::numeric_limits<Local>::max())
    fail_vtu(file, fmt::format("{} points and {} cells are too many for this file", head.n_points,
                               head.n_cells));
  return head;
}

class VtuReader {
 public:
  explicit VtuReader(const SideFile& file) : file_(file), head_(plausible_head(file)) {}

  FileElements read() {
    read_points();
    read_cells();
    for (const VtuArray& array : head_.point_data)
      add_sets(array, head_.n_points, [&](Local set, std::size_t point) {
        tables_.sets[static_cast<std::size_t>(set)].dim = -1;
        tables_.point_sets.emplace_back(set, static_cast<Local>(point));
      });
    for (const VtuArray& array : head_.cell_data) add_cell_sets(array);
    return std::move(tables_);
  }

 private:
  void read_points() {
    if (head_.points.size() != 1 || head_.points[0].components != 3)
      fail_vtu(file_, "the grid needs one array of points, with three components");
    const auto x = read_vtu_numbers(file_, head_, head_.points[0], 3 * head_.n_points);
    tables_.points.reserve(static_cast<std::size_t>(head_.n_points));
    for (std::size_t i = 0; i < x.size(); i += 3) {
      tables_.points.emplace_back(x[i], x[i + 1], x[i + 2]);
      if (!tables_.points.back().allFinite())
        fail_vtu(file_, fmt::format("the coordinates of point {} are not finite numbers", i / 3));
    }
  }

  const VtuArray& cells(const std::string& name) const {
    const auto it = head_.cells.find(name);
    if (it == head_.cells.end()) fail_vtu(file_, fmt::format("the cells have no array '{}'", name));
    return it->second;
  }

  void read_cells() {
    const auto types = read_vtu_integers(file_, head_, cells("types"), head_.n_cells);
    const auto ends = read_vtu_integers(file_, head_, cells("offsets"), head_.n_cells);
    constexpr Index most_nodes_of_cell = 1 << 16;
    const Index n = ends.empty() ? 0 : ends.back();
    if (n < 0 || n > most_nodes_of_cell * head_.n_cells)
      fail_vtu(file_, fmt::format("the offsets of cells end with {}", n));
    const auto nodes = read_vtu_integers(file_, head_, cells("connectivity"), n);
    Index begin = 0;
    for (std::size_t c = 0; c < types.size(); ++c) {
      add_cell(c, types[c], begin, ends[c], nodes);
      begin = ends[c];
    }
  }

  void add_cell(std::size_t c, Index type, Index begin, Index end,
                const std::vector<Index>& nodes) {
    constexpr Index highest_type = 255;
    const int k = type >= 0 && type <= highest_type ? kind_of_vtk(static_cast<int>(type)) : -1;
    if (k < 0) fail_vtu(file_, fmt::format("cell {} is of type {}, which is not read", c, type));
    const ElementKind& kind = element_kinds()[static_cast<std::size_t>(k)];
    if (end < begin || end > static_cast<Index>(nodes.size()))
      fail_vtu(file_, fmt::format("cell {} ends with node {} of {}, and the one before with {}", c,
                                  end, nodes.size(), begin));
    if (end - begin != kind.nodes)
      fail_vtu(file_, fmt::format("cell {} has {} nodes, but {} have {}", c, end - begin, kind.name,
                                  kind.nodes));
    auto& to = tables_.kinds[static_cast<std::size_t>(k)].nodes;
    kind_.push_back(static_cast<Local>(k));
    place_.push_back(static_cast<Local>(to.size() / static_cast<std::size_t>(kind.nodes)));
    for (const int at : order(k)) {
      const Index node = nodes[static_cast<std::size_t>(begin + at)];
      if (node < 0 || node >= head_.n_points)
        fail_vtu(file_, fmt::format("cell {} has node {}; nodes are 0 to {}", c, node,
                                    head_.n_points - 1));
      to.push_back(static_cast<Local>(node));
    }
  }
  const std::vector<int>& order(int kind) {
    auto& order = orders_[kind];
    if (order.empty()) order = vtk_order(element_kinds()[static_cast<std::size_t>(kind)]);
    return order;
  }

  /// Sets of an array: of its name where it is 0 or 1, else of each value but 0, as NAME=VALUE.
  void add_sets(const VtuArray& array, Index count, const auto& add) {
    constexpr std::size_t most_values = 1000;  // more are numbers of something
    if (!array.integer() || array.components != 1 || array.name.empty()) return;
    const auto values = read_vtu_integers(file_, head_, array, count);
    std::map<Index, Local> sets;
    for (const Index value : values)
      if (value != 0 && sets.size() <= most_values) sets.emplace(value, -1);
    if (sets.size() > most_values) return;
    const bool flags = sets.size() == 1 && sets.begin()->first == 1;
    for (auto& [value, set] : sets) {
      set = static_cast<Local>(tables_.sets.size());
      tables_.sets.push_back(
          {flags ? array.name : fmt::format("{}={}", array.name, value), value, -1});
    }
    for (std::size_t i = 0; i < values.size(); ++i)
      if (values[i] != 0) add(sets.at(values[i]), i);
  }

  /// A set may have elements of several dimensions: it becomes one for each.
  void add_cell_sets(const VtuArray& array) {
    std::map<std::pair<Local, int>, Local> by_dim;
    add_sets(array, head_.n_cells, [&](Local set, std::size_t cell) {
      const auto k = static_cast<std::size_t>(kind_[cell]);
      const int dim = element_kinds()[k].dim;
      auto& sets = tables_.sets;
      const auto [it, is_new] = by_dim.try_emplace({set, dim}, set);
      auto& own = sets[static_cast<std::size_t>(set)];
      if (is_new && own.dim >= 0) {
        it->second = static_cast<Local>(sets.size());
        sets.push_back({own.name, own.id, dim});
      } else if (is_new) {
        own.dim = dim;
      }
      tables_.kinds[k].members.emplace_back(it->second, place_[cell]);
    });
  }

  const SideFile& file_;
  VtuHead head_;
  FileElements tables_;
  std::map<int, std::vector<int>> orders_;  ///< of nodes, by kind
  std::vector<Local> kind_, place_;         ///< of each cell: its kind, and which of these it is
};

}  // namespace

double vtu_bytes(const SideFile& file) {
  // Each array as bytes, as numbers and in the tables; cells have some eight nodes.
  constexpr double point = 3 * sizeof(Vec<3>), cell = 10 * (2 * sizeof(Index) + sizeof(Local));
  const VtuHead head = plausible_head(file);
  return point * static_cast<double>(head.n_points) + cell * static_cast<double>(head.n_cells);
}

FileElements read_vtu(const SideFile& file) {
  return VtuReader(file).read();
}

}  // namespace lahar
