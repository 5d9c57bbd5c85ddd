#!/bin/sh
# Makes page.jpg, the page with a part of a courtyard cut away and two places named, and pages.jpg, the gallery and the page on a
# phone, in the folder OUT. Needs splatd in PATH, curl, chromium and ffmpeg; POINTS (2000000) says how many points each scan has.
set -eu
out=${1:?usage: page.sh OUT}
mkdir -p "$out"
for scan in courtyard interior tree; do
    splatd synth "$scan" --points "${POINTS:-2000000}" --format ptx -o "$out/scan"
    splatd pack "$out/scan/$scan.ptx" -o "$out/$scan.spld"
done
splatd serve --listen 127.0.0.1:0 --ops-listen 127.0.0.1:0 "$out"/courtyard.spld "$out"/interior.spld "$out"/tree.spld 2>"$out/log" &
daemon=$!
trap 'kill $daemon' EXIT
until service=$(sed -n 's|.*listening on \(http://[^ ]*[0-9]\)/.*|\1|p' "$out/log"); grep -q ready "$out/log" && [ -n "$service" ]; do
    kill -0 $daemon
    sleep 0.1
done
shoot() { # name, size, pixels of the screen a pixel, fragment
    chromium --headless=new --no-sandbox --disable-gpu --hide-scrollbars --user-data-dir="$out/chromium" --window-size="$2" \
        --force-device-scale-factor="$3" --virtual-time-budget=60000 --screenshot="$out/$1.png" "$service/$4" 2>"$out/chromium.log"
}
# kernels of what is cut are compiled now, or the browser waits for less than they take
curl -s -o "$out/first.jpg" "$service/v1/datasets/courtyard/view?clip=box:-9,-3,-1,9,9,5"
shoot page 1280,800 1 '#dataset=courtyard&eye=7,-9,9&target=0,0.5,1&fov=50&clip=box:-9,-3,-1,9,9,5&mark=2.12,-0.92,1.88,Globe&mark=-4.1,2.7,3.5,Tree'
shoot gallery 880,844 1 ''
shoot phone 500,844 1 '#dataset=interior&clip=z%3C2.3'
ffmpeg -v error -y -i "$out/page.png" -q:v 6 "$out/page.jpg"
ffmpeg -v error -y -i "$out/gallery.png" -i "$out/phone.png" -filter_complex hstack -q:v 4 "$out/pages.jpg"
