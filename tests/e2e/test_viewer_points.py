"""What the page says of points that are clicked, of classes, measures, annotations and views by name."""
import csv
import json
import math
import pathlib
import re
import subprocess
import tempfile
import urllib.parse

from viewer import (
    FACING, SITE, appeared, chromium, daemon, far, link, main, middle, moved, next_link, page, sent, settled,
)
from harness import REAL, Daemon


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


main(globals())
