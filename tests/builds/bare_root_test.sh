#!/usr/bin/env bash
# Whether the package for Debian works where nothing else is: in a new Debian that has no more than
# it needs to start.
#
#     bare_root_test.sh BUILD FOLDER
#
# Makes the package of the build folder BUILD, and a Debian of this machine's release in FOLDER/root.
# Installs the package there with apt, runs an example from an ordinary folder, opens its results as
# a report and from Python. Needs root, debootstrap and Debian's archive. Exit status 77: they are
# not there.
set -euo pipefail
build="$(realpath "$1")"
folder="$2"

skip() { printf '%s\n' "bare_root_test.sh: $*"; exit 77; }
[[ "$(id -u)" == 0 ]] || skip "only root can install a Debian"
for tool in debootstrap dpkg-shlibdeps unshare; do
  command -v "$tool" >/dev/null || skip "there is no $tool"
done
# shellcheck source=/dev/null
release="$(source /etc/os-release && printf '%s' "${VERSION_CODENAME-}")"
[[ -n "$release" ]] || skip "this machine's system has no code name"

rm -rf --one-file-system "$folder"
mkdir -p "$folder/package"
folder="$(realpath "$folder")"
root="$folder/root"
trap 'rm -rf --one-file-system "$root"' EXIT
cpack --config "$build/CPackConfig.cmake" -B "$folder/package" >"$folder/cpack.txt"
debootstrap --variant=minbase "$release" "$root" >"$folder/debootstrap.txt" 2>&1 ||
  skip "debootstrap failed: $(tail -1 "$folder/debootstrap.txt")"
cp "$folder"/package/lahar_*.deb "$root/"

# What a user types. /proc is mounted for these commands alone.
cat >"$root/user.sh" <<'END'
set -eu
export LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive
apt-get install --yes /lahar_*.deb
mkdir /tmp/case
cd /tmp/case
cp /usr/share/doc/lahar/examples/hanging-bar.json .
lahar check hanging-bar.json
lahar run hanging-bar.json -o run
lahar report run -o report.html
python3 - <<'PYTHON'
import lahar

run = lahar.Run("run")
frame = run.frames[-1]
assert len(frame["velocity"]) > 0 and len(run.history) > 1
simulation = lahar.Simulation(lahar.Scenario.read("hanging-bar.json"))
simulation.step(5)
assert simulation.time > 0 and len(simulation.particles["velocity"]) == len(frame["velocity"])
PYTHON
END
unshare --mount --fork sh -c "mount -t proc proc '$root/proc' && chroot '$root' sh -e /user.sh" \
  >"$folder/user.txt" 2>&1 || {
  tail -40 "$folder/user.txt"
  exit 1
}
for file in report.html run/history.csv run/manifest.json; do
  [[ -s "$root/tmp/case/$file" ]] || { echo "there is no $file"; exit 1; }
done
grep -q '<canvas\|<svg' "$root/tmp/case/report.html"
echo "the package works in a bare Debian $release"
