"""The page in a real Chromium, over real daemons: what people see, do and are told. The wall of tests/http is the
dataset: its surface is x = 0.2 sin(y), so that coordinates can be checked."""
import base64
import contextlib
import csv
import http.server
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse
import zipfile

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "http"))
import browser
from browser import Browser, Page
from harness import FAKE, MAPPED, REAL, TEXTURED, WALL, Daemon, eventually, run

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
# Frames that are counted: time stands still once `left` of them have come, so that what moves moves as far everywhere.
STEPS = """(usual => { window.left = 0; let now = 0; window.requestAnimationFrame = step => usual(() => {
    if (left > 0) { left--; now += 16; }
    step(now); }); })(requestAnimationFrame)"""
# Whether a picture was ever bent: it is straight again as soon as the next frame has come.
BENT = """(canvas => { window.bent = false;
    new MutationObserver(() => { window.bent ||= canvas.style.transform.startsWith('matrix3d'); })
        .observe(canvas, {attributes: true}); })(document.querySelector('canvas'))"""

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


def test_a_picture_appears():
    with page(f"{SITE}/") as tab:
        digest = settled(tab)
        assert digest[1] > 50, f"an empty picture: {digest}"
        assert tab.text("title") == "wall – splatd" and "1 600 points" in tab.text("#about").replace("\u202f", " ")
        assert re.fullmatch(r"\d+ × \d+, (\d+ ms|kept from before)", tab.text("#facts")), tab.text("#facts")
        view = daemon.ask("/v1/datasets/wall").json()["default_view"]
        assert far(link(tab)["eye"], view["eye"]) < 0.01 and far(link(tab)["target"], view["target"]) < 0.01
        assert tab.run("document.querySelector('#dataset').value") == "wall"


def test_the_camera_is_the_one_of_the_service():
    """Axes and projection as in the reply's Splatd-Camera; a bent frame has points of the target's plane where they
    are."""
    cameras = [
        dict(eye=[3, 0.5, 1], target=[0, 0.1, 0.9], up=[0, 0, 1], fov=50),
        dict(eye=[-2, 7, 3], target=[0, 0, 1], up=[0.1, 1, 0.5], fov=20),
    ]
    with page() as tab:
        for camera in cameras:
            params = {**{k: ",".join(map(str, v)) for k, v in camera.items() if k != "fov"}, "fov": camera["fov"]}
            used = json.loads(daemon.view(**params, width=400, height=300).headers["Splatd-Camera"])
            right, down, forward = tab.run(
                f"import('/viewer/camera.js').then(m => Object.values(m.axes({json.dumps(camera)})))"
            )
            assert all(abs(a - b) < 1e-12 for a, b in zip(right + down + forward, used["rotation"])), (
                right,
                down,
                forward,
            )
            assert (
                abs(tab.run(f"import('/viewer/camera.js').then(m => m.focal({json.dumps(camera)}, 300))") - used["fx"])
                < 1e-9
            )
        worst = tab.run(
            f"""import('/viewer/camera.js').then(m => {{
            const from = {json.dumps(cameras[0])}, near = m.dolly(from, 0.8, [400, 300], [100, 80], 0.1);
            const to = m.pan(m.orbit(near, 0.2, -0.1), 20, 10, 300);
            const css = new DOMMatrix(m.warp(from, to, [400, 300])), d = m.distance(from);
            return Math.max(...[[0, 0], [400, 0], [30, 270], [200, 150]].map(pixel => {{
                const world = m.add(from.eye, m.times(m.ray(from, [400, 300], pixel), d));
                const there = m.project(to, [400, 300], world), bent = css.transformPoint(new DOMPoint(...pixel));
                return Math.hypot(bent.x / bent.w - there[0], bent.y / bent.w - there[1]);
            }})); }})"""
        )
        assert worst < 0.1, f"{worst} pixels off"  # CSS keeps six digits
        assert (
            tab.run(
                f"""import('/viewer/camera.js').then(m => {{
                    const from = {json.dumps(cameras[0])}; return m.warp(from, m.look(from, 3, 0), [400, 300]); }})"""
            )
            == ""
        )


def test_plans_and_elevations():
    """A button looks from a side, orthographically, and back; what a point's pixel shows is there."""
    with page() as tab:
        before = settled(tab)
        home = link(tab)
        tab.run("document.querySelector('#top').click()")
        top = next_link(tab, lambda now: now.get("projection") == "orthographic")
        assert settled(tab, before)[1] > 0 and "fov" not in top and far(top["eye"][:2], top["target"][:2]) < 1e-6
        assert top["eye"][2] > top["target"][2] and top["up"] == [0, 1, 0]
        bounds = daemon.ask("/v1/datasets/wall").json()["bounds"]
        size, (width, height) = [b - a for a, b in zip(bounds["min"], bounds["max"])], tab.run("[stage.clientWidth, stage.clientHeight]")

        def frames(view, across, upright):  # the whole of it, in the middle, in the picture's aspect
            assert all(abs(view["target"][i] - (bounds["min"][i] + bounds["max"][i]) / 2) < 1e-3 for i in (across, upright)), (view, bounds)
            assert abs(float(view["view_height"]) / max(size[upright], size[across] * height / width) - 1.04) < 1e-2, (view, size)

        frames(top, 0, 1)
        long, unit = tab.text("#scale").split()
        bar = tab.run("document.querySelector('#scale i').getBoundingClientRect().width")
        assert abs(bar * float(top["view_height"]) / height / float(long) - 1) < 0.02 and unit == "us-ft" and re.fullmatch(r"0\.0*[125]|[125]0*", long), (bar, long)
        assert tab.run("document.querySelector('#top').ariaPressed") == "true"
        tab.run("document.querySelector('#front').click()")
        front = next_link(tab, lambda now: now["up"] == [0, 0, 1] and "projection" in now)
        assert abs(front["eye"][2] - front["target"][2]) < 1e-6 and front["eye"][1] < front["target"][1]
        frames(front, 0, 2)
        tab.run("document.querySelector('#front').click()")
        again = next_link(tab, lambda now: "fov" in now)
        assert far(again["eye"], home["eye"]) < 0.01 and tab.run("document.querySelector('#front').ariaPressed") == "false"
    with page(f"{SITE}/#" + urllib.parse.urlencode({k: ",".join(map(str, v)) if isinstance(v, list) else v for k, v in front.items()})) as tab:
        settled(tab)
        now = link(tab)
        assert far(now["target"], front["target"]) < 1e-3 and abs(float(now["view_height"]) / float(front["view_height"]) - 1) < 1e-3
    flat = "eye=3,0,1&target=0,0,1&projection=orthographic&view_height=2&near=2.9&far=3.05"  # a slice of the wall
    with page(f"{SITE}/#dataset=wall&{flat}") as tab:
        asked, now = sent(tab), link(tab)
        for found, eye in (asked, float(asked["eye"].split(",")[0])), (now, now["eye"][0]):  # wherever it is asked for from
            assert abs(eye - float(found["near"]) - 0.1) < 1e-4 and abs(eye - float(found["far"]) + 0.05) < 1e-4, found


def test_front_and_side_do_not_follow_stray_heights():
    """A few heights of -9999 widen the bounds, not what is framed; a street's length is none of them."""
    dataset = daemon.ask("/v1/datasets/wall").json()
    true = dataset["bounds"]
    dataset["bounds"] = {"min": [true["min"][0], true["min"][1] - 1e4, -9999], "max": true["max"]}
    told = json.dumps(dataset)
    script = f"(usual => {{ window.fetch = (path, how) => path === '/v1/datasets/wall' ? Promise.resolve(new Response({json.dumps(told)})) : usual(path, how); }})(fetch)"
    far_off = far(dataset["default_view"]["eye"], dataset["default_view"]["target"])
    with page(f"{SITE}/#dataset=wall", before=script) as tab:
        settled(tab)
        tab.run("document.querySelector('#side').click()")
        side = next_link(tab, lambda now: "projection" in now)
        assert float(side["view_height"]) > 5000, side  # the long way is whole
        dataset["bounds"]["min"][1] = true["min"][1]
    script = script.replace(json.dumps(told), json.dumps(json.dumps(dataset)))
    with page(f"{SITE}/#dataset=wall", before=script) as tab:
        before = settled(tab)
        for name in "front", "side":
            tab.run(f"document.querySelector('#{name}').click()")
            flat = next_link(tab, lambda now: now.get("projection") == "orthographic")
            before = settled(tab, before)
            assert float(flat["view_height"]) < 5 * far_off, flat
            assert before[1] > 10, "nothing of the wall is there"
            low, high = (flat["target"][2] + side * float(flat["view_height"]) / 2 for side in (-1, 1))
            assert low < true["min"][2] and high > true["max"][2], flat
            tab.run(f"document.querySelector('#{name}').click()")
            next_link(tab, lambda now: "fov" in now)
            before = settled(tab)


def test_dragging_orbits_and_pans():
    with page() as tab:
        start, digest = link(tab), settled(tab)
        x, y = middle(tab)
        tab.run(BENT)
        tab.drag((x, y), (x + 60, y + 20), hold="bent")
        orbited, digest = moved(tab, start), settled(tab, digest)
        assert orbited["target"] == start["target"] and abs(far(orbited["eye"], orbited["target"]) - 3) < 0.01
        assert orbited["eye"][2] > 1.1, "dragging down must show more from above"
        assert orbited["eye"][1] < -0.1, "the camera goes left when the scene is dragged right"  # y is to the right
        tab.drag((x, y), (x + 60, y), button="right")
        panned = moved(tab, orbited)
        step = [b - a for a, b in zip(orbited["eye"], panned["eye"])]
        assert (
            far(step, [b - a for a, b in zip(orbited["target"], panned["target"])]) < 0.01 and far(step, [0] * 3) > 0.1
        )
        tab.mouse("mouseWheel", x, y, deltaX=0, deltaY=-300)
        near = moved(tab, panned)
        assert far(near["eye"], near["target"]) < 2.5
        settled(tab, digest)


def test_only_one_frame_is_asked_for_at_a_time():
    """As the page sees it: what it gives up is over for it, whenever the browser notes that it ended."""
    count = """(usual => { window.flying = window.most = 0; window.fetch = async (path, how) => {
        if (!path.includes('/view?')) return usual(path, how);
        most = Math.max(most, ++flying);
        try {
            const reply = await usual(path, how);
            return new Response(await reply.blob(), reply);
        } finally { flying--; } }; })(fetch)"""
    with page(before=count) as tab:
        x, y = middle(tab)
        tab.drag((x, y), (x + 100, y + 30), steps=25)
        settled(tab)
        views = tab.run(VIEWS)
        coarse = [url for url in views if "budget=60ms" in url]
        assert 1 <= len(coarse) <= 26 and "budget" not in views[-1], views
        assert tab.run("[most, flying]") == [1, 0]


def test_the_keyboard_does_all_of_it():
    with page(before=STEPS) as tab:
        start, digest = link(tab), settled(tab)
        for _ in range(2):
            tab.key("Tab")
        assert tab.run("document.activeElement.id") in ("stage", "toggle")
        tab.run("document.querySelector('#stage').focus()")
        assert tab.run("getComputedStyle(document.querySelector('.cross')).opacity") == "1"
        steps = {
            "ArrowRight": lambda a, b: b["eye"][1] > a["eye"][1],
            "ArrowUp": lambda a, b: b["eye"][2] > a["eye"][2],
            "w": lambda a, b: b["target"][0] < a["target"][0],
            "d": lambda a, b: b["target"][1] > a["target"][1],
            "e": lambda a, b: b["target"][2] > a["target"][2],
            "+": lambda a, b: far(b["eye"], b["target"]) < far(a["eye"], a["target"]),
            "-": lambda a, b: far(b["eye"], b["target"]) > far(a["eye"], a["target"]),
        }
        for key, right in steps.items():
            tab.run("left = 4")
            tab.key(key, hold="left === 0")
            now = moved(tab, start)
            assert right(start, now), (key, start, now)
            start = now
        assert settled(tab, digest)
        tab.key("Home")
        view = daemon.ask("/v1/datasets/wall").json()["default_view"]
        assert far(moved(tab, start)["eye"], view["eye"]) < 0.01


def points(tab):
    return [
        [float(x) for x in p.split(",")]
        for p in tab.run("[...document.querySelectorAll('#points dd')].map(e => e.textContent)")
        if "," in p
    ]


def test_clicks_give_coordinates_and_a_distance():
    with page() as tab:
        x, y = middle(tab)
        tab.click(x + 60, y - 40)
        tab.until("document.querySelectorAll('#points dd').length === 1")
        tab.run("document.querySelector('#stage').focus()")
        tab.key("Enter")
        tab.until("document.querySelectorAll('#points dd').length === 2")
        had = tab.run("[...document.querySelectorAll('#attributes dt')].map(e => e.textContent)")
        assert had == [a["name"] for a in daemon.ask("/v1/datasets/wall").json()["attributes"]] and had, had
        assert tab.run("[...document.querySelectorAll('#primitive dd')].map(e => e.textContent)") == ["splat"]
        a, b = points(tab)
        focal = tab.run("document.querySelector('#stage').clientHeight") / 2 / math.tan(math.radians(25))
        for (px, py, pz), (u, v) in zip((a, b), ((60, -40), (0, 0))):
            assert abs(px - 0.2 * math.sin(py)) < 0.03, "not on the wall"
            assert abs(py - u * (3 - px) / focal) < 0.01 and abs(pz - (1 - v * (3 - px) / focal)) < 0.01, (a, b)
        said = tab.text("#said")
        told = float(re.search(r"distance ([\d.]+) us-ft$", said).group(1))
        assert abs(told - far(a, b)) < 0.003, (said, a, b)
        assert tab.text("#marks text") == f"{said.rpartition('distance ')[2]}"
        assert re.search(r"[\d.]+ × [\d.]+ × [\d.]+ us-ft, drawn", tab.text("#about")), tab.text("#about")
        circle = tab.run("+document.querySelector('#marks circle').getAttribute('cx')")
        tab.drag((x, y), (x + 50, y))
        assert tab.run("+document.querySelector('#marks circle').getAttribute('cx')") != circle
        texts = tab.run("""import('/viewer/measure.js').then(m => [[[0, 0, 0], [3.496, 0, -0.233]], [[0, 0, 0], [0.3, 0, -0.0001]]].map(
            points => m.measure(points, 'length', 'm').map(({text}) => text)))""")
        assert texts == [["3.504 m", "-0.233 m", "3.496 m"], ["300.0 mm", "-0.1 mm", "300.0 mm"]], texts  # one unit for all
        tab.key("Escape")
        tab.until("!document.querySelector('#marks').children.length && document.querySelector('#clear').disabled")
        settled(tab)
        before = link(tab)
        tab.click(x + 60, y - 40, times=2)
        target = moved(tab, before)["target"]
        assert abs(target[0] - 0.2 * math.sin(target[1])) < 0.03 and not points(tab), "a double click turns there"
        tab.run("location.hash = 'dataset=wall&eye=3,0,1&target=9,0,1'")
        next_link(tab, lambda now: now["target"][0] == 9 and "layer" in now)
        tab.click(x, y)
        tab.until("document.querySelector('#said').textContent === 'Nothing there'")


def test_picks_ask_for_what_the_picture_shows():
    """Its method and what changes what is seen where; here of a wall that says it has primitives."""
    dataset = {**daemon.ask("/v1/datasets/wall").json(),
               "primitives": {"panels": 1, "panel_points": 9, "pieces": 0, "methods": ["splat", "nearest"]}}
    script = f"""(usual => {{ const told = {json.dumps({"/v1/datasets/wall": dataset})}; window.asked = [];
        window.fetch = (path, how) => {{
            asked.push(path);
            return path in told ? Promise.resolve(new Response(JSON.stringify(told[path]))) : usual(path, how);
        }}; }})(fetch)"""
    for wanted in {"method": "splat", "primitives": "off"}, {"method": "fill", "kernel": "9"}, {"method": "points"}:
        with page(f"{SITE}/{FACING}&{urllib.parse.urlencode(wanted)}&lod=2", before=script) as tab:
            tab.click(*middle(tab))
            tab.until("document.querySelectorAll('#points dd').length === 1")
            pick = next(path for path in tab.run("asked") if "/pick?" in path)
            asked = dict(urllib.parse.parse_qsl(urllib.parse.urlsplit(pick).query))
            camera = {"x", "y", "eye", "target", "up", "fov", "width", "height"}
            assert {name: value for name, value in asked.items() if name not in camera} == wanted, asked
    with page(f"{SITE}/{FACING}&budget=400ms", before=script) as tab:
        tab.until("document.querySelector('#chosen').textContent.startsWith('Chosen: ')")
        tab.click(*middle(tab))
        tab.until("document.querySelectorAll('#points dd').length === 1")
        method = tab.text("#chosen").split()[1].rstrip(",")
        assert any("/pick?" in path and f"method={method}" in path for path in tab.run("asked")), tab.run("asked")


def test_layers_methods_and_budgets():
    with page() as tab:
        digest = settled(tab)
        tab.choose("#layer", "depth")
        digest = settled(tab, digest)
        tab.until("!document.querySelector('#legend').hidden")
        ends = tab.run("[...document.querySelectorAll('#legend span')].map(e => e.textContent)")
        assert all(x.endswith(" us-ft") for x in ends), ends
        near, distant = (float(x.split()[0]) for x in ends)
        assert 2.7 < near < distant < 3.3, (near, distant)
        assert tab.run("document.querySelector('#primitives').hidden")
        tab.choose("#layer", "primitive")
        digest = settled(tab, digest)
        assert tab.run("document.querySelector('#legend').hidden")
        assert tab.text("#primitives").split() == ["splats", "lines", "panels", "meshes"]
        tab.until("!document.querySelector('#primitives').hidden")
        tab.choose("#layer", "color")
        digest = settled(tab, digest)
        assert tab.run("document.querySelector('#primitives').hidden")
        tab.choose("#method", "points")
        settled(tab, digest)
        assert link(tab)["method"] == "points" and tab.run("document.querySelector('#legend').hidden")
        tab.choose("#budget", "120ms")
        tab.until("document.querySelector('#chosen').textContent.startsWith('Chosen: ')")
        assert tab.run("document.querySelector('#method').disabled") and link(tab)["budget"] == "120ms"
        tab.choose("#budget", "")
        tab.choose("#lod", "99")  # the browser's own check keeps it from being asked
        settled(tab)
        assert link(tab)["lod"] == "1"


def test_colours_and_shading():
    with page() as tab:
        digest = settled(tab)
        tab.choose("#color_by", "height")
        digest = settled(tab, digest)
        tab.choose("#shade", "edl+headlight")
        digest = settled(tab, digest)
        assert link(tab)["color_by"] == "height" and link(tab)["shade"] == "edl+headlight", link(tab)
        url = tab.run("location.href") + "&range=-5..5&ramp=turbo"
    with page(url) as tab:
        settled(tab)
        assert {"color_by": "height", "shade": "edl+headlight", "range": "-5..5", "ramp": "turbo"}.items() <= link(tab).items(), link(tab)
        tab.choose("#budget", "500ms")
        tab.until("document.querySelector('#chosen').textContent.startsWith('Chosen: ')")
        assert link(tab)["color_by"] == "height" and link(tab)["ramp"] == "turbo", link(tab)


def asked(tab):
    """The parameters of the newest view that was asked for."""
    return dict(urllib.parse.parse_qsl(tab.run(VIEWS)[-1].split("?", 1)[1]))


def test_layers_are_asked_for_with_what_they_take():
    """Colours, their shading and background are of layer color; the link keeps them for who comes back to it."""
    colors = {"color_by": "height", "shade": "edl", "range": "-5..5", "ramp": "turbo", "background": "ff0000"}
    with page(f"{SITE}/{FACING}&edl_radius=3&{urllib.parse.urlencode(colors)}") as tab:
        digest = settled(tab)
        assert colors.items() <= asked(tab).items() and asked(tab)["edl_radius"] == "3", asked(tab)
        for layer in "depth", "normal", "id":
            tab.choose("#layer", layer)
            digest = settled(tab, digest)
            query = asked(tab)
            assert query["layer"] == layer and not {*colors, "edl_radius"} & set(query), query
            assert colors.items() <= link(tab).items(), link(tab)
        tab.choose("#layer", "color")
        settled(tab, digest)
        assert colors.items() <= asked(tab).items(), asked(tab)


def test_methods_that_draw_no_normals_of_bare_points_are_not_offered_for_them():
    with tempfile.TemporaryDirectory() as folder:
        cloud, bare = pathlib.Path(folder, "cloud.xyz"), pathlib.Path(folder, "bare.spld")
        cloud.write_text("".join(f"0 {0.02 * (i % 100) - 1} {0.02 * (i // 100)}\n" for i in range(10000)))
        subprocess.run([REAL, "pack", cloud, "--points-only", "-o", bare], check=True, stderr=subprocess.DEVNULL)
        with Daemon(REAL, datasets=[bare]) as d, page(f"http://127.0.0.1:{d.port}/#dataset=bare&method=points") as tab:
            digest = settled(tab)
            assert asked(tab)["method"] == "points"
            tab.choose("#layer", "normal")
            digest = settled(tab, digest)
            assert asked(tab)["method"] == "fill" and tab.run("document.querySelector('#notice').hidden"), asked(tab)
            enabled = "[...document.querySelector('#method').options].filter(o => !o.disabled).map(o => o.value)"
            assert tab.run(enabled) == ["fill"]
            tab.choose("#layer", "color")
            settled(tab, digest)
            assert tab.run(enabled) == ["points", "fill"]


def test_the_address_restores_the_picture():
    with page() as tab:
        x, y = middle(tab)
        tab.drag((x, y), (x + 40, y + 30))
        tab.choose("#layer", "normal")
        settled(tab)
        camera, url = link(tab), tab.run("location.href")
        digest = settled(tab)
    with page(url) as tab:
        assert settled(tab) == digest and link(tab) == camera
        assert tab.run("document.querySelector('#layer').value") == "normal"
        command = tab.run(
            """(async () => { let said; navigator.clipboard.writeText = async (text) => { said = text; };
            document.querySelector('#curl').click(); await new Promise(done => setTimeout(done, 50));
            return said; })()"""
        )
        name, path = re.fullmatch(rf"curl -o (\w+\.jpg) '{SITE}(/[^']*)'", command).groups()
        assert name == "normal.jpg"
        body = base64.b64encode(daemon.ask(path).body).decode()
        assert (
            tab.run(
                f"""(async () => {{ const bytes = Uint8Array.from(atob('{body}'), x => x.charCodeAt(0));
            const image = await createImageBitmap(new Blob([bytes])); const c = document.createElement('canvas');
            [c.width, c.height] = [image.width, image.height]; c.getContext('2d').drawImage(image, 0, 0);
            return {DIGEST_OF}(c); }})()"""
            )
            == digest
        )


def test_a_phone():
    with page(f"{SITE}/{FACING}&method=fill", size=(390, 780), phone=True) as tab:
        start, (x, y) = link(tab), middle(tab)
        assert tab.run(
            "[document.documentElement, document.querySelector('#panel')].every(e => e.scrollWidth <= innerWidth)"
        )
        assert tab.run("document.querySelector('#stage').clientHeight") > 400, "the picture comes first"
        small = tab.run(
            "[...document.querySelectorAll('button, select, input[type=number]')]"
            ".filter(e => e.offsetHeight && e.offsetHeight < 40).map(e => e.id)"
        )
        assert not small, f"too small for a finger: {small}"
        tab.touch([(x, y)], [(x + 20, y)], [(x + 60, y)])
        orbited = moved(tab, start)
        assert orbited["target"] == start["target"]
        tab.touch([(x - 30, y), (x + 30, y)], [(x - 50, y), (x + 50, y)], [(x - 80, y), (x + 80, y)])
        near = moved(tab, orbited)
        assert far(near["eye"], near["target"]) < 2.5, "two fingers apart come nearer"
        tab.touch(
            [(x - 30, y), (x + 30, y)], [(x - 30, y + 30), (x + 30, y + 30)], [(x - 30, y + 60), (x + 30, y + 60)]
        )
        panned = moved(tab, near)
        assert panned["target"][2] > near["target"][2] + 0.05, "two fingers down pull the scene down"
        assert tab.run("document.querySelector('canvas').width") == 780, "as sharp as the screen"
        tab.press_on("#toggle")
        tab.until(
            "document.querySelector('#panel').hidden && document.querySelector('#toggle').ariaExpanded === 'false'"
        )


def test_dark_and_light():
    grounds = []
    for dark in (False, True):
        with page(dark=dark) as tab:
            grounds.append(urllib.parse.parse_qs(tab.run(VIEWS)[-1])["background"][0])
            assert tab.run(
                "getComputedStyle(document.body).colorScheme || getComputedStyle(document.documentElement).colorScheme"
            )
    assert int(grounds[0], 16) > 0xC00000 > int(grounds[1], 16), grounds


def test_everything_has_a_name_and_takes_the_focus():
    with page(f"{SITE}/{FACING}&method=fill", size=(1000, 900)) as tab:
        tab.run("document.querySelectorAll('details').forEach(d => d.open = true)")
        tab.press_on("#add")
        tab.press_on("#add")
        names = tab.names()
        assert len(names) > 25 and all(name for _, name in names), names
        assert ("application", "View of wall") in names and ("button", "Move keyframe 2 up") in names, names
        assert ("spinbutton", "Seconds after keyframe 1") in names and ("combobox", "Layer") in names
        tab.run("document.activeElement.blur()")
        seen = set()
        for _ in range(90):
            tab.key("Tab")
            seen.add(tab.run("(e => { e.mark ??= Math.random(); return e.mark; })(document.activeElement)"))
            visible = tab.run(
                "(e => getComputedStyle(e).outlineStyle !== 'none' || e.type === 'radio' || e === document.body)"
                "(document.activeElement)"
            )
            assert visible, tab.run("document.activeElement.outerHTML")
        missed = tab.run(
            f"""[...document.querySelectorAll('button, select, input, summary, [tabindex]')]
            .filter(e => e.offsetHeight && !e.disabled && !(e.type === 'radio' && !e.checked)
                && !{json.dumps(list(seen))}.includes(e.mark))
            .map(e => e.outerHTML)"""
        )
        assert not missed, missed


def appeared(folder, pattern):
    """A download has its name once it is whole."""
    end = time.monotonic() + browser.PATIENCE
    while not (found := list(pathlib.Path(folder).glob(pattern))):
        assert time.monotonic() < end, f"{pattern} was not downloaded"
        time.sleep(0.05)
    return found[0]


def test_tours():
    with tempfile.TemporaryDirectory() as folder, page() as tab:
        chromium.send("Browser.setDownloadBehavior", behavior="allow", downloadPath=folder)
        tab.run("document.querySelectorAll('details').forEach(d => d.open = true)")
        cameras, (x, y) = [link(tab)], middle(tab)
        tab.press_on("#add")
        for _ in range(2):
            tab.drag((x, y), (x + 40, y + 10))
            cameras.append(moved(tab, cameras[-1]))
            tab.press_on("#add")
        for i, seconds in enumerate(("0.4", "0.2")):
            tab.choose(f"#keyframes li:nth-child({i + 1}) input", seconds)
        assert tab.text("#length") == "3 keyframes, 0.6 s"
        tab.press_on("#keyframes li:nth-child(3) button:nth-of-type(2)")  # up
        assert tab.text("#said") == "keyframe 3 moved up"
        cameras = [cameras[0], cameras[2], cameras[1]]
        tab.press_on("#download")
        tour = json.loads(appeared(folder, "wall-tour.json").read_text())
        assert [key["camera"]["eye"] for key in tour["keyframes"]] == [c["eye"] for c in cameras]
        assert [key["time"] for key in tour["keyframes"]] == [0, 0.4, 3.4] and tour["closed"] is False
        tab.choose("#keyframes li:nth-child(2) input", "0.2")
        tab.press_on("#play")
        tab.until("document.querySelector('#play').textContent === 'Play'")
        assert moved(tab, cameras[0])["eye"] == cameras[2]["eye"], "it ends at its last keyframe"
        tab.press_on("#keyframes li:nth-child(2) button:last-of-type")
        assert tab.text("#length") == "2 keyframes, 0.4 s"
        tab.go(f"{SITE}/{FACING}&lod=2")
        tab.until("document.querySelectorAll('#keyframes li').length === 2", "keyframes outlive the page")


def test_the_service_renders_tours():
    with tempfile.TemporaryDirectory() as folder, Daemon(REAL, "--tours", folder + "/tours") as d:
        chromium.send("Browser.setDownloadBehavior", behavior="allow", downloadPath=folder)
        with page(f"http://127.0.0.1:{d.port}/{FACING}") as tab:
            tab.run("document.querySelectorAll('details').forEach(d => d.open = true)")
            tab.press_on("#add")
            assert tab.run("document.querySelector('#render').disabled"), "one keyframe is no tour"
            start, (x, y) = link(tab), middle(tab)
            tab.drag((x, y), (x + 60, y))
            moved(tab, start)
            tab.press_on("#add")
            tab.choose("#keyframes li:first-child input", "0.3")
            assert [tab.run(f"document.querySelector('#tour-{side}').value") for side in ("width", "height")] == ["1280", "720"]
            for side, value in (("width", "9000"), ("height", "")):
                before = tab.run(f"document.querySelector('#tour-{side}').value")
                tab.choose(f"#tour-{side}", value)
                tab.press_on("#render")
                assert tab.run("document.activeElement.id") == f"tour-{side}", "what is wrong is pointed at"
                tab.choose(f"#tour-{side}", before)
            assert not d.ask("/v1/tours").json()["tours"]
            tab.choose("#tour-width", "320")
            tab.choose("#tour-height", "180")
            tab.choose("#method", "fill")
            for name, value in (("visibility", "none"), ("kernel", "9")):
                tab.choose(f"#parameter-{name}", value)
            tab.run(
                """(usual => window.fetch = (path, how) => { if (how?.body) window.asked = JSON.parse(how.body);
                return usual(path, how); })(fetch)"""
            )
            tab.press_on("#render")
            tab.until("!document.querySelector('#result').hidden")
            [made] = d.ask("/v1/tours").json()["tours"]
            assert (made["width"], made["height"]) == (320, 180)
            assert tab.run("asked.settings") == {
                "layer": "color", "method": "fill", "visibility": "none", "kernel": 9, "lod": 1, "supersample": 1,
                "format": "jpeg", "width": 320, "height": 180,
            }
            frames = int(re.fullmatch(r"(\d+) frames are ready", tab.text("#far")).group(1))
            assert 9 <= frames <= 10 and tab.run("document.querySelector('#progress').hidden")
            tab.press_on("#result")
            with zipfile.ZipFile(appeared(folder, "*.zip")) as archive:
                pictures = {archive.read(name) for name in archive.namelist()}
            assert len(pictures) == frames and all(picture.startswith(b"\xff\xd8") for picture in pictures)
            tab.press_on("#cancel")
            tab.until("document.querySelector('#making').hidden")
            eventually(lambda: not d.ask("/v1/tours").json()["tours"], browser.PATIENCE)  # the page does not wait for it
    with page() as tab:
        assert tab.run("document.querySelector('#making-of').hidden"), "a service without a place for tours"


def test_the_chart_has_the_frame_on_it():
    with tempfile.TemporaryDirectory() as folder:
        dataset = pathlib.Path(folder, "wall.spld")
        shutil.copy(WALL, dataset)
        status = daemon.status()
        point = dict(lod=1, supersample=1, front=True, ms_q90=60, fixed_ms=1, ms_per_mpx=50)
        dataset.with_name("wall.profile.json").write_text(
            json.dumps(
                {
                    "format": "splatd-profile",
                    "format_version": 1,
                    "splatd": "0",
                    "reference": "exact",
                    "views": 1,
                    "dataset": {"id": "wall", "version": daemon.ask("/v1/datasets/wall").json()["version"]},
                    "device": {k: status["device"][k] for k in ("backend", "name", "driver", "software")},
                    "width": 1280,
                    "height": 720,
                    "points": [
                        {**point, "method": "splat", "ms": 50, "psnr": 30},
                        {**point, "method": "points", "ms": 0.01, "psnr": 20},
                    ],
                }
            )
        )
        with Daemon(REAL, datasets=[str(dataset)]) as other, page(f"http://127.0.0.1:{other.port}/") as tab:
            tab.run("document.querySelector('#advanced').open = true")
            tab.press_on("#accuracy")
            tab.until(
                "document.querySelector('#chart img').naturalWidth > 0 && !document.querySelector('.here').hidden"
            )
            text = tab.text("#chart figcaption")
            assert re.fullmatch(r"This view: \d+ ms, .*this setting reaches 30\.0 dB .*", text), text
            first = tab.run("document.querySelector('.here').style.top")
            tab.choose("#method", "points")
            tab.until("document.querySelector('#chart figcaption').textContent.includes('20.0 dB')")
            assert float(tab.run("document.querySelector('.here').style.top")[:-1]) > float(
                first[:-1]
            ), "less accurate is lower"


CARDS = "[...document.querySelectorAll('#gallery a')]"
PICTURES = "[...document.querySelectorAll('#gallery img')].every(i => i.complete && i.naturalWidth > 0)"


def test_several_datasets_are_a_gallery():
    with tempfile.TemporaryDirectory() as folder:
        scan = pathlib.Path(folder, "scan.xyz")
        scan.write_text("".join(f"{x / 4} {y / 4} 0\n" for x in range(81) for y in range(41)))
        subprocess.run([REAL, "pack", scan, "-o", f"{folder}/site.spld", "--title", "The <i>site</i>", "--description", "Flat.",
                        "--view", "low=eye=10,-9,2,target=10,5,0,fov=70"], check=True, capture_output=True)
        with Daemon(REAL, datasets=[WALL, f"{folder}/site.spld"]) as other:
            site = f"http://127.0.0.1:{other.port}"
            for size, phone, dark in (((1280, 800), False, False), ((390, 844), True, True)):
                address = f"{site}/#clip=x%3C5" if phone else f"{site}/"  # kept in pictures and links
                with page(address, ready=f"{CARDS}.length === 2 && {PICTURES}", size=size, phone=phone, dark=dark) as tab:
                    asked = tab.run("fetched.filter(url => url.includes('thumbnail'))")
                    assert all(("clip=x%3C5" in url) == phone for url in asked + tab.run(f"{CARDS}.map(a => a.href)")) and asked, asked
                    assert tab.run(f"{CARDS}.map(a => a.querySelector('strong').textContent)") == ["The <i>site</i>", "wall"]
                    assert tab.text("title").startswith("Datasets")
                    assert tab.run("document.querySelector('#gallery').scrollWidth <= innerWidth && document.querySelector('#panel').hidden")
                    boxes = tab.run(f"{CARDS}.map(a => (b => [b.x, b.y, b.width, b.height])(a.getBoundingClientRect()))")
                    assert all(w > 250 and h > 140 for _, _, w, h in boxes), boxes
                    assert (boxes[0][1] == boxes[1][1]) != phone, "side by side, or one below the other"
                    assert [(role, bool(name)) for role, name in tab.names()] == [("link", True)] * 2
            with page(f"{site}/", ready=f"{CARDS}.length === 2", size=(1280, 800)) as tab:
                tab.run(f"{CARDS}[0].focus()")
                tab.key("Enter")
                tab.until(f"{REST} && document.title.startsWith('The <i>site')")
                assert tab.text("#description") == "Flat." and link(tab)["dataset"] == "site"
                before = tab.run(DIGEST)
                tab.choose("#views", "low")
                settled(tab, before)
                assert far(link(tab)["eye"], [10, -9, 2]) < 1e-3
                tab.run("history.back()")
                tab.until(f"{CARDS}.length === 2 && document.querySelector('#stage').hidden")
                tab.run("location.hash = '#dataset=wall'")
                tab.until(f"{REST} && document.title.startsWith('wall')")
                tab.press_on("#all")
                tab.until(f"{CARDS}.length === 2")
                tab.go(f"{site}/#dataset=site&view=low")
                tab.until(f"{REST} && document.title.startsWith('The <i>site')")
                assert far(link(tab)["eye"], [10, -9, 2]) < 1e-3 and abs(float(link(tab)["fov"]) - 70) < 0.01


def test_the_first_view_fits_the_window():
    with tempfile.TemporaryDirectory() as folder:
        scan = pathlib.Path(folder, "scan.xyz")
        scan.write_text("".join(f"{x / 4} {y / 4} 0\n" for x in range(81) for y in range(41)))
        subprocess.run([REAL, "pack", scan, "-o", f"{folder}/site.spld"], check=True, capture_output=True)
        with Daemon(REAL, datasets=[f"{folder}/site.spld"]) as other:
            fit = other.ask("/v1/datasets/site").json()["default_view"]["fit"]

            def across(tab):
                width, height = tab.run("(s => [s.clientWidth, s.clientHeight])(document.querySelector('#stage'))")
                return 2 * math.degrees(math.atan(math.tan(math.radians(float(link(tab)["fov"]) / 2)) * width / height))
            with page(f"http://127.0.0.1:{other.port}/", size=(390, 844), phone=True) as tab:
                assert across(tab) > fit[0] - 0.1, (across(tab), fit)
                tall = link(tab)["fov"]
                tab.resize((1280, 500))
                next_link(tab, lambda now: now["fov"] != tall and across(tab) > fit[0] - 0.1)


def test_wrong_links_say_so():
    with page(f"{SITE}/#dataset=wall&eye=1,2&target=0,0,1&fov=wide", ready=f"{REST} && !!document.querySelector('#said').textContent") as tab:
        told = tab.text("#said")
        assert "eye of the link is left out: it has to be three numbers, not '1,2'" in told and "fov of the link is left out" in told, told
        assert "target" not in told, told
    with page(f"{SITE}/?dataset=wall", ready="document.querySelector('.problem') !== null", complaints="400") as tab:
        assert "dataset" in tab.text(".problem p")
        tab.press_on(".problem a")
        tab.until(REST)
    with page(f"{SITE}/nowhere", ready="document.querySelector('.problem') !== null", complaints="404", dark=True) as tab:
        assert tab.text("h1") == "Not Found" and all(name for _, name in tab.names())


def test_atoms_are_offered_where_there_are_textures():
    hidden = "document.querySelector('#parameter-atoms').hidden"
    with page() as tab:
        assert tab.run(hidden) and "atoms" not in tab.run("location.hash")
    close = FACING.replace("dataset=wall", "dataset=wall-textured").replace("eye=3", "eye=1")
    with Daemon(REAL, datasets=[WALL, TEXTURED]) as other, page(f"http://127.0.0.1:{other.port}/{close}") as tab:
        assert not tab.run(hidden) and tab.run("document.querySelector('[for=parameter-atoms]').offsetHeight > 0")
        whole = tab.run(DIGEST)
        tab.choose("#parameter-atoms", "0")
        tab.until(f"location.hash.includes('atoms=0') && {REST}")
        mean = tab.run(DIGEST)
        assert mean[0] != whole[0], "the textures are on screen"
        tab.choose("#method", "points")
        tab.until(f"{hidden} && !location.hash.includes('atoms') && {REST}")
        tab.choose("#method", "splat")
        tab.until(f"!{hidden} && location.hash.includes('atoms=0') && {REST}")
        tab.run(f"location.hash = '{close}&budget=30s'")  # enough for the best, however slow the machine
        tab.until(f"/^Chosen: splat.* \\d atoms/.test(document.querySelector('#chosen').textContent) && {REST}")
        assert tab.run("document.querySelector('#parameter-atoms').disabled")
        tab.choose("#budget", "")
        tab.choose("#parameter-atoms", "")
        tab.until(f"!location.hash.includes('atoms') && {REST}")
        assert tab.run(DIGEST)[0] == whole[0]
    with Daemon(REAL, datasets=[TEXTURED]) as other:
        with page(f"http://127.0.0.1:{other.port}/{close}&atoms=0") as tab:
            assert tab.run(DIGEST)[0] == mean[0], "the address has them"
        with page(f"http://127.0.0.1:{other.port}/embed/wall-textured{close}&atoms=0") as tab:
            assert any("atoms=0" in name for name in tab.run(VIEWS))


def test_maps_are_offered_where_there_are_any():
    with page() as tab:
        assert tab.run("document.querySelector('#parameter-maps').hidden") and "maps" not in tab.run("location.hash")
        assert tab.run("document.querySelector('#stations-label').hidden")
        assert tab.text("#about").startswith("1\u202f600 points, 0.3"), tab.text("#about")
    look = FACING.replace("dataset=wall", "dataset=wall-mapped")
    with Daemon(REAL, datasets=[WALL, MAPPED]) as other:
        site = f"http://127.0.0.1:{other.port}"
        with page(f"{site}/{look}") as tab:
            assert "maps" in shown(tab) and tab.text("[for=parameter-maps]") == "Maps"
            assert "points, maps of 1 station, 0.3" in tab.text("#about"), tab.text("#about")
            assert tab.run("[...document.querySelector('#parameter-maps').options].map(o => o.text)") == ["on", "off"]
            tab.choose("#parameter-maps", "off")
            tab.until(f"location.hash.includes('maps=off') && {REST}")
            tab.choose("#method", "points")
            tab.until(f"!location.hash.includes('maps') && {REST}")
            assert "maps" not in shown(tab)
            tab.run(f"location.hash = '{look}&budget=30s'")
            tab.until(f"/^Chosen: .*, maps on/.test(document.querySelector('#chosen').textContent) && {REST}")
        with page(f"{site}/{look}") as tab:  # where its panorama was taken
            assert tab.run("[...document.querySelector('#stations').options].map(o => o.text)") == ["none", "0"]
            tab.choose("#stations", "0")
            tab.until(f"/eye=2(,|%2C)0(,|%2C)1&/.test(location.hash) && {REST}", "the station's view")
            assert link(tab)["target"][0] > 2 and tab.run("document.querySelector('#stations').value") == "0"
            tab.press_on("#home")
            tab.until(f"document.querySelector('#stations').value === '' && {REST}")
            tab.run("location.hash = '#dataset=wall-mapped&station=0'")
            tab.until(f"document.querySelector('#stations').value === '0' && {REST}")
        with page(f"{site}/embed/wall-mapped#station=0&target=0,0,1") as tab:
            assert any("eye=2%2C0%2C1&target=0%2C0%2C1" in name.replace(",", "%2C") for name in tab.run(VIEWS)), tab.run(VIEWS)
        with page(f"{site}/{look}&maps=off") as tab:
            assert any("maps=off" in name for name in tab.run(VIEWS)), "the address has it"
            assert tab.run("document.querySelector('#parameter-maps').value") == "off"
        with page(f"{site}/embed/wall-mapped{look}&maps=off") as tab:
            assert any("maps=off" in name for name in tab.run(VIEWS))


def test_a_pruned_dataset_says_what_is_left():
    with tempfile.TemporaryDirectory() as folder:
        for command in ("synth", "courtyard", "--points", "30000", "--format", "ply", "-o", folder), (
                "pack", f"{folder}/courtyard.ply", "--prune", "10", "-o", f"{folder}/left.spld"):
            subprocess.run([REAL, *command], check=True, capture_output=True, timeout=600)
        with Daemon(REAL, datasets=[f"{folder}/left.spld"]) as other:
            about = other.ask("/v1/datasets/left").json()
            assert about["leaf_splats"] < about["pruned"]["of"] / 5, about
            assert daemon.ask("/v1/datasets/wall").json()["pruned"] is None
            with page(f"http://127.0.0.1:{other.port}/") as tab:
                left, whole = (f"{n:,}".replace(",", "\u202f") for n in (about["leaf_splats"], about["pruned"]["of"]))
                assert tab.text("#about").startswith(f"{left} of {whole} points, "), tab.text("#about")


FILL = ("visibility", "kernel", "threshold", "pyramid")


def test_fill_has_its_own_controls():
    offered = f"""{json.dumps(FILL)}.map(id => [`#parameter-${{id}}`, `[for=parameter-${{id}}]`].map(q => document.querySelector(q))).flat()
        .filter(e => e.offsetHeight).length"""
    with page() as tab:
        digest = settled(tab)
        assert tab.run(offered) == 0
        tab.choose("#method", "fill")
        digest = automatic = settled(tab, digest)
        assert tab.run(offered) == 8 and link(tab)["method"] == "fill" and not set(FILL) & set(link(tab))
        assert tab.run("document.querySelector('#method-help').textContent.includes('holes filled')")
        tab.choose("#parameter-kernel", "3")  # smaller than the holes
        digest = settled(tab, digest)
        tab.choose("#parameter-kernel", "2")  # the browser's own check keeps it from being asked, also when something else changes
        assert "3" in tab.text("#said")
        wanted = {"kernel": "3", "threshold": "0.25", "pyramid": "5", "visibility": "none"}
        for name in ("threshold", "pyramid", "visibility"):
            tab.choose(f"#parameter-{name}", wanted[name])
        next_link(tab, lambda now: {name: now.get(name) for name in FILL} == wanted)
        tab.choose("#parameter-kernel", "3")
        next_link(tab, lambda now: {name: now.get(name) for name in FILL} == wanted)
        digest, url = settled(tab), tab.run("location.href")
        assert digest != automatic
        tab.choose("#budget", "500ms")
        next_link(tab, lambda now: "budget" in now and not set(FILL) & set(now))
        assert tab.run(f"{json.dumps(FILL)}.every(id => document.getElementById('parameter-' + id).disabled)")
        tab.choose("#budget", "")
        next_link(tab, lambda now: {name: now.get(name) for name in FILL} == wanted)
        tab.choose("#method", "points")
        next_link(tab, lambda now: now["method"] == "points" and not set(FILL) & set(now))
        assert tab.run(offered) == 0
    with page(url) as tab:
        assert settled(tab) == digest and tab.run(offered) == 8
        assert {name: tab.run(f"document.getElementById('parameter-{name}').value") for name in FILL} == wanted
        for name in FILL:
            tab.choose(f"#parameter-{name}", "")
        assert settled(tab, digest) == automatic
    with page(url) as tab:
        digest = settled(tab)
        x, y = middle(tab)
        tab.drag((x, y), (x + 60, y), steps=10)
        settled(tab, digest)
        moving = [v for v in tab.run(VIEWS) if "budget=60ms" in v and "kernel=3" in v]
        assert moving and all(f"{name}={value}" in moving[-1] for name, value in wanted.items()), "looks as at rest"
    with page(url.replace("/#", "/embed/wall#")) as tab:
        view = urllib.parse.parse_qs(tab.run(VIEWS)[-1])
        assert {name: view[name][0] for name in FILL} == wanted


def shown(tab):
    """The controls of methods that are on screen, by name."""
    return set(tab.run("[...document.querySelectorAll('[id^=parameter-]')].filter(e => e.offsetHeight)"
                       ".map(e => e.id.slice(10)).filter(name => !name.endsWith('-help'))"))


def test_controls_are_those_of_the_table():
    """Each method that the service has is offered, with what it takes, its range and what it is for."""
    table = daemon.ask("/v1/methods").json()
    parameters = {parameter["name"]: parameter for parameter in table["parameters"]}
    with page() as tab:
        assert tab.run("[...document.querySelector('#method').options].map(o => o.value)") == \
            [method["name"] for method in table["methods"]]
        assert tab.run("document.querySelector('#method').value") == table["default"]
        for method in table["methods"]:
            tab.choose("#method", method["name"])
            lacks = {name for name, parameter in parameters.items()  # the wall
                     if parameter["textures"] or parameter["maps"] or parameter["primitives"] or parameter["soft"] or
                     parameter["colors"]}
            names = {name for name in method["parameters"] if name not in lacks}
            assert shown(tab) == names, method["name"]
            assert tab.text("#method-help") == method["description"]
            for parameter in (parameters[name] for name in names):
                control = f"document.querySelector('#parameter-{parameter['name']}')"
                assert tab.text(f"#parameter-{parameter['name']}-help") == parameter["description"]
                assert tab.run(f"{control}.value") == "", "the default"
                if "enum" in parameter:
                    assert tab.run(f"[...{control}.options].map(o => o.text)") == parameter["enum"]
                else:
                    assert tab.run(f"[{control}.min, {control}.max].map(Number)") == [parameter["minimum"], parameter["maximum"]]
                    assert tab.run(f"{control}.step") == ("1" if parameter["type"] == "integer" else "any")


NEW_METHOD = {"name": "fog", "description": "clouds that nobody has seen yet", "textures": False, "stand_in": "fill",
              "parameters": ["thickness", "shade"]}
NEW_PARAMETERS = [
    {"name": "thickness", "description": "of the fog, metres", "type": "number", "minimum": 1, "maximum": 9, "default": 2,
     "textures": False},
    {"name": "shade", "description": "what it is made of", "type": "string", "enum": ["grey", "white"], "default": "grey",
     "textures": False}]


def test_a_method_that_the_page_has_never_heard_of():
    """The page builds its controls from what the service says: here from a table with one method more."""
    table, dataset = (daemon.ask(path).json() for path in ("/v1/methods", "/v1/datasets/wall"))
    table["methods"].append(NEW_METHOD)
    table["parameters"] += NEW_PARAMETERS
    dataset["methods"].append("fog")
    told = json.dumps({"/v1/methods": table, "/v1/datasets/wall": dataset})
    # Views are asked of the daemon, which draws what it knows: points, from the same camera.
    script = f"""(usual => {{ const told = {told}; window.asked = [];
        window.fetch = (path, how) => {{
            asked.push(path);
            if (path in told) return Promise.resolve(new Response(JSON.stringify(told[path])));
            return usual(path.replace('method=fog', 'method=points').replace(/&(thickness|shade)=[^&]*/g, ''), how);
        }}; }})(fetch)"""
    with page(f"{SITE}/{FACING}&method=fog&thickness=3", before=script) as tab:
        assert shown(tab) == {"thickness", "shade"} and link(tab)["thickness"] == "3"
        assert tab.run("document.querySelector('#parameter-thickness').value") == "3"
        tab.choose("#parameter-shade", "white")
        next_link(tab, lambda now: now.get("shade") == "white" and now["thickness"] == "3")
        assert any("method=fog" in path and "thickness=3" in path and "shade=white" in path for path in tab.run("asked"))
        tab.choose("#parameter-thickness", "10")
        assert "9" in tab.text("#said"), "the browser's own check"
        assert all(name for _, name in tab.names())
        tab.choose("#method", "points")
        next_link(tab, lambda now: now["method"] == "points" and not {"thickness", "shade"} & set(now))


# As the service describes an attribute whose values it knows: many small ones and a long tail, and a class of two.
SPREAD = {"count": 1600, "p99": 0.08, "kinds": None, "quantiles": [0.1 * (i / 64) ** 4 for i in range(65)]}
CLASSES = {"count": 1600, "p99": 5, "kinds": [{"value": 2, "count": 1200, "name": "ground"}, {"value": 5, "count": 400, "name": "high vegetation"}],
           "quantiles": [2] * 49 + [5] * 16}


def test_what_is_soft():
    """Histogram and threshold, classes, a height, terms as text; all of it from the keyboard, in the link, and asked for."""
    dataset = daemon.ask("/v1/datasets/wall").json()
    dataset["attributes"] = [{"name": "uncertainty", "unit": "", "values": SPREAD}, {"name": "class", "unit": "", "values": CLASSES},
                             {"name": "odd", "unit": "", "values": None}]
    dataset["soft"] = ["class:5", "plane:0,0,1,0,0,1>0"]
    script = f"""(usual => {{ const told = {json.dumps({"/v1/datasets/wall": dataset})}; window.asked = [];
        window.fetch = (path, how) => {{
            asked.push(path);
            if (path in told) return Promise.resolve(new Response(JSON.stringify(told[path])));
            return usual(path.replace(/soft=(odd|uncertainty|class)[^&]*/, 'soft=axis:0,0,0,0,0,1<0.1'), how);
        }}; }})(fetch)"""
    with page(before=script) as tab:
        tab.run("document.querySelectorAll('details').forEach(d => d.open = true)")
        assert "soft" not in link(tab) and not tab.run("document.querySelector('#soft-threshold').offsetHeight")
        tab.choose("#soft-what", "uncertainty")
        term = next_link(tab, lambda now: "soft" in now)["soft"]
        assert term == "uncertainty>0.75", term  # three quarters of the way to the 99th percentile
        assert tab.run("document.querySelector('#soft-terms').value") == term
        bars = tab.run("[...document.querySelectorAll('#soft-histogram rect')].map(e => [+e.getAttribute('height'), e.classList.contains('on')])")
        assert tab.run("document.querySelector('#soft-histogram').getBoundingClientRect().height") > 20, "it is seen"
        assert len(bars) == 40 and bars[0][0] == 12 and bars[5][0] < 6 and not bars[0][1] and bars[-1][1]
        tab.run("document.querySelector('#soft-threshold').focus()")
        for _ in range(3):
            tab.key("ArrowLeft")
        less = next_link(tab, lambda now: now["soft"] != term)["soft"]
        less = next_link(tab, lambda now: float(now["soft"].split(">")[1]) < float(term.split(">")[1]) - 0.014)["soft"]
        at, share = re.fullmatch(r"Threshold ([\d.]+): ([\d.]+) % soft", tab.text("#soft-threshold-label")).groups()
        assert at == less.split(">")[1] and abs(float(share) - 100 * (1 - (0.08 * float(at) / 0.1) ** 0.25)) < 0.7, (at, share)
        assert "soft" in tab.run("document.querySelector('#soft-threshold').getAttribute('aria-valuetext')")
        tab.choose("#soft-side", "<")
        next_link(tab, lambda now: now["soft"] == less.replace(">", "<"))
        tab.run("document.querySelector('#control-soft_opacity').focus()")
        tab.key("ArrowRight")
        assert next_link(tab, lambda now: "soft_opacity" in now)["soft_opacity"] == "0.31"
        tab.run("document.querySelector('#control-soft_cover').focus()")
        tab.key("ArrowLeft")
        assert next_link(tab, lambda now: "soft_cover" in now)["soft_cover"] == "0.99"
        assert tab.text("#soft-cover-label") == "Cover 0.99"
        tab.choose("#control-soft_model", "layer")
        next_link(tab, lambda now: now.get("soft_model") == "layer")
        assert tab.text("label[for=control-of]") == "Picks and layers of"
        tab.choose("#control-of", "first")
        next_link(tab, lambda now: now.get("of") == "first")
        tab.choose("#budget", "500ms")
        kept = next_link(tab, lambda now: now.get("budget"))
        assert kept["soft"] == less.replace(">", "<") and kept["soft_opacity"] == "0.31" and kept["of"] == "first" and "method" not in kept
        tab.choose("#budget", "")
        tab.until(REST)
        tab.choose("#soft-what", "class")
        next_link(tab, lambda now: now.get("soft") == "class:5")  # what the dataset suggests
        assert tab.run("[...document.querySelectorAll('#soft-kinds label')].map(e => e.textContent.trim())") == ["2 ground 75 %", "5 high vegetation 25 %"]
        tab.run("document.querySelector('#soft-kinds input[value=\"5\"]').focus()")
        tab.key(" ")
        next_link(tab, lambda now: "soft" not in now)
        tab.key(" ")
        next_link(tab, lambda now: now.get("soft") == "class:5")
        select = "document.querySelector('#soft-what')"
        tab.run(f"window.fits = (select => {{ const text = document.createElement('span'); text.textContent = 'above a height';"
                f" select.parentNode.append(text); text.style.font = getComputedStyle(select).font; text.style.position = 'fixed';"
                f" const room = select.clientWidth - text.offsetWidth; text.remove(); return room; }})({select})")
        assert tab.run("fits") > 36, "paddings and arrow"
        for written, checked in ("class:3-5", [False, True]), ("class:2..5", [True, True]), ("class:2,5", [True, True]):
            tab.choose("#soft-terms", written)
            next_link(tab, lambda now: now.get("soft") == written)  # as it was written, and the boxes as it says
            assert tab.run("[document.querySelector('#soft-what').value, "
                           "...[...document.querySelectorAll('#soft-kinds input')].map(e => e.checked)]") == ["class", *checked]
        tab.choose("#soft-terms", "class:2,7")
        assert tab.run("document.querySelector('#soft-what').value") == ":text"
        tab.choose("#soft-terms", "uncertainty<q0.5")
        assert tab.run("['what', 'side'].map(n => document.querySelector('#soft-' + n).value)") == ["uncertainty", "<"]
        assert re.fullmatch(r"Threshold 0.0\d+: (49|50|51) % soft", tab.text("#soft-threshold-label"))
        tab.choose("#soft-what", ":height")
        height = next_link(tab, lambda now: now["soft"].startswith("plane"))["soft"]
        assert re.fullmatch(r"plane:0,0,1\.\d+,0,0,1>0", height), height
        tab.choose("#soft-terms", "axis:0,0,0,0,0,1<0.5 or class:2")
        next_link(tab, lambda now: now["soft"] == "axis:0,0,0,0,0,1<0.5 or class:2")
        assert tab.run("document.querySelector('#soft-what').value") == ":text"
        asked = urllib.parse.unquote(tab.run("asked").pop())
        assert "soft=axis:0,0,0,0,0,1<0.5 or class:2" in asked and "soft_model=layer" in asked, asked
        assert all(name for _, name in tab.names())
        tab.choose("#soft-terms", "plane:0,0,1.25,0,0,1>0")
        now = next_link(tab, lambda now: "1.25" in now["soft"])
        assert tab.run("document.querySelector('#soft-what').value") == ":height"
        tab.go(f"{SITE}/#" + urllib.parse.urlencode({**{k: ",".join(map(str, v)) if isinstance(v, list) else v for k, v in now.items()},
                                                    "soft": less}))
        tab.until("document.querySelector('#soft-what').value === 'uncertainty'")
        assert tab.run("['what', 'side', 'threshold'].map(n => document.querySelector('#soft-' + n).value)") == \
            ["uncertainty", ">", less.split(">")[1]], link(tab)
        assert tab.run("document.querySelector('#control-soft_model').value") == "layer", (now, link(tab), tab.run("document.querySelector('#control-soft_model').value"))
        tab.choose("#soft-what", "")
        next_link(tab, lambda now: "of" not in now and not any(name.startswith("soft") for name in now))
        assert not tab.run("document.querySelector('#control-of').offsetHeight")


TERM = "z<1.5 and !polygon:5,5,6,5,6,6"
ROUND = "document.querySelector('#handles')"


def sent(tab):
    """The parameters of the newest view that was asked for."""
    return dict(urllib.parse.parse_qsl(urllib.parse.urlsplit(tab.run(VIEWS)[-1]).query))


def test_what_the_link_says_of_what_is_drawn_is_kept():
    """Text, planes and background: in every frame, with a budget, in picks, curl and the link. Names on points, too, and
    where these lie on earth."""
    kept = {"clip": TERM, "near": "0.5", "far": "9", "background": "ffeedd"}
    said = f"clip=z%3C1.5&clip=!polygon:5,5,6,5,6,6&near=0.5&far=9&background=ffeedd"
    with tempfile.TemporaryDirectory() as folder, page(f"{SITE}/{FACING}&{said}&mark=0,0,1,here") as tab:
        assert kept.items() <= sent(tab).items() and kept.items() <= link(tab).items(), (sent(tab), link(tab))
        assert tab.run("document.querySelector('#clip-rest').value") == TERM and tab.run("document.querySelector('#clip').open")
        assert tab.run("getComputedStyle(document.querySelector('#stage')).backgroundColor") == "rgb(255, 238, 221)"
        tab.choose("#budget", "500ms")
        next_link(tab, lambda now: now.get("budget"))
        assert kept.items() <= sent(tab).items() and kept.items() <= link(tab).items(), (sent(tab), link(tab))
        x, y = middle(tab)
        tab.click(x, y)
        tab.until("document.querySelectorAll('#points dd').length === 1")
        pick = tab.run("fetched.filter(url => url.includes('/pick?'))")[-1]
        assert {"clip": TERM, "near": "0.5", "far": "9"}.items() <= dict(urllib.parse.parse_qsl(urllib.parse.urlsplit(pick).query)).items()
        tab.click(x, y - 200)  # what is cut away is not there
        tab.until("document.querySelector('#said').textContent === 'Nothing there'")
        command = tab.run("""(async () => { let said; navigator.clipboard.writeText = async (text) => { said = text; };
            document.querySelector('#curl').click(); await new Promise(done => setTimeout(done, 50)); return said; })()""")
        assert urllib.parse.quote(TERM, safe=",!") in command and "background=ffeedd" in command, command
        tab.press_on("#clip-clear")
        now = next_link(tab, lambda now: "clip" not in now)
        assert now["background"] == "ffeedd" and now["mark"] == "0,0,1,here" == ",".join(["0,0,1", tab.text("#names text")])
        chromium.send("Browser.setDownloadBehavior", behavior="allow", downloadPath=folder)
        tab.press_on("#clear")
        tab.press_on("#geojson")
        made = json.loads(appeared(folder, "wall-points.geojson").read_text())
        [feature] = made["features"]
        assert ("note" in made) == (os.environ["SPLATD_PROJ"] != "1") and feature["properties"]["world"] == [0, 0, 1]
        if "note" not in made:
            assert far(feature["geometry"]["coordinates"], list(map(float, lonlat((0, 0, 1)).split(",")))) < 1e-6, feature


def test_a_clip_box_has_handles():
    handle = "document.querySelectorAll('.handle')[{}].getBoundingClientRect()"
    with page(f"{SITE}/{FACING}", size=(1280, 800)) as tab:
        digest = settled(tab)
        assert tab.run(f"{ROUND}.hidden")
        tab.run("document.querySelector('#box-on').click()")
        box = next_link(tab, lambda now: "clip" in now)["clip"]
        x0, y0, z0, x1, y1, z1 = map(float, re.fullmatch(r"box:([-\d.,]+)", box)[1].split(","))
        digest = settled(tab, digest)

        def at(i):
            return tab.run(f"(b => [b.x + b.width / 2, b.y + b.height / 2])({handle.format(i)})")
        x, y = at(3)  # high y, at the right
        focal = 400 / math.tan(math.radians(25))
        tab.drag((x, y), (x - 80, y), hold=f"!{ROUND}.hidden")
        moved_box = next_link(tab, lambda now: now.get("clip") not in (None, box))["clip"]
        now = list(map(float, moved_box[4:].split(",")))
        assert now[:4] == [x0, y0, z0, x1] and now[5] == z1 and abs(y1 - now[4] - 80 / focal * (3 - (x0 + x1) / 2)) < 0.02, (box, moved_box)
        assert settled(tab, digest) and abs(at(3)[0] - (x - 80)) < 2, "it is where it was dragged to"
        tab.run("document.querySelectorAll('.handle')[5].focus()")
        tab.key("ArrowDown")
        lower = float(next_link(tab, lambda link: link["clip"] != moved_box)["clip"].split(",")[5])
        assert lower < z1 and tab.run("document.activeElement.getAttribute('aria-valuetext')") == f"{lower:.3f} us-ft"
        assert ("slider", "High z face of the clip box") in tab.names()
        tab.choose("#box-keep", "outside")
        assert next_link(tab, lambda link: link["clip"][0] == "!")
        tab.run("(e => { e.value = 30; e.dispatchEvent(new Event('input')); })(document.querySelector('#box-turn'))")
        turned = next_link(tab, lambda link: link["clip"].endswith(",30"))["clip"]
        assert not daemon.view(width=8, height=8, clip=turned).status != 200
        tab.choose("#clip-rest", "z<1.8")
        url = next_link(tab, lambda link: link["clip"] == f"{turned} and z<1.8") and tab.run("location.href")
        settled(tab)
    with page(url, size=(390, 844), phone=True) as tab:
        assert tab.run("[document.querySelector('#box-keep').value, document.querySelector('#box-turn').value]") == ["outside", "30"]
        x, y = tab.run(f"(b => [b.x + b.width / 2, b.y + b.height / 2])({handle.format(4)})")
        tab.touch([(x, y)], [(x, y - 15)], [(x, y - 40)])
        higher = next_link(tab, lambda link: link["clip"].split(" and ")[0] != turned)["clip"]
        assert float(higher.split(",")[2]) > float(turned.split(",")[2]) and far(link(tab)["eye"], (3, 0, 1)) < 1e-3, "the view stays"
        tab.choose("#section-axis", "z")
        plan = next_link(tab, lambda link: "projection" in link)  # a section is looked at as a plan
        assert far(plan["eye"][:2], plan["target"][:2]) < 1e-6 and tab.run("document.querySelector('#top').ariaPressed") == "true", plan
        assert re.search(r" and z:[\d.]+\.\.[\d.]+ and z<1.8$", next_link(tab, lambda link: " and z:" in link["clip"])["clip"])
        tab.choose("#section-thick", "0.4")
        tab.run("(e => { e.value = 1; e.dispatchEvent(new Event('input')); })(document.querySelector('#section-at'))")
        next_link(tab, lambda link: any(abs(float(found[1]) - 0.8) < 0.02 and abs(float(found[2]) - 1.2) < 0.02
                                        for found in [re.search(r"z:([\d.]+)\.\.([\d.]+)", link["clip"])] if found))
        tab.choose("#section-axis", "view")
        assert "-0.2<plane:" in next_link(tab, lambda link: "plane:" in link["clip"])["clip"]
        assert tab.run("document.documentElement.scrollWidth <= innerWidth")
        tab.press_on("#clip-clear")
        last = next_link(tab, lambda link: "clip" not in link and "fov" in link)  # and without it, as before
        assert far(last["eye"], (3, 0, 1)) < 1e-3 and far(last["target"], (0, 0, 1)) < 1e-3, last
        assert tab.run(f"{ROUND}.hidden")
        again = """import('/viewer/clip_terms.js').then(({parseClip, formatClip}) => JSON.parse('%s').map(text =>
            formatClip(parseClip(text), 3, [0, 0, 0])))"""
        texts = ["box:0,0,0,1,2,3", "!box:0,0,0,1,2,3,-12.5", "z:1..2", "-1<plane:1,2,3,0,0,1<1", "z<2 or x>1", "!z:1..2", "box:0,0,0,0,1,1",
                 "box:0,0,0,1,1,1 and box:2,0,0,3,1,1 and z:0..1e+2"]
        assert tab.run(again % json.dumps(texts)) == [*texts[:3], "-1<plane:0,0,3,0,0,1<1", *texts[4:7], "box:0,0,0,1,1,1 and z:0..100 and box:2,0,0,3,1,1"]
        endless = ["box:" + ",".join(["1" * 300] * 7) + "x", "z<1" + " " * 7000 + "x", "+" * 8000]  # a link freezes no page
        # the shortest of many: what does not come back in time, or ever, never does
        took = tab.run("""import('/viewer/clip_terms.js').then(({parseClip}) => JSON.parse('%s').map(text =>
            Math.min(...Array.from({length: 20}, () => {
                const begin = performance.now(); parseClip(text); return performance.now() - begin; }))))""" % json.dumps(endless))
        assert max(took) < 500, took


def rows(tab, which):
    return dict(tab.run(f"[...document.querySelectorAll('{which} dt')].map(e => [e.textContent, e.nextElementSibling.textContent])"))


def test_classes_measures_annotations_and_views():
    """Of a floor of 20 x 10 m with a step of 1 m on it, in a directory: its views may be saved."""
    evil = "=1+1,\"<img src=x onerror=alert(1)>\""
    with tempfile.TemporaryDirectory() as folder:
        home = pathlib.Path(folder, "home")
        home.mkdir()
        scan = pathlib.Path(folder, "scan.csv")
        scan.write_text("x,y,z,class\n" + "".join(f"{x / 4},{y / 4},{int(x > 60)},{6 if x > 60 else 2}\n" for x in range(81) for y in range(41)))
        subprocess.run([REAL, "pack", scan, "-o", home / "site.spld"], check=True, capture_output=True)
        tokens = pathlib.Path(folder, "tokens")
        tokens.write_text("a-token-of-the-tests view,admin\n")
        tokens.chmod(0o600)
        chromium.send("Browser.setDownloadBehavior", behavior="allow", downloadPath=folder)
        with Daemon(REAL, "--tokens", str(tokens), datasets=[str(home)]) as other:
            above = "eye=10,5,30&target=10,5,0&up=0,1,0&projection=orthographic&view_height=12"
            site = f"http://127.0.0.1:{other.port}"
            keep = "sessionStorage.setItem('splatd-token', 'a-token-of-the-tests')"
            with page(f"{site}/#dataset=site&{above}&color_by=class", size=(1280, 800), before=keep) as tab:
                digest = settled(tab)
                tab.until("document.querySelector('#colors-legend').naturalWidth > 0")
                assert tab.run("document.querySelector('#colors-legend').alt") == "Legend: colours show class"
                labels = tab.run("[...document.querySelectorAll('#classes-list label')].map(e => e.textContent.trim())")
                assert labels == ["2 ground 75 %", "6 building 25 %"], labels
                assert tab.run("getComputedStyle(document.querySelector('#classes-list i')).backgroundColor") == "rgb(170, 85, 0)"
                tab.run("document.querySelector('#classes-list input[value=\"6\"]').click()")
                assert next_link(tab, lambda now: "class" in now)["class"] == "!6"
                assert settled(tab, digest) and sent(tab)["class"] == "!6"
                tab.run("document.querySelector('#classes').open = true")
                tab.press_on("#classes-none")
                next_link(tab, lambda now: now["class"] == "!2,6")
                tab.run("location.hash = location.hash.replace(/class=[^&]*$|class=![^&]*/, 'class=6')")
                tab.until("document.querySelectorAll('#classes-list :checked').length === 1")
                tab.run("document.querySelector('#classes-list input[value=\"2\"]').click()")
                next_link(tab, lambda now: "class" not in now)
                settled(tab)
                width, height = tab.run("[document.querySelector('#stage').clientWidth, document.querySelector('#stage').clientHeight]")
                metre = height / 12
                for i, (px, py) in enumerate(((8, 4), (12, 4), (12, 7))):
                    tab.click(width / 2 + (px - 10) * metre, height / 2 - (py - 5) * metre)
                    tab.until(f"document.querySelectorAll('#points dd').length === {i + 1}")
                number = {name: float(text.split()[0].rstrip("°")) for name, text in rows(tab, "#measures").items()}
                assert abs(number["Length"] - 7) < 0.02 and abs(number["B – C"] - 3) < 0.02 and abs(number["In plan, A – C"] - 5) < 0.02, number
                assert rows(tab, "#attributes")["class"] == "2 ground" and rows(tab, "#surface")["normal"].endswith("1.000")
                assert "length 7.0" in tab.text("#said") and tab.run("document.querySelector('#said').ariaLive") == "polite"
                tab.choose("#measure", "angle")
                assert abs(float(rows(tab, "#measures")["Angle at B"].rstrip("°")) - 90) < 0.3
                tab.choose("#measure", "area")
                area = rows(tab, "#measures")["Area"]
                assert abs(float(area.split()[0]) - 6) < 0.05 and area.split()[1] in ("m²", "unit²"), area
                tab.run(f"document.querySelector('#mark-name').value = {json.dumps(evil)}")
                tab.press_on("#mark-add")
                assert tab.text("#annotations strong") == evil == tab.text("#names text") and not tab.run("document.querySelector('#annotations img')")
                now = link(tab)["mark"].split(",", 3)
                assert now[3] == evil and far(list(map(float, now[:3])), (12, 7, 0)) < 0.05, now
                tab.press_on("#csv")
                table = list(csv.DictReader(appeared(folder, "site-points.csv").read_text().splitlines()))
                assert [row["kind"] for row in table] == ["point"] * 3 + ["annotation"] + ["measure"] * 3, table
                assert table[3]["name"] == "'" + evil and table[0]["class"] == "2" and abs(float(table[1]["x"]) - 12) < 0.02, table
                assert table[4]["name"] == "Area" and abs(float(table[4]["value"]) - 6) < 0.05 and table[4]["unit"].endswith("²")
                tab.press_on("#geojson")
                made = json.loads(appeared(folder, "site-points.geojson").read_text())
                assert "not longitude" in made["note"] and "not longitude" in tab.text("#said"), "a scan without a coordinate system"
                kinds = [feature["geometry"]["type"] for feature in made["features"]]
                assert kinds == ["Point"] * 4 + ["Polygon"] and made["features"][3]["properties"]["name"] == evil
                ring = made["features"][4]["geometry"]["coordinates"][0]
                assert ring[0] == ring[-1] and len(ring) == 4 and sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(ring, ring[1:])) > 0
                tab.choose("#clip-rest", "x<18")
                tab.choose("#shade", "edl")
                settled(tab)
                tab.run("document.querySelector('#advanced').open = true; document.querySelector('#view-name').value = 'from-above'")
                tab.press_on("#saving button")
                tab.until("document.querySelector('#said').textContent === 'Saved as from-above'")
                assert not tab.run("document.querySelector('#views-label').hidden")
                mark = urllib.parse.quote(link(tab)["mark"])
            auth = {"Authorization": "Bearer a-token-of-the-tests"}
            [view] = other.ask("/v1/datasets/site", headers=auth).json()["views"]
            assert view["settings"] == {"clip": "x<18", "color_by": "class", "shade": "edl"}, view
            assert view["projection"] == "orthographic" and abs(view["view_height"] - 12) < 0.01, view
            with page(f"{site}/#dataset=site&view=from-above&mark={mark}", before=keep) as tab:
                assert view["settings"].items() <= sent(tab).items() and tab.run("document.querySelector('#clip-rest').value") == "x<18"
                plan = {name: sent(tab)[name] for name in ("eye", "target", "projection", "view_height")}
                assert plan["projection"] == "orthographic" and abs(float(plan["view_height"]) - 12) < 0.01, plan
                tab.choose("#views", "")
                next_link(tab, lambda now: "clip" not in now and "projection" not in now)
                tab.choose("#views", "from-above")
                now = next_link(tab, lambda now: now.get("clip") == "x<18" and now.get("shade") == "edl" and "projection" in now)
                assert now["projection"] == "orthographic" and abs(float(now["view_height"]) - 12) < 0.01, now
                assert tab.text("#annotations strong") == evil and link(tab)["mark"].endswith(evil)
                tab.press_on("#annotations button")
                assert "mark" not in link(tab) and not tab.text("#names")


def test_a_tour_keeps_and_fades_what_is_soft():
    term = urllib.parse.quote("axis:0,0,0,0,0,1<0.5")
    with tempfile.TemporaryDirectory() as folder, page(f"{SITE}/{FACING}&soft={term}&soft_opacity=0.8") as tab:
        chromium.send("Browser.setDownloadBehavior", behavior="allow", downloadPath=folder)
        tab.run("document.querySelectorAll('details').forEach(d => d.open = true)")
        tab.press_on("#add")
        tab.run("document.querySelector('#control-soft_opacity').focus()")
        tab.key("Home")
        next_link(tab, lambda now: now.get("soft_opacity") == "0")
        tab.press_on("#add")
        tab.choose("#keyframes li:nth-child(1) input", "0.5")
        tab.press_on("#download")
        tour = json.loads(appeared(folder, "wall-tour.json").read_text())
        assert [key["soft_opacity"] for key in tour["keyframes"]] == [0.8, 0] and "soft_opacity" not in tour["keyframes"][0]["camera"]
        assert tab.run("import('/viewer/tour.js').then(({Tour}) => Tour.prototype.opacityAt.call("
                       "{keyframes: [{soft_opacity: 1}, {}, {soft_opacity: 0}], legs: [1, 3], closed: false}, 3))") == 0.25
        tab.press_on("#keyframes li:nth-child(1) button")
        next_link(tab, lambda now: now.get("soft_opacity") == "0.8")
        assert tab.run("document.querySelector('#control-soft_opacity').value") == "0.8"
        tab.press_on("#play")
        tab.until("document.querySelector('#play').textContent === 'Play'")
        next_link(tab, lambda now: now.get("soft_opacity") == "0")


def refuse(tab, status, problem, retry):
    """The next view is answered with a refusal, by the browser itself."""

    def hear(method, params, usual=tab._hear):
        if method == "Fetch.requestPaused":
            chromium.listeners[tab.session] = usual
            body = base64.b64encode(
                json.dumps({"type": f"urn:splatd:error:{problem}", "detail": "as the test wants it"}).encode()
            )
            headers = [
                {"name": "Retry-After", "value": str(retry)},
                {"name": "Content-Type", "value": "application/problem+json"},
            ]

            def answer():
                tab.send(
                    "Fetch.fulfillRequest",
                    requestId=params["requestId"],
                    responseCode=status,
                    body=body.decode(),
                    responseHeaders=headers,
                )
                tab.send("Fetch.disable")

            threading.Thread(target=answer).start()
        else:
            usual(method, params)

    chromium.listeners[tab.session] = hear
    tab.send("Fetch.enable", patterns=[{"urlPattern": "*/view?*"}])


def test_a_link_outlives_the_frames_before_it():
    """What is on its way when the fragment changes neither puts the old camera back into it nor opens it anew."""
    hold = """window.usual ??= fetch; window.fetch = (path, how) => path !== '/v1/datasets' ? usual(path, how)
        : new Promise(done => { window.release = () => done(usual(path, how)); });"""
    with page(complaints="400") as tab:
        tab.run(f"{hold} location.hash = '#dataset=wall&eye=4,1,2&target=0,0,1'")
        tab.until("Boolean(window.release)")
        tab.run("window.facts = document.querySelector('#facts').firstChild")
        tab.choose("#lod", "2")
        tab.until(f"document.querySelector('#facts').firstChild !== facts && {REST}", "a frame of the old camera")
        assert link(tab)["eye"] == [4, 1, 2]
        tab.run("release()")
        next_link(tab, lambda now: "layer" in now)  # which the page adds
        assert link(tab)["eye"] == [4, 1, 2] and link(tab)["target"] == [0, 0, 1]
        tab.run(f"{hold} delete window.release; location.hash = '#dataset=wall&eye=0,0,1&target=0,0,1'")
        tab.until("Boolean(window.release)")
        tab.choose("#lod", "2")
        tab.until(REST)
        tab.run("release()")
        tab.until("document.querySelector('#notice p').textContent.startsWith('Refused: ')")
    late = """(usual => { window.waiting = null; window.requestAnimationFrame = step =>
        waiting ? waiting.push(step) : usual(step); })(requestAnimationFrame)"""
    with page(before=late) as tab:
        tab.run("waiting = []")
        tab.click(*middle(tab), times=2)
        tab.until("waiting.length", "it begins to turn")
        tab.run("location.hash = '#dataset=wall&eye=4,1,2&target=0,0,1.5'")
        next_link(tab, lambda now: now["eye"] == [4, 1, 2])
        tab.run("(steps => { waiting = null; steps.forEach(step => step(performance.now() + 99)); })(waiting)")
        tab.drawn()
        now = next_link(tab, lambda now: True)
        assert now["eye"] == [4, 1, 2] and now["target"] == [0, 0, 1.5], now


def test_trouble_is_told_and_passes():
    with page(complaints="503|ERR_INTERNET_DISCONNECTED") as tab:
        tab.run(
            """(box => { window.told = [];
            const text = (name) => box.querySelector(name).textContent;
            new MutationObserver(() => told.push(text('p') + text('small')))
                .observe(box, {subtree: true, childList: true, attributes: true}); })(document.querySelector('#notice'))"""
        )
        for problem, title in (("busy", "The service is busy"), ("device-lost", "The device is being rebuilt")):
            refuse(tab, 503, problem, 1)
            began = time.monotonic()
            tab.choose("#lod", "2" if problem == "busy" else "1")
            tab.until(f"told.some(text => text.startsWith('{title}') && text.includes('Trying again in 1 s'))")
            tab.until("document.querySelector('#notice').hidden")
            assert time.monotonic() - began > 0.9, "Retry-After is kept"
            settled(tab)
        tab.send("Network.enable")
        tab.send(
            "Network.emulateNetworkConditions", offline=True, latency=0, downloadThroughput=-1, uploadThroughput=-1
        )
        tab.choose("#lod", "2")
        tab.until("document.querySelector('#notice p').textContent.startsWith('No connection')")
        tab.send(
            "Network.emulateNetworkConditions", offline=False, latency=0, downloadThroughput=-1, uploadThroughput=-1
        )
        tab.until("document.querySelector('#notice').hidden")
        settled(tab)
    with page(f"{SITE}/#dataset=none", ready="!document.querySelector('#notice').hidden", complaints="404|400") as tab:
        assert tab.text("#notice p").startswith("Not there: ") and "'none'" in tab.text("#notice p")
        tab.choose("#dataset", "wall")
        settled(tab)
        assert tab.run("document.querySelector('#notice').hidden")
        tab.run("location.hash = '#dataset=none'")
        tab.until(
            "document.querySelector('#notice p').textContent.startsWith('Not there')"
            " && document.querySelector('canvas').hidden"
        )
        tab.drag((200, 200), (250, 200))  # nothing to move
        tab.run("location.hash = '#dataset=wall&budget=77ms'")
        settled(tab)
        assert link(tab)["budget"] == "77ms"
        tab.run("location.hash = '#dataset=wall&eye=0,0,1&target=0,0,1'")  # a camera that the service refuses
        tab.until("document.querySelector('#notice p').textContent.startsWith('Refused: ')")
        tab.press_on("#home")
        settled(tab)


def test_embed():
    with page(f"{SITE}/embed/wall#eye=3,0,1&target=0,0,1&layer=depth", size=(400, 300)) as tab:
        digest = settled(tab)
        assert digest[1] > 10 and not tab.run(
            "[...document.querySelectorAll('button, select, input')].some(e => e.offsetHeight)"
        )
        tab.drag((200, 150), (260, 150))
        settled(tab, digest)
        assert all(name for _, name in tab.names())
    term = "axis:0,0,0,0,0,1<0.5 or class:3"
    with page(f"{SITE}/embed/wall#eye=3,0,1&target=0,0,1&budget=500ms&soft={urllib.parse.quote(term)}&soft_opacity=0.5"
              "&clip=z%3C1.5&clip=x%3E-9&near=0.5&background=ffeedd&mark=0,0,1,The%20%3Cb%3Ewall", size=(400, 300)) as tab:
        asked = [urllib.parse.unquote(name) for name in tab.run(VIEWS)]
        kept = {"clip": "z<1.5 and x>-9", "near": "0.5", "background": "ffeedd"}
        assert kept.items() <= sent(tab).items() and tab.text(".marks text") == "The <b>wall", sent(tab)
        assert asked and all(f"soft={term}&soft_opacity=0.5" in url for url in asked), asked
    with page(
        f"{SITE}/embed/none", ready="!document.querySelector('#notice').hidden", complaints="404", size=(400, 300)
    ) as tab:
        assert "'none'" in tab.text("#notice p")
    with page(f"{SITE}/embed/wall#eye=3,0,1&target=abc", ready="!document.querySelector('#notice').hidden", size=(400, 300)) as tab:
        told = "Refused: target of the link is left out: it has to be three numbers, not 'abc'"
        assert tab.text("#notice p") == told and not tab.run(VIEWS), tab.text("#notice p")


def lonlat(world):
    reply = daemon.ask(f"/v1/datasets/wall/place?crs=EPSG:4326&world={','.join(map(str, world))}")
    return ",".join(map(repr, reply.json()["position"]))


def test_that_tiles_are_missing():
    """What stands there from afar is no picture of what the scan shows: the page says so."""
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        shutil.copy(WALL, folder / "tile.spld")
        subprocess.run([REAL, "collect", folder / "tile.spld", "-o", folder / "city.spld"], check=True, stderr=subprocess.DEVNULL)
        (folder / "tile.spld").unlink()
        with Daemon(REAL, datasets=[folder / "city.spld"]) as other:
            with page(f"http://127.0.0.1:{other.port}/#dataset=city&eye=3,0,1&target=0,0,1&up=0,0,1&fov=50") as tab:
                tab.until("document.querySelector('#facts').textContent.endsWith(', tiles missing')")


def test_longitude_and_latitude():
    if os.environ["SPLATD_PROJ"] != "1":
        return
    eye, target = lonlat((3, 0, 1)), lonlat((0, 0, 1))
    camera = f"crs=EPSG:4326&eye={eye}&target={target}&up=0,0,1&fov=50"
    plane = urllib.parse.quote(f"plane:{lonlat((0, 0, 1.2))},0,0,1<0")
    with page(f"{SITE}/#dataset=wall&{camera}&clip={plane}") as tab:
        now = link(tab)
        cut = list(map(float, re.fullmatch(r"plane:([^<]*)<0", now["clip"])[1].split(",")))
        assert far(cut[:3], (0, 0, 1.2)) < 1e-3 and cut[3:] == [0, 0, 1], now  # in the world by now
        assert far(now["eye"], (3, 0, 1)) < 1e-3 and far(now["target"], (0, 0, 1)) < 1e-3 and "crs" not in now, now
    with page(f"{SITE}/embed/wall#{camera}", size=(400, 300)) as tab:
        asked = [name for name in tab.run(VIEWS)]
        assert all("eye=3%2C0%2C1&" in a or "eye=3,0,1&" in a for a in asked) and "crs" not in asked[0], asked
        digest = settled(tab)
        tab.drag((200, 150), (260, 150))
        settled(tab, digest)
    with page(f"{SITE}/embed/wall#eye=3,0,1&target=0,0,1&up=0,0,1&fov=50", size=(400, 300)) as tab:
        assert settled(tab) == digest
    for wrong, said in ((f"crs=EPSG:4326&eye=10,50,1&target={target}", "km from the dataset"), ("crs=EPSG:9&eye=1,2,3", "EPSG:9")):
        with page(f"{SITE}/embed/wall#{wrong}", ready="!document.querySelector('#notice').hidden", complaints="400") as tab:
            assert said in tab.text("#notice p"), tab.text("#notice p")


@contextlib.contextmanager
def elsewhere(site, element):
    """A page of another origin with a <splat-view> in it; its address."""
    html = f"""<!doctype html><meta charset=utf-8><link rel=icon href="data:,">
        <script type=module src="{site}/clients/splat-view.js"></script>
        {element}""".encode()

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(html)

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()


def test_splat_view_on_another_origin():
    element = '<splat-view dataset="wall" eye="3,0,1" target="0,0,1" method="fill" kernel="9" class="wide"></splat-view>'
    with elsewhere(SITE, element) as url:
        with page(url, ready="document.querySelector('splat-view')?.camera", size=(500, 400)) as tab:
            assert tab.run("document.querySelector('splat-view').camera.eye") == [3, 0, 1]
            assert tab.run("(e => e.clientWidth / e.clientHeight)(document.querySelector('splat-view'))") > 1.7
            length = tab.run("history.length")
            tab.run("document.querySelector('splat-view').setAttribute('eye', '3,1,1')")
            tab.until("document.querySelector('splat-view').camera.eye[1] === 1")
            assert tab.run("history.length") == length
            frame = tab.run("document.querySelector('splat-view').shadowRoot.querySelector('iframe').src")
            assert frame.endswith("#eye=3%2C0%2C1&target=0%2C0%2C1&method=fill&kernel=9"), "the element's own stay with it"
            tab.drag((250, 150), (320, 150))
            tab.until("document.querySelector('splat-view').camera.eye[1] !== 1")


def test_a_token_is_asked_for():
    token = "a-token-of-the-tests"
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "tokens")
        file.write_text(f"{token} view\n")
        file.chmod(0o600)
        with Daemon(REAL, "--tokens", str(file)) as guarded:
            site = f"http://127.0.0.1:{guarded.port}"
            with page(site, ready="!document.querySelector('#token').hidden", complaints="401") as tab:
                assert tab.text("#notice p") == "A token is needed: enter it in the panel, under Token"
                assert not tab.run("document.querySelector('#panel').hidden")
                tab.click(300, 300)  # there is nothing to pick yet, nor to set
                assert tab.text("#said") == ""
                assert tab.run("[...document.querySelectorAll('#panel :is(button, select, input)')].filter(e => e.offsetParent).map(e => e.id || e.form.id)") \
                    == ["dataset", "token", "token"]
                for text in ("some-other-token-than-that", token):
                    tab.run(
                        f"""document.querySelector('#token input').value = '{text}';
                        document.querySelector('#token').requestSubmit()"""
                    )
                    tab.until(
                        "document.querySelector('#token').hidden"
                        if text == token
                        else "document.querySelector('#notice').textContent.includes('not known')"
                    )
                settled(tab)
                assert token not in tab.run("location.href") + json.dumps(tab.run(VIEWS))
            with page(f"{site}/embed/wall", ready="!document.querySelector('#notice').hidden", complaints="401") as tab:
                assert tab.text("#notice p") == "A token is needed: ask whoever embedded this for a signed URL"
            with elsewhere(site, f'<splat-view dataset="wall" token="{token}"></splat-view>') as url:
                with page(url, ready="document.querySelector('splat-view')?.camera", complaints="401"):
                    pass


def test_a_signed_page_needs_no_token():
    """In a page of another origin: until it expires, unaltered, for its dataset and no other."""
    heard = "<script>addEventListener('message', e => (window.heard ??= []).push(e.data.splatd))</script>"
    with tempfile.TemporaryDirectory() as folder:
        tokens, key = pathlib.Path(folder, "tokens"), pathlib.Path(folder, "key")
        tokens.write_text("a-token-of-the-tests view\n")
        key.write_text("0123456789abcdef0123456789abcdef")
        tokens.chmod(0o600)
        key.chmod(0o600)
        with Daemon(REAL, "--tokens", str(tokens), "--url-key", str(key), datasets=(WALL, TEXTURED)) as guarded:
            site = f"http://127.0.0.1:{guarded.port}"

            def sign(path, expires="1h"):
                command = [REAL, "sign", site + path, "--key", str(key), "--expires", expires]
                return subprocess.run(command, capture_output=True, text=True, check=True, timeout=600).stdout.strip()
            signed = sign("/embed/wall#eye=3,0,1&target=0,0,1")
            with elsewhere(site, f'{heard}<iframe width=400 height=300 src="{signed}"></iframe>') as url:
                with page(url, ready="window.heard?.includes('camera')") as tab:
                    assert "token" not in tab.run("heard")
            with page(signed, size=(400, 300)) as tab:
                digest = settled(tab)
                assert digest[1] > 10
                tab.drag((200, 150), (260, 150))  # views that nobody has signed one by one
                settled(tab, digest)
            query = re.search(r"exp=[^#]*", signed)[0]
            with elsewhere(site, f'<splat-view dataset="wall" signed="{query.replace("&", "&amp;")}"></splat-view>') as url:
                with page(url, ready="document.querySelector('splat-view')?.camera"):
                    pass
            old = sign("/embed/wall", "1s")
            time.sleep(2.1)
            for wrong, said in ((signed.replace("/wall", "/wall-textured"), "was changed"), (old, "has expired"),
                                (signed.replace("exp=", "exp=1"), "was changed"), (signed.replace("&sig=", "&sig=A"), "changed")):
                with page(wrong, ready="!document.querySelector('#notice').hidden", complaints="403") as tab:
                    assert said in tab.text("#notice p") and tab.text("#notice p").startswith("Refused"), wrong
                    assert tab.run("document.querySelector('canvas').hidden")


try:
    with daemon:
        run(globals())
finally:
    chromium.close()
