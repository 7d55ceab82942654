#!/usr/bin/env bash
# Runs on several ranks that are stopped or lose a rank go on, on other ranks, and end as the one
# that was left alone on one: ranks_test.sh LAHAR MPIEXEC [KILLS]
set -euo pipefail
lahar="$1"
mpiexec="$2"
kills="${3:-2}"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"
cp "$here/water.json" .
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
RANDOM=7
common=(run water.json --quiet --set analysis.nsteps=300)

fail() {
  echo "FAILED: $*"
  exit 1
}
# A run on so many ranks, its errors in errors.txt.
run_on() {
  local ranks="$1"
  shift
  timeout 120 "$mpiexec" --oversubscribe --bind-to none -n "$ranks" \
    "$lahar" "${common[@]}" --threads 1 "$@" >/dev/null 2>errors.txt
}
# A process that PROCESS started, if there is one; without ps, which small systems lack.
child_of() {
  local status
  for status in /proc/[0-9]*/status; do
    if grep -qs "^PPid:[[:space:]]*$1\$" "$status"; then
      status="${status#/proc/}"
      echo "${status%/status}"
      return
    fi
  done
}
# Files of a run in which all results are, and the file's name is the step.
compare_finished() {
  local file
  for file in "$1"/frames/particles_*.hdf "$1"/checkpoints/checkpoint_*.h5; do
    [[ -e "$file" && -e "whole/${file#"$1"/}" ]] || continue
    cmp "$file" "whole/${file#"$1"/}" || fail "$file is not that of the undisturbed run"
  done
}
compare_with_whole() {
  cmp whole/history.csv "$1/history.csv" || fail "$1 has another history"
  cmp whole/frames/particles.hdf.series "$1/frames/particles.hdf.series" ||
    fail "$1 has another series"
  for folder in frames checkpoints; do
    [[ -z "$(comm -23 <(ls "whole/$folder") <(ls "$1/$folder"))" ]] || fail "$1 misses $folder"
  done
  compare_finished "$1"
}

"$lahar" "${common[@]}" --threads 2 --output whole
run_on 3 --output three || fail "3 ranks: $(cat errors.txt)"
compare_with_whole three

# Stopped by time again and again, on 2, 3, 4 ... ranks.
status=75
restart=()
for ((ranks = 2; status == 75 && ranks < 40; ++ranks)); do
  status=0
  run_on "$((2 + ranks % 3))" --output stopped --wall-time 1 "${restart[@]}" || status="$?"
  [[ "$status" == 75 || "$status" == 0 ]] || fail "ended with $status: $(cat errors.txt)"
  restart=(--restart latest)
done
[[ "$status" == 0 ]] || fail "the run does not come to an end"
compare_with_whole stopped

# A rank is killed.
killed=0
while [[ "$killed" -lt "$kills" ]]; do
  restart=(--overwrite)
  compgen -G "killed/checkpoints/checkpoint_*.h5" >/dev/null && restart=(--restart latest)
  "$mpiexec" --oversubscribe --bind-to none -n "$((2 + killed % 2))" \
    "$lahar" "${common[@]}" --threads 1 --staging "$((killed % 2))GiB" --output killed \
    "${restart[@]}" >/dev/null 2>&1 &
  job="$!"
  sleep "$((1 + RANDOM % 2)).$((RANDOM % 10))"
  rank="$(child_of "$job")"
  if [[ -n "$rank" ]]; then kill -KILL "$rank" 2>/dev/null || true; fi
  wait "$job" 2>/dev/null || true
  killed="$((killed + 1))"
  compare_finished killed
done
restart=(--overwrite)
compgen -G "killed/checkpoints/checkpoint_*.h5" >/dev/null && restart=(--restart latest)
"$lahar" "${common[@]}" --threads 2 --output killed "${restart[@]}"
compare_with_whole killed
