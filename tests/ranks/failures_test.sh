#!/bin/bash
# What users see when something happens to one of three ranks: all end soon, one message names the
# rank and the last step, and the exit status is as documented.
#
#     failures_test.sh LAHAR MPIEXEC
set -u
lahar="$1"
mpiexec="$2"
here="$(cd "$(dirname "$0")" && pwd)"
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
failed=0

fail() {
  echo "FAILED: $1"
  sed 's/^/    /' "$work/out"
  failed=1
}
# on_ranks PROGRAM...: three ranks; output and exit status in $work/out and $status.
on_ranks() {
  timeout -k 5 150 "$mpiexec" --oversubscribe --bind-to none -n 3 "$@" >"$work/out" 2>&1
  status=$?
}
# in_background PROGRAM...: the same, to be interfered with once it takes steps.
in_background() {
  : >"$work/out"
  timeout -k 5 150 "$mpiexec" --oversubscribe --bind-to none -n 3 "$@" >"$work/out" 2>&1 &
  job=$!
  for _ in $(seq 600); do
    [[ -s "$work/run/history.csv" && "$(wc -l <"$work/run/history.csv")" -gt 3 ]] && return
    sleep 0.1
  done
  fail "the run did not begin"
}
# process_of RANK: of the run in $work.
process_of() {
  local directory
  for directory in /proc/[0-9]*; do
    [[ "$(readlink "$directory/exe")" == "$(readlink -f "$lahar")" ]] || continue
    if tr '\0' '\n' <"$directory/environ" 2>/dev/null | grep -qx "OMPI_COMM_WORLD_RANK=$1" &&
      tr '\0' '\n' <"$directory/cmdline" | grep -qx "$work/run"; then
      echo "${directory#/proc/}"
    fi
  done
}
# ended_within SECONDS WHAT: generous, as machines are busy; it takes a second, or ten where the others
# wait for a rank that does not answer.
ended_within() {
  local begin="$SECONDS"
  wait "$job"
  status=$?
  ((SECONDS - begin <= $1)) || fail "$2 took $((SECONDS - begin)) s"
}
says() {
  grep -q -- "$1" "$work/out" || fail "$2: no '$1'"
}
run=("$lahar" run "$here/tank.json" --threads 1 --output "$work/run" --overwrite)

# Into a file there are no escape codes, though mpirun gives rank 0 a terminal; nor in what input says.
sed 's/"title": "[^"]*"/"title": "\\u001b[31m tank"/' "$here/tank.json" >"$work/coloured.json"
TERM=xterm timeout -k 5 150 "$mpiexec" --oversubscribe --bind-to none -n 2 "$lahar" run \
  "$work/coloured.json" --threads 1 --output "$work/run" --overwrite \
  --set analysis.nsteps=50 >"$work/out" 2>&1 || fail "a run into a file"
says 'x1b.31m tank' "the title"
if grep -q $'\033' "$work/out" "$work/run/log.txt"; then fail "escape codes in a file"; fi

# A case that does not fit is refused once, with the limit of each rank.
on_ranks "$lahar" run "$here/tank.json" --threads 1 --output "$work/run" --overwrite --memory 1M
[[ "$status" == 2 ]] || fail "status of a case that does not fit: $status"
[[ "$(grep -c "of memory are needed" "$work/out")" == 1 ]] || fail "memory: not one message"
says "341.3 KiB for each of 3 ranks" "--memory"
rm -rf "$work/run"

# A rank is killed.
in_background "${run[@]}"
kill -KILL "$(process_of 1)"
ended_within 30 "the end after SIGKILL"
[[ "$status" == 137 || "$status" == 5 ]] || fail "status after SIGKILL: $status"
says "rank 1 (process [0-9]*) is gone" SIGKILL
says "The last step that all ranks finished is [0-9]" SIGKILL
says "restart latest" SIGKILL
[[ "$(grep -c "is gone" "$work/out")" == 1 ]] || fail "SIGKILL: more than one message"

# All are told to stop: a checkpoint, and the documented status.
rm -rf "$work/run"
in_background "${run[@]}"
all=("$(process_of 0)" "$(process_of 1)" "$(process_of 2)")
kill -TERM "${all[@]}"
ended_within 60 "the end after SIGTERM"
[[ "$status" == 75 ]] || fail "status after SIGTERM: $status"
compgen -G "$work/run/checkpoints/checkpoint_*.h5" >/dev/null || fail "SIGTERM: no checkpoint"

# A rank does not answer any more when the others are told to stop.
rm -rf "$work/run"
in_background "${run[@]}"
stopped="$(process_of 2)"
others=("$(process_of 0)" "$(process_of 1)")
kill -STOP "$stopped"
kill -TERM "${others[@]}"
ended_within 60 "the end after SIGTERM without rank 2"
kill -KILL "$stopped" 2>/dev/null
says "was asked to stop, but no step was completed for 10 s" "a rank that does not answer"

# A rank has no memory left: it says so and the last step, and all end.
cat >"$work/short_of_memory" <<END
#!/bin/bash
[[ "\$OMPI_COMM_WORLD_RANK" == 1 ]] && ulimit -v 700000
exec "\$@"
END
chmod +x "$work/short_of_memory"
rm -rf "$work/run"
sed 's/"extent": .*}/"extent": [8, 6]}/; s/"max": .0.2, 0.1./"max": [8, 6]/; s/"nsteps": [0-9]*/"nsteps": 3/' \
  "$here/tank.json" >"$work/large.json"
on_ranks "$work/short_of_memory" "$lahar" run "$work/large.json" --threads 1 --output "$work/run"
[[ "$status" != 0 && "$status" != 124 ]] || fail "status without memory: $status"
says "memory" "a rank without memory"

# A particle leaves the mesh on one of the ranks: the same status as on one rank, one message.
rm -rf "$work/run"
on_ranks "$lahar" run "$here/leaving.json" --threads 1 --output "$work/run" --overwrite
[[ "$status" == 3 ]] || fail "status of a failing step: $status"
[[ "$(grep -c "error:.*particle" "$work/out")" == 1 ]] || fail "a failing step: not one message"

# Ranks are not alike.
cat >"$work/other_options" <<END
#!/bin/bash
[[ "\$OMPI_COMM_WORLD_RANK" == 2 ]] && set -- "\$@" --balance off
exec "\$@"
END
chmod +x "$work/other_options"
on_ranks "$work/other_options" "${run[@]}"
[[ "$status" == 5 ]] || fail "status of different options: $status"
says "the ranks were started with different options: rank 0 against 2" "different options"
sed 's/1000,/999,/' "$here/tank.json" >"$work/other.json"
cat >"$work/other_scenario" <<END
#!/bin/bash
lahar="\$1"
file="$here/tank.json"
[[ "\$OMPI_COMM_WORLD_RANK" == 1 ]] && file="$work/other.json"
exec "\$lahar" run "\$file" --output "$work/run" --overwrite
END
chmod +x "$work/other_scenario"
on_ranks "$work/other_scenario" "$lahar"
[[ "$status" == 5 ]] || fail "status of different scenarios: $status"
says "different scenario files: rank 0 against 1" "different scenarios"

# What is wrong with the input is said once.
rm -rf "$work/run"
mkdir -p "$work/run" && touch "$work/run/mine"
on_ranks "$lahar" run "$here/tank.json" --output "$work/run"
[[ "$status" == 2 ]] || fail "status of a folder that is not empty: $status"
[[ "$(grep -c "error:" "$work/out")" == 1 ]] || fail "a folder that is not empty: not one message"
on_ranks "$lahar" run "$here/tank.json" --threads 0
[[ "$(grep -c -- "--threads" "$work/out")" == 1 ]] || fail "a wrong option: not one message"
on_ranks "$lahar" run "$work/no-such-file.json"
[[ "$status" == 2 ]] || fail "status of a missing scenario: $status"
[[ "$(grep -c "no-such-file.json" "$work/out")" == 1 ]] || fail "a missing scenario: not one message"

((failed)) || echo "all as documented"
exit "$failed"
