#!/bin/sh
# Makes clip.jpg: four clips of `splatd synth interior`, in the folder OUT. Needs splatd in PATH and ffmpeg.
set -eu
out=${1:?usage: clip.sh OUT}
mkdir -p "$out"
splatd synth interior -o "$out/scan"
splatd pack "$out/scan/interior.ptx" --primitives all -o "$out/interior.spld"
n=0
for clip in 'z<2.3' 'z:1.2..1.3' 'box:1,0.6,-1,5.5,3.4,1.9,20' 'z<2.3 and !polygon:2,-1,4.5,-1,5.5,2.2,4,3,2.5,2'; do
    n=$((n + 1))
    splatd render "$out/interior.spld" --eye 3.5,-4.5,10 --target 5,2.05,0.6 --fov 31 --size 480x300 --supersample 2 \
        --background white --clip "$clip" -o "$out/$n.png"
done
ffmpeg -v error -y -i "$out/1.png" -i "$out/2.png" -i "$out/3.png" -i "$out/4.png" -filter_complex \
    'xstack=inputs=4:layout=0_0|w0_0|0_h0|w0_h0' -q:v 5 "$out/clip.jpg"
