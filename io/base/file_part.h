/// \file A side file that a team reads together, each member some of its lines.
#pragma once

#include <functional>
#include <optional>
#include <string_view>

#include "io/base/side_files.h"
#include "io/base/team.h"

namespace lahar {

/// This member's part of the lines of a file from `begin` on.
struct FilePart {
  FilePart(const SideFile& file, Index begin, const Team& team)
      : begin(file.line_start(begin + team.part(file.size - begin, team.index()))),
        end(team.index() + 1 == team.size()
                ? file.size
                : file.line_start(begin + team.part(file.size - begin, team.index() + 1))) {}
  Index begin, end;  ///< [bytes]
};

/// Data rows in a part.
Index count_rows(const SideFile& file, const FilePart& part);

/// The rows of a file behind its head, as a team sees them before it reads them.
struct TeamRows {
  /// `read_head` reads the first row; false if anything is wrong with it, and then no row is looked
  /// at by this member. Collective.
  void see(const SideFile& file, const Team& team,
           const std::function<bool(RowReader&)>& read_head);

  std::optional<FilePart> part;  ///< of this member; none where the head is wrong
  Index first = 0;               ///< row of this part
  Index own = 0;                 ///< rows in it
  Index total = 0;               ///< rows of all members
};

/// How many of the `found` rows behind the head of a file are read: as many as it promises, or,
/// with SideFile::as_cbgeo, all of them, with a warning if they are not as many. `before` are data
/// rows in front of them.
Index rows_to_read(const SideFile& file, std::string_view what, Index before, Index promised,
                   Index found, ProblemList& problems);

/// What is wrong with a file, found by `read`, which one member calls. It has been refused, so
/// there must be something. Collective.
void explain(const SideFile& file, const Team& team, ProblemList& problems,
             const std::function<void(ProblemList&)>& read);

}  // namespace lahar
