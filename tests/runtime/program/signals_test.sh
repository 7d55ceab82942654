#!/bin/bash
# Signals before the first step: nothing is there to be stored, so they end a run at once.
#
#     signals_test.sh LAHAR MPIEXEC
set -u
lahar="$1"
mpiexec="$2"
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failed=0

fail() {
  echo "FAILED: $1"
  sed 's/^/    /' out
  failed=1
}
# A search through all of the mesh: of its nodes for a set, or of its cells for particles.
far='{"difference": [{"box": {"min": [0, 0, 0], "max": [1, 1e7, 1]}},
                     {"half_space": {"point": [0, 0.25, 0], "normal": [0, -1, 0]}}]}'
case_of() { # NODES_OF_SET LENGTH STAGES
  cat <<END
{"title": "slow to read",
 "mesh": {"structured": {"cell_size": 0.1, "extent": [0.8, $2, 0.6]}, "cell_type": "ED3H8",
  "boundary_conditions": {"velocity_constraints": [{"nset": "floor", "dir": 2, "velocity": 0}]}},
 "sets": {"nodes": {"floor": $1}},
 "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
   "region": {"box": {"min": [0.1, 0, 0.1], "max": [0.4, 0.3, 0.3]}}}}],
 "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e5,
                "poisson_ratio": 0.3}],
 "external_loading_conditions": {"gravity": [0, 0, -9.81]},
 "analysis": {"dt": 1e-4, "nsteps": 1000000}, "stages": $3}
END
}
case_of "$far" 1e7 null | sed 's/, "stages": null//' >slow.json

# await WHAT COMMAND...: until it succeeds; generous, as machines are busy.
await() {
  local what="$1" n
  shift
  for ((n = 0; n < 1200; ++n)); do
    "$@" && return
    sleep 0.1
  done
  fail "$what did not come"
}
is_reading() { grep -q "^starting   sets" out; }
# in_background COMMAND...: what it says is in `out`, which has nothing of the one before.
in_background() {
  : >out
  "$@" >out 2>&1 &
  child=$!
}
is_gone() { ! kill -0 "$child" 2>/dev/null; }
# ended WHAT STATUS: soon, as documented, and said once.
ended() {
  await "the end of $1" is_gone
  kill -KILL "$child" 2>/dev/null
  wait "$child"
  status=$?
  [[ "$status" == "$2" ]] || fail "status of $1: $status, not $2"
  [[ "$(grep -c "stopped by signal" out)" == 1 ]] || fail "$1: not one message"
  [[ ! -e run ]] || fail "$1 has written something"
}

for signal in TERM:143 HUP:129; do
  in_background "$lahar" run slow.json --output run --threads 1
  await "the start" is_reading
  kill "-${signal%:*}" "$child"
  ended "a start after SIG${signal%:*}" "${signal#*:}"
  grep -q "before the first step; nothing was written" out || fail "the message"
done

# A run that goes on from a checkpoint has one to go on from.
in_background "$lahar" run slow.json --output run --restart latest --threads 1
await "the start" is_reading
kill -TERM "$child"
ended "a restart after SIGTERM" 75
grep -q "before the first step. To continue: .* --restart latest" out || fail "how to continue"

# What nohup ignores stays ignored.
in_background nohup "$lahar" run slow.json --output run --threads 1
await "the start" is_reading
kill -HUP "$child"
sleep 0.5
is_gone && fail "SIGHUP ends what nohup started"
kill -TERM "$child"
ended "a start with nohup" 143

# Two ranks: the launcher returns the status of the signal.
in_background "$mpiexec" --oversubscribe --bind-to none -n 2 "$lahar" run slow.json --output run \
  --threads 1
await "the start of ranks" is_reading
pkill -TERM -P "$child"
ended "a start of two ranks after SIGTERM" 143

# A stage that does not begin: those before it have ended, and the run goes on from there.
case_of '{"half_space": {"point": [0, 0.05, 0], "normal": [0, 1, 0]}}' 1e5 '[
  {"name": "first", "analysis": {"nsteps": 2}},
  {"name": "second", "place": [{"generator": {"type": "region", "per_cell": 1, "material": 0,
    "region": '"${far/0.25/0.45}"'}}]}]' >stages.json
in_background "$lahar" run stages.json --output stages --threads 1
first_has_ended() { grep -q '"status": "finished"' stages/first/manifest.json 2>/dev/null; }
await "the first stage" first_has_ended
kill -TERM "$child"
ended "a start of the second stage after SIGTERM" 75
grep -q "before the first step. To continue: .* --restart latest" out || fail "how to continue"
compgen -G "stages/first/checkpoints/checkpoint_*.h5" >/dev/null || fail "no state to go on from"

((failed)) || echo "all as documented"
exit "$failed"
