#!/usr/bin/env bash
# Builds the fuzzers and gives each a number of inputs; ends with 1 when one of them finds something,
# which is then in build/fuzz/findings. What they learn stays in build/fuzz/work for the next time.
#
#   tools/fuzz.sh                    every target, a million inputs each
#   RUNS=10000 tools/fuzz.sh ply yaml
set -euo pipefail
cd "$(dirname "$0")/.."

targets=("$@")
if ((${#targets[@]} == 0)); then targets=(ply pcd las xyz poses block tile surroundings gdf1 csv yaml); fi
runs=${RUNS:-1000000}

tools/dependencies.sh --tests --clang
cmake --preset fuzz
cmake --build --preset fuzz -j "$(nproc)" --target "${targets[@]/#/fuzz_}"

export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
mkdir -p build/fuzz/findings
failed=0
for target in "${targets[@]}"; do
  work=build/fuzz/work/$target
  mkdir -p "$work"
  # No single allocation over 64 MiB, whatever the input claims.
  nice "build/fuzz/bin/fuzz_$target" "$work" "tests/fuzz/corpus/$target" -runs="$runs" -max_len=4096 \
    -malloc_limit_mb=64 -rss_limit_mb=1024 -timeout=10 -print_final_stats=1 \
    -artifact_prefix="build/fuzz/findings/$target-" >"$work.log" 2>&1 || failed=1
  echo "$target: $(sed -n 's/^stat::number_of_executed_units: *//p' "$work.log") inputs," \
    "$(ls build/fuzz/findings | grep -c "^$target-" || true) findings, log $work.log"
done
exit $failed
