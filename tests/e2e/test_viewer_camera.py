"""How the page is steered: by mouse, finger, keys and links, and that its camera is the service's."""
import base64
import json
import math
import os
import pathlib
import re
import subprocess
import tempfile
import urllib.parse

from viewer import (
    DIGEST_OF, FACING, SITE, VIEWS, daemon, far, link, lonlat, main, middle, moved, next_link, page, sent,
    settled,
)
from harness import REAL, Daemon

# Frames that are counted: time stands still once `left` of them have come, so that what moves moves as far everywhere.
STEPS = """(usual => { window.left = 0; let now = 0; window.requestAnimationFrame = step => usual(() => {
    if (left > 0) { left--; now += 16; }
    step(now); }); })(requestAnimationFrame)"""
# Whether a picture was ever bent: it is straight again as soon as the next frame has come.
BENT = """(canvas => { window.bent = false;
    new MutationObserver(() => { window.bent ||= canvas.style.transform.startsWith('matrix3d'); })
        .observe(canvas, {attributes: true}); })(document.querySelector('canvas'))"""


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


def test_links_to_plans():
    """As the service takes them: up is +y where nothing else is said and one looks down, and a pixel's height will do."""
    down = "eye=0.1,0.2,9&target=0.1,0.2,0"

    def up(query):
        reply = daemon.ask(f"/v1/datasets/wall/view?{query}&width=64&height=64", method="HEAD")
        assert reply.status == 200, (query, reply.status)
        return [-x for x in json.loads(reply.headers["Splatd-Camera"])["rotation"][3:6]]

    flat = f"{down}&projection=orthographic&view_height=3"
    for address in f"{SITE}/#dataset=wall&{flat}", f"{SITE}/embed/wall#{flat}":
        with page(address) as tab:
            assert list(map(float, sent(tab)["up"].split(","))) == up(flat) == [0, 1, 0] and settled(tab)[1] > 0
            lies = "m.upOf({up: [0, 1, 0]}, {eye: [1, 9, 0], target: [1, 0, 0]})"  # where +y itself is up
            assert tab.run(f"import('/viewer/camera.js').then(m => {lies})") == [0, 0, -1]
    with tempfile.TemporaryDirectory() as folder:
        scan = pathlib.Path(folder, "scan.xyz")
        scan.write_text("".join(f"{x / 4} {y / 4} 0\n" for x in range(41) for y in range(21)))
        subprocess.run([REAL, "pack", scan, "-o", f"{folder}/site.spld", "--view", "low=eye=10,-9,2,target=10,5,0,fov=70"],
                       check=True, capture_output=True)
        with Daemon(REAL, datasets=[f"{folder}/site.spld"]) as other:
            for address in "/#dataset=site&", "/embed/site#":  # a view by name says what is up, but not to whom looks along that
                with page(f"http://127.0.0.1:{other.port}{address}view=low&{flat}") as tab:
                    assert sent(tab)["up"] == "0,1,0", sent(tab)
    for address in f"{SITE}/#dataset=wall&{down}&units_per_pixel=0.01", f"{SITE}/embed/wall#{down}&units_per_pixel=0.01":
        with page(address) as tab:
            height = tab.run("document.querySelector('#stage').clientHeight")
            assert sent(tab)["projection"] == "orthographic" and abs(float(sent(tab)["view_height"]) - height / 100) < 1e-3, sent(tab)
    steep = f"{SITE}/#dataset=wall&{down}"  # refused by the service as well: of a pinhole nobody knows what is up there
    with page(steep, ready="!document.querySelector('#notice').hidden", complaints="400") as tab:
        assert "up is parallel" in tab.text("#notice p")


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


main(globals())
