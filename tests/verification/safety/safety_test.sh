#!/usr/bin/env bash
# Factors of safety against theory and against a published slope: safety_test.sh LAHAR
set -euo pipefail
lahar="$1"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"
bad=0

# factor NAME SCENARIO LOW HIGH [OPTION...]: the middle of the bracket is from LOW to HIGH. Its width
# is $tolerance, 0.004 without one.
factor() {
  local name="$1" scenario="$2" low="$3" high="$4" found
  shift 4
  "$lahar" safety "$scenario" --quiet --tolerance "${tolerance:-0.004}" --output "$name" "$@"
  found="$(awk -F, 'NR > 1 { if ($2) { if ($1 > lo) lo = $1 } else if (!hi || $1 < hi) hi = $1 }
                    END { print (lo + hi) / 2 }' "$name/safety.csv")"
  echo "$name: $found, expected $low to $high"
  awk -v f="$found" -v a="$low" -v b="$high" 'BEGIN { exit !(f >= a && f <= b) }' || bad=1
}

slope="$here/infinite-slope.json"
# Soil that dilates: tan(phi) / tan(b) + c / (gamma H sin(b)) = 1.224, and 2 %.
factor infinite-slope "$slope" 1.200 1.249
# Without dilation, times cos(phi / F) (Davis 1968): 1.169, and 2 %.
factor infinite-slope-without-dilation "$slope" 1.146 1.192 --set /materials/0/dilation=0
# Sand on 20 degrees, phi = 30 degrees: tan(phi) / tan(b) = 1.586, and 2 %.
gravity='[3.4202014332566870,-9.3969262078590838]'
sand=(--set /materials/0/friction=30 --set "external_loading_conditions.gravity=$gravity"
      --set 'mesh.structured.cell_size=[4,0.25]')
factor sand "$slope" 1.554 1.618 "${sand[@]}" --set /materials/0/dilation=30 \
  --set /materials/0/cohesion=0
factor sand-with-100-Pa "$slope" 1.562 1.626 "${sand[@]}" --set /materials/0/dilation=30 \
  --set /materials/0/cohesion=100
# Without dilation 1.477, and 2 %, which half the cell is just within.
tolerance=0.001 factor sand-without-dilation "$slope" 1.448 1.507 "${sand[@]}" \
  --set 'mesh.structured.cell_size=[4,0.125]' --set /materials/0/dilation=0 \
  --set /materials/0/cohesion=0

# Griffiths and Lane 1999: 1.4, and 2 %. Finer cells leave it: it is above the bound below.
factor slope "$here/../../../examples/slope-safety.json" 1.372 1.428
# Bishop and Morgenstern 1960: 1.38, and 2 %. Slips along a logarithmic spiral (Chen 1975) say that
# no factor is above 1.368, whatever the dilation.
factor slope-fine "$here/../../../examples/slope-safety.json" 1.353 1.407 \
  --set mesh.structured.cell_size=0.5
# 0.6 / tan(20) = 1.648, and 2 %: the friction of a rigid slope alone.
factor block-on-slope "$here/block-on-slope.json" 1.615 1.681
# 3.77 to 3.83 c / gamma: 1.414 to 1.436, and 3 %.
factor vertical-cut "$here/vertical-cut.json" 1.372 1.479 --set mesh.structured.cell_size=0.125
exit "$bad"
