// Rigid bodies of a run at its times.
#include "runtime/picture/placed_bodies.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "io/base/atomic_file.h"
#include "io/run/history.h"
#include "io/run/manifest.h"
#include "runtime/picture/particle_view.h"
#include "tests/io/frames/frame_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

HistoryRow row_at(double time, double place, double angle) {
  HistoryRow row;
  row.time = time;
  for (const char* name : {"0", "a, \"b\""})
    row.bodies.push_back({.name = name, .place = {place, 0, 0}, .rotation = {0, 0, angle}});
  return row;
}

}  // namespace

TEST_CASE(
    "Bodies are drawn where they are at a time, between rows too, and where they began without") {
  const TemporaryFolder folder;
  RunInfo info;
  info.dim = 2;
  const Lines line{.points = {{1, 0}, {2, 0}}, .corners = {{0, 1}}};
  info.bodies = {{"0", {1, 0, 0}, line}, {"a, \"b\"", {1, 0, 0}, line}};
  write_text_file(folder.path / "manifest.json", Manifest(info).text());
  write_body_shapes(folder.path, info.bodies);
  const auto ends_at = [&](double time) { return PlacedBodies(folder.path).at(time)[1].points; };
  CHECK(ends_at(3) == std::vector<Vec<3>>{{1, 0, 0}, {2, 0, 0}});
  CHECK(!PlacedBodies(folder.path).at(3)[1].moves);

  // It turns through half a circle, so that the vector of its rotation turns over.
  const double angle = 0.9 * std::numbers::pi;
  write_text_file(folder.path / rigid_bodies_file, rigid_bodies_header() +
                                                       rigid_bodies_lines(row_at(0, 1, angle)) +
                                                       rigid_bodies_lines(row_at(1, 3, -angle)));
  CHECK(PlacedBodies(folder.path).at(0)[1].moves);
  for (const auto& [time, place, turned] : {std::tuple{0.0, 1.0, angle},
                                            {0.5, 2.0, std::numbers::pi},
                                            {1.0, 3.0, -angle},
                                            {9.0, 3.0, -angle}}) {
    CAPTURE(time);
    const std::vector<Vec<3>> ends = ends_at(time);
    CHECK((ends[0] - Vec<3>(place, 0, 0)).norm() < 1e-12);
    CHECK((ends[1] - ends[0] - Vec<3>(std::cos(turned), std::sin(turned), 0)).norm() < 1e-12);
  }
}

TEST_CASE("a picture has room for bodies that move, not for terrain") {
  Frame frame;
  frame.dim = 2;
  frame.coordinates = {0, 0, 2, 1};
  std::vector<PlacedBody> bodies(2);
  for (PlacedBody& body : bodies) body.points = {{1, 3, 0}, {4, 1, 0}};
  CHECK(bounds_of(frame, bodies).high == Point{2, 1, 0});
  bodies[1].moves = true;
  CHECK(bounds_of(frame, bodies).low == Point{0, 0, 0});
  CHECK(bounds_of(frame, bodies).high == Point{4, 3, 0});
}
