#!/usr/bin/env bash
# Stages begin with the exact state in which the ones before ended: stages_test.sh LAHAR MPIEXEC
set -euo pipefail
lahar="$1"
mpiexec="$2"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"
cp "$here/stages.json" .
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1

fail() {
  echo "FAILED: $*"
  exit 1
}
run() { "$lahar" run stages.json --quiet "$@"; }
# All columns of the last frame, in every digit.
last_frame() { "$lahar" export "$1" --to csv -o "$2" >/dev/null; }
same_frames() { cmp "$1" "$2" || fail "$3"; }

# One run cut in two has the bits of that run: with FLIP, and with affine columns.
half='stages=[{"name":"first","analysis":{"nsteps":200}},{"name":"second","analysis":{"nsteps":200}}]'
for transfer in flip apic; do
  options=(--set analysis.velocity_update="$transfer")
  run "${options[@]}" --output "whole-$transfer" --threads 2
  run "${options[@]}" --set "$half" --output "cut-$transfer" --threads 1
  last_frame "whole-$transfer" whole.csv
  last_frame "cut-$transfer/second" cut.csv
  same_frames whole.csv cut.csv "two stages with $transfer are not the one run"
done

# Threads and ranks, with schemes, materials and transfers that differ between the stages.
other='stages=[{"name":"first","analysis":{"nsteps":150}},
  {"name":"second","analysis":{"nsteps":100,"mpm_scheme":"musl","velocity_update":"apic"}},
  {"name":"third","analysis":{"nsteps":100,"mpm_scheme":"usf","velocity_update":"flip"},
   "external_loading_conditions":{"gravity":[2,-9.81]}}]'
run --set "$other" --output one --threads 1
run --set "$other" --output two --threads 2
timeout 120 "$mpiexec" --oversubscribe --bind-to none -n 2 "$lahar" run stages.json --quiet \
  --set "$other" --output ranks --threads 1
for stage in first second third; do
  last_frame "one/$stage" one.csv
  for way in two ranks; do
    last_frame "$way/$stage" other.csv
    same_frames one.csv other.csv "stage $stage differs with $way"
    cmp "one/$stage/history.csv" "$way/$stage/history.csv" || fail "history of $stage, $way"
  done
done

# A run that stopped in its second stage goes on there.
run --set "$other" --output stopped --checkpoint-steps 40
rm -r stopped/third
sed -i 's/"status": "finished"/"status": "stopped"/' stopped/second/manifest.json
rm stopped/second/checkpoints/checkpoint_0000000100.h5
run --set "$other" --output stopped --checkpoint-steps 40 --restart latest
grep -q '"step": 80' stopped/second/manifest.json || fail "the second stage did not go on from step 80"
last_frame stopped/third other.csv
last_frame one/third one.csv
same_frames one.csv other.csv "the run that stopped in its second stage ends otherwise"

# At rest by quasi-static steps; explicit steps without damping leave it there.
rest='stages=[{"name":"rest","analysis":{"mpm_scheme":"newmark","scheme_settings":{"quasi_static":true},
  "dt":0.1,"nsteps":10}},{"name":"stay","analysis":{"mpm_scheme":"usl","scheme_settings":null,
  "dt":5e-4,"nsteps":200}}]'
strong=(--set materials.0.cohesion=1e5 --set materials.0.tension_cutoff=1e4
        --set materials.0.residual_cohesion=1e5 --set analysis.b_bar=false)
run --set "$rest" "${strong[@]}" --output rest
# 800 kg/m fall through 0.4 m: 3139 J/m.
awk -F, 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i ~ /^kinetic/) k = i }
         NR > 1 && $k > 1e-10 * 3139 { print "kinetic energy " $k; bad = 1 }
         END { exit bad || !k }' rest/stay/history.csv || fail "the block does not stay at rest"

# Messages: what is wrong, where, and what is allowed.
refused() {
  local stages="$1" expected="$2" status=0
  "$lahar" check stages.json --set "stages=$stages" >out.txt 2>&1 || status=$?
  [[ "$status" == 2 ]] && grep -q -- "$expected" out.txt ||
    fail "$stages: status $status, $(cat out.txt)"
}
refused '[{"name":"a"},{"name":"a"}]' 'two stages have the name "a"'
refused '[{"analysis":{}}]' "'name' is missing in a stage"
refused '[{"name":"../a"}]' "'name' must be the name of a folder"
refused '[]' "'stages' must be an array of objects"
refused '[{"name":"a","particles":[]}]' "'particles' is the same in all stages"
refused '[{"name":"a","mesh":{"structured":{}}}]' "'mesh.structured' is the same in all stages"
refused '[{"name":"a"},{"name":"b","analysis":{"dtt":1}}]' "stage b: unknown key 'dtt' in analysis"
refused '[{"name":"a"},{"name":"b","analysis":{"shape_functions":"gimp"}}]' \
  "stage b: 'analysis.shape_functions'"
refused '[{"name":"a"},{"name":"b","analysis":{"plane":"stress"}}]' "stage b: 'analysis.plane'"
refused '[{"name":"a"},{"name":"b","materials":[{"name":"soil","type":"LinearElastic",
  "density":2000,"youngs_modulus":1e6,"poisson_ratio":0.3}]}]' "'type' of a material is the same"
refused '[{"name":"a"},{"name":"b","analysis":{"nsteps":null}}]' "stage b: .*nsteps"
"$lahar" check stages.json --set "$other" >out.txt || fail "check refuses the stages"
grep -q "^stage      2 of 3: second" out.txt || fail "check does not say the stages"

# A key of a stage's text is found on its line.
sed 's|"post_processing": {|"stages": [\n  {"name": "a"},\n  {"name": "b", "analysis": {"nstep": 1}}],\n  &|' \
  stages.json >typo.json
line="$(grep -n '"nstep"' typo.json | cut -d: -f1)"
"$lahar" check typo.json >out.txt 2>&1 && fail "a misspelt key is accepted"
grep -q "typo.json:$line:.*stage b: unknown key 'nstep'" out.txt || fail "$(cat out.txt)"
