#!/bin/sh
# Makes default-views.jpg: the views that pack finds of a flat and a courtyard, which were scanned from inside, of trees, and of a
# power line from the air, in the folder OUT. Needs splatd in PATH and ffmpeg; POINTS (400000) says how many points each has.
set -eu
out=${1:?usage: default-views.sh OUT}
mkdir -p "$out"
n=0
for scan in interior.ptx courtyard.ptx tree.ptx powerline.las; do
    n=$((n + 1))
    splatd synth "${scan%.*}" --points "${POINTS:-400000}" --format "${scan#*.}" -o "$out/scan"
    splatd pack "$out/scan/$scan" -o "$out/$n.spld"
    splatd render "$out/$n.spld" --size 480x270 --supersample 2 --background white -o "$out/$n.png"
done
ffmpeg -v error -y -i "$out/1.png" -i "$out/2.png" -i "$out/3.png" -i "$out/4.png" -filter_complex \
    'xstack=inputs=4:layout=0_0|w0_0|0_h0|w0_h0' -q:v 5 "$out/default-views.jpg"
