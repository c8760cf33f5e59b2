#!/usr/bin/env bash
# Installs the build into a fresh prefix, builds examples/minimal.cpp against it and runs it.
#   run.sh BUILD_FOLDER SOURCE_FOLDER
set -euo pipefail
build=$1
source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/prefix" >/dev/null
cmake -S "$source/tests/package" -B "$work/build" -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_BUILD_TYPE=Release \
  -DMINIMAL="$source/examples/minimal.cpp" >/dev/null
cmake --build "$work/build" >/dev/null
out=$("$work/build/minimal")
echo "$out"
# The ray through that pixel meets the tetrahedron, which is neither invisible nor opaque.
[[ "$out" =~ ^320\ x\ 240\ pixels,\ opacity\ 0\.([0-9]+)$ ]] && [ "${BASH_REMATCH[1]}" -gt 50 ]
"$work/prefix/bin/spillikin" --version >/dev/null
