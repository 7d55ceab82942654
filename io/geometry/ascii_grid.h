/// \file The text of ESRI ASCII grids. GDAL takes a word that is no number as 0, and leaves out
/// what is too much: such files are refused before it reads them.
#pragma once

#include "io/geometry/map_files.h"

namespace lahar {

/// Throws InputError, with the line, where a file that begins as an ESRI ASCII grid has a word that
/// is no number, or other than columns times rows values. Reads all of the file, a piece at a time.
/// Other files pass.
void check_ascii_grid(const MapFile& file);

}  // namespace lahar
