/// \file A small valid case in a temporary folder, ways to break it, and what the reader then says.
#pragma once

#include <string>
#include <vector>

namespace lahar::broken {

/// One change to the files of the valid case.
struct Edit {
  enum class Kind { remove, folder, write, replace } kind;
  std::string file, from, to;
};

inline Edit absent(std::string file) {
  return {Edit::Kind::remove, std::move(file), "", ""};
}
inline Edit folder(std::string file) {
  return {Edit::Kind::folder, std::move(file), "", ""};
}
inline Edit write(std::string file, std::string text) {
  return {Edit::Kind::write, std::move(file), "", std::move(text)};
}
inline Edit replace(std::string file, std::string from, std::string to) {
  return {Edit::Kind::replace, std::move(file), std::move(from), std::move(to)};
}

/// One way to break the case and the full text that a user then reads.
struct Entry {
  std::string name;
  std::vector<Edit> edits;
  std::vector<std::string> overrides;
  std::string expected;
};

/// Write the case, apply the edits and read it; the problems as text, paths without the folder.
/// "accepted" and the warnings if there are none. Where a team reads it, every member says the
/// same.
std::string read(const std::vector<Edit>& edits, const std::vector<std::string>& overrides = {},
                 int team = 1);

/// Check every entry of a table, read by one and by several; its size is checked too, so that no
/// entry is lost.
void check(const std::vector<Entry>& table, std::size_t size);

}  // namespace lahar::broken
