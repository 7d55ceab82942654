#!/usr/bin/env bash
# The page of a recorded run of 2 ranks x 2 threads, in Chromium, which is installed where there is
# root, apt and no LAHAR_NO_INSTALL. Exit status 77: there is no Chromium.
#
#     trace_test.sh LAHAR MPIEXEC PYTHON [--screenshot FILE.png]
set -euo pipefail
lahar="$1"
mpiexec="$2"
python="$3"
shift 3
here="$(cd "$(dirname "$0")" && pwd)"
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

# shellcheck source=find_browser.sh
source "$here/find_browser.sh"

cat >"$work/soil.json" <<'END'
{"title": "Block of soil",
 "mesh": {"structured": {"cell_size": 0.1, "extent": [2.0, 2.0, 2.0]}},
 "materials": [{"type": "MohrCoulomb3D", "density": 1000, "youngs_modulus": 1e6,
   "poisson_ratio": 0.3, "friction": 30, "dilation": 5, "cohesion": 0.1, "tension_cutoff": 0,
   "softening": false}],
 "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
   "region": {"box": {"min": [0.2, 0.2, 0.2], "max": [1.8, 1.8, 1.2]}}}}],
 "external_loading_conditions": {"gravity": [0, 0, -9.81]},
 "analysis": {"mpm_scheme": "usl", "dt": 1e-4, "nsteps": 40},
 "post_processing": {"output_steps": 20}}
END
"$mpiexec" --oversubscribe --bind-to none -n 2 "$lahar" run "$work/soil.json" -t 2 -o "$work/run" \
  --trace >"$work/out" 2>&1 || { cat "$work/out"; exit 1; }
"$lahar" trace "$work/run" --html "$work/page.html"
"$python" "$here/trace_page.py" "$browser" "$work/page.html" "$@"

# What cannot be written is said.
if "$lahar" trace "$work/run" --html "$work/none/page.html" 2>"$work/out"; then
  echo "FAILED: a page was written into a folder that is not there"
  exit 1
fi
grep -q "cannot write .*page.html: No such file" "$work/out" || { cat "$work/out"; exit 1; }
