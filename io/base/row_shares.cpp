#include "io/base/row_shares.h"

namespace lahar {

namespace {

// The range of a sorted list that holds a row; the end if none does.
auto find_range(const std::vector<RowShares::Range>& ranges, Index row) {
  const auto after = std::upper_bound(ranges.begin(), ranges.end(), row,
                                      [](Index r, const auto& range) { return r < range.first; });
  return after == ranges.begin() || row >= std::prev(after)->end ? ranges.end() : std::prev(after);
}

}  // namespace

void RowShares::append(Index own, const Team& team) {
  const std::vector<Index> counts = team.each(own);
  sizes_.resize(counts.size(), 0);
  for (int m = 0; m < team.size(); ++m) {
    const Index n = counts[static_cast<std::size_t>(m)];
    Index& size = sizes_[static_cast<std::size_t>(m)];
    if (n > 0) {
      ranges_.push_back({total_, total_ + n, size, m});
      if (m == team.index()) own_ranges_.push_back(ranges_.back());
    }
    size += n;
    total_ += n;
  }
  own_ += own;
}

const RowShares::Range& RowShares::at(Index row) const {
  return *find_range(ranges_, row);
}

Index RowShares::local(Index row) const {
  const Range& range = at(row);
  return range.local + row - range.first;
}

Index RowShares::row(Index local) const {
  auto range = own_ranges_.begin();
  while (local - range->local >= range->end - range->first) ++range;
  return range->first + local - range->local;
}

std::vector<Index> RowShares::own_rows(Index first, Index end) const {
  std::vector<Index> rows;
  Index n = 0;
  for (const Range& range : own_ranges_)
    n += std::max<Index>(std::min(end, range.end) - std::max(first, range.first), 0);
  rows.reserve(static_cast<std::size_t>(n));
  for (const Range& range : own_ranges_)
    for (Index row = std::max(first, range.first); row < std::min(end, range.end); ++row)
      rows.push_back(row);
  return rows;
}

bool RowShares::holds(Index row) const {
  return find_range(own_ranges_, row) != own_ranges_.end();
}

}  // namespace lahar
