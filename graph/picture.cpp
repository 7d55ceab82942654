#include "graph/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <string_view>

namespace lahar {

namespace {

/// The stages that a task consists of, "G2P, stress", below each other.
std::string one_per_line(std::string names) {
  for (std::size_t at = 0; (at = names.find(", ", at)) != std::string::npos;)
    names.replace(at, 2, "\\n");
  return names;
}

/// Text of a user within the quotes of a label.
std::string label_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

/// Patches, those of a rank one after the other.
std::vector<int> by_rank(int patches, const std::vector<int>& ranks) {
  std::vector<int> order(static_cast<std::size_t>(patches));
  std::iota(order.begin(), order.end(), 0);
  if (!ranks.empty())
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return ranks[static_cast<std::size_t>(a)] < ranks[static_cast<std::size_t>(b)];
    });
  return order;
}

std::string head(const std::string& title, const char* dashed, const char* more) {
  return fmt::format(
      "digraph timestep {{\n  label=\"{}\\nred: between patches; dashed: {}\";\n"
      "  labelloc=t; rankdir=TB; newrank=true; {}fontname=\"sans-serif\";\n"
      "  node [shape=box, style=\"rounded,filled\", fillcolor=\"#eef3f8\", "
      "fontname=\"sans-serif\"];\n"
      "  edge [color=\"#44546a\"];\n",
      label_text(title), dashed, more);
}

/// The tasks and edges of one graph. Names of nodes and frames begin with `prefix`.
class GraphText {
 public:
  GraphText(const TaskGraph& graph, std::string prefix, std::string sums)
      : graph_(graph), prefix_(std::move(prefix)), sums_(std::move(sums)) {}

  std::string of(const PicturePatches& patches) const {
    return columns(patches) + rows() + edges();
  }
  std::string node(int task) const { return fmt::format("{}t{}", prefix_, task); }

 private:
  std::string columns(const PicturePatches& patches) const {
    std::string text;
    int rank = -1;
    for (const int p : by_rank(graph_.patches, patches.ranks)) {
      const auto at = static_cast<std::size_t>(p);
      if (!patches.ranks.empty() && patches.ranks[at] != rank) {
        if (rank >= 0) text += "  }\n";
        rank = patches.ranks[at];
        text += fmt::format(
            "  subgraph cluster_{}rank_{} {{\n  label=\"rank {}\"; color=\"#7f8fa6\"; "
            "penwidth=2;\n",
            prefix_, rank, rank);
      }
      text += fmt::format("  subgraph cluster_{}{} {{\n    label=\"{}\"; color=\"#c5cfda\";\n",
                          prefix_, p, patches.names[at]);
      for (int s = 0; s < static_cast<int>(graph_.stages.size()); ++s)
        text += fmt::format("    {} [label=\"{}\"];\n", node(graph_.task(s, p)),
                            one_per_line(graph_.stages[static_cast<std::size_t>(s)].name));
      text += "  }\n";
    }
    return rank >= 0 ? text + "  }\n" : text;
  }

  std::string rows() const {
    std::string text;
    for (int s = 0; s < static_cast<int>(graph_.stages.size()); ++s) {
      text += "  { rank=same;";
      for (int p = 0; p < graph_.patches; ++p) text += fmt::format(" {};", node(graph_.task(s, p)));
      text += " }\n";
    }
    for (int round = 0; graph_.has_dt && round < graph_.rounds; ++round)
      text += fmt::format("  {} [label=\"{}\", shape=ellipse, fillcolor=\"#fdebd0\"];\n",
                          node(graph_.dt_task(round)), sums_);
    return text;
  }

  std::string edges() const {
    std::string text;
    for (const Edge& edge : graph_.edges) {
      std::string style = edge.lag == 1 ? "style=dashed, constraint=false" : "";
      if (edge.exchange && !graph_.is_dt(edge.to) && !graph_.is_dt(edge.from)) {
        const auto& stage = graph_.stages[static_cast<std::size_t>(graph_.stage_of(edge.to))];
        style += fmt::format("{}color=\"#c0504d\", tooltip=\"{}\"", style.empty() ? "" : ", ",
                             stage.exchange);
      }
      text += fmt::format("  {} -> {}{};\n", node(edge.from), node(edge.to),
                          style.empty() ? "" : " [" + style + "]");
    }
    return text;
  }

  const TaskGraph& graph_;
  std::string prefix_, sums_;
};

}  // namespace

std::string to_dot(const TaskGraph& graph, const PicturePatches& patches,
                   const std::string& title) {
  return head(title, "to the next step", "") + GraphText(graph, "", "dt").of(patches) + "}\n";
}

std::string to_dot(const std::vector<PictureLoop>& loops, const PicturePatches& patches,
                   const std::string& title) {
  std::string text = head(title, "to the next round", "compound=true; ");
  std::vector<GraphText> parts;
  for (std::size_t l = 0; l < loops.size(); ++l)
    parts.emplace_back(loops[l].graph, fmt::format("l{}_", l), "sums");
  for (std::size_t l = 0; l < loops.size(); ++l)
    text += fmt::format(
        "  subgraph cluster_loop_{} {{\n  label=\"{}: {}\"; style=rounded; color=\"#44546a\"; "
        "penwidth=2;\n{}  }}\n",
        l, label_text(loops[l].name), label_text(loops[l].taken), parts[l].of(patches));
  for (std::size_t l = 0; l + 1 < loops.size(); ++l) {
    const TaskGraph& from = loops[l].graph;
    const int last = static_cast<int>(from.stages.size()) - 1;
    text += fmt::format(
        "  {} -> {} [ltail=cluster_loop_{}, lhead=cluster_loop_{}, penwidth=3, "
        "tooltip=\"when all is done\"];\n",
        parts[l].node(from.task(last, 0)), parts[l + 1].node(0), l, l + 1);
  }
  return text + "}\n";
}

}  // namespace lahar
