#!/bin/sh
# Make a package for Debian that suits the processor on which it runs: with programs for all
# processors, for those with AVX2, and for those with AVX-512.
#
#     runtime/program/package.sh      # build/package/lahar_VERSION_amd64.deb
set -eu
cd "$(dirname "$0")/../.."
for preset in package-x86-64-v4 package-x86-64-v3 package; do
  cmake --preset "$preset"
  cmake --build "build/$preset" --target lahar
done
cpack --config build/package/CPackConfig.cmake
