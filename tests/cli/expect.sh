#!/usr/bin/env bash
# Runs shell text in a fresh folder and checks what a script would see.
#   expect.sh PROGRAM EXAMPLES STATUS STDOUT_REGEX STDERR_REGEX TEXT
# In TEXT, `spillikin` is the program and $EXAMPLES the folder of example meshes. An error must be one line that starts
# with "spillikin: error: ", and a command that fails must leave no file that was not there before.
set -uo pipefail
program=$1 EXAMPLES=$2 status=$3 out_regex=$4 err_regex=$5 text=$6
export EXAMPLES
spillikin() { "$program" "$@"; }
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
