#!/usr/bin/env bash
# Runs whose linear solver ends before it has a solution, as users have them: exit status 3, a message
# that says which system, after how many iterations, what is left and where, and a state to go on
# from: unsolved_test.sh LAHAR MPIEXEC
set -u
lahar="$1"
mpiexec="$2"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
failed=0

fail() {
  echo "FAILED: $1"
  tail -n 20 out | sed "s/^/    /"
  failed=1
}

# Soil or water, 0.5 x 0.8 m in a mesh of 1 x 1 m: node i lies at (i % 11, i / 11) tenths of a metre.
scenario() {
  cat <<END
{
  "mesh": {"structured": {"cell_size": 0.1, "extent": [1, 1]},
    "boundary_conditions": {"velocity_constraints": [
      {"nset": "floor", "dir": "x", "velocity": 0}, {"nset": "floor", "dir": "y", "velocity": 0}]}},
  "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
  "materials": [$1],
  "particles": [{"generator": {"type": "region", "material": 0, "per_cell": 2,
    "region": {"box": {"min": [0, 0], "max": [0.5, 0.8]}}}}],
  "external_loading_conditions": {"gravity": [0, -9.81]},
  "analysis": {$2, "linear_solver": {"solver_type": "IterativeEigen"}}
}
END
}
scenario '{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e7, "poisson_ratio": 0.3}' \
  '"mpm_scheme": "newmark", "dt": 0.5, "nsteps": 2, "scheme_settings": {"quasi_static": true}' \
  >implicit.json
scenario '{"type": "Newtonian", "density": 1000, "bulk_modulus": 1e8, "dynamic_viscosity": 1e-3}' \
  '"mpm_scheme": "projection", "dt": 0.002, "nsteps": 2' >projection.json

# Two steps go well; the third does not, with two iterations. number='...' of what is printed.
number='[0-9.e+-]+'
place="node ([0-9]+) \(($number), ($number)\)"
check() {
  local name="$1" system="$2" unit="$3"
  local run=("$lahar" run "$name.json" -t 1)
  local more=(--restart latest --set analysis.nsteps=3)
  "${run[@]}" -o "$name" --checkpoint-steps 1 >out 2>&1 || fail "$name: the first two steps"
  cp -r "$name" "$name-ranks"
  "${run[@]}" -o "$name" "${more[@]}" --set analysis.linear_solver.max_iter=2 >out 2>&1
  [[ $? == 3 ]] || fail "$name: the exit status is not 3"
  grep "error: step 3 " out >message || fail "$name: there is no message of the third step"
  local solver="$system: (conjugate gradients|BiCGStab): too many iterations"
  solver+=" \(2 iterations, relative residual ($number)\); most is left at $place, ($number) $unit"
  if ! [[ "$(cat message)" =~ $solver ]]; then
    fail "$name: the message is $(cat message)"
    return
  fi
  awk -v left="${BASH_REMATCH[2]}" -v node="${BASH_REMATCH[3]}" -v x="${BASH_REMATCH[4]}" \
    -v y="${BASH_REMATCH[5]}" -v worst="${BASH_REMATCH[6]}" \
    'function far(a, b) { return (a - b) ^ 2 > 1e-12 }
     BEGIN { exit !(left > 1e-9 && left < 100 && worst > 0 && x < 0.65 && y < 0.95 &&
                    !far(node % 11 / 10, x) && !far(int(node / 11) / 10, y)) }' ||
    fail "$name: what is left, or its place: $(cat message)"
  grep -q "max_iter" message || fail "$name: it does not say what to do"
  # The state is that after two steps, can be read, and be gone on from.
  [[ -f "$name/checkpoints/checkpoint_0000000002.h5" ]] || fail "$name: there is no checkpoint"
  grep -q '"status": "failed"' "$name/manifest.json" || fail "$name: the manifest"
  "$lahar" export "$name" --to csv --step 2 -o "$name-csv" >out 2>&1 || fail "$name: the last frame"
  "${run[@]}" -o "$name" "${more[@]}" >out 2>&1 || fail "$name: with iterations enough"
  grep -q '"steps": 3' "$name/manifest.json" || fail "$name: it did not go on to step 3"
  # All ranks have the same system, and say the same.
  timeout 120 "$mpiexec" --oversubscribe --bind-to none -n 2 "${run[@]}" -o "$name-ranks" \
    "${more[@]}" --set analysis.linear_solver.max_iter=2 >out 2>&1
  [[ "$(grep "error: step 3 " out)" == "$(cat message)" ]] || fail "$name: two ranks"
}
check implicit "the linear system of iteration 1 of Newton's method was not solved" "N"
check projection "the pressure was not found" "1/s"

# A direct solver says where, too: here nothing holds the block, and a sideways load moves it.
"$lahar" run implicit.json -t 1 -o free --set analysis.linear_solver.solver_type=DirectEigen \
  --set mesh.boundary_conditions.velocity_constraints=[] >out 2>&1
[[ $? == 3 ]] || fail "free: the exit status is not 3"
free="direct solver: .*\(relative residual $number\); most is left at $place, $number N"
[[ "$(cat out)" =~ $free ]] || fail "free: where is not said"
exit "$failed"
