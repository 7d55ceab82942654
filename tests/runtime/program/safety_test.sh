#!/bin/bash
# `lahar safety` as users have it: a coarse vertical cut, on any threads and ranks, and what it
# refuses.
#
#     safety_test.sh LAHAR MPIEXEC
set -u
lahar="$1"
mpiexec="$2"
here="$(cd "$(dirname "$0")" && pwd)"
cut="$here/../../verification/safety/vertical-cut.json"
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
failed=0

fail() {
  echo "FAILED: $1"
  tail -n 20 "$work/out" | sed "s/^/    /"
  failed=1
}
# safety NAME OPTION...: the factor of the cut with 4 cells over its height, in $work/NAME.
safety() {
  local name="$1"
  shift
  "${launch[@]}" timeout -k 5 240 "$lahar" safety "$cut" --tolerance "${tolerance:-0.02}" -o "$work/$name" \
    --set mesh.structured.cell_size=1 --set analysis.patch_particles=60 "$@" >"$work/out" 2>&1
}
# same NAME: its trials are those of `one`, to the last bit.
same() {
  cmp -s "$work/one/safety.csv" "$work/$1/safety.csv" || fail "trials of $1 differ"
}

launch=()
safety one -t 1 || fail "one thread"
# Cells of H / 4 are 18 % too strong; the trials that fail have moved.
awk -F, 'NR > 1 { if ($2) { if ($1 > lo) lo = $1 } else { if (!hi || $1 < hi) hi = $1 }
                  if (!$2 && $5 == "equilibrium" || $2 && $5 != "equilibrium") bad = 1 }
         END { exit bad || !(lo > 1.55 && hi < 1.85 && hi - lo < 0.04) }' "$work/one/safety.csv" ||
  fail "the factor of the cut: $(tr '\n' ' ' <"$work/one/safety.csv")"
grep -q "factor of safety 1\.[5-8]" "$work/out" || fail "the factor is not said"
[ -f "$work/one/mechanism/manifest.json" ] || fail "there is no mechanism"
safety one -t 1 && fail "earlier results are replaced without being asked"
grep -q "holds the results of an earlier search" "$work/out" &&
  grep -q -- "add --restart latest to continue it, --overwrite to replace them" "$work/out" ||
  fail "it does not say what to do with earlier results"
safety none -t 1 --restart latest && fail "a search goes on that never began"
grep -q "holds no search that could be continued" "$work/out" || fail "it does not say what is missing"
safety broken -t 1 --set materials.0.yield_stress=20000 && fail "a run that failed is used"
grep -q "no equilibrium with full strength" "$work/out" || fail "it does not say why there is no factor"
grep -q '"status": "failed"' "$work/broken/safety.json" || fail "the record does not say that it failed"
safety two -t 2 || fail "two threads"
same two
# A search that is stopped or killed keeps its trials, and goes on with them: to the same files.
for signal in TERM KILL; do
  rm -rf "$work/stopped"
  (exec "$lahar" safety "$cut" --tolerance 0.02 -t 1 --set mesh.structured.cell_size=1 \
    --set analysis.patch_particles=60 -o "$work/stopped" >"$work/out" 2>&1) &
  search=$!
  for _ in $(seq 2000); do
    [ -f "$work/stopped/safety.csv" ] && [ "$(wc -l <"$work/stopped/safety.csv")" -ge 3 ] && break
    sleep 0.01
  done
  kill -s "$signal" "$search"
  wait "$search" 2>/dev/null
  status=$?
  [ "$signal" = KILL ] || [ "$status" = 75 ] || fail "a search that is stopped ends with $status"
  rows="$(wc -l <"$work/stopped/safety.csv")"
  [ "$rows" -ge 3 ] && [ "$rows" -lt "$(wc -l <"$work/one/safety.csv")" ] ||
    fail "$signal leaves $rows rows"
  if [ "$signal" = TERM ]; then
    grep -q "To continue: the same command with --restart latest" "$work/out" ||
      fail "it does not say how to go on"
    safety stopped -t 1 --restart latest --set materials.0.yield_stress=40000 &&
      fail "a search goes on with another strength"
    grep -q "/materials/0/yield_stress is 40000" "$work/out" || fail "it does not say what differs"
  fi
  equilibrium="$(stat -c %Y.%i "$work"/stopped/equilibrium/manifest.json)"
  safety stopped -t 2 --restart latest || fail "a search does not go on after $signal"
  [ "$(stat -c %Y.%i "$work"/stopped/equilibrium/manifest.json)" = "$equilibrium" ] ||
    fail "the equilibrium is made again"
  same stopped
done
# One that has finished goes on to a narrower bracket.
tolerance=0.01 safety stopped -t 1 --restart latest || fail "a narrower bracket"
rows="$(wc -l <"$work/one/safety.csv")"
cmp -s "$work/one/safety.csv" <(head -n "$rows" "$work/stopped/safety.csv") ||
  fail "a narrower bracket has other trials"
[ "$(wc -l <"$work/stopped/safety.csv")" -gt "$rows" ] || fail "the bracket is no narrower"
# Trials of another equilibrium are not taken.
safety stopped -t 1 --restart latest --set analysis.nsteps=12 || fail "a longer run to equilibrium"
grep -q "Earlier trials began with another state" "$work/out" || fail "trials of another state are kept"

"$lahar" report "$work/stopped" >"$work/out" 2>&1 || fail "there is no report"
grep -q "How far the body moved in each trial" "$work/stopped/report.html" || fail "a report without trials"

launch=("$mpiexec" --oversubscribe --bind-to none -n 2)
safety ranks -t 1 || fail "two ranks"
same ranks
head -n 4 "$work/one/safety.csv" >"$work/ranks/safety.csv"
safety ranks -t 1 --restart latest || fail "two ranks that go on"
same ranks

# Water that moves in the pores of level ground is no failure.
cat >"$work/wet.json" <<'END'
{
  "mesh": {"structured": {"cell_size": 1, "extent": [6, 5]},
    "boundary_conditions": {"velocity_constraints": [
      {"nset": "base", "dir": "x", "velocity": 0}, {"nset": "base", "dir": "y", "velocity": 0},
      {"nset": "sides", "dir": "x", "velocity": 0}]},
    "particles_pore_pressures": {"type": "water_table", "water_tables":
      [{"position": 0, "h0": 3}, {"position": 6, "h0": 3}]},
    "particles_stresses": {"type": "k0", "k0": "jaky"}},
  "sets": {"nodes": {
    "base": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
    "sides": {"union": [{"half_space": {"point": [0, 0], "normal": [1, 0]}},
                        {"half_space": {"point": [6, 0], "normal": [-1, 0]}}]}}},
  "particles": [{"generator": {"type": "region", "per_cell": 2, "material": ["soil", "water"],
    "region": {"box": {"min": [0, 0], "max": [6, 3]}}}}],
  "materials": [
    {"name": "soil", "type": "MohrCoulomb", "density": 2650, "youngs_modulus": 2e7,
     "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 5000, "tension_cutoff": 0,
     "porosity": 0.4, "k_x": 1e-3},
    {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 5e7,
     "dynamic_viscosity": 1e-3}],
  "external_loading_conditions": {"gravity": [0, -10]},
  "analysis": {"end_time": 20, "damping": {"type": "Cundall", "damping_factor": 0.7},
               "until": {"imbalance": 0.005, "kinetic_energy": 0.001}}
}
END
launch=()
timeout -k 5 240 "$lahar" safety "$work/wet.json" --most 2 --tolerance 0.5 -t 1 -o "$work/wet" \
  >"$work/out" 2>&1 || fail "wet ground"
grep -q "the factor of safety is above 2" "$work/out" || fail "wet ground at rest fails"

# What a rigid slope does to a strong block is divided as well: 0.6 / tan(20) = 1.648.
block="$here/../../verification/safety/block-on-slope.json"
block_with() {
  timeout -k 5 240 "$lahar" safety "$block" --tolerance 0.02 -t 1 "$@" >"$work/out" 2>&1
}
block_with -o "$work/block" || fail "a block on a slope"
grep -q "divided    material 'block'; friction and cohesion of rigid body 'slope'" "$work/out" ||
  fail "it does not say what is divided"
grep -q "factor of safety 1\.6[1-9]" "$work/out" || fail "the factor of a block on a slope"
elastic='{"name": "block", "type": "LinearElastic", "density": 2000, "youngs_modulus": 1e7,
          "poisson_ratio": 0.2}'
block_with -o "$work/rough" --set "/materials/0=$elastic" --set '/rigid_bodies/0/friction="rough"' &&
  fail "nothing to divide is accepted"
grep -q "nothing has a strength that can be reduced" "$work/out" || fail "rough has a strength"

# A free rigid body that slides has failed, and walls under it are divided: 0.6 / tan(15) = 2.239.
cat >"$work/boulder.json" <<'END'
{
  "mesh": {"structured": {"cell_size": 0.1, "extent": [4, 1.4]},
    "boundary_conditions": {
      "walls": [{"nset": "floor", "normal": [0, 1], "friction": 0.6}],
      "velocity_constraints": [{"nset": "right", "dir": "x", "velocity": 0}]}},
  "sets": {"nodes": {
    "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
    "right": {"box": {"min": [2.5, -1], "max": [4, 4]}}}},
  "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "sand",
    "region": {"box": {"min": [2.6, 0], "max": [3, 0.4]}}}}],
  "materials": [{"name": "sand", "type": "MohrCoulomb", "density": 1800, "youngs_modulus": 1e7,
    "poisson_ratio": 0.3, "friction": 40, "dilation": 0, "cohesion": 1e5, "tension_cutoff": 1e4}],
  "rigid_bodies": [{"name": "boulder", "density": 2000, "friction": 0,
    "region": {"box": {"min": [0.5, 0], "max": [1.5, 0.4]}}}],
  "external_loading_conditions": {"gravity": [2.539014832455729, -9.475732355895762]},
  "analysis": {"end_time": 4, "damping": {"type": "Cundall", "damping_factor": 0.7},
               "until": {"imbalance": 0.001}}
}
END
timeout -k 5 240 "$lahar" safety "$work/boulder.json" --tolerance 0.02 -t 1 -o "$work/boulder" \
  >"$work/out" 2>&1 || fail "a boulder on a slope"
grep -q "factor of safety 2\.2[2-5]" "$work/out" || fail "the factor of a boulder on a slope"

safety few --set analysis.scheme_settings.quasi_static=false && fail "steps with inertia are taken"
grep -q "the factor of safety is looked for from an equilibrium" "$work/out" ||
  fail "it does not say that there is no equilibrium"
exit "$failed"
