#!/usr/bin/env bash
# Makes the pictures of the documentation.
#   scripts/pictures.sh [SPILLIKIN]
set -euo pipefail
cd "$(dirname "$0")/.."
spillikin=${1:-build/release/bin/spillikin}
mkdir -p docs/pictures
"$spillikin" render examples/bluntfin.vts --field Density --range 0.6,2.6 --tf plasma --opacity 1.6 --azimuth 25 --elevation 25 \
  --zoom 1.55 --size 900x520 -o docs/pictures/bluntfin.png
"$spillikin" render examples/disk_out_ref.ex2 --field Temp --range 350,900 --tf inferno --opacity 1.5 --azimuth 35 --elevation 25 \
  --zoom 1.6 --size 600x450 -o docs/pictures/disk.png
"$spillikin" render examples/post.vtk --azimuth 35 --elevation 35 --zoom 1.5 --size 600x450 -o docs/pictures/post.png
