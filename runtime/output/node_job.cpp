#include "runtime/output/node_job.h"

#include <algorithm>
#include <cassert>
#include <set>
#include <tuple>
#include <type_traits>
#include <utility>

#include "io/frames/frame_slabs.h"
#include "runtime/output/output_agreement.h"

namespace lahar {

namespace {

/// Places [begin, end) of a list of nodes.
Frame part_of(const Frame& all, std::size_t begin, std::size_t end) {
  const auto cut = [&](const auto& values, int components) {
    const auto width = static_cast<std::ptrdiff_t>(components);
    const auto from = values.begin() + static_cast<std::ptrdiff_t>(begin) * width;
    return std::decay_t<decltype(values)>(from,
                                          from + static_cast<std::ptrdiff_t>(end - begin) * width);
  };
  Frame part;
  part.dim = all.dim;
  part.id = cut(all.id, 1);
  part.coordinates = cut(all.coordinates, all.dim);
  for (const FrameColumn& column : all.columns)
    part.columns.push_back(
        {column.name, column.unit, column.components, cut(column.values, column.components)});
  return part;
}

std::vector<NodeRun> runs_of(const std::vector<Index>& ids) {
  std::vector<NodeRun> runs;
  for (const Index id : ids)
    if (!runs.empty() && runs.back().end == id)
      ++runs.back().end;
    else
      runs.push_back({id, id + 1});
  return runs;
}

/// What prepare() of all ranks gave: of each, the number of its runs and the runs.
std::vector<std::vector<NodeRun>> runs_in(std::span<const std::byte> parts) {
  const std::vector<Index> numbers = values_of<Index>(parts);
  std::vector<std::vector<NodeRun>> all;
  for (std::size_t at = 0; at < numbers.size();) {
    std::vector<NodeRun>& runs = all.emplace_back();
    for (Index left = numbers[at++]; left > 0; --left, at += 2)
      runs.push_back({numbers[at], numbers[at + 1]});
  }
  return all;
}

}  // namespace

Frame unite_nodes(const FramePieces& nodes) {
  Frame all = join(nodes);
  std::size_t n = 0;  // nodes that were kept
  const auto each = [&](auto act) {
    act(all.coordinates, all.dim);
    for (FrameColumn& column : all.columns) act(column.values, column.components);
  };
  for (std::size_t i = 0; i < all.id.size(); ++i) {
    const bool again = n > 0 && all.id[n - 1] == all.id[i];
    each([&](std::vector<double>& values, int components) {
      const auto width = static_cast<std::size_t>(components);
      const auto from = values.begin() + static_cast<std::ptrdiff_t>(i * width);
      if (again)
        assert(std::equal(from, from + components,
                          values.begin() + static_cast<std::ptrdiff_t>((n - 1) * width)));
      else if (n < i)
        std::copy_n(from, width, values.begin() + static_cast<std::ptrdiff_t>(n * width));
    });
    if (!again) all.id[n++] = all.id[i];
  }
  all.id.resize(n);
  each([n](std::vector<double>& values, int components) {
    values.resize(n * static_cast<std::size_t>(components));
  });
  return all;
}

std::vector<PlacedRun> place_nodes(const std::vector<std::vector<NodeRun>>& runs, int rank,
                                   Index& total) {
  struct Change {
    Index id;
    int rank;
    bool begins;
  };
  std::vector<Change> changes;
  for (std::size_t r = 0; r < runs.size(); ++r)
    for (const NodeRun& run : runs[r]) {
      changes.push_back({run.begin, static_cast<int>(r), true});
      changes.push_back({run.end, static_cast<int>(r), false});
    }
  std::sort(changes.begin(), changes.end(), [](const Change& a, const Change& b) {
    return std::tie(a.id, a.rank, a.begins) < std::tie(b.id, b.rank, b.begins);
  });
  std::vector<PlacedRun> own;
  std::set<int> present;  // ranks that have the ids from `before` on
  Index before = 0;
  total = 0;
  for (const Change& change : changes) {
    if (!present.empty() && change.id > before) {
      const Index n = change.id - before;
      if (*present.begin() == rank) {
        const bool goes_on = !own.empty() && own.back().ids.end == before;
        if (goes_on)
          own.back().ids.end = change.id;
        else
          own.push_back({{before, change.id}, total});
      }
      total += n;
    }
    before = change.id;
    if (change.begins)
      present.insert(change.rank);
    else
      present.erase(change.rank);
  }
  return own;
}

NodeJob::NodeJob(std::filesystem::path target, FramePieces nodes,
                 std::function<void(AtomicFile&)> name)
    : OutputJob({.target = std::move(target), .step = nodes.header.step, .kind = TraceKind::frame}),
      pieces_(std::move(nodes)),
      name_(std::move(name)) {}

OutputJob::Bytes NodeJob::prepare() {
  own_ = unite_nodes(pieces_);
  pieces_.release();
  const std::vector<NodeRun> runs = runs_of(own_.id);
  std::vector<Index> told{static_cast<Index>(runs.size())};
  for (const NodeRun& run : runs) told.insert(told.end(), {run.begin, run.end});
  return bytes_of(std::span<const Index>(told));
}

void NodeJob::hear_parts(std::span<const std::byte> parts, int rank) {
  runs_ = place_nodes(runs_in(parts), rank, total_);
}

OutputJob::Bytes NodeJob::create(const AtomicFile& file) {
  layout_ = lay_out_frame(pieces_.header, total_, file.temporary(), file.target());
  return bytes_of(std::span<const FrameLayout>(&layout_, 1));
}

void NodeJob::hear_layout(std::span<const std::byte> layout) {
  layout_ = values_of<FrameLayout>(layout).front();
}

void NodeJob::write(const ByteSink& sink, bool) {
  const auto place_of = [&](Index id) {
    return static_cast<std::size_t>(std::lower_bound(own_.id.begin(), own_.id.end(), id) -
                                    own_.id.begin());
  };
  for (std::size_t k = 0; k < runs_.size();) {
    const std::size_t begin = place_of(runs_[k].ids.begin);
    const Index first = runs_[k].place;
    std::size_t end = begin;
    // What follows here and in the file is written at once.
    for (; k < runs_.size() && runs_[k].place == first + static_cast<Index>(end - begin) &&
           place_of(runs_[k].ids.begin) == end;
         ++k)
      end += static_cast<std::size_t>(runs_[k].ids.end - runs_[k].ids.begin);
    const Frame part = part_of(own_, begin, end);
    write_slab(layout_, first, {&part, 1}, sink);
  }
  own_ = {};
}

}  // namespace lahar
