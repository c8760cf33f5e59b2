#!/usr/bin/env bash
# Every mesh of a folder against the reference, then VTK's mappers on the same truth; one report.
#   scripts/accuracy.sh BUILD DATA OUTPUT.md [SIZE]
set -euo pipefail
build=$1 data=$2 output=$3 size=${4:-96}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

status=0
"$build/bench/spillikin_accuracy" "$data" "$output" "$size" || status=$?
if "$(dirname "$0")/peers.sh" "$build" accuracy "$data" "$work/peers.md" --size "$size" >"$work/peers.log"; then
  cat "$work/peers.md" >>"$output"
else
  { printf '\n## Against the mappers of VTK\n\n'; [[ ! -s $work/peers.md ]] || cat "$work/peers.md"; tail -n 1 "$work/peers.log"; } >>"$output"
fi
exit $status
