#!/usr/bin/env bash
# Programs without GDAL refuse maps with one message, and run all else: without_gdal_test.sh LAHAR
# LAHAR_WITHOUT_GDAL GDAL_LIBRARY. The last is the name of the library that LAHAR loads; empty = it was built
# without one.
set -euo pipefail
lahar="$1"
without="$2"
library="$3"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"

fail() {
  echo "FAILED: $*"
  exit 1
}

# A block above a bed; the bed, the block and its stiffness come from ... (geometry, region, stiffness).
scenario() {
  cat <<JSON
{
  "mesh": {"structured": {"cell_size": 0.25, "extent": [2, 1, 1.5]}},
  "geometry": {$1},
  "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": $3, "poisson_ratio": 0.2}],
  "rigid_bodies": [{"region": {"below": "bed"}}],
  "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0, "region": $2}}],
  "external_loading_conditions": {"gravity": [0, 0, -9.81]},
  "analysis": {"nsteps": 20},
  "post_processing": {"maps": {}, "history_steps": 1}
}
JSON
}
box='{"box": {"min": [0.5, 0.25, 0.75], "max": [1.25, 0.75, 1.25]}}'
points='"bed": {"points": [[-1, -1, 0.3], [3, -1, 0.4], [-1, 2, 0.3], [3, 2, 0.4]]}'
scenario "$points" "$box" 1e5 >plain.json
cat >bed.asc <<ASC
ncols 2
nrows 2
xllcorner -2
yllcorner -2
cellsize 4
0.3 0.4
0.3 0.4
ASC
cat >zones.geojson <<JSON
{"type": "FeatureCollection", "crs": null, "features": [{"type": "Feature", "properties": {}, "geometry":
  {"type": "Polygon", "coordinates": [[[0.4, 0.2], [1.3, 0.2], [1.3, 0.8], [0.4, 0.2]]]}}]}
JSON
scenario '"bed": {"raster": "bed.asc"}' "$box" 1e5 >raster.json
scenario "$points, \"zones\": {\"polygons\": \"zones.geojson\"}" \
  "{\"intersection\": [{\"under\": \"zones\"}, $box]}" 1e5 >polygons.json
scenario "$points" "$box" '{"raster": "bed.asc"}' >field.json
scenario '"bed": {"raster": "bed.asc"}, "low": {"surface": "bed", "raise_by": 0.3},
  "top": {"raster": "bed.asc"}, "zones": {"polygons": "zones.geojson"}' \
  '{"difference": [{"between": ["low", "top"]}, {"under": "zones"}]}' '{"raster": "bed.asc"}' >all.json

# refuses "PROGRAM" MESSAGE: one error in each scenario with a map, which names the file's place.
refuses() {
  local name status
  for name in raster polygons field all; do
    status=0
    "$1" check "$name.json" >out.txt 2>&1 || status=$?
    [[ "$status" == 2 ]] || fail "$1, $name: status $status, $(cat out.txt)"
    [[ "$(grep -c 'error:' out.txt)" == 1 ]] || fail "$1, $name: not one error: $(cat out.txt)"
    grep -q -- "$name.json:[0-9]*:[0-9]*: error: $2" out.txt || fail "$1, $name: $(cat out.txt)"
    grep -q "libgdal-dev" out.txt || fail "$1, $name: no word of what to install: $(cat out.txt)"
  done
}
# runs PROGRAM: without maps of others it does all that the program does, and writes its maps as text.
runs() {
  rm -rf other
  "$1" run plain.json --quiet --threads 1 --output other
  cmp other/history.csv reference/history.csv || fail "$1 computes something else"
  cmp other/maps/max_thickness.asc reference/maps/max_thickness.asc || fail "$1 has other maps"
  ! ls other/maps/*.tif >/dev/null 2>&1 || fail "$1 writes GeoTIFF"
}

"$lahar" run plain.json --quiet --threads 1 --output reference
refuses "$without" "rasters and polygons need GDAL, which this build lacks"
runs "$without"

[[ -n "$library" ]] || exit 0
for name in raster polygons; do
  "$lahar" check "$name.json" >out.txt 2>&1 || fail "$name: $(cat out.txt)"
done
ls reference/maps/max_thickness.tif >/dev/null || fail "no GeoTIFF with GDAL"
# The library is damaged: the loader finds an empty file in its place.
mkdir damaged
touch "damaged/$library"
export LD_LIBRARY_PATH="$work/damaged"
refuses "$lahar" "the library of GDAL cannot be loaded"
runs "$lahar"
