#!/usr/bin/env bash
# What the scripts say without installing or building anything.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
failures=0
fail() {
  echo "FAILED: $*"
  failures=1
}

list="$("$root/examples/run" --list)"
for file in "$root"/examples/*.json; do
  name="$(basename "$file" .json)"
  grep -Eq "^  $name +[A-Z]" <<<"$list" || fail "examples/run --list does not describe $name"
done
for script in examples/run tests/run tests/races; do
  "$root/$script" --help | grep -q '^Usage:' || fail "$script --help"
done

status=0
message="$("$root/examples/run" no-such-case 2>&1)" || status=$?
[[ "$status" == 2 ]] || fail "an unknown case exits with $status, not 2"
grep -q "no-such-case" <<<"$message" || fail "the message does not name the unknown case"
grep -q "plate-with-hole" <<<"$message" || fail "the message does not list the examples"

status=0
message="$("$root/tests/races" --no-such-thing 2>&1)" || status=$?
[[ "$status" == 2 ]] || fail "tests/races with a folder that does not exist exits with $status, not 2"
grep -q "'--no-such-thing' is no folder" <<<"$message" || fail "the message does not name the folder"

exit "$failures"
