#include "io/geometry/raster_output.h"

#include <cmath>

#include "io/base/numbers.h"

namespace lahar {

std::string ascii_grid_text(const RasterGrid& grid, std::span<const double> values) {
  std::string text;
  const auto line = [&](const char* key, auto value) {
    text += key;
    append_number(text, value);
    text += '\n';
  };
  line("ncols ", grid.columns);
  line("nrows ", grid.rows);
  line("xllcorner ", grid.low.x());
  line("yllcorner ", grid.low.y());
  line("cellsize ", grid.cell);
  line("NODATA_value ", no_data);
  for (Index row = grid.rows - 1; row >= 0; --row)  // the first is the northernmost
    for (Index i = 0; i < grid.columns; ++i) {
      const double value = values[static_cast<std::size_t>(row * grid.columns + i)];
      append_number(text, std::isnan(value) ? no_data : value);
      text += i + 1 < grid.columns ? ' ' : '\n';
    }
  return text;
}

}  // namespace lahar
