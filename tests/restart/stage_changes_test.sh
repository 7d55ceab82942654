#!/usr/bin/env bash
# Stages remove, change and place particles; a run ends when it has come to rest:
# stage_changes_test.sh LAHAR MPIEXEC
set -euo pipefail
lahar="$1"
mpiexec="$2"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"
cp "$here/excavation.json" .
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1

fail() {
  echo "FAILED: $*"
  exit 1
}
run() { "$lahar" run excavation.json --quiet --checkpoint-steps 40 "$@"; }
export_frame() { "$lahar" export "$1" --to csv -o "$2" "${@:3}" >/dev/null; }
# The values of a named column of a CSV file.
column() {
  awk -F, -v name="$2" 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i == name) k = i; next }
                        { print $k }' "$1"
}

run --output one --threads 1
run --output two --threads 2
timeout 300 "$mpiexec" --oversubscribe --bind-to none -n 2 "$lahar" run excavation.json --quiet \
  --checkpoint-steps 40 --output ranks --threads 1
for stage in rest dig fill; do
  export_frame "one/$stage" one.csv
  for way in two ranks; do
    export_frame "$way/$stage" other.csv
    cmp one.csv other.csv || fail "stage $stage differs with $way"
    cmp "one/$stage/history.csv" "$way/$stage/history.csv" || fail "history of $stage, $way"
  done
done

# The first two stages end by themselves, before their end time, and say why.
for stage in rest dig; do
  grep -q '"message": "at rest after' "one/$stage/manifest.json" || fail "$stage is not at rest"
done
grep -q "at rest after 1 steps" one/rest/log.txt || fail "level ground with K0 is not in balance"

# Masses: 8 x 2 m^2 of sand are removed, half of them are placed again, 1.5 m^2 become heavier.
first_mass() { column "one/$1/history.csv" mass | head -1; }
awk -v a="$(column one/rest/history.csv mass | tail -1)" -v b="$(first_mass dig)" \
  -v c="$(first_mass fill)" 'function off(x, y) { d = x - y; return d * d > 1e-6 }
  END { exit off(b, a - 8 * 1800 + 1.5 * 400) || off(c, b + 4 * 1800) }' </dev/null ||
  fail "masses: $(first_mass rest) $(first_mass dig) $(first_mass fill)"
grep -q "128 particles (14400 kg) removed" one/dig/log.txt || fail "$(cat one/dig/log.txt)"
grep -q "24 particles (3300 kg) became grout" one/dig/manifest.json || fail "grout in the manifest"
grep -q "64 particles (7200 kg) placed" one/fill/log.txt || fail "$(cat one/fill/log.txt)"

# What the floor bears is the weight, whatever the stage before did.
for stage in rest dig; do
  awk -v force="$(column "one/$stage/gauges/floor.csv" "force_y [N]" | tail -1)" -v mass="$(first_mass $stage)" \
    'BEGIN { share = -force / (mass * 9.81); exit !(share > 0.98 && share < 1.02) }' ||
    fail "force on the floor in $stage: $(tail -1 "one/$stage/gauges/floor.csv")"
  cmp "one/$stage/gauges/floor.csv" "ranks/$stage/gauges/floor.csv" || fail "gauge of $stage, ranks"
done

# Particles keep their ids, and new ones have those above all.
column one.csv id | sort -n >ids.txt
[[ "$(wc -l <ids.txt)" == 576 && "$(tail -1 ids.txt)" == 703 && "$(sed -n 513p ids.txt)" == 640 ]] ||
  fail "ids $(wc -l <ids.txt), $(sed -n 512,513p ids.txt), $(tail -1 ids.txt)"

# Displacements begin anew, and what is placed has its own stress.
export_frame one/fill start.csv --step 0
column start.csv displacement_y | awk '$1 != 0 { exit 1 }' || fail "displacements were not reset"
paste <(column start.csv id) <(column start.csv stress_yy) |
  awk '$1 >= 640 && $2 != -100 { exit 1 }' || fail "placed particles have another stress"

# A run that stopped in its last stage goes on there, with what it had changed.
cp -r one stopped
sed -i 's/"status": "finished"/"status": "stopped"/' stopped/fill/manifest.json
rm "$(ls stopped/fill/checkpoints/*.h5 | tail -1)"
run --output stopped --restart latest
export_frame one/fill one.csv
export_frame stopped/fill other.csv
cmp one.csv other.csv || fail "the run that stopped in its last stage ends otherwise"
cmp one/fill/history.csv stopped/fill/history.csv || fail "its history is another one"

# A stage that came to rest has ended: a restart takes no step.
cp -r one again
steps="$(grep '"steps"' again/dig/manifest.json | tail -1)"
"$lahar" run excavation.json --quiet --checkpoint-steps 40 --output again \
  --restart "$(ls again/dig/checkpoints/*.h5 | tail -1)"
[[ "$(grep '"steps"' again/dig/manifest.json | tail -1)" == "$steps" ]] ||
  fail "a stage at rest took more steps"

refused() {
  local change="$1" expected="$2" status=0
  "$lahar" check excavation.json --set "$change" >out.txt 2>&1 || status=$?
  [[ "$status" == 2 ]] && grep -q -- "$expected" out.txt ||
    fail "$change: status $status, $(cat out.txt)"
}
refused 'stages.0.remove=[{"region":{"box":{"min":[0,0],"max":[1,1]}}}]' \
  "'remove' is not for the first stage"
refused 'stages.1.remove=[{}]' "which particles?"
refused 'stages.1.remove=[{"pset":"walls"}]' "walls"
refused 'stages.1.change_material=[{"pset":"wall","material":"rock"}]' "rock"
refused 'stages.1.reset=["stress"]' "'reset' knows"
refused 'stages.2.place=[{"generator":{"type":"gauss","cset_id":-1,"nparticles_per_dir":2,
  "material":"sand"}}]' 'a stage can place particles of type "region"'
refused 'stages.2.analysis.until={"imbalance":0}' "'imbalance' must be greater than 0"
refused 'mesh.particles_stresses={"type":"k0"}' "'k0' is missing for the material"
refused 'mesh.particles_stresses.k0="jacky"' "'k0'.*jaky"
refused 'external_loading_conditions.gravity=[1,-9.81]' '"k0" needs gravity along an axis'

# A stage that removes all particles says so.
cat >gone.json <<'END'
{"mesh": {"structured": {"cell_size": 0.5, "counts": [2, 2]}},
 "materials": [{"name": "sand", "type": "LinearElastic", "density": 1800, "youngs_modulus": 1e7,
                "poisson_ratio": 0.3}],
 "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "sand"}}],
 "analysis": {"nsteps": 2},
 "stages": [{"name": "there"}, {"name": "gone", "remove": [{"region": {"all": true}}]}]}
END
"$lahar" run gone.json --quiet --threads 1 --output gone >gone.txt 2>&1 || fail "$(cat gone.txt)"
grep -q "the stage removes all particles" gone.txt gone/gone/log.txt || fail "$(cat gone.txt)"

# A stage that is added when the ones before have run, and changes a material, says what it lacks.
"$lahar" run gone.json --quiet --threads 1 --checkpoint-steps 1 --output later \
  --set 'stages=[{"name":"there"}]' >later.txt 2>&1 || fail "$(cat later.txt)"
soft='{"name":"soft","materials":[{"name":"sand","type":"LinearElastic","density":1800,
  "youngs_modulus":1e6,"poisson_ratio":0.3}]}'
"$lahar" run gone.json --quiet --threads 1 --output later --restart latest \
  --set "stages=[{\"name\":\"there\"},$soft]" >later.txt 2>&1 || fail "$(cat later.txt)"
grep -q "stage soft: strains begin at zero" later.txt || fail "lost strains are not told of"

# A stage that places particles where others are says so, with how many.
"$lahar" run gone.json --quiet --threads 1 --output twice --set 'stages=[{"name":"there"},
  {"name":"twice","place":[{"generator":{"type":"region","material":"sand","per_cell":2,
   "region":{"all":true}}}]}]' >twice.txt 2>&1 || fail "$(cat twice.txt)"
grep -q "stage twice: 'place' puts .* particles where others are" twice.txt ||
  fail "material that is there twice is not told of: $(cat twice.txt)"
