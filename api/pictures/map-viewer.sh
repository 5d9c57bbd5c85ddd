#!/bin/sh
# Makes map-viewer.jpg: api/examples/map.html as Chromium shows it, orthophoto and surface model of `splatd synth courtyard`, in the
# folder OUT. Needs splatd in PATH, python3, ffmpeg, chromium, Leaflet (LEAFLET says where: /usr/share/javascript/leaflet); POINTS
# (600000) says how many points the scan has.
set -eu
out=${1:?usage: map-viewer.sh OUT}
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$out/site"
splatd synth courtyard --points "${POINTS:-600000}" --format ptx -o "$out/scan"
splatd pack "$out/scan/courtyard.ptx" -o "$out/hall.spld"
. "$here/serve.sh"
serve --cors '*' "$out/hall.spld"
cp "${LEAFLET:-/usr/share/javascript/leaflet}"/leaflet.* "$here/../examples/map.css" "$out/site"
n=0
for layer in 'surface=""' 'photo="color_by=height\&ramp=turbo\&shade=edl" surface=""'; do
    n=$((n + 1))
    sed "s|http://127.0.0.1:8080|$service|; s|surface=\"[^\"]*\"|$layer|" "$here/../examples/map.html" >"$out/site/map.html"
    # the page itself comes from a file, so its scripts do, too
    chromium --headless=new --no-sandbox --disable-gpu --hide-scrollbars --allow-file-access-from-files --user-data-dir="$out/chromium" \
        --window-size=640,560 --virtual-time-budget=20000 --screenshot="$out/$n.png" "file://$(cd "$out/site" && pwd)/map.html" 2>"$out/chromium.log"
done
ffmpeg -v error -y -i "$out/1.png" -i "$out/2.png" -filter_complex hstack -q:v 4 "$out/map-viewer.jpg"
