#!/bin/sh
# Makes around.jpg: `splatd synth interior` all around, as six faces, and through a fisheye, in the folder OUT. Needs splatd in
# PATH and ffmpeg; POINTS (1000000) says how many points the scan has.
set -eu
out=${1:?usage: around.sh OUT}
mkdir -p "$out"
splatd synth interior --points "${POINTS:-1000000}" -o "$out/scan"
splatd pack "$out/scan/interior.ptx" --primitives all -o "$out/interior.spld"
view() {
    splatd render "$out/interior.spld" --eye 3.2,1.6,1.6 --target 5,2.6,1.6 --supersample 2 "$@"
}
view --projection equirectangular --size 960 -o "$out/1.png"
view --projection cube --size 1440 -o "$out/3.png"
view --projection fisheye --fov 200 --size x480 --background white -o "$out/4.png"
ffmpeg -v error -y -i "$out/1.png" -i "$out/4.png" -i "$out/3.png" -filter_complex \
    '[0][1]hstack[a];[2]scale=1440:240[b];[a][b]vstack' -q:v 5 "$out/around.jpg"
