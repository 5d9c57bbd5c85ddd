#!/bin/sh
# Makes page.jpg, the page with a part of a courtyard cut away and two places named, and pages.jpg, the gallery and the page on a
# phone, in the folder OUT. Needs splatd in PATH, python3, chromium and ffmpeg; POINTS (2000000) says how many points each scan has.
set -eu
out=${1:?usage: page.sh OUT}
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$out"
for scan in courtyard interior tree; do
    splatd synth "$scan" --points "${POINTS:-2000000}" --format ptx -o "$out/scan"
    splatd pack "$out/scan/$scan.ptx" -o "$out/$scan.spld"
done
. "$here/serve.sh"
serve "$out"/courtyard.spld "$out"/interior.spld "$out"/tree.spld
python3 - "$here/../../tests/e2e" "$service" "$out" <<'PY'
import sys
import time

sys.path.insert(0, sys.argv[1])
from browser import Browser, Page

service, out = sys.argv[2:]
COURTYARD = ("#dataset=courtyard&eye=7,-9,9&target=0,0.5,1&fov=50&clip=box:-9,-3,-1,9,9,5"
             "&mark=2.12,-0.92,1.88,Globe&mark=-4.1,2.7,3.5,Tree")
DRAWN = "/[0-9] ms$|kept/.test(document.querySelector('#facts').textContent)"  # and no longer coarse
LOADED = "document.images.length && [...document.images].every((image) => image.complete)"
with Browser() as browser:
    for name, size, fragment, there in (("page", (1280, 800), COURTYARD, DRAWN), ("gallery", (880, 844), "", LOADED),
                                        ("phone", (500, 844), "#dataset=interior&clip=z%3C2.3", DRAWN)):
        tab = Page(browser, f"{service}/{fragment}", size)
        tab.until(there)
        time.sleep(1)
        tab.picture(f"{out}/{name}.png")
        tab.close()
PY
ffmpeg -v error -y -i "$out/page.png" -q:v 6 "$out/page.jpg"
ffmpeg -v error -y -i "$out/gallery.png" -i "$out/phone.png" -filter_complex hstack -q:v 4 "$out/pages.jpg"
