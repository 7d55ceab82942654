#!/bin/bash
# Traces of whole runs: sound on two ranks, with the main loss named that was planted, and with
# clear messages where files are damaged or mixed.
#
#     trace_test.sh LAHAR MPIEXEC
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
  head -n 20 "$work/out" | sed "s/^/    /"
  failed=1
}
# record NAME RANKS OPTIONS...: a run of the tank with a trace, in $work/NAME.
record() {
  local name="$1" ranks="$2"
  shift 2
  timeout -k 5 150 "$mpiexec" --oversubscribe --bind-to none -n "$ranks" \
    "$lahar" run "$here/tank.json" -q --overwrite --trace --set analysis.nsteps=60 \
    -o "$work/$name" "$@" >"$work/out" 2>&1 || fail "the run $name did not end well"
}
# says TEXT COMMAND...: the command's output has the text.
says() {
  local text="$1"
  shift
  "$@" >"$work/out" 2>&1
  status=$?
  grep -qF -- "$text" "$work/out" || fail "'$text' is missing from: $*"
}
# main_loss NAME LOSS: the first finding.
main_loss() {
  "$lahar" trace "$work/$1" --json >"$work/out" 2>&1
  local first
  first="$(grep -A4 '"findings"' "$work/out" | grep -m1 '"name"' | cut -d'"' -f4)"
  [[ "$first" == "$2" ]] || fail "the main loss of $1 is '$first' instead of '$2'"
}

record plain 2 -t 2
says "sound: " "$lahar" trace "$work/plain" --check
[[ $status == 0 ]] || fail "a sound trace is exit status 0"
says "steps 0 to 59" "$lahar" trace "$work/plain" --check
says "parallel efficiency" "$lahar" trace "$work/plain"

record window 2 -t 1 --trace-steps 20:39
says "steps 20 to 39" "$lahar" trace "$work/window" --check
says "sound: " "$lahar" trace "$work/window" --check

# Trace events: complete, ascending within a row where they nest, each arrow with both ends.
"$lahar" trace "$work/plain" --chrome "$work/plain.json.gz" >"$work/out" 2>&1 || fail "--chrome"
python3 - "$work/plain.json.gz" >"$work/out" 2>&1 <<'EOF' || fail "trace events"
import collections, gzip, json, sys
events = json.load(gzip.open(sys.argv[1]))["traceEvents"]
needs = {"X": {"name", "pid", "tid", "ts", "dur"}, "M": {"name", "pid", "args"},
         "s": {"id", "pid", "tid", "ts"}, "f": {"id", "pid", "tid", "ts", "bp"},
         "b": {"id", "cat", "name", "pid", "ts"}, "e": {"id", "cat", "name", "pid", "ts"},
         "C": {"name", "pid", "ts", "args"}}
ends = collections.Counter()
for event in events:
    missing = needs[event["ph"]] - event.keys()
    assert not missing, (event, missing)
    assert event.get("dur", 0) >= 0, event
    if event["ph"] in "sf":
        ends[event["id"], event["ph"]] += 1
ids = {id for id, _ in ends}
assert len(ids) > 1000 and all(ends[id, ph] == 1 for id in ids for ph in "sf")
assert {e["pid"] for e in events} == {0, 1}
assert sum(e["ph"] == "X" and e["cat"] == "task" for e in events) > 60 * 4
EOF

record slow_patch 1 -t 2 --slow-patch 0:300
main_loss slow_patch imbalance
says "patch 0" "$lahar" trace "$work/slow_patch"
record late 2 -t 1 --late-sends 1:2ms
main_loss late "late sender"
says "most of them of rank 1" "$lahar" trace "$work/late"
record serial 1 -t 1 --serial-section 20ms
main_loss serial "serial section"
record latency 2 -t 1 --inject-latency 10ms
main_loss latency messages

says "rank 1" "$lahar" graph "$here/tank.json" --all --ranks 2

# Files that are no trace of one run.
says "has no trace" "$lahar" trace "$here"
cp -r "$work/plain" "$work/broken"
file="$work/broken/trace/rank-1.trace"
head -c 5000 "$work/plain/trace/rank-1.trace" >"$file"
says "the trace is not complete" "$lahar" trace "$work/broken"
[[ $status == 2 ]] || fail "exit status $status instead of 2"
{ head -c 3000 "$work/plain/trace/rank-1.trace"; echo damage; tail -c +3008 "$work/plain/trace/rank-1.trace"; } >"$file"
says "is damaged" "$lahar" trace "$work/broken"
echo "something else" >"$file"
says "is not a trace of Lahar" "$lahar" trace "$work/broken"
cp "$work/late/trace/rank-1.trace" "$file"
says "is of another run" "$lahar" trace "$work/broken"
rm "$file"
says "cannot be read" "$lahar" trace "$work/broken"
says "no step of the run was within" bash -c \
  "'$lahar' run '$here/tank.json' -q -t 1 --set analysis.nsteps=5 --trace-steps 7:9 -o '$work/none' && '$lahar' trace '$work/none'"
says "FIRST not above LAST" "$lahar" run "$here/tank.json" --trace-steps 9:7
says "NUMBER:TIME such as" "$lahar" run "$here/tank.json" --late-sends 1

[[ $failed == 0 ]] && echo "all passed"
exit $failed
