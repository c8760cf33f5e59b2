#!/usr/bin/env bash
# Runs shell text in a fresh folder and checks what a script would see.
#   expect.sh PROGRAM EXAMPLES STATUS STDOUT_REGEX STDERR_REGEX TEXT
# In TEXT, `spillikin` is the program, $EXAMPLES the folder of example meshes and `cubes` makes two hexahedra. An error must be one line that starts
# with "spillikin: error: ", and a command that fails must leave no file that was not there before.
set -uo pipefail
program=$1 EXAMPLES=$2 status=$3 out_regex=$4 err_regex=$5 text=$6
export EXAMPLES
spillikin() { "$program" "$@"; }
# cubes FILE [N="x y z"] [array=NAME] [value="..."] [first="ids"] [second="ids"]: the box [0,2]x[0,1]x[0,1] as two
# hexahedra in a legacy file, with other places for points, another name or other values for the point array, other
# corners for a cell; second= leaves it out. shift="x y z" is the value of the vector D at every point.
cubes() {
  local file=$1 array=T value="1 2 3 4 5 6 7 8 9 10 11 12" first="0 1 4 3 6 7 10 9" second="1 2 5 4 7 8 11 10" shift="0 0 0" change
  shift
  local -a point=("0 0 0" "1 0 0" "2 0 0" "0 1 0" "1 1 0" "2 1 0" "0 0 1" "1 0 1" "2 0 1" "0 1 1" "1 1 1" "2 1 1")
  for change in "$@"; do
    case $change in
      array=*) array=${change#*=} ;;
      value=*) value=${change#*=} ;;
      first=*) first=${change#*=} ;;
      second=*) second=${change#*=} ;;
      shift=*) shift=${change#*=} ;;
      *) point[${change%%=*}]=${change#*=} ;;
    esac
  done
  local cells=2
  [ -n "$second" ] || cells=1
  {
    printf '# vtk DataFile Version 3.0\ncubes\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 12 double\n'
    printf '%s\n' "${point[@]}"
    printf 'CELLS %d %d\n' "$cells" $((9 * cells))
    printf '8 %s\n' "$first"
    [ -z "$second" ] || printf '8 %s\n' "$second"
    printf 'CELL_TYPES %d\n' "$cells"
    for ((change = 0; change < cells; ++change)); do echo 12; done
    printf 'POINT_DATA 12\nSCALARS %s double 1\nLOOKUP_TABLE default\n%s\nVECTORS D double\n' "$array" "$value"
    for change in "${point[@]}"; do echo "$shift"; done
  } >"$file"
}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/in"
cd "$work/in" || exit 1
{ eval "$text"; } >"$work/out" 2>"$work/err" </dev/null
seen=$?
fail() {
  echo "FAILED: $1"
  echo "--- command: $text"
  echo "--- status: $seen"
  echo "--- stdout:"; head -c 4000 "$work/out"
  echo "--- stderr:"; head -c 4000 "$work/err"
  exit 1
}
[ "$seen" -eq "$status" ] || fail "exit status $seen, expected $status"
grep -qE -- "$out_regex" "$work/out" || [ -z "$out_regex" ] || fail "stdout does not match $out_regex"
grep -qE -- "$err_regex" "$work/err" || [ -z "$err_regex" ] || fail "stderr does not match $err_regex"
if [ "$seen" -ne 0 ]; then
  grep -q '^spillikin: error: ' "$work/err" || [ -n "${EXPECT_QUIET:-}" ] || fail "no line 'spillikin: error: ...' on stderr"
  [ "$(grep -vc '^spillikin: warning: ' "$work/err")" -le 1 ] || fail "the error is more than one line"
  left=$(find . -name '*.png*' -o -name '*.exr*' -o -name '*.npy*' | head -3)
  [ -z "$left" ] || [ -n "${EXPECT_FILES:-}" ] || fail "files left behind: $left"
fi
exit 0
