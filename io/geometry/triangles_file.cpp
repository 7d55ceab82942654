#include "io/geometry/triangles_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "io/geometry/triangles_builder.h"

namespace lahar {

std::string ending_of(const std::string& name) {
  std::string ending = std::filesystem::path(name).extension().string();
  if (!ending.empty()) ending.erase(0, 1);
  std::transform(ending.begin(), ending.end(), ending.begin(), [](char c) {
    return 'A' <= c && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return ending;
}

std::optional<Triangles> read_triangles(const SideFile& file, const TrianglesPlace& place,
                                        ProblemList& problems) {
  const std::string ending = ending_of(file.name);
  TrianglesBuilder builder(place);
  bool good = false;
  try {
    if (ending == "stl")
      good = read_stl(file, builder, problems);
    else if (ending == "obj")
      good = read_obj(file, builder, problems);
    else if (ending == "ply")
      good = read_ply(file, builder, problems);
    else
      problems.error({.file = file.name,
                      .message = fmt::format("the format of '{}' is not known", file.name),
                      .hint = "triangles are read from files that end on .stl, .obj or .ply"});
  } catch (const InputError& error) {  // of the builder, which knows no file
    for (Problem problem : error.problems()) {
      problem.file = file.name;
      problems.error(std::move(problem));
    }
  }
  if (!good) return std::nullopt;
  return builder.take();
}

}  // namespace lahar
