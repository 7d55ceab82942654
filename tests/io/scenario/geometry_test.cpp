// Named shapes, and the regions that they bound.
#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include "io/scenario/regions.h"
#include "io/scenario/scenario.h"
#include "tests/within.h"

using namespace lahar;

namespace {

std::string scenario_2d(const std::string& geometry, const std::string& region) {
  return R"({"mesh": {"structured": {"origin": [0, 0], "cell_size": 1, "counts": [8, 8]}},
  "geometry": )" +
         geometry + R"(, "sets": {"nodes": {"some": )" + region + R"(}},
  "particles": [{"generator": {"type": "region", "region": )" +
         region + R"(, "per_cell": 2, "material_id": 0}}],
  "materials": [{"id": 0, "type": "LinearElastic2D", "density": 1000, "youngs_modulus": 1e6,
                 "poisson_ratio": 0.3}],
  "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": 1}})";
}

Model<2> read_2d(const std::string& geometry, const std::string& region) {
  return std::get<Model<2>>(read_scenario_text(scenario_2d(geometry, region), ".").model);
}

/// The problems of a 2D scenario, as "message (hint)".
std::string said(const std::string& geometry, const std::string& region) {
  try {
    read_2d(geometry, region);
  } catch (const InputError& e) {
    std::string text;
    for (const Problem& p : e.problems())
      text += p.message + (p.hint.empty() ? "" : " (" + p.hint + ")") + "\n";
    return text;
  }
  return "accepted\n";
}

}  // namespace

TEST_CASE("particles lie below, above and between surfaces through points") {
  const std::string lines = R"({"ground": {"points": [[0, 2], [4, 6], [8, 6]]},
                                "bed": {"surface": "ground", "lower_by": 1.5}})";
  const auto ground = [](double x) { return x < 4 ? 2 + x : 6; };
  const auto below = read_2d(lines, R"({"below": "ground"})").particles;
  const auto above = read_2d(lines, R"({"above": "ground"})").particles;
  const auto between = read_2d(lines, R"({"between": ["bed", "ground"]})").particles;
  CHECK(below.size() > 0);
  for (const auto& x : below.x) CHECK(x.y() <= ground(x.x()) + 1e-6);
  for (const auto& x : above.x) CHECK(x.y() >= ground(x.x()) - 1e-6);
  for (const auto& x : between.x) {
    CHECK(x.y() <= ground(x.x()) + 1e-6);
    CHECK(x.y() >= ground(x.x()) - 1.5 - 1e-6);
  }
}

TEST_CASE("where surfaces touch, nothing lies between them") {
  const auto points = [](double east) {
    return R"({"bed": {"points": [[0, 2.01], [8, 2.01]]},
               "ground": {"points": [[0, 2.01], [4, 2.01], [8, )" +
           std::to_string(east) + "]]}}";
  };
  for (const auto& x : read_2d(points(6), R"({"between": ["bed", "ground"]})").particles.x)
    CHECK(x.x() > 4);
  CHECK(said(points(2.01), R"({"between": ["bed", "ground"]})")
            .find("the region contains no particle") != std::string::npos);
}

TEST_CASE("a stage removes what lies above a surface") {
  std::string text = scenario_2d(R"({"pit": {"points": [[0, 5], [8, 1]]}})", R"({"all": true})");
  text.insert(text.rfind('}'), R"(, "stages": [{"name": "ground"},
      {"name": "dug", "remove": [{"region": {"above": "pit"}}]}])");
  const auto model =
      std::get<Model<2>>(read_scenario_text(text, ".", {.overrides = {}, .stage = 1}).model);
  REQUIRE(model.changes.removed.size() == 1);
  CHECK(model.changes.removed[0].of.region({2, 4.1}));
  CHECK(!model.changes.removed[0].of.region({2, 3.9}));
}

TEST_CASE("a stage that removes ground at once is warned of, and has to outlast what it lets go") {
  const auto stage = [](const std::string& over, const std::string& analysis) {
    std::string text = scenario_2d(R"({"pit": {"points": [[0, 5], [8, 1]]}})", R"({"all": true})");
    text.insert(text.rfind('}'), R"(, "external_loading_conditions": {"gravity": [0, -10]},
      "stages": [{"name": "ground"}, {"name": "dug", "analysis": )" +
                                     analysis + R"(, "remove": [{"region": {"above": "pit"})" +
                                     over + "}]}]");
    const auto said = [](const std::vector<Problem>& problems) {
      std::string all;
      for (const Problem& one : problems) all += one.message + "\n";
      return all;
    };
    try {
      return said(read_scenario_text(text, ".", {.overrides = {}, .stage = 1}).warnings);
    } catch (const InputError& error) {
      return said(error.problems());
    }
  };
  const std::string
      adaptive = R"({"dt": null, "nsteps": null, "end_time": 2, "time_step": {"adaptive": true}})",
      fixed = R"({"dt": 0.001, "nsteps": 2000, "end_time": null})",
      at_once = "all of it is gone at once";
  CHECK(stage("", adaptive).find(at_once) != std::string::npos);
  for (const char* over : {R"(, "over": 0)", R"(, "over": 1)"}) {
    CHECK(stage(over, adaptive).find(at_once) == std::string::npos);
    CHECK(stage(over, fixed).find("suddenly") == std::string::npos);
  }
  for (const std::string& steps : {adaptive, fixed})
    CHECK(stage(R"(, "over": 2)", steps).find("all is gone after 2 s, but the stage ends at 2 s") !=
          std::string::npos);
  CHECK(stage(R"(, "over": 0.004)", fixed)
            .find("all goes within 4 step(s), nearly as suddenly as without 'over'") !=
        std::string::npos);
}

TEST_CASE("layers reach from their surface to the next one, each with its material and set") {
  const std::string text = R"({"mesh": {"structured": {"cell_size": 1, "extent": [8, 8]}},
  "geometry": {"ground": {"points": [[0, 6.3], [8, 6.3]]}, "horizon": {"points": [[0, 0.1], [8, 8.1]]},
               "rock": {"points": [[0, 1.7], [4, 1.7]]}},
  "sets": {"particles": {"left": {"box": {"max": [4, 8]}}}},
  "particles": [{"generator": {"type": "region", "spacing": 0.4, "layers": [
    {"below": "ground", "material": "clay"}, {"below": "horizon", "material": "sand"},
    {"below": "rock", "material": "rock", "pset": "rocks"}]}}],
  "materials": [
    {"name": "clay", "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6, "poisson_ratio": 0.3},
    {"name": "sand", "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6, "poisson_ratio": 0.3},
    {"name": "rock", "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6, "poisson_ratio": 0.3}],
  "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": 1}})";
  const auto p = std::get<Model<2>>(read_scenario_text(text, ".").model).particles;
  std::array<double, 3> volume{};
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    volume[p.material[i]] += p.volume[i];
    // The rock is known to x = 4 only; beyond it the sand goes on. It is cut where the horizon is
    // below it, and the horizon where it comes out of the ground.
    const double x = p.x[i].x(), y = p.x[i].y(), horizon = 0.1 + x;
    const int layer = y > horizon ? 0 : x > 4 || y > 1.7 ? 1 : 2;
    if (std::min(std::abs(y - horizon), std::abs(y - 1.7)) > 0.3 && std::abs(x - 4) > 0.3)
      CHECK(p.material[i] == layer);
  }
  const double above = 0.5 * 6.2 * 6.2, rock = 0.5 * 1.6 * 1.6 + 1.6 * 0.1 + 1.7 * 2.4;
  CHECK(volume[0] == test::within(3e-3, above));
  CHECK(volume[1] == test::within(3e-3, 8 * 6.3 - above - rock));
  CHECK(volume[2] == test::within(3e-3, rock));
  CHECK(p.x.size() > 9 * 8 * 6);  // three along each edge of a cell
}

TEST_CASE("a region between surfaces has the bounds of the surfaces") {
  const std::string text = R"({"between": ["low", "high"]})";
  ProblemList problems;
  const JsonDocument document("region", text, problems);
  Geometries<3> shapes;
  const Surface<3>::Axes axes{{{0, 2}, {1, 4}}};
  shapes["low"].surface = std::make_shared<Surface<3>>(axes, std::vector<float>{3, 1, 2, 2});
  shapes["high"].surface = std::make_shared<Surface<3>>(axes, std::vector<float>{5, 6, 4, 4});
  const Region<3> region(document.root, 1e-9, document, problems, shapes);
  REQUIRE(problems.empty());
  CHECK(region.bounds().first.isApprox(Vec<3>(0, 1, 1), 1e-6));
  CHECK(region.bounds().second.isApprox(Vec<3>(2, 4, 6), 1e-6));
  CHECK(region.contains({2 + 1e-10, 4, 3}));  // on the edge in plan, but for rounding
  CHECK(!region.contains({2.001, 4, 3}));
  CHECK(!region.contains({1, 2, 0.9}));
  CHECK(region.coverage({0.5, 1.5, 3.1}, {1, 2, 3.2}) == Coverage::all);
  CHECK(region.coverage({0.5, 1.5, 6.1}, {1, 2, 6.2}) == Coverage::none);
  CHECK(region.coverage({0.5, 1.5, 0.1}, {1, 2, 5.2}) == Coverage::part);
}

TEST_CASE("solids and outlines are regions in combination with others") {
  const std::string text =
      R"({"difference": [{"intersection": [{"under": "field"}, {"box": {"min": [0, 0, 0],
          "max": [9, 9, 2]}}]}, {"inside": "ball"}]})";
  ProblemList problems;
  const JsonDocument document("region", text, problems);
  Geometries<3> shapes;
  shapes["ball"].solid = ball<3>({1, 1, 1}, 0.5);
  shapes["field"].outlines = std::make_shared<Outlines>(std::vector<Outlines::Polygon>{
      {{{0, 0}, {4, 0}, {4, 4}, {0, 4}}, {{2, 2}, {3, 2}, {3, 3}, {2, 3}}}});
  const Region<3> region(document.root, 1e-9, document, problems, shapes);
  REQUIRE(problems.empty());
  CHECK(region.contains({0.5, 0.5, 1}));
  CHECK(!region.contains({1.2, 1, 1}));    // in the ball
  CHECK(!region.contains({2.5, 2.5, 1}));  // in the hole
  CHECK(!region.contains({0.5, 0.5, 2.1}));
  CHECK(region.coverage({3.2, 0.2, 0.2}, {3.8, 0.8, 0.8}) == Coverage::all);
  CHECK(region.coverage({2.2, 2.2, 0.2}, {2.8, 2.8, 0.8}) == Coverage::none);
  CHECK(region.coverage({0.9, 0.9, 0.9}, {1.1, 1.1, 1.1}) == Coverage::none);
  CHECK(region.coverage({1.9, 2.2, 0.9}, {2.1, 2.4, 1.1}) == Coverage::part);
}

TEST_CASE("what a box has of a region is what its points say") {
  const std::string text =
      R"({"union": [{"cylinder": {"from": [1, 1, 1], "to": [3, 2, 2], "radius": 0.7}},
          {"intersection": [{"sphere": {"centre": [3, 3, 2], "radius": 1.2}},
                            {"half_space": {"point": [3, 3, 2], "normal": [1, 1, 2]}}]},
          {"polygon": {"points": [[0, 0], [1, 0], [0.4, 2]], "range": [2, 3]}}]})";
  ProblemList problems;
  const JsonDocument document("region", text, problems);
  const Region<3> region(document.root, 1e-9, document, problems);
  REQUIRE(problems.empty());
  int all = 0, none = 0;
  for (int k = 0; k < 16 * 16 * 16; ++k) {
    const Vec<3> low = 0.25 * Vec<3>(k % 16, k / 16 % 16, k / 256), high = low.array() + 0.25;
    const Coverage coverage = region.coverage(low, high);
    all += coverage == Coverage::all, none += coverage == Coverage::none;
    if (coverage == Coverage::part) continue;
    for (int p = 0; p < 27; ++p) {
      const Vec<3> x = low + 0.125 * Vec<3>(p % 3, p / 3 % 3, p / 9);
      const Vec<3> inwards = x + 1e-6 * (0.5 * (low + high) - x);
      CHECK(region.contains(inwards) == (coverage == Coverage::all));
    }
  }
  CHECK(all > 20);
  CHECK(none > 2000);
}

TEST_CASE("outlines with many corners are found by bands, holes and several polygons included") {
  Outlines::Ring star;
  constexpr int n = 20000;
  const auto radius = [](double angle) { return 10 + 3 * std::sin(7 * angle); };
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * 3.14159265358979 * i / n;
    star.push_back(radius(angle) * Vec<2>(std::cos(angle), std::sin(angle)));
  }
  // Two polygons that coverage do not cancel each other.
  const Outlines outlines(
      {{star, {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}}, {{{5, 0}, {30, 0}, {30, 1}}}});
  for (int k = 0; k < 4000; ++k) {
    const Vec<2> x(-14 + 0.37 * (k % 78), -14 + 0.553 * (k / 78));
    const double r = x.norm(), edge = radius(std::atan2(x.y(), x.x()));
    const bool other = x.y() >= 0 && x.x() <= 30 && x.x() >= 5 && x.y() <= (x.x() - 5) / 25;
    const bool hole = x.cwiseAbs().maxCoeff() < 1;
    if (std::abs(r - edge) < 1e-3) continue;
    CHECK(outlines.contains(x, 1e-9) == ((r < edge && !hole) || other));
  }
  for (const Vec<2>& x : {Vec<2>(0.2, 0.1), Vec<2>(0, 9.5), Vec<2>(40, 0.3), Vec<2>(-7, -20)}) {
    double least = 1e9;
    for (int i = 0; i < n; ++i)
      least = std::min(least, (star[static_cast<std::size_t>(i)] - x).norm());
    if (x.x() == 0.2) least = 0.8;                          // of the hole
    if (x.x() == 40) least = (x - Vec<2>(30, 0.3)).norm();  // of the other polygon
    CHECK(outlines.from_edge(x).norm() == test::within(1e-3, least));
  }
  CHECK(outlines.crosses({0.5, 0.5}, {1.5, 1.5}));
  CHECK(!outlines.crosses({-0.5, -0.5}, {0.5, 0.5}));
  CHECK(!outlines.crosses({2, 2}, {3, 3}));
}

TEST_CASE("shapes and regions that name each other wrongly are refused") {
  const std::string ground = R"({"ground": {"points": [[0, 2], [8, 6]]}})";
  const std::string below = R"({"below": "ground"})";
  const auto twice = [](const std::string& text) { return text + text; };  // a set and a generator
  CHECK(said(ground, R"({"below": "grund"})") ==
        twice("there is no geometry named 'grund' (did you mean 'ground'?)\n"));
  CHECK(said(ground, R"({"inside": "ground"})") ==
        twice("'inside' needs a solid, but the geometry 'ground' is a surface (write \"below\", "
              "\"above\" or \"between\")\n"));
  CHECK(said(ground, R"({"under": "ground"})") ==
        twice("'under' needs polygons, but the geometry 'ground' is a surface (write \"below\", "
              "\"above\" or \"between\")\n"));
  CHECK(said(ground, R"({"between": ["ground"]})") ==
        twice("'between' needs the names of two surfaces, found 1 ([lower, upper])\n"));
  CHECK(said(R"({"ground": {"points": [[0, 2], [8, 6]]}, "top": {"points": [[0, 7], [8, 7]]}})",
             R"({"between": ["top", "ground"]})") ==
        twice("nothing lies between: 'top' is nowhere below 'ground' (the lower surface comes "
              "first)\n"));
  CHECK(
      said(
          R"({"ground": {"points": [[0, 2], [8, 6]]}, "top": {"surface": "ground", "raise_by": 1}})",
          R"({"between": ["top", "ground"]})")
          .find("the region contains no particle ('top' is above 'ground': the lower surface "
                "comes first in 'between')\n") != std::string::npos);
  CHECK(said(R"({"ground": {}})", below) ==
        "the geometry 'ground' has no shape (give one of 'points', 'raster', "
        "'surface', 'triangles', 'solid', 'polygons')\n");
  CHECK(said(R"({"ground": {"points": [[0, 2], [8, 6]], "surface": "x", "lower_by": 1}})", below) ==
        "the geometry 'ground' has several shapes: 'points', 'surface' (give one of 'points', "
        "'raster', 'surface', 'triangles', 'solid', 'polygons')\n");
  CHECK(said(R"({"ground": {"points": [[0, 2], [0, 6]]}})", below) ==
        "a surface needs points at two places along x at least, found 1\n");
  CHECK(said(R"({"ground": {"points": [[0, 2], [8, 6], [4, 3]]}})", below) ==
        "the points of a surface must have ascending x (a surface has one height above each "
        "place; overhangs are solids)\n");
  CHECK(said(R"({"ground": {"points": [[0, 2, 1], [8, 6, 1]]}})", below) ==
        "'points' must be an array of points (2 numbers each) [m], found array [[0, 2, 1], [8, 6, "
        "1]]\n");
  CHECK(said(R"({"ground": {"surface": "ground", "lower_by": 1}})", below) ==
        "the surfaces follow from each other in a circle: ground, ground\n");
  CHECK(said(R"({"ground": {"surface": "bed", "raise_by": 1},
                 "bed": {"surface": "ground", "lower_by": 1}})",
             below) == "the surfaces follow from each other in a circle: ground, bed, ground\n");
  CHECK(said(R"({"ground": {"surface": "bad", "raise_by": 1}})", below) ==
        "there is no geometry named 'bad' (geometries: ground)\n");
  CHECK(said(R"({"bed": {"points": [[0, 1], [8, 1]]}, "ground": {"surface": "bed"}})", below) ==
        "a surface that follows from another needs 'lower_by' or 'raise_by' (a number [m], or the "
        "name of a surface that has the thickness)\n");
  CHECK(said(R"({"bed": {"points": [[0, 1], [8, 1]]},
                 "ground": {"surface": "bed", "raise_by": "depth"},
                 "depth": {"points": [[0, 1], [8, -1]]}})",
             below) == "the thickness is -1 at x = 8 (a thickness must not be negative)\n");
  CHECK(said(R"({"bed": {"points": [[0, 1], [8, 1]]},
                 "ground": {"surface": "bed", "raise_by": "depth"},
                 "depth": {"points": [[10, 1], [12, 1]]}})",
             below) == "the surface and its thickness are not at the same places in plan\n");
  CHECK(said(R"({"ground": {"points": [[0, 2], [8, 6]], "lower_by": 1}})", below) ==
        "'lower_by' needs 'surface': what is it to be moved from?\n");
  CHECK(said(R"({"ground": {"surface": "bed", "lower_by": -1},
                 "bed": {"points": [[0, 2], [8, 6]]}})",
             below) == "'lower_by' must be at least 0 [m], found -1\n");
}
