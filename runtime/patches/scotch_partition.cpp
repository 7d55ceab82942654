#include "runtime/patches/scotch_partition.h"

#include <scotch.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

namespace lahar {

namespace {

/// What Scotch said last on this thread.
thread_local std::string scotch_message;

void keep_message(const char* format, va_list arguments) {
  char text[512];
  std::vsnprintf(text, sizeof text, format, arguments);
  scotch_message = text;
}

}  // namespace

}  // namespace lahar

// Scotch leaves these to the program, or to a library that prints and that the program's own take
// precedence over.
extern "C" {
void SCOTCH_errorProg(const char* const) {}
void SCOTCH_errorPrint(const char* const format, ...) {
  va_list arguments;
  va_start(arguments, format);
  lahar::keep_message(format, arguments);
  va_end(arguments);
}
void SCOTCH_errorPrintW(const char* const, ...) {}
}

namespace lahar {

namespace {

using Nums = std::vector<SCOTCH_Num>;

/// How much heavier than the mean a rank may become for the sake of fewer shared nodes.
constexpr double allowed_imbalance = 0.01;
/// Scotch adds weights in SCOTCH_Num, 32 bits in Debian: their sum stays far below its end.
constexpr double largest_sum = 1 << 28;

void require(int error, const char* what) {
  if (error == 0) return;
  throw std::runtime_error(std::string("Scotch failed to ") + what +
                           (scotch_message.empty() ? "" : ": " + scotch_message));
}

/// Scaled down to what SCOTCH_Num can add up; nothing below 1, which Scotch needs for edges, and
/// which for patches says that empty ones too cost a little.
Nums scaled(std::span<const Index> values) {
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  const double scale = std::min(1.0, largest_sum / std::max(sum, 1.0));
  Nums nums(values.size());
  std::transform(values.begin(), values.end(), nums.begin(), [scale](Index value) {
    return std::max(SCOTCH_Num{1},
                    static_cast<SCOTCH_Num>(std::lround(static_cast<double>(value) * scale)));
  });
  return nums;
}

/// A context: one thread, the same random numbers each time, so that results depend on the input
/// alone.
class Context {
 public:
  Context() {
    require(SCOTCH_contextInit(&context_), "start");
    require(SCOTCH_contextOptionSetNum(&context_, SCOTCH_OPTIONNUMDETERMINISTIC, 1),
            "become deterministic");
    require(SCOTCH_contextOptionSetNum(&context_, SCOTCH_OPTIONNUMRANDOMFIXEDSEED, 1),
            "fix its random numbers");
    require(SCOTCH_contextThreadSpawn(&context_, 1, nullptr), "use one thread");
    // Else the context draws from a state that all calls of the process share.
    require(SCOTCH_contextRandomClone(&context_), "draw random numbers of its own");
    SCOTCH_contextRandomSeed(&context_, 1);
  }
  ~Context() { SCOTCH_contextExit(&context_); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  SCOTCH_Context* get() { return &context_; }

 private:
  SCOTCH_Context context_;
};

/// A graph in Scotch's form, bound to a context.
class Graph {
 public:
  explicit Graph(const PatchGraph& patches) : vertex_weight_(scaled(patches.weight)) {
    begin_.push_back(0);
    std::vector<Index> shared;
    for (const auto& edges : patches.edges) {
      for (const PatchGraph::Edge& edge : edges) {
        end_.push_back(static_cast<SCOTCH_Num>(edge.patch));
        shared.push_back(edge.shared_nodes);
      }
      if (end_.size() > static_cast<std::size_t>(std::numeric_limits<SCOTCH_Num>::max()))
        throw std::runtime_error("Scotch cannot hold so many pairs of patches: use larger ones");
      begin_.push_back(static_cast<SCOTCH_Num>(end_.size()));
    }
    edge_weight_ = scaled(shared);
    SCOTCH_graphInit(&graph_);
    SCOTCH_graphInit(&bound_);
    require(
        SCOTCH_graphBuild(&graph_, 0, static_cast<SCOTCH_Num>(patches.size()), begin_.data(),
                          begin_.data() + 1, vertex_weight_.data(), nullptr,
                          static_cast<SCOTCH_Num>(end_.size()), end_.data(), edge_weight_.data()),
        "take the graph of patches");
    require(SCOTCH_contextBindGraph(context_.get(), &graph_, &bound_), "bind the graph");
  }
  ~Graph() {
    SCOTCH_graphExit(&bound_);
    SCOTCH_graphExit(&graph_);
  }
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;
  SCOTCH_Graph* get() { return &bound_; }

 private:
  Context context_;
  Nums vertex_weight_, begin_, end_, edge_weight_;
  SCOTCH_Graph graph_, bound_;
};

class Strategy {
 public:
  Strategy(int ranks, SCOTCH_Num flags) {
    SCOTCH_stratInit(&strategy_);
    require(SCOTCH_stratGraphMapBuild(&strategy_, flags, static_cast<SCOTCH_Num>(ranks),
                                      allowed_imbalance),
            "choose a strategy");
  }
  ~Strategy() { SCOTCH_stratExit(&strategy_); }
  Strategy(const Strategy&) = delete;
  Strategy& operator=(const Strategy&) = delete;
  SCOTCH_Strat* get() { return &strategy_; }

 private:
  SCOTCH_Strat strategy_;
};

/// Parts renamed such that as many bytes as a greedy choice finds stay where they are: Scotch often
/// returns nearly the old parts under other names.
std::vector<int> renamed(const Nums& part, const Nums& old, std::span<const Index> bytes,
                         int ranks) {
  std::map<std::pair<int, int>, Index> common;  // of a part and a rank
  for (std::size_t p = 0; p < part.size(); ++p)
    if (old[p] >= 0) common[{part[p], old[p]}] += bytes[p] + 1;
  std::vector<std::tuple<Index, int, int>> best;
  for (const auto& [pair, held] : common) best.emplace_back(-held, pair.first, pair.second);
  std::sort(best.begin(), best.end());
  std::vector<int> name(static_cast<std::size_t>(ranks), -1), taken(name.size(), 0);
  for (const auto& [held, from, to] : best) {
    int& rank = name[static_cast<std::size_t>(from)];
    if (rank >= 0 || taken[static_cast<std::size_t>(to)]) continue;
    rank = to;
    taken[static_cast<std::size_t>(to)] = 1;
  }
  auto next = taken.begin();
  for (int& rank : name) {
    if (rank >= 0) continue;
    next = std::find(next, taken.end(), 0);
    rank = static_cast<int>(next - taken.begin());
    *next = 1;
  }
  std::vector<int> owner(part.size());
  std::transform(part.begin(), part.end(), owner.begin(),
                 [&](SCOTCH_Num i) { return name[static_cast<std::size_t>(i)]; });
  return owner;
}

}  // namespace

std::vector<int> scotch_partition(const PatchGraph& graph, int ranks) {
  if (ranks <= 0) throw std::invalid_argument("a partition needs at least one rank");
  if (ranks == 1 || graph.size() == 0) return std::vector<int>(graph.weight.size(), 0);
  scotch_message.clear();
  Graph patches(graph);
  Strategy strategy(ranks, SCOTCH_STRATBALANCE);
  Nums part(graph.weight.size());
  require(
      SCOTCH_graphPart(patches.get(), static_cast<SCOTCH_Num>(ranks), strategy.get(), part.data()),
      "partition the patches");
  return {part.begin(), part.end()};
}

std::vector<int> scotch_repartition(const PatchGraph& graph, std::span<const int> owner,
                                    std::span<const Index> bytes, int ranks,
                                    double migration_weight) {
  if (ranks <= 0) throw std::invalid_argument("a partition needs at least one rank");
  if (owner.size() != graph.weight.size() || bytes.size() != graph.weight.size())
    throw std::invalid_argument("a partition needs one owner and one size for every patch");
  if (ranks == 1 || graph.size() == 0) return std::vector<int>(graph.weight.size(), 0);
  scotch_message.clear();
  Graph patches(graph);
  Strategy strategy(ranks, SCOTCH_STRATBALANCE | SCOTCH_STRATREMAP);
  Nums old(owner.size()), part(owner.size());
  std::transform(owner.begin(), owner.end(), old.begin(), [ranks](int rank) {
    return rank >= 0 && rank < ranks ? static_cast<SCOTCH_Num>(rank) : SCOTCH_Num{-1};
  });
  // Scotch wants integers: bytes that count less than a shared node still decide between patches.
  Nums cost = scaled(bytes);
  const double total_bytes = std::accumulate(bytes.begin(), bytes.end(), 0.0);
  const double total_cost = std::accumulate(cost.begin(), cost.end(), 0.0);
  const double per_cost = migration_weight * std::max(total_bytes, 1.0) / total_cost;
  require(SCOTCH_graphRepart(patches.get(), static_cast<SCOTCH_Num>(ranks), old.data(), per_cost,
                             cost.data(), strategy.get(), part.data()),
          "repartition the patches");
  return renamed(part, old, bytes, ranks);
}

}  // namespace lahar
