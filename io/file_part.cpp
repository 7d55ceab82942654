#include "io/file_part.h"

#include <fmt/format.h>

namespace lahar {

Index count_rows(const SideFile& file, const FilePart& part) {
  ProblemList none;
  RowReader rows(file, none, part.begin, part.end);
  Index n = 0;
  while (rows.next()) ++n;
  return n;
}

void explain(const SideFile& file, const Team& team, ProblemList& problems,
             const std::function<void(ProblemList&)>& read) {
  const std::size_t before = problems.count();
  by_the_first(team, problems, read);
  if (problems.count() == before)
    throw IoError(fmt::format("{}: the file changed while it was read", file.name));
}

}  // namespace lahar
