#!/bin/sh
# Makes clip.jpg: four clips of `splatd synth interior`, in the folder OUT. Needs splatd in PATH and ffmpeg;
# POINTS (1000000) says how many points the scan has.
set -eu
out=${1:?usage: clip.sh OUT}
mkdir -p "$out"
splatd synth interior --points "${POINTS:-1000000}" -o "$out/scan"
splatd pack "$out/scan/interior.ptx" --primitives all -o "$out/interior.spld"
from_above='--eye 3.5,-4.5,10 --target 5,2.05,0.6 --fov 31'
render() {
    splatd render "$out/interior.spld" --size 480x300 --supersample 2 --background white --clip "$1" $3 -o "$out/$2.png"
}
render 'z<2.3' 1 "$from_above"
render 'z:1.2..1.3' 2 '--projection orthographic --view-height 6.6 --eye 5,2.2,9 --target 5,2.2,0 --color-by flat:#202020 --shade none'
render 'box:1,0.6,-1,5.5,3.4,1.9,20' 3 "$from_above"
render 'z<2.3 and !polygon:2,-1,4.5,-1,5.5,2.2,4,3,2.5,2' 4 "$from_above"
ffmpeg -v error -y -i "$out/1.png" -i "$out/2.png" -i "$out/3.png" -i "$out/4.png" -filter_complex \
    'xstack=inputs=4:layout=0_0|w0_0|0_h0|w0_h0' -q:v 5 "$out/clip.jpg"
