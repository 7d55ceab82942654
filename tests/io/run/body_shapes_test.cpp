#include "io/run/body_shapes.h"

#include <doctest/doctest.h>

#include <fstream>
#include <numbers>

#include "io/base/atomic_file.h"
#include "io/frames/surface_files.h"
#include "io/run/manifest.h"
#include "physics/base/error.h"
#include "tests/io/frames/frame_samples.h"
#include "tests/within.h"

namespace lahar {

using namespace test;
namespace fs = std::filesystem;

namespace {

const std::pair<Vec<3>, Vec<3>> unit_box{Vec<3>::Zero(), Vec<3>::Ones()};

/// What lies below a level raster that ends at x = `end`.
SolidPtr<3> ground_until(double end) {
  const Surface<3>::Axes axes{std::vector<double>{0, end / 2, end}, std::vector<double>{0, 1}};
  return below<3>(std::make_shared<const Surface<3>>(axes, std::vector<float>(6, 0.3F)));
}

void write_run(const fs::path& run, const std::vector<BodyShape>& shapes, int dim) {
  RunInfo info;
  info.dim = dim;
  info.bodies = shapes;
  write_text_file(run / "manifest.json", Manifest(info).text());
  write_body_shapes(run, shapes);
}

}  // namespace

TEST_CASE("the surface of a body is closed in the mesh and open where it leaves it") {
  const SolidPtr<3> inside = ball<3>({0.5, 0.5, 0.5}, 0.02);
  const Triangles small = surface_within<3>(*inside, unit_box, 100'000);
  CHECK(edges_of(small).open.count == 0);
  CHECK(enclosed_volume(small) == test::within(0.01, 4.0 / 3 * std::numbers::pi * 8e-6));
  const SolidPtr<3> ground = half_space<3>({0, 0, 0.3}, Vec<3>::UnitZ());
  const Triangles plane = surface_within<3>(*ground, unit_box, 100'000);
  double area = 0;
  for (Index t = 0; t < static_cast<Index>(plane.corners.size()); ++t)
    area += 0.5 * plane.area_vector(t)[2];
  CHECK(area == test::within(0.03, 1));
  for (const Vec<3>& x : plane.points) CHECK(x[2] == test::within(1e-5, 0.3));
  const SolidPtr<3> away = ball<3>({3, 3, 3}, 0.5);
  CHECK(surface_within<3>(*away, unit_box, 100'000).corners.empty());
}

TEST_CASE(
    "the surface of a thin body is found, and of one that only touches the mesh there is none") {
  const SolidPtr<3> plate = box<3>({0.1, 0.1, 0.5}, {0.9, 0.9, 0.501});
  const Triangles surface = surface_within<3>(*plate, unit_box, 100'000);
  CHECK(edges_of(surface).open.count == 0);
  CHECK(enclosed_volume(surface) == test::within(0.05, 0.8 * 0.8 * 0.001));
  CHECK(surface.points.size() < 200'000);  // thin bodies have no more places than others
  const SolidPtr<3> beside = box<3>({-1, -1, -1}, {1e-16, 2, 2});
  CHECK(surface_within<3>(*beside, unit_box, 100'000).corners.empty());
}

TEST_CASE("terrain is open at its ends and those of the mesh, and has no walls there") {
  for (const double end : {0.7, 1.0, 1.5}) {  // before, at, and beyond the end of the mesh
    CAPTURE(end);
    const SolidPtr<3> ground = ground_until(end);
    const Triangles surface = surface_within<3>(*ground, unit_box, 100'000);
    double area = 0;
    for (Index t = 0; t < static_cast<Index>(surface.corners.size()); ++t) {
      if (surface.area_vector(t).norm() < 1e-12) continue;  // through a point of the grid
      const Vec<3> normal = surface.area_vector(t).normalized();
      const Vec<3> at = surface.centre(t);
      if (at[0] < std::min(end, 1.0) - 0.05) CHECK(normal[2] > 0.99);
      area += 0.5 * surface.area_vector(t)[2];
    }
    CHECK(area == test::within(0.05, std::min(end, 1.0)));
    for (const Vec<3>& x : surface.points) CHECK(x.allFinite());
  }
}

TEST_CASE("shapes come back from a run folder as they were, whatever their names are") {
  const TemporaryFolder folder;
  const SolidPtr<3> solid = ball<3>({0.5, 0.5, 0.5}, 0.2);
  const Triangles surface = surface_within<3>(*solid, unit_box, 100'000);
  const std::vector<BodyShape> shapes{{"../\"a\" b", {1, 2, 3}, surface},
                                      {std::string(300, 'x'), {}, surface}};
  write_run(folder.path, shapes, 3);
  const std::vector<BodyShape> found = read_body_shapes(folder.path);
  REQUIRE(found.size() == 2);
  CHECK(found[0].name == shapes[0].name);
  CHECK(found[0].centre == shapes[0].centre);
  const auto& read = std::get<Triangles>(found[0].surface);
  CHECK(read.corners == surface.corners);
  CHECK(read.points == surface.points);
  CHECK(fs::exists(folder.path / "bodies" / "0-____a__b.vtp"));

  const TemporaryFolder flat;
  const SolidPtr<2> disc = ball<2>({0.5, 0.5}, 0.2);
  const Lines lines = surface_within<2>(*disc, {Vec<2>::Zero(), Vec<2>::Ones()}, 10'000);
  write_run(flat.path, {{"disc", {}, lines}}, 2);
  CHECK(std::get<Lines>(read_body_shapes(flat.path)[0].surface).points == lines.points);
}

TEST_CASE(
    "damaged shapes are refused, and runs without them, or whose files were removed, have none") {
  const TemporaryFolder folder;
  CHECK(read_body_shapes(folder.path).empty());
  const SolidPtr<3> solid = ball<3>({0.5, 0.5, 0.5}, 0.2);
  write_run(folder.path, {{"a", {}, surface_within<3>(*solid, unit_box, 100'000)}}, 3);
  const fs::path file = folder.path / "bodies" / "0-a.vtp";
  const std::string whole = read_text_file(file);
  for (const std::string& text :
       {whole.substr(0, whole.size() / 2), std::string("<VTKFile>"), std::string()}) {
    std::ofstream(file, std::ios::binary) << text;
    CHECK_THROWS_WITH_AS(
        read_body_shapes(folder.path),
        ("cannot read " + file.string() + ": not a surface of a rigid body").c_str(), IoError);
  }
  fs::remove(file);
  CHECK(read_body_shapes(folder.path).empty());
}

}  // namespace lahar
