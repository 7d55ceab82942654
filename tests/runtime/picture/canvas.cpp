// Pictures as pixels, and as PNG files.
#include "runtime/picture/canvas.h"

#include <doctest/doctest.h>
#include <zlib.h>

#include <cmath>
#include <string>

#include "runtime/picture/glyphs.h"
#include "tests/within.h"

using namespace lahar;

namespace {

/// How much ink there is: pixels that are black, parts of them counted.
double ink(const Image& image) {
  double sum = 0;
  for (const Rgba& pixel : image.pixels) sum += 1 - pixel[0] / 255.0;
  return sum;
}

std::uint32_t number_at(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k)
    value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

/// A PNG file read back, independently of how it was written.
Image read_back(const std::string& png) {
  Image image;
  std::string data, palette, opacity;
  int channels = 0;
  for (std::size_t at = 8; at < png.size();) {
    const std::size_t length = number_at(png, at);
    const std::string type = png.substr(at + 4, 4), body = png.substr(at + 8, length);
    const std::string summed = type + body;
    CHECK(number_at(png, at + 8 + length) == crc32(0, reinterpret_cast<const Bytef*>(summed.data()),
                                                   static_cast<uInt>(summed.size())));
    if (type == "IHDR") {
      image = Image(static_cast<int>(number_at(body, 0)), static_cast<int>(number_at(body, 4)));
      channels = body[9] == 3 ? 1 : body[9] == 2 ? 3 : 4;
    }
    if (type == "PLTE") palette = body;
    if (type == "tRNS") opacity = body;
    if (type == "IDAT") data += body;
    at += 12 + length;
  }
  const auto row = static_cast<std::size_t>(image.width * channels);
  std::string rows((row + 1) * static_cast<std::size_t>(image.height), '\0');
  auto size = static_cast<uLongf>(rows.size());
  REQUIRE(uncompress(reinterpret_cast<Bytef*>(rows.data()), &size,
                     reinterpret_cast<const Bytef*>(data.data()),
                     static_cast<uLong>(data.size())) == Z_OK);
  std::string above(row, '\0');
  for (int j = 0; j < image.height; ++j) {
    const std::size_t from = static_cast<std::size_t>(j) * (row + 1);
    REQUIRE(rows[from] == 2);
    for (std::size_t k = 0; k < row; ++k)
      above[k] = static_cast<char>(above[k] + rows[from + 1 + k]);
    for (int i = 0; i < image.width; ++i) {
      Rgba& pixel = image.at(i, j);
      pixel = {0, 0, 0, 255};
      const auto byte = [&](std::size_t k) {
        return static_cast<std::uint8_t>(above[static_cast<std::size_t>(i * channels) + k]);
      };
      if (channels == 1) {
        for (std::size_t k = 0; k < 3; ++k)
          pixel[k] = static_cast<std::uint8_t>(palette[3 * byte(0) + k]);
        if (!opacity.empty()) pixel[3] = static_cast<std::uint8_t>(opacity[byte(0)]);
      } else {
        for (std::size_t k = 0; k < static_cast<std::size_t>(channels); ++k) pixel[k] = byte(k);
      }
    }
  }
  return image;
}

}  // namespace

TEST_CASE("PNG files of few colours, of many, and of clear ones read back to the same pixels") {
  for (const int colours : {3, 700})
    for (const bool clear : {false, true}) {
      Image image(50, 31);
      for (int j = 0; j < 31; ++j)
        for (int i = 0; i < 50; ++i) {
          const int c = (50 * j + i) % colours;
          image.at(i, j) = {static_cast<std::uint8_t>(c), static_cast<std::uint8_t>(c / 256), 7,
                            static_cast<std::uint8_t>(clear && i % 2 ? 0 : 255)};
        }
      const Image back = read_back(png_of(image));
      CHECK(back.width == 50);
      CHECK(back.pixels == image.pixels);
    }
}

TEST_CASE("Shapes on a canvas have their areas, wherever they lie between pixels") {
  const double pi = std::acos(-1.0);
  Canvas disc(60, 60, 2);
  disc.circle(30.3, 29.7, 20, {.fill = "#000000"});
  CHECK(ink(disc.pixels()) == test::within(0.005, 4 * pi * 400));  // 48 corners
  Canvas ring(60, 60, 2);
  ring.circle(30.3, 29.7, 20, {.stroke = "#000000", .width = 3});
  CHECK(ink(ring.pixels()) == test::within(0.01, 4 * 2 * pi * 20 * 3));
  Canvas line(60, 60, 2);
  line.line(5.2, 7.1, 48.9, 33.3, {.stroke = "#000000", .width = 1.5});
  CHECK(ink(line.pixels()) == test::within(0.01, 4 * 1.5 * std::hypot(43.7, 26.2)));
  Canvas dashed(60, 60, 2);
  dashed.line(5, 30, 55, 30, {.stroke = "#000000", .width = 2, .dash = "6 4"});
  CHECK(ink(dashed.pixels()) == test::within(0.01, 4 * 2 * 30));
  Canvas half(60, 60, 1);
  half.rectangle(10, 10, 20, 30, {.fill = "#000000", .opacity = 0.5});
  CHECK(ink(half.pixels()) == test::within(0.01, 300));
}

TEST_CASE("Shapes that leave a canvas are cut at its border") {
  Canvas canvas(20, 20, 1);
  canvas.rectangle(-10, -10, 100, 100, {.fill = "#000000"});
  canvas.circle(0, 30, 25, {.fill = "#000000"});
  canvas.line(-50, 10, 90, 12, {.stroke = "#000000"});
  canvas.text(-5, 25, "words", 20, "start", "#000000");
  CHECK(ink(canvas.pixels()) == doctest::Approx(400));
}

TEST_CASE("Texts have ink where they should, for all letters and any anchor") {
  const auto place = [](const char* anchor, double angle) {
    Canvas canvas(300, 300, 1);
    canvas.text(150, 150, "m/s² −12 µ", 20, anchor, "#000000", angle);
    double x = 0, y = 0, sum = 0;
    for (int j = 0; j < 300; ++j)
      for (int i = 0; i < 300; ++i) {
        const double black = 1 - canvas.pixels().at(i, j)[0] / 255.0;
        x += black * i, y += black * j, sum += black;
      }
    CHECK(sum > 200);
    return std::pair{x / sum, y / sum};
  };
  const double half = 0.5 * text_length("m/s² −12 µ", 20);
  CHECK(half == test::within(0.2, 58));
  const double start = place("start", 0).first;  // its middle, as far as ink is spread evenly
  CHECK(start == test::within(0.08, 150 + half));
  CHECK(place("middle", 0).first == test::within(0.01, start - half));
  CHECK(place("end", 0).first == test::within(0.01, start - 2 * half));
  CHECK(place("start", -90).second == test::within(0.03, 300 - start));
  CHECK(place("start", -90).first == test::within(0.05, 144));
}
