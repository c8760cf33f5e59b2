#!/bin/sh
# Every visibility sort that calls itself exact, on every mesh of a folder and on made ones, from 50 random viewpoints
# outside and inside: fails when cells come in the wrong order on any ray where none overlap.
#   verify.sh BUILD DATA
set -e
build=$1
data=$2
cases=$(find "$data" -mindepth 2 -maxdepth 2 -name '*.foam')  # meshes that are folders
"$build/bench/spillikin_orders" --strict --views 50 --rays 32 --repeat 1 \
    --sorts mpvo,mpvonc,xmpvo,bsp-xmpvo,convexified,power,newell \
    grid:12 curved:12 delaunay:3000 shell:12 tori:6 ring:7 bar:8 "$data" $cases
