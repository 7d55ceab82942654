# shellcheck shell=bash disable=SC2034
# Everything between a bare Debian 12 and a built Lahar. Sourced by examples/run and tests/run.

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)"
build_dir="$root/build/release"

# Debian package : what it is for.
build_packages=(
  "g++:C++20 compiler"
  "cmake:build system"
  "ninja-build:build system"
  "libeigen3-dev:small vectors and matrices"
  "libtbb-dev:task graph and threads"
  "libhdf5-dev:output files for ParaView and Python"
  "zlib1g-dev:checksums of checkpoints"
  "libfmt-dev:text formatting"
  "nlohmann-json3-dev:scenario files"
  "libcli11-dev:command line"
  "robin-map-dev:hash map"
  "libopenmpi-dev:several processes, also on several machines"
  "libscotch-dev:partition over processes"
  "libgdal-dev:elevation rasters and polygons"
  "openmpi-bin:mpirun, which starts them"
  "python3-dev:Python package"
  "pybind11-dev:Python package"
  "python3-numpy:Python package"
)
test_packages=(
  "doctest-dev:test framework"
  "libbenchmark-dev:micro-benchmarks"
  "python3-jsonschema:tests that traces are as their schemas say"
  "python3-vtk9:tests that VTK's own readers open frames"
)
python_test_packages=(
  "python3-venv:test that pip installs the Python package"
  "mypy:test of its types"
  "python3-nbformat:tests that notebooks are as Jupyter wants them"
)
package_packages=(
  "dpkg-dev:libraries that the package for Debian needs"
  "file:which files are programs"
)
browser_packages=("chromium:tests of the pages that lahar trace --html and lahar report write")
guide_packages=(
  "mkdocs:the site of the guide"
  "mkdocs-material:its looks"
)
picture_packages=(
  "python3-pandas:tables in Python"
  "python3-h5py:pictures and comparisons"
  "python3-matplotlib:pictures"
)

say() { printf '%s\n' "== $*"; }
complain() { printf '%s\n' "$*" >&2; }

# Words "package:purpose" of the arguments that are not installed, one per line.
missing_packages() {
  local entry
  for entry in "$@"; do
    if [[ "$(dpkg-query -W -f='${Status}' "${entry%%:*}" 2>/dev/null)" != "install ok installed" ]]; then
      printf '%s\n' "$entry"
    fi
  done
}

# The command that becomes root, into the array `as_root`; fails where there is none.
find_root() {
  as_root=()
  if [[ "$(id -u)" != 0 ]]; then
    command -v sudo >/dev/null || return 1
    as_root=(sudo)
  fi
}

# Install those of "package:purpose" ... that are missing. Says what and why first; touches neither
# network nor apt when nothing is missing.
install_packages() {
  if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    say "Not a Debian system: not checking packages. Needed are the equivalents of: ${*%%:*}"
    return 0
  fi
  local missing=() entry
  mapfile -t missing < <(missing_packages "$@")
  if [[ "${#missing[@]}" == 0 ]]; then
    return 0
  fi
  say "Missing Debian packages, to be installed with apt-get:"
  for entry in "${missing[@]}"; do
    printf '     %-22s %s\n' "${entry%%:*}" "${entry#*:}"
  done
  local as_root
  if ! find_root; then
    complain "Installing them needs root, and there is no sudo. Ask an administrator to run"
    complain "    apt-get install --no-install-recommends ${missing[*]%%:*}"
    complain "and call this script again; it needs neither root nor network then."
    return 1
  fi
  # `env` carries the setting through sudo.
  local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o Dpkg::Use-Pty=0)
  "${apt[@]}" update || complain "apt-get update failed; trying with the package lists already here"
  if ! "${apt[@]}" install -y --no-install-recommends "${missing[@]%%:*}"; then
    complain "apt-get could not install the packages above. Is the network reachable, and is the"
    complain "'main' section of Debian 12 in /etc/apt/sources.list or sources.list.d?"
    return 1
  fi
  say "Packages installed."
}

# Compilers to run at once: one per core, but 1.5 GB of memory for each.
build_jobs() {
  local cores memory
  cores="$(nproc)"
  memory="$(awk '/^MemAvailable:/ {print int($2 / 1500000)}' /proc/meminfo 2>/dev/null || true)"
  if [[ -n "$memory" && "$memory" -lt "$cores" ]]; then
    cores="$memory"
  fi
  echo "$((cores > 0 ? cores : 1))"
}

# configure [cmake option...]: prepare build/release. A build directory that came from elsewhere
# (a copied or moved checkout) is made afresh.
configure() {
  local fresh=() home
  if [[ -f "$build_dir/CMakeCache.txt" ]]; then
    home="$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$build_dir/CMakeCache.txt")"
    if [[ "$home" != "$root" ]]; then
      fresh=(--fresh)
    fi
  fi
  if [[ -n "${CI:-}" ]]; then
    set -- -DLAHAR_WERROR=ON "$@"
  fi
  say "Configuring build/release"
  (cd "$root" && cmake --preset release "${fresh[@]}" -Wno-dev "$@")
}

# build [target...]: compile what changed ("all" for everything).
build() {
  local jobs=()
  if [[ -z "${CMAKE_BUILD_PARALLEL_LEVEL:-}" ]]; then
    jobs=(--parallel "$(build_jobs)")
  fi
  say "Building (only what changed since the last call)"
  cmake --build "$build_dir" "${jobs[@]}" --target "$@"
}

# A Python that can draw, into `python`: Debian's own first, since the packages above belong to it.
find_python() {
  local candidate
  for candidate in /usr/bin/python3 python3; do
    if "$candidate" -c 'import numpy, h5py, matplotlib' 2>/dev/null; then
      python="$candidate"
      return 0
    fi
  done
  return 1
}
