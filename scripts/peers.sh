#!/usr/bin/env bash
# Runs spillikin_peers on a display: the one there is, or a virtual one.
#   scripts/peers.sh BUILD ARGUMENTS...
# Says on one line why it cannot, and fails, where VTK's rendering modules or a display are missing.
set -euo pipefail
peers=$1/bench/spillikin_peers
shift
if [[ ! -x $peers ]]; then
  echo "VTK's rendering modules were not installed when this was built: the peers were not run"
  exit 3
elif [[ -n ${DISPLAY:-} ]]; then
  exec "$peers" "$@"
elif command -v xvfb-run >/dev/null; then
  # -noreset: the peers close and open their windows one after the other.
  exec xvfb-run -a -s "-noreset -screen 0 1280x1024x24" "$peers" "$@"
fi
echo "there is no display (install xvfb for a virtual one): the peers were not run"
exit 3
