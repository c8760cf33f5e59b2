#!/usr/bin/env bash
# Measures everything and writes the report of it.
#   scripts/bench.sh BUILD DATA OUTPUT.md [QUICK]
# DATA is the folder of real meshes; with any fourth word only small meshes are run, to see that all of it works.
set -euo pipefail
build=$1 data=$2 output=$3 quick=${4:-}
here=$(dirname "$0")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

seconds=0.2 frames=5 most=10500000 rounds=3 heaviest=0
if [[ -n $quick ]]; then seconds=0.01 frames=2 most=200000 rounds=1 heaviest=20000; fi

read -r load _ </proc/loadavg # before anything here adds to it
"$build/bench/spillikin_bench" --benchmark_min_time="$seconds" --benchmark_out="$work/bench.json" --benchmark_out_format=json >"$work/bench.log"
if ! "$here/peers.sh" "$build" speed "$data" "$work/peers.md" --rounds "$rounds" --most "$heaviest" >"$work/peers.log"; then
  { [[ ! -s $work/peers.md ]] || cat "$work/peers.md"; echo; echo "Beside VTK: $(tail -n 1 "$work/peers.log")."; } >"$work/peers.part"
  mv "$work/peers.part" "$work/peers.md"
fi
"$build/bench/spillikin_performance" report "$output" --bench "$work/bench.json" --peers "$work/peers.md" --data "$data" --most "$most" --frames "$frames" --load "$load"
