#!/usr/bin/env bash
# Make the 3D library of the report anew, in page/three/: only for who changes its version, or what is
# taken of it. Needs npm; the build does not, it takes the files as they are in the repository.
set -euo pipefail
three=0.187.0
esbuild=0.25.12

here="$(cd "$(dirname "$0")" && pwd -P)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --no-save --no-audit --no-fund --silent "three@$three" "esbuild@$esbuild"
cat >names.js <<'END'
export { BufferAttribute, BufferGeometry, DataTexture, Float32BufferAttribute, LineBasicMaterial, LineSegments, Mesh,
         PerspectiveCamera, Points, Scene, ShaderMaterial, Vector3, WebGLRenderer } from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
END
npx esbuild names.js --bundle --minify --charset=ascii --legal-comments=none --format=iife \
  --global-name=THREE --outfile=three.min.js
# It is put into an HTML page.
if grep -qi '</script\|<!--' three.min.js; then
  echo "The bundle cannot be put into a page: it has an end of a script." >&2
  exit 1
fi
cp three.min.js "$here/three/"
cp node_modules/three/LICENSE "$here/three/LICENSE"
echo "three.js $three: $(wc -c <three.min.js) bytes"
