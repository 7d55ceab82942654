/// \file The ASCII side files of a scenario: whitespace-separated rows, # and ! comment lines.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/problems.h"
#include "physics/types.h"

namespace lahar {

/// A file read as a whole.
struct SideFile {
  std::string name;  ///< as the scenario names it
  std::string text;
  /// 1-based line of the n-th data row; 0 if there is none.
  int line_of_row(Index row) const;
  Problem at_line(int line, std::string message, std::string hint = "") const;
};

/// Read a whole file; says why in `reason` if that fails (missing, a folder, empty, unreadable).
std::optional<std::string> read_text_file(const std::string& path, std::string& reason);

/// Reads a side file row by row. Every complaint goes to the problem list, with line and column;
/// after `cap` of them the rest of the file's are counted only.
class RowReader {
 public:
  static constexpr int cap = 10;

  RowReader(const SideFile& file, ProblemList& problems);
  ~RowReader();  ///< reports how many more problems there are
  RowReader(const RowReader&) = delete;
  RowReader& operator=(const RowReader&) = delete;

  /// Go to the next data row (comments and blank lines are skipped); false at the end.
  bool next();
  /// The next column as a finite number. `what` names it in messages.
  bool real(double& value, std::string_view what);
  /// The next column as an integer in [low, high].
  bool integer(Index& value, std::string_view what, Index low,
               Index high = std::numeric_limits<Index>::max());
  /// No more columns are allowed; `optional` further numbers are accepted and not used.
  bool end_of_row(int optional = 0);

  int line() const { return line_; }
  /// A problem with the column read last, or the file as a whole.
  void complain(std::string message, std::string hint = "");
  void complain_file(std::string message, std::string hint = "");
  bool failed() const { return failures_ > 0; }

 private:
  bool token(std::string_view what, std::string_view& out);
  const SideFile& file_;
  ProblemList& problems_;
  const char* at_;       // next byte of the current row
  const char* row_;      // first byte of the current row
  const char* row_end_;  // one past its last
  const char* next_;     // first byte of the next row
  const char* end_;
  const char* column_;  // start of the column read last
  int line_ = 0;
  int failures_ = 0;
};

template <int Dim>
struct MeshTables {
  std::vector<Vec<Dim>> nodes;
  std::vector<std::array<Index, corners<Dim>>> cells;
  std::vector<int> cell_lines;  ///< line of each cell in the file
};

/// `nnodes ncells`, then coordinates, then node ids; nothing if anything is wrong.
template <int Dim>
std::optional<MeshTables<Dim>> read_mesh_file(const SideFile& file, ProblemList& problems);

/// The count, then coordinates.
template <int Dim>
std::optional<std::vector<Vec<Dim>>> read_particle_file(const SideFile& file,
                                                        ProblemList& problems);

/// The count, then six components per particle.
std::optional<std::vector<Voigt>> read_stress_file(const SideFile& file, Index n_particles,
                                                   ProblemList& problems);

/// Rows `id value`, ids below n and each once; `positive` values only.
std::optional<std::vector<std::pair<Index, double>>> read_volume_file(const SideFile& file,
                                                                      Index n_particles,
                                                                      ProblemList& problems);

/// Rows `particle cell`.
std::optional<std::vector<std::pair<Index, Index>>> read_particle_cell_file(const SideFile& file,
                                                                            Index n_particles,
                                                                            Index n_cells,
                                                                            ProblemList& problems);

/// Rows `node dir value`.
struct NodeValue {
  Index node;
  int dir;
  double value;
};
std::optional<std::vector<NodeValue>> read_node_values(const SideFile& file, std::string_view what,
                                                       Index n_nodes, int dim,
                                                       ProblemList& problems);

/// Check the rows of files whose content is not supported yet: `node dir sign_n friction`,
/// `node alpha beta [gamma]`.
void check_friction_file(const SideFile& file, Index n_nodes, int dim, ProblemList& problems);
void check_angle_file(const SideFile& file, Index n_nodes, int dim, ProblemList& problems);

}  // namespace lahar
