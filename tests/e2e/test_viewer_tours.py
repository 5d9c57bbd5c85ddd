"""Tours in the page: made, played, and rendered by the service."""
import json
import re
import tempfile
import urllib.parse
import zipfile

import browser

from viewer import FACING, SITE, appeared, chromium, link, main, middle, moved, next_link, page
from harness import REAL, Daemon, eventually


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


main(globals())
