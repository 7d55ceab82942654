#include "io/base/file_part.h"

#include <fmt/format.h>

namespace lahar {

Index count_rows(const SideFile& file, const FilePart& part) {
  ProblemList none;
  RowReader rows(file, none, part.begin, part.end);
  Index n = 0;
  while (rows.next()) ++n;
  return n;
}

void TeamRows::see(const SideFile& file, const Team& team,
                   const std::function<bool(RowReader&)>& read_head) {
  all_or_none(team, [&] {
    ProblemList none;
    RowReader rows(file, none);
    if (!read_head(rows)) return;
    part.emplace(file, rows.offset(), team);
    own = count_rows(file, *part);
  });
  const std::vector<Index> each = team.each(own);
  for (int m = 0; m < team.size(); ++m) {
    if (m == team.index()) first = total;
    total += each[static_cast<std::size_t>(m)];
  }
}

Index rows_to_read(const SideFile& file, std::string_view what, Index before, Index promised,
                   Index found, ProblemList& problems) {
  if (!file.as_cbgeo || found == promised || found < 1) return promised;
  const int line = found > promised ? file.line_of_row(before + promised) : 0;
  problems.warning(
      file.at_line(line,
                   fmt::format("the first row counts {} {}, the file has {}; all are read",
                               promised, what, found),
                   "CB-Geo MPM does not look at that number; without --as-cbgeo this is an error"));
  return found;
}

void explain(const SideFile& file, const Team& team, ProblemList& problems,
             const std::function<void(ProblemList&)>& read) {
  const std::size_t before = problems.count();
  by_the_first(team, problems, read);
  if (problems.count() == before)
    throw IoError(fmt::format("{}: the file changed while it was read", file.name));
}

}  // namespace lahar
