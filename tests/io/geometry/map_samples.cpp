#include "tests/io/geometry/map_samples.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

namespace lahar::test {

namespace {

template <class T>
void put(std::string& to, T value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  to.append(bytes, sizeof value);
}

void put_big_endian(std::string& to, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) to += static_cast<char>(value >> shift & 255u);
}

double height_of(const GridSample& grid, int column, int row) {
  return grid.height(grid.x + (column + 0.5) * grid.cell,
                     grid.y + (grid.rows - row - 0.5) * grid.cell);
}

}  // namespace

std::string ascii_grid(const GridSample& grid, double no_data) {
  std::string text =
      fmt::format("ncols {}\nnrows {}\nxllcorner {}\nyllcorner {}\ncellsize {}\nNODATA_value {}\n",
                  grid.columns, grid.rows, grid.x, grid.y, grid.cell, no_data);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const double h = height_of(grid, column, row);
      text += fmt::format("{:.6f} ", std::isnan(h) ? no_data : h);
    }
    text += '\n';
  }
  return text;
}

std::string geotiff(const GridSample& grid, int epsg) {
  struct Entry {
    std::uint16_t tag, type;
    std::uint32_t count;
    std::string data;
  };
  const auto shorts = [](std::vector<int> values) {
    std::string out;
    for (const int v : values) put(out, static_cast<std::uint16_t>(v));
    return out;
  };
  const auto longs = [](std::uint32_t value) {
    std::string out;
    put(out, value);
    return out;
  };
  const auto doubles = [](std::vector<double> values) {
    std::string out;
    for (const double v : values) put(out, v);
    return out;
  };
  const auto cells = static_cast<std::uint32_t>(grid.columns * grid.rows);
  std::vector<Entry> entries = {
      {256, 4, 1, longs(static_cast<std::uint32_t>(grid.columns))},
      {257, 4, 1, longs(static_cast<std::uint32_t>(grid.rows))},
      {258, 3, 1, shorts({32, 0})},
      {259, 3, 1, shorts({1, 0})},
      {262, 3, 1, shorts({1, 0})},
      {273, 4, 1, longs(8)},
      {277, 3, 1, shorts({1, 0})},
      {278, 4, 1, longs(static_cast<std::uint32_t>(grid.rows))},
      {279, 4, 1, longs(4 * cells)},
      {339, 3, 1, shorts({3, 0})},
      {33550, 12, 3, doubles({grid.cell, grid.cell, 0})},
      {33922, 12, 6, doubles({0, 0, 0, grid.x, grid.y + grid.rows * grid.cell, 0})}};
  if (epsg != 0)
    entries.push_back({34735, 3, 16,
                       shorts({1, 1, 0, 3, 1024, 0, 1, epsg > 0 ? 1 : 2, 1025, 0, 1, 1,
                               epsg > 0 ? 3072 : 2048, 0, 1, std::abs(epsg)})});
  std::string out = "II";
  put(out, std::uint16_t{42});
  put(out, 8 + 4 * cells);
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column)
      put(out, static_cast<float>(height_of(grid, column, row)));
  auto beyond = static_cast<std::uint32_t>(out.size() + 2 + 12 * entries.size() + 4);
  std::string values;
  put(out, static_cast<std::uint16_t>(entries.size()));
  for (const Entry& e : entries) {
    put(out, e.tag);
    put(out, e.type);
    put(out, e.count);
    if (e.data.size() <= 4) {
      out += e.data;
    } else {
      put(out, beyond);
      beyond += static_cast<std::uint32_t>(e.data.size());
      values += e.data;
    }
  }
  put(out, std::uint32_t{0});
  return out + values;
}

std::string geojson(const std::vector<std::vector<std::vector<Vec<2>>>>& polygons,
                    const std::string& members) {
  std::string text = R"({"type": "FeatureCollection", )" + members + R"("features": [)";
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    text += fmt::format(R"({}{{"type": "Feature", "properties": {{"zone": "{}"}}, "geometry": )"
                        R"({{"type": "Polygon", "coordinates": [)",
                        i ? ", " : "", i);
    for (std::size_t r = 0; r < polygons[i].size(); ++r) {
      text += r ? ", [" : "[";
      for (const Vec<2>& x : polygons[i][r]) text += fmt::format("[{}, {}], ", x.x(), x.y());
      text += fmt::format("[{}, {}]]", polygons[i][r][0].x(), polygons[i][r][0].y());
    }
    text += "]}}";
  }
  return text + "]}";
}

Shapefile shapefile(const std::vector<std::vector<std::vector<Vec<2>>>>& polygons) {
  std::string records, index;
  Vec<2> low = Vec<2>::Constant(1e300), high = -low;
  std::uint32_t number = 0;
  for (const auto& polygon : polygons) {
    Vec<2> a = Vec<2>::Constant(1e300), b = -a;
    std::string parts, points;
    std::int32_t count = 0;
    for (const auto& ring : polygon) {
      put(parts, count);
      for (std::size_t i = 0; i <= ring.size(); ++i) {
        const Vec<2>& x = ring[i % ring.size()];
        put(points, x.x());
        put(points, x.y());
        a = a.cwiseMin(x), b = b.cwiseMax(x);
        ++count;
      }
    }
    std::string content;
    put(content, std::int32_t{5});
    for (const double v : {a.x(), a.y(), b.x(), b.y()}) put(content, v);
    put(content, static_cast<std::int32_t>(polygon.size()));
    put(content, count);
    content += parts + points;
    put_big_endian(index, static_cast<std::uint32_t>(50 + records.size() / 2));
    put_big_endian(index, static_cast<std::uint32_t>(content.size() / 2));
    put_big_endian(records, ++number);
    put_big_endian(records, static_cast<std::uint32_t>(content.size() / 2));
    records += content;
    low = low.cwiseMin(a), high = high.cwiseMax(b);
  }
  const auto header = [&](std::size_t bytes) {
    std::string out;
    put_big_endian(out, 9994);
    for (int k = 0; k < 5; ++k) put_big_endian(out, 0);
    put_big_endian(out, static_cast<std::uint32_t>((100 + bytes) / 2));
    put(out, std::int32_t{1000});
    put(out, std::int32_t{5});
    for (const double v : {low.x(), low.y(), high.x(), high.y(), 0.0, 0.0, 0.0, 0.0}) put(out, v);
    return out;
  };
  Shapefile out;
  out.shp = header(records.size()) + records;
  out.shx = header(index.size()) + index;
  out.dbf = std::string{3, 100, 1, 1};
  put(out.dbf, number);
  put(out.dbf, std::uint16_t{65});
  put(out.dbf, std::uint16_t{2});
  out.dbf += std::string(20, '\0') + std::string("zone\0\0\0\0\0\0\0C", 12) + std::string(4, '\0') +
             std::string{1, 0} + std::string(14, '\0') + '\r';
  for (std::uint32_t i = 0; i < number; ++i) {
    out.dbf += ' ';
    out.dbf += static_cast<char>('a' + i);
  }
  out.dbf += '\x1a';
  return out;
}

std::string utm_wkt(int zone) {
  return fmt::format(R"(PROJCS["WGS_1984_UTM_Zone_{}N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",)"
                     R"(SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],)"
                     R"(UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],)"
                     R"(PARAMETER["False_Easting",500000.0],PARAMETER["False_Northing",0.0],)"
                     R"(PARAMETER["Central_Meridian",{}],PARAMETER["Scale_Factor",0.9996],)"
                     R"(PARAMETER["Latitude_Of_Origin",0.0],UNIT["Meter",1.0]])",
                     zone, 6 * zone - 183);
}

}  // namespace lahar::test
