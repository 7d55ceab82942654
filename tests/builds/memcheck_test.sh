#!/usr/bin/env bash
# Small runs of two ranks use no memory that is not theirs, and none that has no value, from the start
# to the end: memcheck_test.sh SOURCE LAHAR MPIEXEC FOLDER
# Valgrind runs LAHAR where it knows its instructions; else a program without AVX-512, built in FOLDER.
set -euo pipefail
source="$1"
lahar="$2"
mpiexec="$3"
folder="$4"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fail() {
  echo "FAILED: $*"
  exit 1
}
if ! command -v valgrind >/dev/null; then
  echo "valgrind is not installed: nothing is tested"
  exit 77
fi
mkdir -p "$folder"

if ! valgrind -q "$lahar" --version >/dev/null 2>&1; then
  arch=""
  if [[ "$(uname -m)" == x86_64 ]] && grep -q -w avx2 /proc/cpuinfo; then arch=x86-64-v3; fi
  cmake -S "$source" -B "$folder/build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DLAHAR_TESTS=OFF \
    -DLAHAR_PYTHON=OFF -DLAHAR_NATIVE=OFF -DLAHAR_ARCH="$arch" \
    -DCMAKE_CXX_FLAGS_RELEASE="-O1 -g1 -DNDEBUG" >"$folder/build.txt"
  cmake --build "$folder/build" --target lahar >>"$folder/build.txt" || fail "no build for valgrind"
  lahar="$folder/build/lahar"
  valgrind -q "$lahar" --version >/dev/null || fail "valgrind does not run $lahar"
fi

suppressions=(--suppressions="$here/../valgrind.supp")
# Open MPI's own, where the system has them.
for file in /usr/share/openmpi/openmpi-valgrind.supp /usr/lib64/openmpi/share/openmpi/openmpi-valgrind.supp; do
  if [[ -e "$file" ]]; then suppressions+=(--suppressions="$file"); fi
done

# run NAME SCENARIO OPTION...: on two ranks, each of which has a report of valgrind.
run() {
  local name="$1" scenario="$2" status=0 reports
  shift 2
  rm -f "$folder/$name".*.txt
  "$mpiexec" --oversubscribe --bind-to none -n 2 valgrind --error-exitcode=99 --num-callers=40 \
    --leak-check=full --show-leak-kinds=definite --errors-for-leak-kinds=definite \
    "${suppressions[@]}" --log-file="$folder/$name.%p.txt" \
    "$lahar" run "$scenario" --threads 2 --output "$folder/$name" "$@" >"$folder/$name.txt" 2>&1 ||
    status="$?"
  reports=("$folder/$name".*.txt)
  if [[ "$status" != 0 ]]; then
    cat "$folder/$name.txt" "${reports[@]}"
    fail "$name: status $status"
  fi
  [[ "$(grep -l "ERROR SUMMARY: 0 errors" "${reports[@]}" | wc -l)" == 2 ]] ||
    fail "$name: valgrind has not looked at both ranks"
}

few=(--set analysis.patch_particles=40 --set post_processing.output_steps=3)
run tank "$source/tests/ranks/tank.json" --overwrite "${few[@]}" --set analysis.nsteps=12 \
  --checkpoint-steps 5 --balance 4 --trace
run tank "$source/tests/ranks/tank.json" --restart latest "${few[@]}" --set analysis.nsteps=16
run block "$source/tests/ranks/implicit.json" --overwrite --set analysis.nsteps=2
run water "$source/tests/ranks/projection.json" --overwrite --set analysis.nsteps=3
echo "no errors"
