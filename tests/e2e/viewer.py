"""What all tests of the page stand on: a real Chromium, a real daemon that serves the wall of tests/http, whose
surface is x = 0.2 sin(y), so that coordinates can be checked, and how to wait for the page."""
import contextlib
import json
import math
import pathlib
import re
import sys
import time
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "http"))
import browser
from browser import Browser, Page
from harness import REAL, Daemon, run

if not browser.BINARY:
    print("skipped: there is no chromium")
    sys.exit(77)

FACING = "#dataset=wall&eye=3,0,1&target=0,0,1&up=0,0,1&fov=50"
REST = "document.querySelector('#stage').classList.contains('rest')"
# A digest of the pixels on screen, and how many colours there are among some of them.
DIGEST_OF = """(c => {
    const copy = new OffscreenCanvas(c.width, c.height).getContext('2d');
    copy.drawImage(c, 0, 0);
    const d = copy.getImageData(0, 0, c.width, c.height).data;
    let h = 0; const colours = new Set();
    for (let i = 0; i < d.length; i += 52) {
        h = (h * 31 + d[i] + 256 * d[i + 1] + 65536 * d[i + 2]) | 0;
        colours.add(d[i] >> 3 | d[i + 1] >> 3 << 5);
    }
    return [h, colours.size, c.width, c.height]; })"""
DIGEST = f"{DIGEST_OF}(document.querySelector('canvas'))"
VIEWS = "fetched.filter(url => url.includes('/view?'))"
chromium = Browser()
daemon = Daemon(REAL)
SITE = f"http://127.0.0.1:{daemon.port}"


@contextlib.contextmanager
def page(url=f"{SITE}/{FACING}", ready=REST, complaints=r"(?!)", **how):
    """A tab that shows `url`, once its picture rests; nothing but the `complaints` that are expected may come up."""
    tab = Page(chromium, url, **how)
    try:
        if ready:
            tab.until(ready)
            tab.drawn()
        yield tab
        wrong = [c for c in tab.complaints if not re.search(complaints, c)]
        assert not wrong, wrong
        tab.run("localStorage.clear()")
    finally:
        tab.close()


def settled(tab, before=None):
    """Digest of the picture at rest; other than `before` if that is given."""
    tab.until(REST)
    if before is not None:
        tab.until(
            f"JSON.stringify({DIGEST}) !== {json.dumps(json.dumps(before, separators=(',', ':')))}", "another picture"
        )
    return tab.run(DIGEST)


def link(tab):
    return read_link(tab.run("location.hash"))


def read_link(text):
    """The fragment as {name: text}, vectors as lists of floats."""
    found = dict(urllib.parse.parse_qsl(text.removeprefix("#")))
    return {k: [float(x) for x in v.split(",")] if k in ("eye", "target", "up") else v for k, v in found.items()}


def moved(tab, camera):
    """Waits until the fragment has another eye or target, at rest."""
    return next_link(tab, lambda now: now["eye"] != camera["eye"] or now["target"] != camera["target"])


def next_link(tab, wanted):
    """The fragment at rest, once it is as wanted: in the middle of a motion the page may rest, too, and say where it is."""
    end = time.monotonic() + browser.PATIENCE
    while not (text := tab.run(f"{REST} && location.hash")) or not wanted(now := read_link(text)):
        assert time.monotonic() < end, link(tab)
        time.sleep(0.05)
    return now


def far(a, b):
    return math.dist(a, b)


def middle(tab):
    return tab.run(
        "(b => [b.x + b.width / 2, b.y + b.height / 2])(document.querySelector('#stage').getBoundingClientRect())"
    )


def appeared(folder, pattern):
    """A download has its name once it is whole."""
    end = time.monotonic() + browser.PATIENCE
    while not (found := list(pathlib.Path(folder).glob(pattern))):
        assert time.monotonic() < end, f"{pattern} was not downloaded"
        time.sleep(0.05)
    return found[0]


def sent(tab):
    """The parameters of the newest view that was asked for."""
    return dict(urllib.parse.parse_qsl(urllib.parse.urlsplit(tab.run(VIEWS)[-1]).query))


def lonlat(world):
    reply = daemon.ask(f"/v1/datasets/wall/place?crs=EPSG:4326&world={','.join(map(str, world))}")
    return ",".join(map(repr, reply.json()["position"]))


def main(tests):
    """Runs the tests of a module; the daemon and the browser are theirs."""
    try:
        with daemon:
            run(tests)
    finally:
        chromium.close()
