#!/usr/bin/env bash
# Builds of one instruction set give the same bits at any level of optimisation:
# equal_bits_test.sh SOURCE LAHAR FOLDER [LEVEL...]
# LAHAR is the program at -O3; programs at the other levels (-O1 -O2) are built in FOLDER.
set -euo pipefail
source="$1"
lahar="$2"
folder="$3"
shift 3
levels=("${@:-O1}")
[[ $# -gt 0 ]] || levels=(O1 O2)
fail() {
  echo "FAILED: $*"
  exit 1
}

# Functions, transfers, schemes and laws: a name, an example, and what is set in it.
cases=(
  "plate plate-with-hole.json analysis.nsteps=40"
  "bar vibrating-bar.json analysis.nsteps=200"
)
short_sand="column-collapse.json analysis.end_time=0.1 post_processing.output_steps=100"
short_water="dam-break.json analysis.end_time=0.05 post_processing.output_dt=0.01"
short_discs="two-discs.json analysis.end_time=1.6"
for functions in element gimp cpdi cpdi2 quadratic_spline cubic_spline; do
  cases+=("sand-$functions $short_sand analysis.shape_functions=$functions")
done
for functions in element quadratic_spline; do
  cases+=("water-$functions $short_water analysis.shape_functions=$functions")
done
for transfer in flip pic apic tpic xpic fmpm; do
  cases+=("sand-$transfer $short_sand analysis.velocity_update=$transfer")
done
for scheme in usf usl musl; do
  cases+=("discs-$scheme $short_discs analysis.mpm_scheme=$scheme")
done

# run_all LAHAR FOLDER
run_all() {
  local program="$1" to="$2" line name scenario settings setting options law
  rm -rf "$to"
  mkdir -p "$to"
  for line in "${cases[@]}"; do
    read -r name scenario settings <<<"$line"
    options=()
    for setting in $settings; do options+=(--set "$setting"); done
    "$program" run "$source/examples/$scenario" --quiet --output "$to/$name" "${options[@]}" ||
      fail "$name does not run at all"
  done
  for law in clay sand triaxial; do
    "$program" material "$source/examples/material/$law.json" -o "$to/material-$law" >"$to/$law.txt"
  done
}

# All that the laws and the steps compute; who wrote it is in other files.
results() {
  (cd "$1" && find . -name 'particles_*.hdf' -o -name '*.csv' | sort)
}

mkdir -p "$folder"
run_all "$lahar" "$folder/O3-runs"
files="$(results "$folder/O3-runs")"
[[ "$(wc -l <<<"$files")" -gt 40 ]] || fail "too few results: $files"
status=0
for level in "${levels[@]}"; do
  cmake -S "$source" -B "$folder/$level" -G Ninja -DCMAKE_BUILD_TYPE=Release -DLAHAR_TESTS=OFF \
    -DCMAKE_CXX_FLAGS_RELEASE="-$level -DNDEBUG" >"$folder/$level.txt"
  cmake --build "$folder/$level" --target lahar >>"$folder/$level.txt" || fail "no build at -$level"
  run_all "$folder/$level/lahar" "$folder/$level-runs"
  [[ "$(results "$folder/$level-runs")" == "$files" ]] || fail "-$level writes other files"
  differing=0
  for file in $files; do
    if ! cmp -s "$folder/O3-runs/$file" "$folder/$level-runs/$file"; then
      echo "-$level gives other bits than -O3: $file"
      differing=$((differing + 1))
    fi
  done
  echo "-$level: $differing of $(wc -l <<<"$files") files differ from those of -O3"
  [[ "$differing" == 0 ]] || status=1
done
exit "$status"
