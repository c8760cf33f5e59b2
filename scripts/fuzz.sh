#!/bin/sh
# Damages small files of every format and reads them: each must be read to a consistent mesh or refused in one line. Then
# draws random pictures, which the ground truth judges. Then orders random meshes of curved cells from everywhere: no ray
# may meet an inversion.
#   fuzz.sh BUILD_FOLDER    RUNS, PICTURES, MESHES and SEED in the environment choose how many files of each format, how
#                           many pictures, how many times six meshes, and from which seed on
set -eu
runs=${RUNS:-2000}
seed=${SEED:-$(date +%s)}
echo "$runs damaged files of each format, from seed $seed on"
SPILLIKIN_FUZZ_RUNS=$runs SPILLIKIN_FUZZ_SEED=$seed "$1"/tests/io_test --gtest_filter='*Fuzz*' --gtest_brief=1 |
  awk '/^[0-9]+: / {refused++; if ($0 ~ /crashed/) crashed++; next} {print}
       END {printf "%d files were refused, %d of them by a reader that crashed in its own process\n", refused, crashed}'

pictures=${PICTURES:-1000}
echo "$pictures pictures, from seed $seed on"
SPILLIKIN_FUZZ_RUNS=$pictures SPILLIKIN_FUZZ_SEED=$seed "$1"/tests/render_test --gtest_filter='*Fuzz*' --gtest_brief=1

meshes=${MESHES:-40}
echo "$meshes times six meshes of curved cells, from seed $seed on"
last=$((seed + meshes))
while [ "$seed" -lt "$last" ]; do
  SPILLIKIN_FUZZ_SEED=$seed "$1"/tests/sort_test --gtest_filter=ProblemCells.PartsOfCurvedCellsAreInOrder --gtest_brief=1
  seed=$((seed + 1))
done
