#!/usr/bin/env bash
# Runs that are stopped, killed or damaged go on, and end as the one that was left alone:
# restart_test.sh LAHAR [KILLS]
set -euo pipefail
lahar="$1"
kills="${2:-6}"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"
cp "$here/water.json" .
RANDOM=20

fail() {
  echo "FAILED: $*"
  exit 1
}
run() { "$lahar" run water.json --quiet "$@"; }

# All files of results but those that say when and how often the run was started.
compare_with_whole() {
  local file
  for file in history.csv scenario.full.json frames/particles.hdf.series; do
    cmp "whole/$file" "$1/$file" || fail "$1/$file is not that of the undisturbed run"
  done
  [[ "$(ls whole/frames)" == "$(ls "$1/frames")" ]] || fail "$1 has other frames"
  compare_finished "$1"
}

# Every frame and checkpoint that has its name is whole, whatever happened.
compare_finished() {
  local file
  for file in "$1"/frames/particles_*.hdf "$1"/checkpoints/checkpoint_*.h5; do
    [[ -e "$file" ]] || continue
    [[ -e "whole/${file#"$1"/}" ]] || continue
    cmp "$file" "whole/${file#"$1"/}" || fail "$file is not that of the undisturbed run"
  done
}

run --output whole --threads 2
last="$(ls whole/checkpoints | tail -n 1)"
[[ "$last" == checkpoint_0000002000.h5 ]] || fail "the end has no checkpoint"

# Without memory for copies steps wait for frames and checkpoints, which are the same.
"$lahar" run water.json --output waiting --staging 0MiB >waiting.txt
grep -q "steps wait while frames (.*) and checkpoints (.*) are written" waiting.txt ||
  fail "nothing says that steps wait: $(cat waiting.txt)"
"$lahar" run water.json --output copied --staging 1GiB | grep "steps wait" &&
  fail "there is memory enough"
compare_with_whole waiting
compare_with_whole copied
status=0
"$lahar" run water.json --output copied --staging -1GiB 2>error.txt || status="$?"
[[ "$status" == 2 ]] && grep -q -e "--staging" error.txt ||
  fail "--staging -1GiB: status $status, $(cat error.txt)"

# Killed at any moment, and continued on another number of threads, with and without copies.
killed=0
for ((k = 0; k < 20 * kills && killed < kills; ++k)); do
  options=(--output killed --threads "$((1 + k % 3))" --staging "$((k % 2))GiB")
  if compgen -G "killed/checkpoints/checkpoint_*.h5" >/dev/null; then
    options+=(--restart latest)
  else
    options+=(--overwrite)
  fi
  "$lahar" run water.json --quiet "${options[@]}" &
  child="$!"
  sleep "0.$((RANDOM % 40 + 5))"
  if kill -KILL "$child" 2>/dev/null; then killed="$((killed + 1))"; fi
  status=0
  wait "$child" 2>/dev/null || status="$?"
  [[ "$status" == 137 || "$status" == 0 ]] || fail "a run that was to be killed ended with $status"
  compare_finished killed
  if [[ "$status" == 0 ]]; then
    compare_with_whole killed
    rm -rf killed
  fi
done
if [[ -d killed ]]; then
  compgen -G "killed/checkpoints/checkpoint_*.h5" >/dev/null &&
    run --output killed --restart latest || run --output killed --overwrite
  compare_with_whole killed
fi
echo "killed $killed times"

# Stopped by a signal: exit status 75, and a message that says how to go on. SIGUSR1 does not stop.
checkpoints() { compgen -G "stopped/checkpoints/checkpoint_*.h5" | wc -l; }
"$lahar" run water.json --output stopped --threads 1 --checkpoint-steps 0 >log.txt &
child="$!"
while [[ ! -e stopped/frames/particles_0000000020.hdf ]]; do sleep 0.02; done
kill -USR1 "$child"
while [[ "$(checkpoints)" == 0 ]]; do sleep 0.02; done
kill -TERM "$child"
status=0
wait "$child" || status="$?"
[[ "$status" == 75 ]] || fail "a run that was stopped ended with $status, not 75"
grep -q "stopped by signal 15 .* --restart latest" log.txt || fail "nothing says how to continue"
[[ "$(checkpoints)" == 2 ]] || fail "$(checkpoints) checkpoints were asked for by signals, not 2"

# The latest checkpoint is damaged: the one before is taken, with a warning that names it.
latest="stopped/checkpoints/$(ls stopped/checkpoints | tail -n 1)"
truncate -s -1 "$latest"
run --output stopped --restart latest 2>warnings.txt
grep -q "$(basename "$latest").*truncated" warnings.txt || fail "no warning: $(cat warnings.txt)"
compare_with_whole stopped
# One of the same step may have been written anew; compare_with_whole has looked at that.
[[ -e "$latest" && ! -e "whole/${latest#stopped/}" ]] && fail "the damaged checkpoint is still there"

# Damaged where it is named: an error.
status=0
cp "whole/checkpoints/$last" bad.h5
size="$(stat -c %s bad.h5)"
printf 'x' | dd of=bad.h5 bs=1 seek="$((size - 100))" conv=notrunc status=none
run --output stopped --restart bad.h5 2>errors.txt || status="$?"
[[ "$status" == 4 ]] || fail "a damaged checkpoint ends with $status, not 4"
grep -q "bad.h5: the state of patch .* does not match its checksum" errors.txt ||
  fail "no reason: $(cat errors.txt)"

# Another scenario is refused, and nothing is touched.
status=0
run --output stopped --restart latest --set analysis.patch_particles=128 2>errors.txt || status="$?"
[[ "$status" == 2 ]] || fail "another scenario ends with $status, not 2"
grep -q "/analysis/patch_particles is 128, in the checkpoint it is 256" errors.txt ||
  fail "no difference named: $(cat errors.txt)"
compare_with_whole stopped

# A run that ended can be made longer.
run --output stopped --restart latest --set analysis.nsteps=2100
run --output longer --set analysis.nsteps=2100
for file in history.csv frames/particles.hdf.series frames/particles_0000002100.hdf \
  checkpoints/checkpoint_0000002100.h5; do
  cmp "stopped/$file" "longer/$file" ||
    fail "a run that was made longer is not one that was longer from the start"
done

# Output by time: rows and frames at the time of a checkpoint are kept or written, as they should.
by_time=(--set analysis.nsteps=24 --set post_processing.output_steps=0
  --set post_processing.history_steps=0 --set post_processing.output_dt=1.5e-3
  --set post_processing.history_dt=1e-3 --checkpoint-steps 1)
run --output times "${by_time[@]}"
[[ "$(ls times/frames/*.hdf | wc -l)" -gt 3 ]] || fail "no frames by time: $(ls times/frames)"
cp -r times again
for step in 22 17 16 15 14 13 12 11 10 9 8 7 1; do
  run --output again "${by_time[@]}" --restart "again/checkpoints/checkpoint_00000000$(printf %02d $step).h5"
  for file in history.csv frames/particles.hdf.series; do
    cmp "times/$file" "again/$file" || fail "$file by time differs after a restart from step $step"
  done
  [[ "$(ls times/frames)" == "$(ls again/frames)" ]] || fail "other frames from step $step"
done

# The watchdog ends a run with status 3, a frame and a checkpoint, from which it goes on if told to.
status=0
run --output watched --checkpoint-steps 0 --set analysis.watchdog.speed=1e-3 2>errors.txt || status="$?"
[[ "$status" == 3 ]] || fail "the watchdog ends a run with $status, not 3"
grep -q "step 64 (t = .*): the largest speed is .* The fastest particle after step 67: particle" \
  errors.txt || fail "the watchdog says: $(cat errors.txt)"
[[ -e watched/frames/particles_0000000067.hdf && -e watched/checkpoints/checkpoint_0000000067.h5 ]] ||
  fail "the watchdog kept $(ls watched/frames watched/checkpoints)"
status=0
run --output watched --restart latest --set analysis.watchdog.speed=1e-3 2>again.txt || status="$?"
[[ "$status" == 3 ]] && grep -qF "$(grep "the largest speed" errors.txt)" again.txt ||
  fail "with the same bounds: $status, $(cat again.txt)"
run --output watched --restart latest --set analysis.watchdog.action=off --set analysis.nsteps=100
