#!/bin/sh
# Make a package for Debian that suits the processor on which it runs: with programs for all
# processors, for those with AVX2, and for those with AVX-512.
#
#     runtime/program/package.sh [PRESET...]      # build/package/lahar_VERSION_amd64.deb
#
# Without presets: all of them. The last one has to be `package`: it takes in those that are built.
set -eu
cd "$(dirname "$0")/../.."
[ $# -gt 0 ] || set -- package-x86-64-v4 package-x86-64-v3 package
for preset; do
  cmake --preset "$preset"
  cmake --build "build/$preset"
done
cpack --config build/package/CPackConfig.cmake
