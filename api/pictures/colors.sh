#!/bin/sh
# Makes colors-street.jpg (colours beside intensity), colors-class.jpg (a power line by class) and colors-trees.jpg (a tree
# without and with eye-dome lighting, with a sun, by height) in the folder OUT, of scans that are named, a street with its
# camera in $STREET_VIEW, a power line with its in $LINE_VIEW; without them, of synthetic ones. Needs splatd in PATH and ffmpeg.
set -eu
out=${1:?usage: colors.sh OUT [STREET POWERLINE TREE]}
mkdir -p "$out"
if [ $# = 1 ]; then
    for scan in railway powerline tree; do
        splatd synth $scan --classes --points "${POINTS:-400000}" --format las -o "$out"
    done
    set -- "$out" "$out/railway.las" "$out/powerline.las" "$out/tree.las"
fi
splatd pack "$2" -o "$out/1.spld"
splatd pack "$3" -o "$out/2.spld"
splatd pack "$4" -o "$out/3.spld"
render() {
    splatd render "$out/$1.spld" --supersample 2 -o "$out/$2.png" $3
}
render 1 rgb "--size 480x270 ${STREET_VIEW-}"
render 1 intensity "--size 480x270 ${STREET_VIEW-} --color-by intensity"
render 2 class "--size 480x270 ${LINE_VIEW-} --color-by class"
ffmpeg -v error -y -i "$out/rgb.png" -i "$out/intensity.png" -filter_complex hstack -q:v 5 "$out/colors-street.jpg"
ffmpeg -v error -y -i "$out/class.png" -q:v 4 "$out/colors-class.jpg"
render 3 none "--size 240x360 --background white --shade none"
render 3 edl "--size 240x360 --background white --shade edl"
render 3 sun "--size 240x360 --background white --shade edl+sun:200,35"
render 3 height "--size 240x360 --background white --color-by height --ramp turbo"
ffmpeg -v error -y -i "$out/none.png" -i "$out/edl.png" -i "$out/sun.png" -i "$out/height.png" -filter_complex \
    hstack=inputs=4 -q:v 4 "$out/colors-trees.jpg"
