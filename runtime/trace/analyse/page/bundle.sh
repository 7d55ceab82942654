#!/usr/bin/env bash
# Make the chart library of the page anew, in page/uplot/: only for who changes its version. Needs
# npm; the build does not, it takes the files as they are in the repository.
set -euo pipefail
uplot=1.6.32
esbuild=0.25.12

here="$(cd "$(dirname "$0")" && pwd -P)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --no-save --no-audit --no-fund --silent "uplot@$uplot" "esbuild@$esbuild"
options=(--bundle --minify --charset=ascii --legal-comments=inline)
echo 'export { default } from "uplot";' |
  npx esbuild "${options[@]}" --format=iife --global-name=uPlotModule --footer:js='var uPlot=uPlotModule.default;' \
    --outfile=uplot.min.js
npx esbuild "${options[@]}" --outfile=uplot.min.css node_modules/uplot/dist/uPlot.min.css
# Both are put into one HTML page.
if grep -qi '</script\|</style\|<!--\|)page"' uplot.min.js uplot.min.css; then
  echo "The bundle cannot be put into a page: it has an end of a script, style or string." >&2
  exit 1
fi
cp uplot.min.js uplot.min.css "$here/uplot/"
cp node_modules/uplot/LICENSE "$here/uplot/LICENSE"
echo "uPlot $uplot: $(wc -c <uplot.min.js) bytes"
