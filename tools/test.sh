#!/usr/bin/env bash
# Installs the dependencies, builds gdfmap and runs every test. Safe to run twice.
#
#   ./tools/test.sh                  the development build
#   ./tools/test.sh asan             the same under address and undefined-behaviour sanitizers
#   ./tools/test.sh tsan             under the thread sanitizer (needs clang-14 and libomp-14-dev)
#   ./tools/test.sh dev -L soak      further arguments go to ctest; `soak` is left out by default
set -euo pipefail
cd "$(dirname "$0")/.."

preset=dev
if (($# > 0)); then
  preset=$1
  shift
fi
selection=(-LE soak)
if (($# > 0)); then selection=("$@"); fi

needs=(--tests)
if [[ $preset == tsan ]]; then needs+=(--clang); fi
tools/dependencies.sh "${needs[@]}"
echo "== configure ($preset)"
cmake --preset "$preset"
echo "== build"
cmake --build --preset "$preset" -j "$(nproc)"
echo "== test"
ctest --preset "$preset" -j "$(nproc)" "${selection[@]}"
