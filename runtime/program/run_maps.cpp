#include "runtime/program/run_maps.h"

#include <span>

#include "io/base/atomic_file.h"
#include "io/geometry/raster_output.h"

namespace lahar {

std::vector<GaugeColumn> map_columns() {
  return {{"thickness", "m", "volume over area, at the end"},
          {"speed", "m/s", "speed of the mean velocity over a raster cell, at the end"},
          {"pressure", "Pa", "largest pressure of a particle, at the end"},
          {"max_thickness", "m", "largest volume over area"},
          {"max_speed", "m/s", "largest speed of the mean velocity over a raster cell"},
          {"max_pressure", "Pa", "largest pressure of a particle"},
          {"arrival_time", "s", "first time at which the thickness was above the threshold"}};
}

void write_maps(const std::filesystem::path& run, const MapPlan& plan, const MapFrame& frame,
                const std::vector<double>& maps) {
  const std::filesystem::path folder = run / "maps";
  make_folder(folder);
  const RasterGrid grid{.columns = plan.n[0],
                        .rows = plan.n[1],
                        .low = Vec<2>(plan.low[0], plan.low[1]) + frame.origin,
                        .cell = plan.cell};
  const auto cells = static_cast<std::size_t>(plan.cells());
  std::size_t first = 0;
  for (const GaugeColumn& map : map_columns()) {
    const auto values = std::span(maps).subspan(first, cells);
    first += cells;
    write_text_file(folder / (map.name + ".asc"), ascii_grid_text(grid, values));
    if (!frame.reference.empty())
      write_text_file(folder / (map.name + ".prj"), frame.reference + '\n');
    if (!has_gdal()) continue;
    const std::filesystem::path file = folder / (map.name + ".tif");
    AtomicFile atomic(file);
    write_geotiff(atomic.temporary().string(), grid, frame.reference, values);
    atomic.commit();
  }
}

}  // namespace lahar
