#include "io/geometry/triangles_check.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "io/base/text.h"
#include "physics/geometry/triangle_shells.h"

namespace lahar {

namespace {

std::string text_of(const Vec<3>& x) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", x[0], x[1], x[2]);
}

/// "1 edge", "12 edges".
std::string counted(Index n, std::string_view noun) {
  return fmt::format("{} {}{}", n, noun, n == 1 ? "" : "s");
}

class Check {
 public:
  Check(const std::string& file, Triangles& triangles, ProblemList& problems)
      : file_(file), triangles_(triangles), problems_(problems), before_(problems.count()) {}

  bool good() const { return problems_.count() == before_; }

  void error(std::string message, std::string hint = "") {
    problems_.error({.file = file_, .message = std::move(message), .hint = std::move(hint)});
  }
  void warning(std::string message, std::string hint = "") {
    problems_.warning({.file = file_, .message = std::move(message), .hint = std::move(hint)});
  }

  void triangles() {
    const auto collapsed = remove_collapsed(triangles_);
    if (collapsed.count > 0)
      warning(fmt::format("{} with a corner twice {} left out, the first at {}",
                          counted(collapsed.count, "triangle"), collapsed.count == 1 ? "is" : "are",
                          text_of(collapsed.at)));
    if (triangles_.corners.empty()) return error("the file has no triangles");
    const auto flat = find_flat(triangles_);
    if (flat.count > 0)
      error(fmt::format("{} {} no area, the first at {}", counted(flat.count, "triangle"),
                        flat.count == 1 ? "has" : "have", text_of(flat.at)),
            "their corners lie on a line; remove them in the program that made the surface");
  }

  void branches(const TriangleEdges& edges) {
    if (edges.branched.count > 0)
      error(
          fmt::format("{} {} to more than two triangles, the first at {}",
                      counted(edges.branched.count, "edge"),
                      edges.branched.count == 1 ? "belongs" : "belong", text_of(edges.branched.at)),
          "walls within a solid, and bodies that share an edge, are not one solid");
  }

  void holes(const TriangleEdges& edges) {
    if (edges.open.count == 0) return;
    constexpr std::size_t shown = 3;
    const auto found = find_holes(triangles_, edges, shown + 1);
    std::string text;
    for (std::size_t i = 0; i < std::min(shown, found.size()); ++i)
      text += fmt::format("{}{} around {}", i > 0 ? "; " : "", counted(found[i].edges, "edge"),
                          text_of(found[i].centre));
    error(fmt::format("the surface is not closed: {} {} to one triangle only",
                      counted(edges.open.count, "edge"),
                      edges.open.count == 1 ? "belongs" : "belong"),
          fmt::format("close the hole{}: {}{}", found.size() == 1 ? "" : "s", text,
                      found.size() > shown ? "; and more" : ""));
  }

  void sides(const TriangleEdges& edges) {
    if (edges.turned.count > 0)
      error(fmt::format("triangles do not agree which side is outside: at {} neighbours are turned "
                        "over, the first at {}",
                        counted(edges.turned.count, "edge"), text_of(edges.turned.at)),
            "corners have to be counter-clockwise seen from outside; let the program that made the "
            "surface recalculate its normals");
  }

  void volume() {
    if (!(std::abs(enclosed_volume(triangles_)) > nothing()))
      return error("the surface encloses no volume");
  }

  /// Bodies show their outside, and so do hollows in them, whose outside is the hollow.
  void orientation(const TriangleEdges& edges) {
    const TriangleShells shells = shells_of(edges);
    const auto volumes = shell_volumes(triangles_, shells);
    std::vector<int> depths(volumes.size(), 0);
    if (shells.count > 1) depths = nesting_depths(triangles_, shells);
    if (depths.empty())
      return error(fmt::format("too many of the {} closed surfaces lie within each other, or cross",
                               shells.count),
                   "unite what overlaps in the program that made the surface");
    std::vector<bool> wrong(volumes.size(), false);
    Index turned = 0, hollows = 0;
    double hollow = 0;  // [m^3]
    for (std::size_t s = 0; s < volumes.size(); ++s) {
      const bool within = depths[s] % 2 == 1;
      wrong[s] = within ? volumes[s] > 0 : volumes[s] < 0;
      turned += wrong[s] ? 1 : 0;
      hollows += wrong[s] && within ? 1 : 0;
      hollow += wrong[s] && within ? volumes[s] : 0.0;
    }
    if (turned == 0) return;
    turn_over(triangles_, shells, wrong);
    if (turned == shells.count)
      return warning("all triangles are turned over: the surface showed its inside", corners_hint);
    if (const Index bodies = turned - hollows; bodies > 0)
      warning(fmt::format("{} of the {} closed surfaces {} turned over: {} inside", bodies,
                          shells.count, bodies == 1 ? "is" : "are",
                          bodies == 1 ? "it showed its" : "they showed their"),
              corners_hint);
    if (hollows > 0)
      warning(fmt::format("{} of the {} closed surfaces {} within others, and {} turned over: the "
                          "body is hollow there, {:.4g} m^3",
                          hollows, shells.count, hollows == 1 ? "lies" : "lie",
                          hollows == 1 ? "is" : "are", hollow),
              "remove inner surfaces from the file if the body is solid there");
  }

 private:
  static constexpr const char* corners_hint =
      "corners have to be counter-clockwise seen from outside";

  /// What counts as no volume [m^3].
  double nothing() const {
    constexpr double share = 1e-12;  // of a cube around all [-]
    Vec<3> low = triangles_.point(0, 0), high = low;
    for (Index i = 0; i < static_cast<Index>(triangles_.corners.size()); ++i)
      for (int k = 0; k < 3; ++k) {
        low = low.cwiseMin(triangles_.point(i, k));
        high = high.cwiseMax(triangles_.point(i, k));
      }
    return share * std::pow((high - low).maxCoeff(), 3);
  }

  const std::string& file_;
  Triangles& triangles_;
  ProblemList& problems_;
  std::size_t before_;
};

}  // namespace

bool check_solid(const std::string& file, Triangles& triangles, ProblemList& problems) {
  Check check(file, triangles, problems);
  check.triangles();
  if (!check.good()) return false;
  const auto edges = edges_of(triangles);
  check.branches(edges);
  check.holes(edges);
  check.sides(edges);
  if (check.good()) check.orientation(edges);
  if (check.good()) check.volume();
  return check.good();
}

bool check_crossings(const std::string& file, const TriangleTree& tree, ProblemList& problems) {
  const auto found = tree.crossings();
  if (found.count == 0) return true;
  const Triangles& all = tree.triangles();
  problems.error(
      {.file = file,
       .message =
           fmt::format("the surface passes through itself: {}{} of triangles cross, the first "
                       "at {}",
                       counted(found.count, "pair"),
                       found.count == TriangleCrossings::most ? " or more" : "", text_of(found.at)),
       .hint = fmt::format("these two have their centres at {} and {}; unite what overlaps in the "
                           "program that made the surface",
                           text_of(all.centre(found.first)), text_of(all.centre(found.second)))});
  return false;
}

bool check_surface(const std::string& file, Triangles& triangles, ProblemList& problems) {
  Check check(file, triangles, problems);
  check.triangles();
  if (check.good()) check.branches(edges_of(triangles));
  return check.good();
}

}  // namespace lahar
