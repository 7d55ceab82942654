#include "io/mesh/mesh_search.h"

#include <algorithm>
#include <array>
#include <optional>

namespace lahar {

namespace {

// Bins are given to members in so many blocks for each.
constexpr Index blocks_of_member = 64;
// Cells of a member that are on their way at a time.
constexpr Index cells_at_a_time = Index{1} << 14;

}  // namespace

template <int Dim>
MeshSearch<Dim>::MeshSearch(const Mesh<Dim>& share, const Team& team)
    : team_(team),
      n_bins_(share.n_bins()),
      n_blocks_(std::min<Index>(n_bins_, blocks_of_member * team.size())),
      holder_(static_cast<std::size_t>(n_blocks_), 0),
      part_(share.share({})) {
  share_out_bins(share);
  auto pieces = fetch_own(share);
  all_or_none(team_, [&] { part_ = share.part({}, std::move(pieces)); });
}

template <int Dim>
void MeshSearch<Dim>::share_out_bins(const Mesh<Dim>& share) {
  std::vector<Index> count(static_cast<std::size_t>(n_blocks_), 0);
  const auto [first, end] = own_cells(share.n_cells(), team_);
  for (Index cell = first; cell < end; ++cell)
    for (const Index bin : share.bins_of(cell)) ++count[static_cast<std::size_t>(block(bin))];
  // Every member adds up some of the blocks.
  std::vector<std::vector<Index>> to(static_cast<std::size_t>(team_.size()));
  for (std::size_t m = 0; m < to.size(); ++m) {
    const auto at = [&](std::size_t member) {
      return count.begin() + team_.part(n_blocks_, static_cast<int>(member));
    };
    to[m].assign(at(m), at(m + 1));
  }
  std::vector<Index> sums;
  for (const auto& part : team_.exchange(std::move(to))) {
    sums.resize(part.size(), 0);
    for (std::size_t i = 0; i < part.size(); ++i) sums[i] += part[i];
  }
  count.clear();
  for (const auto& part : team_.gather(sums)) count.insert(count.end(), part.begin(), part.end());
  Index total = 0, before = 0;
  for (const Index n : count) total += n;
  for (std::size_t b = 0; b < holder_.size(); ++b) {
    holder_[b] = static_cast<int>((2 * before + count[b]) * team_.size() / (2 * total));
    holder_[b] = std::min(holder_[b], team_.size() - 1);
    before += count[b];
  }
}

template <int Dim>
std::vector<std::vector<std::byte>> MeshSearch<Dim>::fetch_own(const Mesh<Dim>& share) const {
  std::vector<std::vector<std::byte>> pieces;
  auto [next, end] = own_cells(share.n_cells(), team_);
  while (team_.any(next < end)) {
    std::vector<std::vector<Index>> cells(static_cast<std::size_t>(team_.size()));
    const Index stop = std::min(end, next + cells_at_a_time);
    for (; next < stop; ++next)
      for (const Index bin : share.bins_of(next)) {
        auto& of_member = cells[static_cast<std::size_t>(holder(bin))];
        if (of_member.empty() || of_member.back() != next) of_member.push_back(next);
      }
    std::vector<std::vector<std::byte>> packed;
    for (const auto& of_member : cells)
      packed.push_back(of_member.empty() ? std::vector<std::byte>() : share.pack(of_member));
    for (auto& piece : team_.exchange_bytes(std::move(packed)))
      if (!piece.empty()) pieces.push_back(std::move(piece));
  }
  return pieces;
}

template <int Dim>
std::vector<Index> MeshSearch<Dim>::locate(const std::vector<Vec<Dim>>& x,
                                           const std::vector<Index>& suggested) const {
  struct Question {
    std::array<double, static_cast<std::size_t>(Dim)> x;
    Index suggested;
  };
  const auto bin_of = [&](const Question& q) { return part_.bin_of(Vec<Dim>(q.x.data())); };
  std::vector<Question> questions(x.size());
  for (std::size_t p = 0; p < x.size(); ++p) {
    std::copy_n(x[p].data(), Dim, questions[p].x.begin());
    questions[p].suggested = suggested.empty() ? -1 : suggested[p];
  }
  return ask<Index>(
      team_, questions,
      [&](const Question& q) {
        const Index bin = bin_of(q);
        return bin < 0 ? team_.index() : holder(bin);
      },
      [&](const Question& q) -> Index {
        const Vec<Dim> at(q.x.data());
        // A cell that does not touch the bin does not contain the point.
        if (q.suggested >= 0 && part_.holds(q.suggested) &&
            part_.natural_coordinates(q.suggested, at))
          return q.suggested;
        return part_.locate(at).cell;
      });
}

template class MeshSearch<2>;
template class MeshSearch<3>;

}  // namespace lahar
