/// \file Rasters of a run as files.
#pragma once

#include <filesystem>
#include <vector>

#include "io/geometry/map_files.h"
#include "io/run/gauge_rows.h"
#include "physics/model/gauges.h"

namespace lahar {

/// What the maps are, in the order in which a run keeps them (runtime/step/map_sums.h).
std::vector<GaugeColumn> map_columns();

/// Write RUN/maps/NAME.asc, beside it NAME.prj with the coordinate reference system if it is known,
/// and where there is GDAL, NAME.tif. Throws IoError.
void write_maps(const std::filesystem::path& run, const MapPlan& plan, const MapFrame& frame,
                const std::vector<double>& maps);

}  // namespace lahar
