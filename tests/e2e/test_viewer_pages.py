"""The page among others: the gallery, inside pages of other origins, behind tokens, and when something is wrong."""
import base64
import contextlib
import http.server
import json
import pathlib
import re
import shutil
import subprocess
import tempfile
import threading
import time
import urllib.parse

from viewer import DIGEST, REST, SITE, VIEWS, chromium, daemon, far, link, main, middle, next_link, page, sent, settled
from harness import REAL, TEXTURED, WALL, Daemon

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
                tab.run("location.hash = '#datset=wall'")
                tab.until("document.querySelector('#said').textContent.startsWith('datset of the link is left out')")
                tab.run("location.hash = '#dataset=wall'")
                tab.until(f"{REST} && document.title.startsWith('wall')")
                tab.press_on("#all")
                tab.until(f"{CARDS}.length === 2")
                tab.go(f"{site}/#dataset=site&view=low")
                tab.until(f"{REST} && document.title.startsWith('The <i>site')")
                assert far(link(tab)["eye"], [10, -9, 2]) < 1e-3 and abs(float(link(tab)["fov"]) - 70) < 0.01


def test_wrong_links_say_so():
    with page(f"{SITE}/#dataset=wall&eye=1,2&target=0,0,1&fov=wide", ready=f"{REST} && !!document.querySelector('#said').textContent") as tab:
        told = tab.text("#said")
        assert "eye of the link is left out: it has to be three numbers, not '1,2'" in told and "fov of the link is left out" in told, told
        assert "target" not in told, told
    odd = "eye=3,0,1&target=0,0,1&projecton=orthographic&layers=depth"
    own = "&width=64&height=64&format=png&quality=9&wait=1&data-id=7"  # of a view's URL, or of HTML; what the page sees to itself
    for address in f"{SITE}/#dataset=wall&{odd}{own}", f"{SITE}/embed/wall#{odd}{own}":
        with page(address, ready=f"{REST} && !!document.querySelector('#said').textContent") as tab:
            said = [f"{name} of the link is left out: the page knows no such parameter" for name in ("projecton", "layers")]
            assert tab.text("#said") == ". ".join(said), tab.text("#said")
    known = urllib.parse.urlencode({one["name"]: one["default"] for one in daemon.ask("/v1/methods").json()["parameters"]})
    with page(f"{SITE}/#dataset=wall&eye=3,0,1&target=0,0,1&{known}{own}") as tab:
        assert tab.text("#said") == "", tab.text("#said")
    for heights, said in (("view_height=0", "view_height of the link is left out: it has to be above 0, not '0'"),
                          ("units_per_pixel=-1", "units_per_pixel of the link is left out: it has to be above 0, not '-1'"),
                          ("units_per_pixel=1&view_height=2", "units_per_pixel of the link is left out: view_height says it already")):
        with page(f"{SITE}/#dataset=wall&eye=3,0,1&target=0,0,1&{heights}", ready="!!document.querySelector('#said').textContent") as tab:
            assert tab.text("#said") == said, tab.text("#said")
    with page(f"{SITE}/?dataset=wall", ready="document.querySelector('.problem') !== null", complaints="400") as tab:
        assert "dataset" in tab.text(".problem p")
        tab.press_on(".problem a")
        tab.until(REST)
    with page(f"{SITE}/nowhere", ready="document.querySelector('.problem') !== null", complaints="404", dark=True) as tab:
        assert tab.text("h1") == "Not Found" and all(name for _, name in tab.names())


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
    element = '<splat-view dataset="wall" eye="3,0,1" target="0,0,1" method="fill" kernel="9" class="wide" id="v" title="The wall" role="img" tabindex="0" data-v-7></splat-view>'
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
                for width in 900, 700, 390:  # one may read all of it
                    tab.resize((width, 600))
                    apart = "((a, b) => a.top >= b.bottom || a.right <= b.left)(...['#notice', '#toggle'].map(n => document.querySelector(n).getBoundingClientRect()))"
                    assert tab.run(apart), f"{width} pixels"
                tab.resize((900, 600))
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


main(globals())
