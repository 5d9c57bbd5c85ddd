"""The page's controls: each parameter where the service takes it, in its words, and within reach of everybody."""
import json
import pathlib
import re
import shutil
import subprocess
import tempfile
import urllib.parse

from viewer import DIGEST, FACING, REST, SITE, VIEWS, daemon, link, main, middle, next_link, page, settled
from harness import MAPPED, REAL, TEXTURED, WALL, Daemon


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


main(globals())
