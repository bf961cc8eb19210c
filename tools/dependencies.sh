#!/usr/bin/env bash
# Installs what gdfmap builds and runs with, from the distribution's packages. Safe to run twice: does
# nothing when everything is there.
#
#   tools/dependencies.sh [--tests] [--clang]
set -euo pipefail

PACKAGES=(g++ cmake ninja-build ccache git pkg-config ca-certificates
  libeigen3-dev libceres-dev libsqlite3-dev libxxhash-dev libyaml-cpp-dev
  libcli11-dev libnanoflann-dev nlohmann-json3-dev libcairo2-dev fonts-dejavu-core)
for option in "$@"; do
  case $option in
    --tests) PACKAGES+=(libgtest-dev libpcl-dev libbenchmark-dev) ;;
    --clang) PACKAGES+=(clang-14 libomp-14-dev) ;;
    *) echo "unknown option $option" >&2; exit 2 ;;
  esac
done

missing=()
for package in "${PACKAGES[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' ||
    missing+=("$package")
done
if ((${#missing[@]} == 0)); then
  echo "dependencies: all installed"
  exit 0
fi

echo "dependencies: installing ${missing[*]}"
sudo=()
if ((EUID != 0)); then
  command -v sudo >/dev/null || { echo "needs root or sudo to install packages" >&2; exit 3; }
  sudo=(sudo)
fi
"${sudo[@]}" apt-get update
"${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}"
