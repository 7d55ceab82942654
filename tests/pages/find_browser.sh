# shellcheck shell=bash
# Find Chromium, as `browser`; it is installed where there is root, apt and no LAHAR_NO_INSTALL. Exit
# status 77: there is none.

# shellcheck source=../../examples/setup.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"

find_browser() {
  browser="$(command -v chromium || command -v chromium-browser || command -v google-chrome)"
}
if ! find_browser && [[ -z "${LAHAR_NO_INSTALL:-}" && "$(id -u)" == 0 ]]; then
  install_packages "${browser_packages[@]}" || true
fi
if ! find_browser; then
  echo "SKIPPED: there is no Chromium (apt-get install chromium)"
  exit 77
fi
