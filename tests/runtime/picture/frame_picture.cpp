// Fields of frames as pictures.
#include "runtime/picture/frame_picture.h"

#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "physics/base/error.h"
#include "runtime/picture/canvas.h"
#include "runtime/picture/quantity.h"
#include "runtime/picture/svg.h"
#include "tests/within.h"

using namespace lahar;

namespace {

/// Particles in a row along x, one metre apart, in three dimensions.
Frame row_of(int n) {
  Frame frame{.step = 7,
              .time = 0.25,
              .dim = 3,
              .id = {},
              .coordinates = {},
              .material = {},
              .columns = {}};
  FrameColumn volume{.name = "volume", .unit = "m^3", .components = 1, .values = {}},
      velocity{.name = "velocity", .unit = "m/s", .components = 3, .values = {}},
      stress{.name = "stress", .unit = "Pa", .components = 6, .values = {}};
  for (int k = 0; k < n; ++k) {
    frame.id.push_back(k);
    frame.coordinates.insert(frame.coordinates.end(), {k + 0.5, 0.5, 0.5});
    volume.values.push_back(1);
    velocity.values.insert(velocity.values.end(), {3.0 * k, 4.0 * k, 0});
    stress.values.insert(stress.values.end(), {-1e5 * k, 0, 0, 2e3, 0, 0});
  }
  frame.columns = {volume, velocity, stress};
  return frame;
}

std::size_t filled(const Image& image) {
  std::size_t count = 0;
  for (const Rgba& pixel : image.pixels) count += pixel[3] > 0;
  return count;
}

}  // namespace

TEST_CASE("Fields of a frame are its columns, their components and magnitudes, and derived ones") {
  const Frame frame = row_of(4);
  CHECK(field_of(frame, "speed").values[2] == doctest::Approx(10));
  CHECK(field_of(frame, "velocity").values[3] == doctest::Approx(15));
  CHECK(field_of(frame, "velocity_y").values[3] == doctest::Approx(12));
  CHECK(field_of(frame, "stress_xy").values[1] == 2e3);
  CHECK(field_of(frame, "stress_xy").label == "stress xy");
  CHECK(field_of(frame, "stress_xy").unit == "Pa");
  CHECK(field_of(frame, "mean_stress").values[3] == doctest::Approx(1e5));
  CHECK(columns_of_field(header_of(frame), "mean_stress") == std::vector<std::string>{"stress"});
  CHECK_THROWS_WITH_AS(field_of(frame, "wetness"), "this frame has no field 'wetness'", InputError);
  CHECK_THROWS_AS(columns_of_field(header_of(frame), "equivalent_strain"), InputError);
  CHECK_THROWS_AS(field_of(frame, "equivalent_strain"), InputError);  // not zeros
}

TEST_CASE("The total stress of a frame has its pore pressure") {
  Frame frame = row_of(4);
  CHECK_THROWS_AS(field_of(frame, "total_mean_stress"), InputError);
  frame.columns.push_back(
      {.name = "pore_pressure", .unit = "Pa", .components = 1, .values = {5e3, 5e3, 5e3, 5e3}});
  CHECK(field_of(frame, "total_mean_stress").values[3] == doctest::Approx(1e5 + 5e3));
}

TEST_CASE("A few values that are much larger than all others do not decide the colours") {
  std::vector<double> values(10000, 0);
  for (std::size_t k = 0; k < values.size(); ++k)
    values[k] = 1 + 1e-4 * static_cast<double>(k % 100);
  values[17] = 1e9;
  values[18] = std::nan("");
  const ColourScale scale = scale_of(values);
  CHECK(scale.low == test::within(0.001, 1));
  CHECK(scale.high == test::within(0.001, 1.0099));
  CHECK_FALSE(scale.is_signed);
  const ColourScale both = scale_of({-2, 0, 1});
  CHECK(both.is_signed);
  CHECK(both.low == -2);
  CHECK(both.high == 2);
  CHECK(joined({.low = 3, .high = 5}, {.low = 4, .high = 6}).high == 6);
  const ColourScale one = scale_of({7, 7, 7});
  CHECK(one.low < 7);
  CHECK(one.high > 7);
}

TEST_CASE("Colours of signed values are light in the middle, others become lighter") {
  const auto light = [](const Rgba& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; };
  for (int k = 0; k < 20; ++k) CHECK(light(viridis(0.05 * (k + 1))) > light(viridis(0.05 * k)));
  CHECK(light(diverging(0.5)) > 230);
  CHECK(light(diverging(0)) < 100);
  CHECK(light(diverging(1)) < 110);
  CHECK(diverging(0)[2] > diverging(0)[0]);  // blue
  CHECK(diverging(1)[0] > diverging(1)[2]);  // red
  CHECK(hex_of(viridis(0)) == "#440154");
}

TEST_CASE("From above, squares of particles cover their areas, and the highest is in front") {
  Frame frame = row_of(4);
  const std::vector<double> edges = edges_of(frame, false);
  CHECK(edges[0] == doctest::Approx(1));
  const ColourScale scale{.low = 0, .high = 1};
  ParticleView plan(80, 20, {0, 0}, {4, 1});
  plan.add(frame, edges, {0, 0, 0, 1}, {.kind = Look::Kind::plan});
  const Image image = plan.image(scale, false);
  CHECK(filled(image) == 80 * 20);
  CHECK(image.at(5, 10) == viridis(0));
  CHECK(image.at(75, 10) == viridis(1));
  frame.coordinates[0] = 3.5, frame.coordinates[2] = 9;  // the first one above the last one
  ParticleView above(80, 20, {0, 0}, {4, 1});
  above.add(frame, edges, {0.5, 0, 0, 1}, {.kind = Look::Kind::plan});
  CHECK(above.image(scale, false).at(75, 10) == viridis(0.5));
}

TEST_CASE("A section shows the particles that it cuts, and no others") {
  const Frame frame = row_of(4);
  ParticleView section(20, 20, {0, 0}, {1, 1});
  section.add(frame, edges_of(frame, false), {0, 0.25, 0.5, 1},
              {.kind = Look::Kind::section, .normal = 0, .at = 2.6});
  CHECK(section.image({.low = 0, .high = 1}, false).at(10, 10) == viridis(0.5));
  ParticleView outside(20, 20, {0, 0}, {1, 1});
  outside.add(frame, edges_of(frame, false), {0, 0, 0, 0},
              {.kind = Look::Kind::section, .normal = 0, .at = 7});
  CHECK(filled(outside.image({}, false)) == 0);
}

TEST_CASE("Views are 3d, plan and sections, and other words are refused") {
  CHECK(look_of("", 2).kind == Look::Kind::plane);
  CHECK(look_of("", 3).kind == Look::Kind::space);
  CHECK(look_of("plan", 3).kind == Look::Kind::plan);
  CHECK(look_of("y=-1.5", 3).at == -1.5);
  CHECK(name_of(look_of("y=-1.5", 3)) == "section at y = -1.5 m");
  // In names of files each view has its own.
  CHECK(file_part_of(look_of("", 2)).empty());
  CHECK(file_part_of(look_of("3d", 3)).empty());
  CHECK(file_part_of(look_of("plan", 3)) == "-plan");
  CHECK(file_part_of(look_of("y=-1.5", 3)) == "-y=-1.5");
  for (const char* wrong : {"side", "w=1", "y=", "y=1m", "y", "y=nan"})
    CHECK_THROWS_AS(look_of(wrong, 3), InputError);
  CHECK_THROWS_AS(look_of("plan", 2), InputError);
}

TEST_CASE("A picture has title, time, axes and a colour bar with a readable unit") {
  const Frame frame = row_of(4);
  FramePictureOptions options;
  options.field = "mean_stress";
  options.look = look_of("plan", 3);
  options.title = "Row <1>";
  const FramePicture picture(frame, options);
  Svg svg(picture.width(), picture.height());
  picture.draw(svg);
  const std::string text = svg.finish();
  for (const char* words : {"Row &lt;1&gt;", "mean stress at 0.25 s (step 7), plan", "x [m]",
                            "y [m]", "[kPa]", "data:image/png;base64,"})
    CHECK_MESSAGE(text.find(words) != std::string::npos, words);
  Canvas canvas(picture.width(), picture.height(), 1);
  picture.draw(canvas);
  CHECK(canvas.pixels().width == static_cast<int>(std::lround(picture.width())));
  options.look = look_of("y=12", 3);
  CHECK_THROWS_AS(FramePicture(frame, options), InputError);
}

TEST_CASE(
    "Quantities have prefixes, thousands are separated, ticks are as exact as their distance") {
  CHECK(quantity(12300, "Pa") == "12.3 kPa");
  CHECK(quantity(-2.5e6, "Pa") == "−2.5 MPa");
  CHECK(quantity(0.002, "s") == "2 ms");
  CHECK(quantity(300, "s") == "300 s");
  CHECK(quantity(0.35, "m/s") == "0.35 m/s");
  CHECK(quantity(1900, "kg/m^3") == "1,900 kg/m^3");
  CHECK(quantity(4.2e9, "kg m/s") == "4.2 × 10⁹ kg m/s");
  CHECK(quantity(0, "J") == "0 J");
  CHECK(short_number(1234567, 9) == "1,234,567");
  CHECK(tick_label(0.30000000000000004, 0.1) == "0.3");
  CHECK(tick_label(1500, 500) == "1,500");
  CHECK(tick_label(-0.25, 0.05) == "−0.25");
  CHECK(unit_scale(3.3e5, "Pa").unit == "kPa");
  CHECK(unit_scale(3, "-").unit.empty());
}

TEST_CASE("Rigid bodies are grey beside particles, and what is behind them shines through") {
  Frame frame = row_of(4);            // x from 0 to 4, at z = 0.5
  frame.columns[0].values[1] = 1e-6;  // a gap between 1 and 2
  const ColourScale scale{.low = 0, .high = 15};
  // A square below the particles, and one above the last two.
  const auto square = [](double from, double to, double z) {
    return PlacedBody{.name = "",
                      .points = {{from, 0, z}, {to, 0, z}, {to, 1, z}, {from, 1, z}},
                      .triangles = {{0, 1, 2}, {0, 2, 3}},
                      .lines = {}};
  };
  const Look plan{.kind = Look::Kind::plan};
  const auto draw = [&](const std::vector<PlacedBody>& bodies, const Look& look) {
    ParticleView view(60, 10, {-1, 0}, {5, 1});
    view.add(frame, edges_of(frame, false), field_of(frame, "speed").values, look);
    for (const PlacedBody& body : bodies) view.add(body, look, bounds_of(frame));
    return view.image(scale, false);
  };
  const Image without = draw({}, plan), with = draw({square(-1, 5, 0.3), square(2, 4, 0.75)}, plan);
  CHECK(without.at(23, 5)[3] == 0);
  const Rgba grey = with.at(23, 5);  // beside the particles
  CHECK(grey[3] == 255);
  CHECK(std::abs(grey[0] - grey[2]) < 20);
  CHECK(with.at(15, 5) == without.at(15, 5));  // above the lower one
  for (std::size_t c = 0; c < 3; ++c) {        // below the upper one
    const int own = without.at(45, 5)[c], seen = with.at(45, 5)[c];
    CHECK(std::abs(seen - (0.65 * own + 0.35 * grey[c])) < 2);
  }
  const Look section{.kind = Look::Kind::section, .normal = 1, .at = 0.5};
  ParticleView view(60, 40, {-1, -2}, {5, 2});
  view.add(square(-1, 5, 0.3), section, bounds_of(frame));
  const Image line = view.image(scale, false);
  CHECK(line.at(30, 16)[3] == 255);  // at z = 0.3, counted from above
  CHECK(line.at(30, 20)[3] == 0);
}
