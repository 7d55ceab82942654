#!/bin/bash
# Traces of whole runs: sound on two ranks, with the main loss named that was planted, and with
# clear messages where files are damaged or mixed.
#
#     trace_test.sh LAHAR MPIEXEC [PYTHON]
#
# Exit status 77: all passed, but there was no validator of JSON Schema; where CI is set, a failure.
set -u
lahar="$1"
mpiexec="$2"
python="${3:-python3}"
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
# main_loss NAME: the first finding.
main_loss() {
  "$lahar" trace "$work/$1" --json >"$work/out" 2>&1
  grep -A4 '"findings"' "$work/out" | grep -m1 '"name"' | cut -d'"' -f4
}
# names NAME LOSS RANKS SIZE OPTIONS...: a run with a planted loss is said to have it as the main
# one. The options have SIZE as %; what else the machine does is a loss, too, so that a loss which is
# not the main one is planted again, three and nine times as large.
names() {
  local name="$1" loss="$2" ranks="$3" size="$4" first="" times
  shift 4
  for times in 1 3 9; do
    record "$name" "$ranks" "${@//%/$((size * times))}"
    first="$(main_loss "$name")"
    [[ "$first" == "$loss" ]] && return
    echo "the main loss of $name, planted $times times, is '$first' instead of '$loss'"
  done
  fail "the main loss of $name is '$first' instead of '$loss'"
}

record plain 2 -t 2 --set post_processing.output_steps=20 --checkpoint-steps 30
says "sound: " "$lahar" trace "$work/plain" --check
[[ $status == 0 ]] || fail "a sound trace is exit status 0"
says "steps 0 to 59" "$lahar" trace "$work/plain" --check
says "parallel efficiency" "$lahar" trace "$work/plain"

record window 2 -t 1 --trace-steps 20:39
says "steps 20 to 39" "$lahar" trace "$work/window" --check
says "sound: " "$lahar" trace "$work/window" --check

# Trace events: complete, ascending within a row where they nest, each arrow with both ends.
"$lahar" trace "$work/plain" --chrome "$work/plain.json.gz" >"$work/out" 2>&1 || fail "--chrome"
"$lahar" trace "$work/plain" --chrome "$work/both.json" --html "$work/both.html" --json \
  >"$work/both.report.json" 2>"$work/out" || fail "--chrome, --html and --json"
for file in both.json both.html both.report.json; do
  [[ -s "$work/$file" ]] || fail "$file is missing where several outputs are asked for"
done
grep -q '"findings"' "$work/both.report.json" || fail "--json beside files"
"$python" - "$work/plain.json.gz" >"$work/out" 2>&1 <<'EOF' || fail "trace events"
import collections, gzip, json, sys
events = json.load(gzip.open(sys.argv[1]))["traceEvents"]
needs = {"X": {"name", "pid", "tid", "ts", "dur"}, "M": {"name", "pid", "args"},
         "s": {"id", "pid", "tid", "ts"}, "f": {"id", "pid", "tid", "ts", "bp"},
         "b": {"id", "cat", "name", "pid", "ts"}, "e": {"id", "cat", "name", "pid", "ts"},
         "C": {"name", "pid", "ts", "args"}}
ends = collections.Counter()
arrow = {}
counters = set()
for event in events:
    missing = needs[event["ph"]] - event.keys()
    assert not missing, (event, missing)
    assert event.get("dur", 0) >= 0, event
    if event["ph"] in "sf":
        ends[event["id"], event["ph"]] += 1
        arrow[event["id"], event["ph"]] = event["ts"]
    if event["ph"] == "C":
        counters.add((event["pid"], event["name"]))
ids = {id for id, _ in ends}
assert len(ids) > 1000 and all(ends[id, ph] == 1 for id in ids for ph in "sf")
assert all(arrow[id, "s"] <= arrow[id, "f"] for id in ids), "an arrow into the past"
assert counters == {(r, c) for r in (0, 1) for c in ("active particles", "memory", "load")}, counters
assert {e["pid"] for e in events} == {0, 1}
# Output has the step that it is of, and is written behind later ones. (The first frame may have been
# written before anything is recorded.)
assert {e["args"]["step"] for e in events if e.get("cat") == "frame"} >= {20, 40, 60}
assert {e["args"]["step"] for e in events if e.get("cat") == "checkpoint"} >= {30, 60}
assert sum(e["ph"] == "X" and e["cat"] == "task" for e in events) > 60 * 4
EOF

# The JSON of both is as the schemas say.
schemas="$here/../../runtime/trace/analyse/schema"
"$lahar" trace "$work/plain" --json >"$work/plain.report.json" 2>"$work/out" || fail "--json"
record one 1 -t 1
"$lahar" trace "$work/one" --json >"$work/one.report.json" 2>"$work/out" || fail "--json"
"$lahar" trace "$work/one" --chrome "$work/one.json" >"$work/out" 2>&1 || fail "--chrome"
record bulk 2 -t 1 --bulk-synchronous
"$lahar" trace "$work/bulk" --json >"$work/bulk.report.json" 2>"$work/out" || fail "--json"
says "sound: " "$lahar" trace "$work/bulk" --check
"$python" "$here/trace_schema_test.py" \
  "$work/plain.report.json" "$schemas/report.schema.json" "$work/plain.json.gz" "$schemas/chrome.schema.json" \
  "$work/one.report.json" "$schemas/report.schema.json" "$work/one.json" "$schemas/chrome.schema.json" \
  "$work/bulk.report.json" "$schemas/report.schema.json" >"$work/out" 2>&1
status=$?
skipped=0
if [[ $status == 77 && -z "${CI:-}" ]]; then
  skipped=77
elif [[ $status != 0 ]]; then
  fail "schemas"
fi

# Runs whose steps begin with a solve: their loops are in everything that is made of a trace.
for case in implicit projection; do
  timeout -k 5 150 "$mpiexec" --oversubscribe --bind-to none -n 2 \
    "$lahar" run "$here/$case.json" -q --overwrite --trace -t 2 -o "$work/$case" >"$work/out" 2>&1 ||
    fail "the run $case did not end well"
  says "sound: " "$lahar" trace "$work/$case" --check
  says " solve" "$lahar" trace "$work/$case"
  says "reductions of solvers" "$lahar" trace "$work/$case"
  says "what solvers do between their loops" "$lahar" trace "$work/$case" --replay measured
  says "replay the run as it is" "$lahar" trace "$work/$case" --project
  "$lahar" trace "$work/$case" --json >"$work/$case.report.json" 2>"$work/out" || fail "--json"
  "$lahar" trace "$work/$case" --chrome "$work/$case.json" --html "$work/$case.html" \
    >"$work/out" 2>&1 || fail "--chrome and --html"
  for what in '"name":"solve: multiply"' '"name":"unpack solve: multiply"' '"name":"solve: advance"' \
    '"name":"solve: sums"' '"name":"sums of a round"' '"name":"solve"'; do
    grep -qF "$what" "$work/$case.json" || fail "$what is missing from the events of $case"
  done
  grep -qF 'solve: advance' "$work/$case.html" || fail "the page of $case has no rounds"
  says "solve: round after round" "$lahar" graph "$here/$case.json" --ranks 2
  "$python" "$here/trace_schema_test.py" "$work/$case.report.json" "$schemas/report.schema.json" \
    "$work/$case.json" "$schemas/chrome.schema.json" >"$work/out" 2>&1
  status=$?
  [[ $status == 0 || $status == 77 ]] || fail "schemas of $case"
done

names slow_patch imbalance 1 300 -t 2 --slow-patch 0:%
says "patch 0" "$lahar" trace "$work/slow_patch"
names late "late sender" 2 2 -t 1 --late-sends 1:%ms
says "most of them of rank 1" "$lahar" trace "$work/late"
names serial "serial section" 1 20 -t 1 --serial-section %ms
names latency messages 2 10 -t 1 --inject-latency %ms

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

[[ $failed == 0 ]] || exit 1
if [[ $skipped != 0 ]]; then
  echo "SKIPPED: there is no validator of JSON Schema (apt-get install python3-jsonschema); all else passed"
  exit $skipped
fi
echo "all passed"
