#!/usr/bin/env bash
# Pages of `lahar report` in Chromium, which is installed where there is root, apt and no
# LAHAR_NO_INSTALL. Exit status 77: there is no Chromium.
#
#     report_test.sh LAHAR PYTHON [--screenshot FILE.png]
set -euo pipefail
lahar="$1"
python="$2"
shift 2
here="$(cd "$(dirname "$0")" && pwd)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

fail() {
  echo "FAILED: $*"
  exit 1
}

# A heap that a ball falls into.
cat >"$work/heap.json" <<'END'
{"title": "Heap & <ball>",
 "mesh": {"structured": {"cell_size": 0.25, "extent": [4, 2, 3]},
   "boundary_conditions": {"velocity_constraints": [
     {"nset": "ends", "dir": "x", "velocity": 0}, {"nset": "sides", "dir": "y", "velocity": 0}]}},
 "sets": {"nodes": {
   "ends": {"union": [{"half_space": {"point": [0, 0, 0], "normal": [1, 0, 0]}},
                      {"half_space": {"point": [4, 0, 0], "normal": [-1, 0, 0]}}]},
   "sides": {"union": [{"half_space": {"point": [0, 0, 0], "normal": [0, 1, 0]}},
                       {"half_space": {"point": [0, 2, 0], "normal": [0, -1, 0]}}]}}},
 "materials": [{"name": "sand", "type": "MohrCoulomb", "density": 1700, "youngs_modulus": 1e6,
   "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 100, "tension_cutoff": 0}],
 "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "sand",
   "region": {"box": {"min": [0, 0, 0.25], "max": [2, 2, 1.25]}}}}],
 "rigid_bodies": [
   {"name": "floor", "region": {"half_space": {"point": [0, 0, 0.25], "normal": [0, 0, 1]}}, "friction": 0.5},
   {"name": "ball", "region": {"sphere": {"centre": [1, 1, 1.8], "radius": 0.4}}, "density": 2000}],
 "external_loading_conditions": {"gravity": [0, 0, -9.81]},
 "analysis": {"end_time": 0.4},
 "post_processing": {"output_dt": 0.05}}
END
cat >"$work/slope.json" <<'END'
{"title": "Two stages",
 "mesh": {"structured": {"cell_size": 0.5, "extent": [6, 3]},
   "boundary_conditions": {"velocity_constraints": [{"nset": "base", "dir": "y", "velocity": 0}]}},
 "sets": {"nodes": {"base": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
 "materials": [{"name": "clay", "type": "LinearElastic", "density": 1800, "youngs_modulus": 1e6, "poisson_ratio": 0.3}],
 "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "clay",
   "region": {"box": {"min": [1, 0], "max": [3, 2]}}}}],
 "external_loading_conditions": {"gravity": [0, -9.81]},
 "analysis": {"end_time": 0.05},
 "stages": [{"name": "first"}, {"name": "second", "analysis": {"end_time": 0.1}}],
 "post_processing": {"output_dt": 0.02}}
END
"$lahar" run "$work/heap.json" -q -t 2 -o "$work/heap"
"$lahar" run "$work/heap.json" -q -t 2 -o "$work/light" --set rigid_bodies.1.density=500
"$lahar" run "$work/slope.json" -q -t 1 -o "$work/slope"

# Gauges and maps as a run lists them.
"$python" - "$work/heap" <<'END'
import json, math, pathlib, sys
run = pathlib.Path(sys.argv[1])
for folder in ("gauges", "maps"):
    (run / folder).mkdir(exist_ok=True)
rows = [f"{k},{0.02 * k},{1 - 0.02 * k},{3000 * math.sin(k)}" for k in range(20)]
(run / "gauges/toe.csv").write_text("step [-],time [s],height [m],pressure [Pa]\n" + "\n".join(rows) + "\n")
cells = [" ".join(str(round(max(0, 5 - math.hypot(i - 12, j - 6)), 3)) if i else "-9999" for i in range(24)) for j in range(12)]
(run / "maps/max_thickness.asc").write_text(
    "ncols 24\nnrows 12\nxllcorner 652000\nyllcorner 5163000\ncellsize 2\nNODATA_value -9999\n" + "\n".join(cells) + "\n")
manifest = json.loads((run / "manifest.json").read_text())
manifest["gauges"] = [{"name": "toe", "file": "gauges/toe.csv", "columns": []}]
manifest["maps"] = [{"name": "max_thickness", "unit": "m", "meaning": "largest thickness of the whole run",
                     "files": ["maps/max_thickness.asc"]}]
manifest["warnings"] = ["a warning with <tags> & signs"]
(run / "manifest.json").write_text(json.dumps(manifest, indent=2))
END

"$lahar" report "$work/heap" | grep -q "heap/report.html" || fail "the page is not named"
"$lahar" report "$work/heap" -o "$work/again.html"
cmp "$work/heap/report.html" "$work/again.html" || fail "the same run gives another page"
"$lahar" report "$work/heap" "$work/light" -o "$work/two.html" --points 2000
"$lahar" report "$work/slope" -o "$work/stages.html"
# More runs than colours, of one name.
many=()
for k in 1 2 3 4 5 6 7 8; do
  mkdir -p "$work/many/$k"
  cp -r "$work/slope" "$work/many/$k/slope"
  many+=("$work/many/$k/slope")
done
"$lahar" run "$work/slope.json" -q -t 1 -o "$work/many/9/slope" --set materials.0.density=3000
"$lahar" report "${many[@]}" "$work/many/9/slope" -o "$work/nine.html"
mkdir "$work/empty"
"$lahar" report "$work/heap" --at 0 -o "$work/at.html"
figures() { grep -o "<figure>" "$1" | wc -l; }
[[ "$(figures "$work/at.html")" -lt "$(figures "$work/heap/report.html")" ]] || fail "pictures at chosen times"
if "$lahar" report "$work/empty" 2>"$work/out"; then fail "a page of an empty folder"; fi
grep -q "is not a run folder" "$work/out" || fail "no reason: $(cat "$work/out")"
if "$lahar" report "$work/heap" --field wetness 2>"$work/out"; then fail "a field that is not there"; fi
grep -q "no field 'wetness'" "$work/out" || fail "no reason: $(cat "$work/out")"

# Pictures, and a film where ffmpeg is.
for view in 3d plan y=1; do
  "$lahar" picture "$work/heap" --view "$view" -o "$work/$view.png" >/dev/null
  head -c 8 "$work/$view.png" | cmp -s - <(printf '\211PNG\r\n\032\n') || fail "no PNG of $view"
done
[[ "$("$lahar" picture "$work/heap" --time 0)" == *0000.png ]] || fail "a picture at a chosen time"
"$lahar" picture "$work/slope/second" --field stress_yy --step all | grep -c "pictures/stress_yy_.*png" >/dev/null
"$lahar" picture "$work/slope/second" --field stress_yy -o "$work/second.svg" >/dev/null
grep -q "stress yy" "$work/second.svg" || fail "no label in an SVG"
if "$lahar" picture "$work/heap" --view y=99 2>"$work/out"; then fail "a section outside"; fi
grep -q "no particles at y = 99" "$work/out" || fail "no reason: $(cat "$work/out")"
"$lahar" picture "$work/heap" --map max_thickness >/dev/null
head -c 8 "$work/heap/pictures/max_thickness.png" | cmp -s - <(printf '\211PNG\r\n\032\n') || fail "no PNG of a map"
"$lahar" picture "$work/heap" --map max_thickness -o "$work/map.svg" >/dev/null
grep -q "max thickness" "$work/map.svg" || fail "no label of a map"
if "$lahar" picture "$work/heap" --map depth 2>"$work/out"; then fail "a map that is not there"; fi
grep -q "has no map 'depth'" "$work/out" || fail "no reason: $(cat "$work/out")"
grep -q "it has max_thickness" "$work/out" || fail "no names: $(cat "$work/out")"
if command -v ffmpeg >/dev/null; then
  "$lahar" picture "$work/heap" --film -o "$work/heap.mp4" >/dev/null
  test -s "$work/heap.mp4" || fail "no film"
fi

# Watching: runs that have ended, were killed, or go on.
"$lahar" watch "$work/heap" | grep -q "^finished: step" || fail "an end is not told"
"$lahar" watch "$work/slope" | grep -q "stage second" || fail "the stage is not told"
"$lahar" run "$work/heap.json" -q -t 1 -o "$work/long" --set analysis.end_time=60 2>"$work/out" &
run=$!
until [[ -s "$work/long/history.csv" ]]; do sleep 0.1; done
"$lahar" watch "$work/long" --every 0.2 >"$work/watched" 2>&1 &
watch=$!
for _ in $(seq 600); do
  grep -q " left" "$work/watched" && break
  sleep 0.2
done
kill -KILL "$run"
wait "$run" 2>/dev/null || true
code=0
wait "$watch" || code=$?
[[ "$code" == 3 ]] || fail "watching a killed run ends with $code"
grep -q "%  step .* left" "$work/watched" || fail "no progress: $(cat "$work/watched")"
grep -q "process does not exist any more" "$work/watched" || fail "no end: $(cat "$work/watched")"

# shellcheck source=find_browser.sh
source "$here/find_browser.sh"
"$python" "$here/report_page.py" "$browser" "$work/heap/report.html" "$work/two.html" "$work/stages.html" "$work/nine.html" "$@"
