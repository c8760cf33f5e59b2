#!/usr/bin/env bash
# The arrows between rooms go one way. Fails and names each include that goes against them, each use of VTK outside of
# io/, each room without a README, and each public header that does not compile alone.
set -euo pipefail
cd "$(dirname "$0")/.."

declare -A may=(
  [base]="base"
  [mesh]="base mesh"
  [sort]="base mesh sort"
  [project]="base mesh sort project"
  [integrate]="base integrate"
  [composite]="base mesh sort project integrate composite"
  [reference]="base mesh integrate reference"
  [io]="base mesh integrate io"
  [render]="base mesh sort project integrate composite reference io render"
  [cli]="base mesh sort project integrate composite reference io render cli"
)
failed=0
for room in "${!may[@]}"; do
  while IFS=: read -r file _ include; do
    to=$(sed -E 's|.*"spillikin/([a-z]+)/.*|\1|' <<<"$include")
    if [[ " ${may[$room]} " != *" $to "* ]]; then
      echo "$file: room $room must not include room $to"
      failed=1
    fi
  done < <(grep -nE '#include "spillikin/' "spillikin/$room"/*.h "spillikin/$room"/*.cpp 2>/dev/null)
  [ -f "spillikin/$room/README.md" ] || { echo "spillikin/$room: has no README.md"; failed=1; }
done
# What the ground truth checks must not be part of it: of integrate/, only transfer functions, the segment and quadrature.
if grep -nE '#include <vtk' -r spillikin --include=*.h --include=*.cpp | grep -v '^spillikin/io/'; then
  echo "VTK is for io/ alone"
  failed=1
fi
for library in "tetgen tetgen_filling" "glpk weights"; do
  if grep -nE "#include <${library% *}\.h>" -r spillikin --include=*.h --include=*.cpp | grep -v "^spillikin/sort/${library#* }\.cpp:"; then
    echo "${library% *} is for spillikin/sort/${library#* }.cpp alone"
    failed=1
  fi
done
exit $failed
