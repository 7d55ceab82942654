/// \file The ASCII side files of a scenario: whitespace-separated rows, # and ! comment lines.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/base/problems.h"
#include "physics/base/types.h"

namespace lahar {

/// A side file that could be opened and is not empty: a regular file, which is read in pieces, as
/// often as needed; or a text that is kept.
struct SideFile {
  std::string name;  ///< as the scenario names it
  std::string path;
  Index size = 0;         ///< [bytes]
  std::string text = "";  ///< all of it, where it is not read from a file; else empty
  bool as_cbgeo = false;  ///< what CB-Geo MPM reads is taken, with a warning, although it is wrong

  /// Copies up to n bytes from `offset` on; fewer only at the end. Throws IoError.
  std::size_t read(Index offset, char* to, std::size_t n) const;
  /// Everything. Throws IoError.
  std::string all() const;
  bool regular() const { return text.empty(); }

  /// 1-based line of the n-th data row; 0 if there is none. Reads the file.
  int line_of_row(Index row) const;
  /// A problem with that line, which is read for it.
  Problem at_line(int line, std::string message, std::string hint = "") const;
  /// Where the first line begins that begins at or after `offset`; the size if none does.
  Index line_start(Index offset) const;
};

/// Open a side file; says why in `reason` if that fails (missing, a folder, a
/// device or pipe, empty, unreadable).
std::optional<SideFile> open_side_file(std::string name, const std::string& path,
                                       std::string& reason);

/// Read a whole file; says why in `reason` if that fails (missing, a folder, empty, unreadable).
std::optional<std::string> read_text_file(const std::string& path, std::string& reason);

/// Reads a side file row by row, of which it keeps a piece. Every complaint goes to the problem
/// list, with line and column; after `cap` of them the rest of the file's are counted only.
class RowReader {
 public:
  static constexpr int cap = 10;

  RowReader(const SideFile& file, ProblemList& problems);
  /// Reads the bytes [begin, end) alone, which are whole lines. Lines count from the first of them.
  RowReader(const SideFile& file, ProblemList& problems, Index begin, Index end);
  ~RowReader();  ///< reports how many more problems there are, and rows without a value
  RowReader(const RowReader&) = delete;
  RowReader& operator=(const RowReader&) = delete;

  /// Go to the next data row (comments and blank lines are skipped); false at the end.
  bool next();
  /// The next column as a finite number. `what` names it in messages.
  bool real(double& value, std::string_view what);
  /// As real(), for the last column. With SideFile::as_cbgeo, 0 where the row ends before it; one
  /// warning names all such rows.
  bool value(double& value, std::string_view what);
  /// The next column as an integer in [low, high].
  bool integer(Index& value, std::string_view what, Index low,
               Index high = std::numeric_limits<Index>::max());
  /// The next column as it is written.
  bool word(std::string_view& value, std::string_view what) { return token(what, value); }
  /// Whether the row has no more columns.
  bool row_ended();
  /// No more columns are allowed; `optional` further numbers are accepted and not used.
  bool end_of_row(int optional = 0);

  int line() const { return line_; }
  /// Where the next row begins [bytes from the beginning of the file].
  Index offset() const { return filled_ - (end_ - next_); }
  /// A problem with the column read last, or the file as a whole.
  void complain(std::string message, std::string hint = "");
  void complain_file(std::string message, std::string hint = "");
  bool failed() const { return failures_ > 0; }
  /// Whether rows ended before their value, and 0 was taken.
  bool mended() const { return !without_value_.empty(); }

 private:
  bool token(std::string_view what, std::string_view& out);
  /// Make the current piece hold all of the line that begins at next_; returns its end.
  const char* whole_line();
  const SideFile& file_;
  ProblemList& problems_;
  std::vector<char> piece_;
  Index filled_;                   ///< the piece ends here in the file
  Index stop_;                     ///< end of what is to be read
  const char* next_ = nullptr;     ///< first byte of the next row
  const char* end_ = nullptr;      ///< of the piece
  const char* at_ = nullptr;       ///< next byte of the current row
  const char* row_ = nullptr;      ///< first byte of the current row
  const char* row_end_ = nullptr;  ///< one past its last
  const char* column_ = nullptr;   ///< start of the column read last
  int line_ = 0;
  int failures_ = 0;
  std::vector<int> without_value_;  ///< lines
  std::string value_name_;          ///< of what they do not have
};

template <int Dim>
struct MeshTables {
  std::vector<Vec<Dim>> nodes;
  std::vector<Index> cells;  ///< the nodes of each cell, one cell after the other
  std::vector<Index> ring;   ///< the further nodes of the cells, one cell after the other
};

/// `nnodes ncells`, then coordinates, then the ids of so many nodes per cell, and so many more
/// around it; nothing if anything is wrong.
template <int Dim>
std::optional<MeshTables<Dim>> read_mesh_file(const SideFile& file, int nodes_per_cell,
                                              ProblemList& problems, int further_nodes = 0);

/// Highest id allowed where n entities exist; any where their number is unknown (-1).
inline Index last_id(Index n) {
  return n < 0 ? std::numeric_limits<Index>::max() : n - 1;
}

/// The coordinates of a row, to its end.
template <int Dim>
bool read_point(RowReader& rows, Vec<Dim>& x);

/// Whether there is room for `count` rows of at least two bytes: a wild count must not allocate.
bool plausible(const SideFile& file, Index count);

/// Complain that rows are missing, or that there are more than promised.
void too_few(RowReader& rows, std::string_view what, Index found, Index promised);
bool no_more_rows(RowReader& rows, std::string_view what, Index promised);

}  // namespace lahar
