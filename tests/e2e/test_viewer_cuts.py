"""What the page leaves out and sees through: the box with handles, sections, what is soft."""
import json
import math
import os
import re
import tempfile
import urllib.parse

from viewer import (
    FACING, REST, SITE, appeared, chromium, daemon, far, link, lonlat, main, middle, next_link, page, sent,
    settled,
)

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


main(globals())
