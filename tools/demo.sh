#!/usr/bin/env bash
# Builds gdfmap in Release and runs the main job: ingest, train, query, export, slice.
#
#   ./tools/demo.sh                     on a generated city of 2 million points
#   ./tools/demo.sh CLOUD...            on your clouds (PLY, PCD, LAS, XYZ/CSV)
#
# The results go to out/demo (OUT=DIR for another place); an earlier demo there is continued, so that a
# second run with the same clouds finds nothing to do.
set -euo pipefail
caller=$PWD
cd "$(dirname "$0")/.."

out=${OUT:-out/demo}
clouds=()
for cloud in "$@"; do
  [[ $cloud == /* ]] || cloud=$caller/$cloud
  [[ -r $cloud ]] || { echo "cannot read $cloud" >&2; exit 3; }
  clouds+=("$cloud")
done

tools/dependencies.sh
echo "== build (release)"
cmake --preset release -DGDFMAP_TESTS=OFF -DGDFMAP_BENCHMARKS=OFF >/dev/null
cmake --build --preset release -j "$(nproc)" --target gdfmap_program
gdfmap=$PWD/build/release/bin/gdfmap
mkdir -p "$out"
started=$SECONDS

name=map
if ((${#clouds[@]} == 0)); then
  name=city
  if [[ ! -e $out/city.ply ]]; then
    echo "== synth: a city of 60 m with 2 million points"
    "$gdfmap" synth city "$out/city.ply" --points 2000000 --size 60
  fi
  clouds=("$out/city.ply")
fi
map=$out/$name.gdfmap

echo "== ingest"
"$gdfmap" ingest "$map" "${clouds[@]}"
echo "== train"
"$gdfmap" train "$map"
echo "== query: distance and gradient at three places inside the cloud"
# The middle of the box of the cubes that hold points.
read -r x y z < <("$gdfmap" info "$map" | awk '
  $1 == "from" { gsub(",", " "); lx = $2; ly = $3; lz = $4 }
  $1 == "to" { gsub(",", " "); print (lx + $2) / 2, (ly + $3) / 2, (lz + $4) / 2 }')
"$gdfmap" query "$map" --at="$x,$y,$z" --at="$x,$y,$(awk "BEGIN {print $z + 0.5}")" \
  --at="$(awk "BEGIN {print $x + 1}"),$y,$z" | tee "$out/query.csv"
echo "== export"
"$gdfmap" export "$map" "$out/$name.bin"
echo "== slice"
"$gdfmap" slice "$map" --axis z --at "$z" --out "$out/$name.png"
echo "== evaluate"
"$gdfmap" evaluate "$map" --samples 50000

size() { du -sh "$1" | cut -f1; }
echo
echo "done in $((SECONDS - started)) s"
printf '%-22s %8s  %s\n' what size where
printf '%-22s %8s  %s\n' \
  "map" "$(size "$map")" "$map" \
  "GDF1 model" "$(size "$out/$name.bin")" "$out/$name.bin" \
  "slice" "$(size "$out/$name.png")" "$out/$name.png" \
  "queries" "$(size "$out/query.csv")" "$out/query.csv"
