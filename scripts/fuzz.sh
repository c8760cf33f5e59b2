#!/bin/sh
# Damages small files of every format and reads them: each must be read to a consistent mesh or refused in one line.
#   fuzz.sh BUILD_FOLDER    RUNS and SEED in the environment choose how many files of each format, and from which seed on
set -eu
runs=${RUNS:-2000}
seed=${SEED:-$(date +%s)}
echo "$runs damaged files of each format, from seed $seed on"
SPILLIKIN_FUZZ_RUNS=$runs SPILLIKIN_FUZZ_SEED=$seed "$1"/tests/io_test --gtest_filter='*Fuzz*' --gtest_brief=1 |
  awk '/^[0-9]+: / {refused++; if ($0 ~ /crashed/) crashed++; next} {print}
       END {printf "%d files were refused, %d of them by a reader that crashed in its own process\n", refused, crashed}'
