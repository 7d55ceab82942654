/// \file The text of ESRI ASCII grids. GDAL reads words that are not numbers as 0, and ignores
/// values beyond the last cell. Lahar refuses such files before GDAL reads them.
#pragma once

#include "io/geometry/map_files.h"

namespace lahar {

/// Checks a file that begins as an ESRI ASCII grid. Throws InputError, with the line, if a word is
/// not a number, or if the number of values is not columns times rows. Files of other formats pass.
/// Reads the whole file, a piece at a time.
void check_ascii_grid(const MapFile& file);

}  // namespace lahar
