#include "io/results/free_surface.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "io/base/atomic_file.h"
#include "io/frames/surface_files.h"
#include "io/frames/vtkhdf.h"
#include "io/results/export.h"
#include "physics/base/error.h"
#include "tests/io/frames/frame_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A ball of particles on a lattice of distance `d`.
Frame ball(double radius, double d) {
  Frame frame;
  FrameColumn volume{"volume", "m^3", 1, {}};
  const int n = static_cast<int>(radius / d) + 1;
  for (int i = -n; i <= n; ++i)
    for (int j = -n; j <= n; ++j)
      for (int k = -n; k <= n; ++k) {
        const Vec<3> x = d * Vec<3>(i + 0.5, j + 0.5, k + 0.5);
        if (x.norm() > radius) continue;
        frame.coordinates.insert(frame.coordinates.end(), x.data(), x.data() + 3);
        frame.id.push_back(static_cast<Index>(frame.id.size()));
        volume.values.push_back(d * d * d);
      }
  frame.columns.push_back(volume);
  return frame;
}

double enclosed(const Triangles& triangles) {
  double volume = 0;
  for (Index t = 0; t < static_cast<Index>(triangles.corners.size()); ++t)
    volume += triangles.area_vector(t).dot(triangles.centre(t)) / 6;
  return volume;
}

}  // namespace

TEST_CASE("the free surface of a ball is closed, shows its outside, and has its volume and place") {
  const double R = 1;
  double before = 1;
  for (const double d : {0.1, 0.05}) {
    const Triangles surface = free_surface(ball(R, d));
    const TriangleEdges edges = edges_of(surface);
    CHECK(edges.open.count == 0);
    CHECK(edges.branched.count == 0);
    CHECK(edges.turned.count == 0);
    const double error = std::abs(enclosed(surface) / (4.0 / 3 * std::numbers::pi * R * R * R) - 1);
    CHECK(error < 0.6 * before);
    before = error;
    for (const Vec<3>& x : surface.points) CHECK(std::abs(x.norm() - R) < d);
  }
  CHECK(before < 0.02);
}

TEST_CASE("files of a free surface have its triangles") {
  const TemporaryFolder folder;
  const Triangles surface = free_surface(ball(0.5, 0.1));
  write_stl(surface, folder.path / "a.stl");
  const std::string stl = read_text_file(folder.path / "a.stl");
  CHECK(stl.size() == 84 + 50 * surface.corners.size());
  float x = 0;
  std::memcpy(&x, stl.data() + 84 + 12, sizeof x);
  CHECK(x == static_cast<float>(surface.point(0, 0)[0]));
  write_vtp<3>(surface, 2.5, folder.path / "a.vtp");
  const std::string vtp = read_text_file(folder.path / "a.vtp");
  const auto data = vtp.find('_', vtp.find("AppendedData")) + 1;
  double y = 0;
  std::memcpy(&y, vtp.data() + data + 8 + sizeof(double), sizeof y);
  CHECK(y == surface.points[0][1]);
}

TEST_CASE("frames without a surface are refused") {
  Frame flat;
  flat.dim = 2;
  CHECK_THROWS_AS(free_surface(flat), InputError);
  CHECK_THROWS_WITH_AS(free_surface(ball(1, 0.1), {1e-5}),
                       "the grid for the surface would have 6.86e+15 points", InputError);
}

TEST_CASE("a grid that is finer than the particles gets a warning with the least spacing") {
  const TemporaryFolder folder;
  write_frame(ball(0.5, 0.1), folder.path / "a.hdf");
  const auto warnings_at = [&](double spacing) {
    std::vector<Problem> warnings;
    export_run(folder.path / "a.hdf", ExportFormat::stl, {}, {}, spacing, &warnings);
    std::string text;
    for (const Problem& one : warnings) text += one.message + " | " + one.hint + "\n";
    return text;
  };
  CHECK(warnings_at(0) == "");
  CHECK(warnings_at(0.13) == "");
  CHECK(warnings_at(0.1) ==
        "--spacing 0.1 is finer than the particles lie: the surface has holes between them | "
        "give at least 0.13; without --spacing it is 0.2 m\n");
}
