// Meshes of Gmsh: MSH 2.2 and 4.1, as text and binary (its manual, "MSH file format").
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <numeric>

#include "io/mesh/element_file.h"
#include "io/mesh/gmsh_source.h"
#include "physics/base/id_map.h"

namespace lahar {

namespace {

using Id = std::uint64_t;  // size_t of Gmsh

class GmshReader {
 public:
  explicit GmshReader(const SideFile& file) : source_(file) {}

  FileElements read() {
    std::string line;
    bool nodes = false, elements = false;
    while (!elements && source_.line(line)) {
      if (line.empty()) continue;
      if (line[0] != '$')
        fail(fmt::format("expected the start of a section, found '{}'", line.substr(0, 40)));
      const std::string name = line.substr(1);
      if (major_ == 0 && name != "MeshFormat" && name != "Comments")
        fail("a Gmsh file begins with $MeshFormat");
      if (elements_need_nodes(name, nodes)) fail("$Elements come before $Nodes");
      if (name == "MeshFormat")
        read_format();
      else if (name == "PhysicalNames")
        read_names();
      else if (name == "Entities" && major_ == 4)
        read_entities();
      else if (name == "Nodes")
        major_ == 4 ? read_nodes_4() : read_nodes_2();
      else if (name == "Elements")
        major_ == 4 ? read_elements_4() : read_elements_2();
      else if (name == "PartitionedEntities")
        fail("the mesh is partitioned", "save it without partitions; Lahar makes its own");
      else {
        skip(name);
        continue;
      }
      nodes = nodes || name == "Nodes";
      elements = name == "Elements";
      end(name);
    }
    if (!elements)
      fail(fmt::format("the file ends before ${}: it is cut short", nodes ? "Elements" : "Nodes"));
    return std::move(tables_);
  }

 private:
  static bool elements_need_nodes(const std::string& name, bool nodes) {
    return name == "Elements" && !nodes;
  }
  [[noreturn]] void fail(std::string message, std::string hint = "") const {
    source_.fail(std::move(message), std::move(hint));
  }

  void read_format() {
    const std::string version{source_.word("the version")};
    const auto type = source_.number<int>("the file type");
    const auto size = source_.number<int>("the size of numbers");
    if (version != "2.2" && version != "4.1")
      fail(fmt::format("version {} of the format is not read", version),
           "save as version 4.1 or 2.2: gmsh -save -format msh41 FILE, or -format msh22");
    if (type != 0 && type != 1) fail(fmt::format("the file type must be 0 or 1, found {}", type));
    if (size != sizeof(double))
      fail(fmt::format("the size of numbers must be 8 bytes, found {}", size));
    major_ = version[0] - '0';
    if (type == 0) return;
    source_.binary = true;
    if (source_.number<std::int32_t>("the sign of the byte order") != 1)
      fail("the file was written in another byte order");
  }

  /// The end of a section.
  void end(const std::string& name) {
    std::string line;
    while (line.empty())
      if (!source_.line(line))
        fail(fmt::format("the file ends before $End{}: it is cut short", name));
    if (line != "$End" + name)
      fail(fmt::format("expected '$End{}', found '{}'", name, line.substr(0, 40)));
  }
  void skip(const std::string& name) {
    std::string line;
    while (line != "$End" + name)
      if (!source_.line(line))
        fail(fmt::format("the file ends before $End{}: it is cut short", name));
  }

  /// Always text: dimension, number and name in quotes.
  void read_names() {
    std::string line;
    source_.line(line);
    const int n = std::atoi(line.c_str());
    for (int i = 0; i < n; ++i) {
      if (!source_.line(line)) fail("the file ends in $PhysicalNames: it is cut short");
      const auto open = line.find('"'), close = line.rfind('"');
      int dim = -1;
      Index tag = 0;
      if (std::sscanf(line.c_str(), "%d %ld", &dim, &tag) != 2 || open == line.npos ||
          close == open || dim < 0 || dim > 3)
        fail(fmt::format("expected a dimension, a number and a name in quotes, found '{}'",
                         line.substr(0, 40)));
      names_[{dim, tag}] = line.substr(open + 1, close - open - 1);
    }
  }

  /// The set of a physical group.
  Local set_of(int dim, Index tag) {
    const auto [it, is_new] =
        set_numbers_.try_emplace(std::pair(dim, tag), static_cast<Local>(tables_.sets.size()));
    if (is_new) {
      const auto name = names_.find({dim, tag});
      tables_.sets.push_back({name == names_.end() ? "" : name->second, tag, dim});
    }
    return it->second;
  }

  /// A count of things that take so many bytes each at least.
  Index count(Id n, int bytes, std::string_view what) {
    if (n > static_cast<Id>(source_.left() / bytes + 1) || n > most)
      fail(fmt::format("the file promises {} {}, but ends after {} bytes more", n, what,
                       source_.left()));
    return static_cast<Index>(n);
  }

  void read_entities() {
    std::array<Id, 4> n;
    for (Id& of : n) of = source_.number<Id>("the number of entities");
    for (int dim = 0; dim < 4; ++dim)
      for (Id i = 0; i < n[static_cast<std::size_t>(dim)]; ++i) {
        const auto tag = source_.number<std::int32_t>("the number of an entity");
        for (int k = 0; k < (dim == 0 ? 3 : 6); ++k) source_.number<double>("a bound of an entity");
        auto& groups = groups_[{dim, tag}];
        const auto n_groups = count(source_.number<Id>("the number of groups"), 1, "groups");
        // Each of its elements becomes a member of each of them.
        if (static_cast<Index>(groups.size()) + n_groups > most_groups)
          fail(
              fmt::format("entity {} of dimension {} is in {} physical groups; at most {} are read",
                          tag, dim, static_cast<Index>(groups.size()) + n_groups, most_groups));
        for (Index g = 0; g < n_groups; ++g)
          groups.push_back(set_of(dim, std::abs(Index{source_.number<std::int32_t>("a group")})));
        if (dim == 0) continue;
        const auto n_around =
            count(source_.number<Id>("the number of bounding entities"), 1, "bounding entities");
        for (Index k = 0; k < n_around; ++k) source_.number<std::int32_t>("a bounding entity");
      }
  }

  void read_nodes_2() {
    const auto n = count(text_count("the number of nodes"), 8, "nodes");
    for (Index i = 0; i < n; ++i) {
      tags_.push_back(source_.number<std::int32_t>("the number of a node"));
      add_point();
    }
    order_nodes();
  }
  void read_nodes_4() {
    const auto blocks = source_.number<Id>("the number of blocks");
    const auto n = count(source_.number<Id>("the number of nodes"), 8, "nodes");
    for (int k = 0; k < 2; ++k) source_.number<Id>("a number of a node");
    for (Id b = 0; b < blocks; ++b) {
      const auto dim = source_.number<std::int32_t>("a dimension");
      source_.number<std::int32_t>("the number of an entity");
      const auto parametric = source_.number<std::int32_t>("0 or 1 (parameters)");
      const auto size = count(source_.number<Id>("the number of nodes"), 8, "nodes");
      for (Index i = 0; i < size; ++i)
        tags_.push_back(static_cast<Index>(source_.number<Id>("the number of a node")));
      for (Index i = 0; i < size; ++i) {
        add_point();
        for (int k = 0; k < (parametric != 0 ? dim : 0); ++k) source_.number<double>("a parameter");
      }
    }
    if (static_cast<Index>(tags_.size()) != n)
      fail(fmt::format("the file promises {} nodes and has {}", n, tags_.size()));
    order_nodes();
  }
  void add_point() {
    Vec<3> x;
    for (int d = 0; d < 3; ++d) x[d] = source_.real("a coordinate");
    tables_.points.push_back(x);
  }
  /// Nodes by ascending numbers.
  void order_nodes() {
    std::vector<Local> order(tags_.size());
    std::iota(order.begin(), order.end(), 0);
    const auto tag = [&](Local i) { return tags_[static_cast<std::size_t>(i)]; };
    std::sort(order.begin(), order.end(), [&](Local a, Local b) { return tag(a) < tag(b); });
    std::vector<Vec<3>> points;
    std::vector<Index> ids;
    points.reserve(order.size());
    ids.reserve(order.size());
    constexpr Index highest = Index{1} << 60;
    for (const Local i : order) {
      if (tag(i) < 1 || tag(i) > highest)
        fail(fmt::format("the number of a node must be positive, found {}", tag(i)));
      if (!ids.empty() && ids.back() == tag(i)) fail(fmt::format("node {} occurs twice", tag(i)));
      ids.push_back(tag(i));
      points.push_back(tables_.points[static_cast<std::size_t>(i)]);
    }
    tables_.points = std::move(points);
    tags_ = {};
    rows_ = IdMap::some(std::move(ids));
  }

  /// In MSH 2.2 counts are text in binary files, too.
  Id text_count(std::string_view what) {
    const bool binary = std::exchange(source_.binary, false);
    const Id n = source_.number<Id>(what);
    source_.binary = binary;
    return n;
  }

  std::size_t kind(int number) {
    const int kind = kind_of_gmsh(number);
    if (kind < 0)
      fail(fmt::format("elements of type {} are not read", number),
           "elements may be of first or second order");
    return static_cast<std::size_t>(kind);
  }
  template <class T>
  void read_element_nodes(std::size_t kind) {
    auto& nodes = tables_.kinds[kind].nodes;
    for (int a = 0; a < element_kinds()[kind].nodes; ++a) {
      const auto tag = static_cast<Index>(source_.number<T>("a node of an element"));
      const Index row = rows_.row(tag);
      if (row < 0) fail(fmt::format("an element has node {}, which does not exist", tag));
      nodes.push_back(static_cast<Local>(row));
    }
  }
  Local last_element(std::size_t kind) const {
    return static_cast<Local>(tables_.kinds[kind].nodes.size() /
                              static_cast<std::size_t>(element_kinds()[kind].nodes)) -
           1;
  }

  /// One element, as text, or several of one kind, binary.
  void read_elements_2() {
    const auto n = count(text_count("the number of elements"), 8, "elements");
    for (Index done = 0; done < n;) {
      if (!source_.binary) source_.number<std::int32_t>("the number of an element");
      const auto of = kind(source_.number<std::int32_t>("the type of an element"));
      const Index together =
          source_.binary ? source_.number<std::int32_t>("the number of elements") : 1;
      const auto n_tags = source_.number<std::int32_t>("the number of tags");
      if (together < 1 || together > n - done || n_tags < 0 || n_tags > 1000)
        fail(fmt::format("a block of {} elements with {} tags is not possible", together, n_tags));
      for (Index i = 0; i < together; ++i, ++done) {
        if (source_.binary) source_.number<std::int32_t>("the number of an element");
        Index group = 0;
        for (int t = 0; t < n_tags; ++t) {
          const auto tag = source_.number<std::int32_t>("a tag");
          if (t == 0) group = std::abs(Index{tag});
        }
        read_element_nodes<std::int32_t>(of);
        if (group > 0)
          tables_.kinds[of].members.emplace_back(set_of(element_kinds()[of].dim, group),
                                                 last_element(of));
      }
    }
  }
  void read_elements_4() {
    const auto blocks = source_.number<Id>("the number of blocks");
    const auto n = count(source_.number<Id>("the number of elements"), 4, "elements");
    for (int k = 0; k < 2; ++k) source_.number<Id>("a number of an element");
    Index done = 0;
    for (Id b = 0; b < blocks; ++b) {
      const auto dim = source_.number<std::int32_t>("a dimension");
      const auto entity = source_.number<std::int32_t>("the number of an entity");
      const auto of = kind(source_.number<std::int32_t>("the type of elements"));
      const auto size = count(source_.number<Id>("the number of elements"), 4, "elements");
      const auto groups = groups_.find({dim, entity});
      for (Index i = 0; i < size; ++i, ++done) {
        source_.number<Id>("the number of an element");
        read_element_nodes<Id>(of);
        if (groups != groups_.end())
          for (const Local set : groups->second)
            tables_.kinds[of].members.emplace_back(set, last_element(of));
      }
    }
    if (done != n) fail(fmt::format("the file promises {} elements and has {}", n, done));
  }

  static constexpr Id most = std::numeric_limits<Local>::max();
  static constexpr Index most_groups = 100;  ///< of an entity
  GmshSource source_;
  int major_ = 0;  ///< of the version
  FileElements tables_;
  std::vector<Index> tags_;                                     ///< of nodes, while they are read
  IdMap rows_;                                                  ///< from their numbers to points
  std::map<std::pair<int, Index>, std::string> names_;          ///< of dimension and group
  std::map<std::pair<int, Index>, Local> set_numbers_;          ///< likewise
  std::map<std::pair<int, Index>, std::vector<Local>> groups_;  ///< of dimension and entity
};

}  // namespace

FileElements read_gmsh(const SideFile& file) {
  return GmshReader(file).read();
}

}  // namespace lahar
