/// \file A side file that a team reads together, each member some of its lines.
#pragma once

#include <functional>

#include "io/side_files.h"
#include "io/team.h"

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

/// What is wrong with a file, found by `read`, which one member calls. It has been refused, so
/// there must be something. Collective.
void explain(const SideFile& file, const Team& team, ProblemList& problems,
             const std::function<void(ProblemList&)>& read);

}  // namespace lahar
