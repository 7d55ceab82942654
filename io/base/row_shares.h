/// \file Which member of a team holds which rows of a table that is spread over all of them.
#pragma once

#include <vector>

#include "io/base/team.h"

namespace lahar {

/// Rows are numbered from 0 over all members. Each block of rows that is appended is spread over
/// the members, in their order; a member keeps its rows one after the other, ascending.
class RowShares {
 public:
  /// Consecutive rows that one member holds.
  struct Range {
    Index first, end;  ///< rows [first, end)
    Index local;       ///< position of the first in that member's rows
    int member;
  };

  /// The next rows, `own` of them this member's. Collective.
  void append(Index own, const Team& team);

  Index total() const { return total_; }
  Index own() const { return own_; }
  /// Who holds a row of [0, total).
  int member(Index row) const { return at(row).member; }
  /// Position of a row in its holder's.
  Index local(Index row) const;
  /// The row at a position of this member's.
  Index row(Index local) const;
  /// The ranges of this member, ascending.
  const std::vector<Range>& own_ranges() const { return own_ranges_; }
  /// This member's rows in [first, end), ascending.
  std::vector<Index> own_rows(Index first, Index end) const;
  bool holds(Index row) const;

 private:
  const Range& at(Index row) const;
  std::vector<Range> ranges_, own_ranges_;  ///< ascending, none empty
  std::vector<Index> sizes_;                ///< rows of each member
  Index total_ = 0, own_ = 0;
};

}  // namespace lahar
