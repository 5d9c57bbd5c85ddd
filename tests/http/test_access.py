"""Who may do what, over HTTP: tokens and their patterns, signed URLs, rates, other origins, files read again by SIGHUP."""
import base64
import contextlib
import hashlib
import hmac
import os
import pathlib
import re
import signal
import subprocess
import tempfile
import threading
import time

from harness import FAKE, REAL, VIEW, WALL, Daemon, eventually, run, together

SMALL = VIEW + "?width=16&height=16"
VIEWER, TOURIST, ADMIN, OUTSIDER, NEXT = (f"{name}-0123456789abcdef" for name in
                                          ("viewer", "tourist", "admin", "outsider", "next"))
KEY = "0123456789abcdef0123456789abcdef\n"


def lines():
    return (f"# tests\n{VIEWER} view\nsha256:{hashlib.sha256(TOURIST.encode()).hexdigest()} view,tour wa*\n"
            f"{ADMIN} admin\n{OUTSIDER} view,admin other-*\n")


@contextlib.contextmanager
def guarded(*args, tokens=None, datasets=(WALL,), **environment):
    with tempfile.TemporaryDirectory() as home:
        file, key = pathlib.Path(home, "tokens"), pathlib.Path(home, "url.key")
        file.write_text(tokens or lines())
        key.write_text(KEY)
        file.chmod(0o600)
        key.chmod(0o600)
        with Daemon(FAKE, "--tokens", str(file), "--url-key", str(key), *args, datasets=datasets, **environment) as d:
            d.tokens, d.key = file, str(key)
            yield d
        log = "".join(d.lines)
        for secret in (VIEWER, TOURIST, ADMIN, OUTSIDER, NEXT, KEY.strip(), "sig="):
            assert secret not in log, "a secret in the log"


def bearer(token, **more):
    return {"Authorization": f"Bearer {token}", **more}


def sign(d, url, expires="1h"):
    return subprocess.run([REAL, "sign", url, "--key", d.key, "--expires", expires], capture_output=True, text=True,
                          check=True, timeout=150).stdout.strip()


def test_without_a_token_only_the_page_is_there():
    with guarded() as d:
        for path in (SMALL, "/v1/datasets", "/v1/status", "/v1/datasets/wall", "/v1/datasets/none", VIEW):
            reply = d.ask(path)
            assert reply.status == 401 and reply.headers["WWW-Authenticate"] == 'Bearer realm="splatd"', path
        index = d.ask("/", headers={"Accept": "application/json"})
        assert index.status == 200 and index.json()["views"] == []
        assert d.ask("/v1/openapi.yaml").status == 200
        for wrong in ("nobody-0123456789abcdef", VIEWER[:-1], VIEWER + "0", "", "x" * 8000):
            reply = d.ask(SMALL, headers=bearer(wrong))
            assert reply.status == 401 and "invalid_token" in reply.headers["WWW-Authenticate"], reply.body
            assert not wrong or wrong not in reply.body.decode()
        for other in (f"Basic {VIEWER}", VIEWER, f"Bearer{VIEWER}"):
            assert d.ask(SMALL, headers={"Authorization": other}).status == 401
        status = d.ask("/v1/status", headers=bearer(VIEWER)).json()
        assert status["counters"]["refused_access"] == 14 and status["counters"]["frames"] == 0, status
        assert "tokens" not in status["parameters"] and "url-key" not in status["parameters"]


def test_a_token_does_what_its_line_says():
    with guarded() as d:
        for token in (VIEWER, TOURIST):
            assert d.ask(SMALL, headers=bearer(token)).status == 200
            assert d.ask(SMALL, headers={"Authorization": f"bearer  {token}"}).status == 200
            assert d.ask(VIEW, "POST", '{"width": 16}', bearer(token)).status == 200
            assert [x["id"] for x in d.ask("/v1/datasets", headers=bearer(token)).json()["datasets"]] == ["wall"]
            assert d.ask("/v1/datasets/none", headers=bearer(VIEWER)).status == 404
        reply = d.ask(SMALL, headers=bearer(ADMIN))
        assert reply.status == 403 and 'scope="view"' in reply.headers["WWW-Authenticate"], reply.headers
        for path in ("/v1/datasets/wall", SMALL, "/v1/datasets/none"):  # what is not theirs may be there or not
            assert d.ask(path, headers=bearer(OUTSIDER)).status == 403
        assert d.ask("/v1/datasets", headers=bearer(OUTSIDER)).json() == {"datasets": []}
        assert d.ask("/v1/status", headers=bearer(OUTSIDER)).json()["datasets"] == []
        assert d.ask("/", headers=bearer(OUTSIDER, Accept="application/json")).json()["views"] == []
        assert d.ask("/", headers=bearer(VIEWER, Accept="application/json")).json()["views"] == [VIEW]


def test_a_token_in_a_url_is_refused():
    with guarded() as d:
        for query in (f"token={VIEWER}", f"width=16&access_token={VIEWER}"):
            for headers in ({}, bearer(VIEWER)):
                reply = d.ask(f"{VIEW}?{query}", headers=headers)
                assert reply.status == 400 and reply.json()["field"] == "token" and VIEWER not in reply.body.decode()


def test_a_signed_url_is_good_for_what_it_says():
    with guarded() as d:
        url = sign(d, SMALL)
        plain = d.ask(SMALL, headers=bearer(VIEWER)).body
        for path in (url, sign(d, f"http://somewhere{SMALL}").removeprefix("http://somewhere")):
            reply = d.ask(path)
            assert reply.status == 200 and reply.body == plain
        assert d.ask(url, "HEAD").status == 200
        assert d.ask(sign(d, "/v1/datasets/wall")).status == 200
        assert d.ask(sign(d, VIEW)).status == 200
        soft = sign(d, SMALL + "&soft=class:3-5+or+axis:0,0,0,0,0,1<0.5&soft=class:7")
        assert "<" not in soft and "0.5&" in soft  # as browsers write it: they would ask for other bytes than were signed
        assert d.ask(soft).status == 200 and '"class:7"' in d.ask(soft).headers["Splatd-Soft"]
        assert d.ask(soft.replace("class:7", "class:8")).status == 403
        pick = sign(d, VIEW.replace("/view", "/pick") + "?x=8&y=8&width=16&height=16")
        assert d.ask(pick).status == d.ask(pick, "HEAD").status == 200
        assert d.ask(pick.replace("x=8", "x=9")).status == 403 and d.ask(pick, "POST", '{"x": 8, "y": 8}').status == 401
        at = url.index("sig=") + 4
        forged = [url.replace("width=16", "width=17"), url.replace("wall", "walk"), url[:-1], url[:at] + "A" * 43,
                  url + "&x=1", url[:at], url.replace("exp=", "exp=9"), url.replace("&exp", "&&exp")]
        for path in forged:
            reply = d.ask(path)
            assert reply.status in (401, 403), (path, reply.status)
            assert reply.status == 401 or reply.json()["field"] in ("sig", "exp"), reply.body
        for path in (url + "&x=1", url.replace("&exp", "&x=1&exp") + "&", url + "&x=1&y=2"):
            reply = d.ask(path)
            assert reply.status == 401 and reply.json()["field"] == "sig", (path, reply.body)
            assert "signature does not match" in reply.json()["detail"], reply.body
        assert "signature" not in d.ask(SMALL).json()["detail"]
        assert d.ask(url, "POST", "{}").status == 401
        assert d.ask(sign(d, "/v1/datasets/none")).status == 404
        short = sign(d, SMALL, "1s")
        eventually(lambda: d.ask(short).status == 403)
        assert d.ask(short).json()["field"] == "exp"
        assert d.ask(short, headers=bearer(VIEWER)).status == 403  # it says what it is; the token does not mend it


TILES = "/v1/datasets/wall/tiles"


def sign_here(path, seconds=3600):
    """As the documents say that any program can: of tiles the path in the text is that of all."""
    text = re.sub(r"/tiles(/\{z\}/\{x\}/\{y\}.png|\.json)", "/tiles/", path)
    text, path = (f"{t}{'&' if '?' in t else '?'}exp={int(time.time()) + seconds}" for t in (text, path))
    digest = hmac.digest(KEY.strip().encode(), text.encode(), "sha256")
    return f"{path}&sig={base64.urlsafe_b64encode(digest).decode().rstrip('=')}"


def test_a_signed_map_shows_all_its_tiles_and_nothing_else():
    with tempfile.TemporaryDirectory() as home:
        other = pathlib.Path(home, "yard.spld")
        other.write_bytes(pathlib.Path(WALL).read_bytes())
        with guarded(datasets=(WALL, str(other))) as d:
            version = d.ask("/v1/datasets/wall", headers=bearer(VIEWER)).json()["version"]
            url = sign(d, f"https://maps.example{TILES}/{{z}}/{{x}}/{{y}}.png?clip=z<1.2&v={version}")
            assert "clip=z%3C1.2&v=" in url and "/{z}/{x}/{y}.png?" in url, url
            grant = url.partition("?")[2]
            for tile in ("0/0/0.png", "3/7/2.png", "3/7/2@2x.png", "30/1073741823/0.png"):
                before = time.time()
                reply = d.ask(f"{TILES}/{tile}?{grant}")
                assert reply.status == 200 and d.ask(f"{TILES}/{tile}?{grant}", "HEAD").status == 200, (tile, reply.body)
                kept = reply.headers["Cache-Control"]
                left = int(kept.removeprefix("private, max-age=").removesuffix(", immutable"))
                expires = int(re.search(r"exp=(\d+)", grant)[1])
                assert expires - time.time() - 2 < left < expires - before + 2, kept  # as long as the signature holds
                again = d.ask(f"{TILES}/{tile}?{grant}", headers={"If-None-Match": reply.headers["ETag"]})
                assert again.status == 304 and again.headers["Cache-Control"].startswith("private, max-age=3"), again.headers
                assert d.ask(f"{TILES}/{tile}?clip=z%3C1.2&v={version}", headers=bearer(VIEWER)).headers["ETag"] == reply.headers["ETag"]
            # TileJSON by the same signature hands it on
            said = d.ask(f"{TILES}.json?{grant}")
            assert said.status == 200 and said.json()["tiles"] == [f"{TILES}/{{z}}/{{x}}/{{y}}.png?{grant}"], said.body
            assert d.ask(sign_here(f"{TILES}.json?clip=z%3C1.2&v={version}")).status == 200
            plain = sign_here(f"{TILES}/{{z}}/{{x}}/{{y}}.png").partition("?")[2]  # no parameters, and so no version
            assert d.ask(f"{TILES}/1/0/1.png?{plain}").headers["Cache-Control"] == "no-cache"
            assert d.ask(f"{TILES}.json?{plain}").json()["tiles"] == [f"{TILES}/{{z}}/{{x}}/{{y}}.png?{plain}"]
            page = passed_on(sign(d, "/embed/wall"))  # who may look at a dataset at will may do so from above
            assert d.ask(f"{TILES}/1/0/1.png?class=7&{page}").status == d.ask(f"/v1/datasets/wall/thumbnail.jpg?{page}").status == 200
            assert d.ask(d.ask(f"{TILES}.json?class=7&{page}").json()["tiles"][0].format(z=0, x=0, y=0)).status == 200
            # another dataset, other parameters, another time, tricks with the path
            signature = grant.partition("&sig=")[2]
            forged = [grant.replace("1.2", "1.3"), grant.replace("clip=z%3C1.2&", ""), "class=2&" + grant, grant.replace("exp=", "exp=9"),
                      grant[:-1], grant.replace("%3C", "%3c"), grant.replace("&sig=", "&embed="), grant.replace("&exp", "&&exp"),
                      f"sig={signature}", grant.partition("exp=")[0] + f"sig={signature}"]
            for query in forged:
                for path in (f"{TILES}/0/0/0.png", f"{TILES}.json"):
                    reply = d.ask(f"{path}?{query}")
                    assert reply.status == 403 and reply.json()["field"] in ("sig", "exp"), (path, query, reply.status, reply.body)
            for query in (grant + "&clip=z%3C9", grant + "&", ""):
                assert d.ask(f"{TILES}/0/0/0.png?{query}").status == 401, query
            for path in ("/v1/datasets/yard/tiles/0/0/0.png", "/v1/datasets/wall/../yard/tiles/0/0/0.png",
                         "/v1/datasets/wall%2f..%2fyard/tiles/0/0/0.png", "/v1/datasets/wall/%2e%2e/yard/tiles/0/0/0.png",
                         "/v1/datasets/wal%6c/tiles/0/0/0.png", "/v1/datasets/yard/tiles.json", "/v1/datasets/wall//tiles/0/0/0.png",
                         f"{TILES}//0/0/0.png", f"{TILES}/0/0/../0/0/0.png", f"{TILES}/../../yard/tiles/0/0/0.png",
                         f"{TILES}/%2e%2e/%2e%2e/0.png", f"{TILES}/..%2f..%2fyard/tiles/0.png", f"{TILES}/0%2f0%2f0.png/0/0",
                         f"{TILES}/%30/0/0.png", f"{TILES}/0/0/0.png%00", f"{TILES}/0/0/0.png/", f"{TILES}/0/0/0.jpg", f"{TILES}/",
                         f"{TILES}/0/0/-1.png", f"{TILES}/{{z}}/{{x}}/{{y}}.png", "/v1/datasets/wall", VIEW, "/v1/datasets", "/v1/status",
                         "/v1/datasets/wall/thumbnail.jpg", "/V1/datasets/wall/tiles/0/0/0.png", "//v1/datasets/wall/tiles/0/0/0.png"):
                reply = d.ask(f"{path}?{grant}")
                assert reply.status in (400, 401, 403, 404), (path, reply.status)
                assert reply.status != 400 or "%00" in path, path
            for method, body in (("POST", "{}"), ("PUT", "x"), ("DELETE", None)):
                assert d.ask(f"{TILES}/0/0/0.png?{grant}", method, body).status in (401, 405)
            assert d.ask(f"{TILES}/31/0/0.png?{grant}").status == 404  # signed, and no tile
            # one tile by itself, and a thumbnail
            one = sign_here(f"{TILES}/1/0/1.png")
            assert d.ask(one).status == 200 and d.ask(one.replace("/1/0/1", "/1/0/0")).status == 403
            thumbnail = sign(d, f"/v1/datasets/wall/thumbnail.jpg?width=64&v={version}")
            reply = d.ask(thumbnail)
            assert reply.status == 200 and reply.headers["Cache-Control"].startswith("private, max-age=3"), reply.headers
            assert d.ask(thumbnail.replace("width=64", "width=65")).status == d.ask(thumbnail.replace("wall", "yard")).status == 403
            assert d.ask(sign_here("/v1/datasets/wall/legend.svg?color_by=height")).status == 200
            short = sign_here(f"{TILES}/{{z}}/{{x}}/{{y}}.png", 1).replace("{z}/{x}/{y}", "0/0/0")
            eventually(lambda: d.ask(short).status == 403)
            assert d.ask(short).json()["field"] == "exp"
            longer = d.ask(sign_here(f"{TILES}/{{z}}/{{x}}/{{y}}.png?v={version}", 999 * 86400).replace("{z}/{x}/{y}", "0/0/0"))
            assert longer.headers["Cache-Control"] == "private, max-age=31536000, immutable"
            d.tokens.write_text(lines())
            pathlib.Path(d.key).write_text("another-" + KEY)
            d.process.send_signal(signal.SIGHUP)
            eventually(lambda: d.ask(f"{TILES}/0/0/0.png?{grant}").status == 403)


def passed_on(signed):
    """What the page at a signed /embed/ adds to its requests."""
    return signed.partition("?")[2].partition("#")[0].replace("&sig=", "&embed=")


def test_a_signed_page_looks_at_its_dataset_and_nothing_else():
    with tempfile.TemporaryDirectory() as home:
        other = pathlib.Path(home, "yard_2.b.spld")
        other.write_bytes(pathlib.Path(WALL).read_bytes())
        with guarded("--tours", home, datasets=(WALL, str(other))) as d:
            page = sign(d, "/embed/wall#eye=3,0,1&target=0,0,1")
            assert page.endswith("#eye=3,0,1&target=0,0,1") and d.ask(page.partition("#")[0]).status == 200
            grant = passed_on(page)
            looks = ["/v1/datasets/wall?", f"{SMALL}&", f"{VIEW}?eye=3,0,1&target=0,0,1&width=32&height=32&",
                     f"{VIEW}?width=16&layer=depth&format=png&", "/v1/datasets/%77all?",
                     "/v1/datasets/wall/pick?x=8&y=8&width=16&height=16&"]
            for path in looks:
                assert d.ask(path + grant).status == d.ask(path + grant, "HEAD").status == 200, path
                assert d.ask(path.rstrip("&?")).status == 401, path
            assert d.ask("/v1/datasets/wall/profile?" + grant).status == 404  # it has none
            assert d.ask("/v1/datasets/wall/place?crs=EPSG:4326&world=1,2,3&" + grant).status in (200, 501)  # or no PROJ
            for path in ("/v1/datasets", "/v1/status", "/v1/tours", "/v1/tours/0123456789abcdef",
                         "/v1/tours/0123456789abcdef/events", "/v1/tours/0123456789abcdef/video.mp4"):
                assert d.ask(f"{path}?{grant}").status == 401, path
            for method, path, body in (("POST", VIEW, "{}"), ("POST", VIEW + "s", "{}"), ("PUT", "/v1/datasets/wall", "x"),
                                       ("POST", "/v1/datasets/wall/tours", "{}"), ("DELETE", "/v1/datasets/wall", None),
                                       ("POST", "/v1/datasets/wall/pick", "{}")):
                assert d.ask(f"{path}?{grant}", method, body).status == 401, (method, path)
            odd = "/v1/datasets/yard_2.b"
            for path in (odd, odd + "/view", "/v1/datasets/none", "/v1/datasets/wall%2fview/view", "/v1/datasets/wal/view"):
                reply = d.ask(f"{path}?{grant}")
                assert reply.status == 403 and reply.json()["field"] == "sig", (path, reply.status)
            for way in ("/embed/yard_2.b", "/embed/%79ard%5f2.b"):  # its id counts, not how it is written
                theirs = passed_on(sign(d, way))
                assert d.ask(f"{odd}/view?width=16&{theirs}").status == 200 and d.ask(f"{SMALL}&{theirs}").status == 403
            expiry, signature = grant.removeprefix("exp=").split("&embed=")
            for wrong in (f"exp={int(expiry) + 1}&embed={signature}", f"exp={expiry}&embed={signature[:-1]}", "embed=",
                          f"exp={expiry}&embed={'A' * 43}", f"exp={expiry}&width=16&embed={signature}",
                          f"exp=0{expiry}&embed={signature}", f"embed={signature}", f"exp={expiry}&sig={signature}"):
                reply = d.ask(f"{SMALL}&{wrong}")
                assert reply.status == 403 and reply.json()["field"] in ("sig", "exp"), (wrong, reply.status)
            for wrong in (f"exp={expiry}&embed={signature}&x=1", f"embed={signature}&exp={expiry}"):
                assert d.ask(f"{SMALL}&{wrong}").status == 401, wrong
            view = sign(d, VIEW + "?width=16").replace("&sig=", "&embed=")  # a view's signature is no page's
            assert d.ask(view).status == 403 and d.ask(f"/v1/datasets/wall?{passed_on(view)}").status == 403
            short = passed_on(sign(d, "/embed/wall", "1s"))
            eventually(lambda: d.ask(f"{SMALL}&{short}").status == 403)
            assert d.ask(f"{SMALL}&{short}").json()["field"] == "exp"
            for path in ("/embed/wall?x=1", "/embed/wall?exp=1", f"/embed/wall?x=1&{page.partition('?')[2]}"):
                assert d.ask(path.partition("#")[0]).status == 400, path


def test_splatd_sign_refuses_what_nobody_could_use():
    with tempfile.TemporaryDirectory() as home:
        key = pathlib.Path(home, "key")
        key.write_text(KEY)
        key.chmod(0o600)
        for path in ("/", "/tours", "/v1/status", "/v1/datasets", "/v1/datasets/", "/v1/tours", "/v1/tours/x/video.mp4",
                     "/v1/datasets/a/views", "/v1/datasets/a/tours", "/v1/datasets/a/view/", "/v1/datasets//view",
                     "/v1/datasets/a/b/view", "/V1/datasets/a", "/embed/", "/embed/a/b", "/embed", "/embed/a?width=16",
                     "/embed/a%2", "/viewer/main.js", "/v1/datasets/a/tiles/", "/v1/datasets/a/view#x", "/x/embed/a"):
            for url in (path, "https://scans.example" + path):
                done = subprocess.run([REAL, "sign", url, "--key", key], capture_output=True, text=True, timeout=150)
                assert done.returncode == 2 and not done.stdout and path in done.stderr, (url, done)
                assert "/embed/" in done.stderr, done.stderr  # it says what can be signed
        shown = subprocess.run([REAL, "sign", "--help"], capture_output=True, text=True, timeout=150).stdout
        assert "/embed/vault" in shown and "iframe" in shown


def test_splatd_sign_refuses_bad_arguments():
    with tempfile.TemporaryDirectory() as home:
        key = pathlib.Path(home, "key")
        key.write_text(KEY)
        short = pathlib.Path(home, "short")
        short.write_text("secret")
        for arguments, said in [
            (["/embed/x"], "--key"), (["--key", key], "one URL"), (["/a", "/b", "--key", key], "one URL"),
            (["/embed/x", "--key", "/nowhere"], "/nowhere"), (["/embed/x", "--key", short], "32"),
            (["v1", "--key", key], "'v1'"), (["/a#b", "--key", key], "'/a#b'"),
            *[(["/embed/x", "--key", key, "--expires", e], f"'{e}'") for e in ("1", "h", "-1h", "0s", "1w", "1hh", "99999d", "")],
        ]:
            done = subprocess.run([REAL, "sign", *arguments], capture_output=True, text=True, timeout=150)
            assert done.returncode == 2 and said in done.stderr and not done.stdout, (arguments, done)
            assert "secret" not in done.stderr


def test_sighup_reads_the_files_again():
    with guarded() as d:
        url = sign(d, SMALL)
        assert d.ask(SMALL, headers=bearer(NEXT)).status == 401
        d.tokens.write_text(f"{NEXT} view\n")
        pathlib.Path(d.key).write_text("another-" + KEY)
        d.process.send_signal(signal.SIGHUP)
        eventually(lambda: d.ask(SMALL, headers=bearer(NEXT)).status == 200)
        assert d.ask(SMALL, headers=bearer(VIEWER)).status == 401
        assert d.ask(url).status == 403 and d.ask(sign(d, SMALL)).status == 200
        d.tokens.write_text(f"{VIEWER} view\n{ADMIN} whatever\n")
        d.process.send_signal(signal.SIGHUP)
        eventually(lambda: any("stay as they were" in line and "line 2" in line for line in d.lines))
        assert d.ask(SMALL, headers=bearer(NEXT)).status == 200 and d.ask(SMALL, headers=bearer(VIEWER)).status == 401
    with Daemon(FAKE) as d:
        d.process.send_signal(signal.SIGHUP)
        eventually(lambda: any("no tokens" in line for line in d.lines))
        assert d.ask(SMALL).status == 200


def test_anonymous_may_view_where_that_is_said():
    with guarded("--allow-anonymous") as d:
        assert d.ask(SMALL).status == 200 and d.ask("/v1/datasets").json()["datasets"]
        assert d.ask(SMALL, headers=bearer("nobody-0123456789abcdef")).status == 401


def test_what_others_reach_needs_a_word():
    def start(*arguments):
        process = subprocess.Popen([FAKE, "--listen", "0.0.0.0:0", *arguments, WALL], stderr=subprocess.PIPE, text=True)
        said = ""
        for line in process.stderr:
            said += line
            if line.endswith(" ready\n"):
                process.send_signal(signal.SIGTERM)
        return process.wait(150), said
    with tempfile.TemporaryDirectory() as home:
        file = pathlib.Path(home, "tokens")
        file.write_text(lines())
        file.chmod(0o600)
        code, said = start()
        assert code == 2 and "--tokens" in said and "--allow-anonymous" in said, (code, said)
        assert start("--allow-anonymous")[0] == 0 and start("--tokens", str(file))[0] == 0
        for broken, wanted in [("", "no token"), (f"{VIEWER}\n", "line 1"), (f"{VIEWER} view\n{VIEWER} view\n", "line 2")]:
            file.write_text(broken)
            code, said = start("--tokens", str(file))
            assert code == 2 and wanted in said and VIEWER not in said, said
        for arguments, wanted in [(("--tokens", "/nowhere"), "/nowhere"), (("--url-key", str(file)), "--tokens")]:
            code, said = start("--allow-anonymous", *arguments)
            assert code == 2 and wanted in said, said


def test_pages_of_listed_origins_may_read():
    with guarded("--cors", "https://dash.example", "--cors", "http://127.0.0.1:9") as d:
        asked = {"Origin": "https://dash.example", "Access-Control-Request-Method": "GET",
                 "Access-Control-Request-Headers": "authorization"}
        reply = d.ask(VIEW, "OPTIONS", headers=asked)
        assert reply.status == 204 and not reply.body, reply.status
        assert reply.headers["Access-Control-Allow-Origin"] == "https://dash.example"
        assert "Authorization" in reply.headers["Access-Control-Allow-Headers"]
        assert "GET" in reply.headers["Access-Control-Allow-Methods"] and reply.headers["Vary"] == "Origin"
        for path, headers in ((SMALL, bearer(VIEWER)), (SMALL, {}), ("/nowhere", {})):
            reply = d.ask(path, headers={**headers, "Origin": "http://127.0.0.1:9"})
            assert reply.headers["Access-Control-Allow-Origin"] == "http://127.0.0.1:9", reply.status
            assert reply.headers["Access-Control-Expose-Headers"] == "*"
        for origin in ("https://dash.example.evil", "http://dash.example", "null", ""):
            reply = d.ask(SMALL, headers=bearer(VIEWER, Origin=origin))
            assert reply.status == 200 and reply.headers["Access-Control-Allow-Origin"] is None
            assert d.ask(VIEW, "OPTIONS", headers={**asked, "Origin": origin}).status == 405
        assert d.ask(VIEW, "OPTIONS", headers={"Origin": "https://dash.example"}).status == 405
    with Daemon(FAKE, "--cors", "*") as d:
        assert d.ask(SMALL, headers={"Origin": "https://any.example"}).headers["Access-Control-Allow-Origin"]
    with Daemon(FAKE) as d:
        assert d.ask(SMALL, headers={"Origin": "https://any.example"}).headers["Access-Control-Allow-Origin"] is None


def test_who_asks_too_often_waits():
    for flag, said in (("--rate-limit", "this address"), ("--rate-limit-total", "all clients")):
        with Daemon(FAKE, flag, "5", FAKE_FRAME_MS=0) as d:
            connection, replies = d.connect(), []
            while len(replies) < 60 or {reply.status for reply in replies} == {200} and len(replies) < 2000:
                replies.append(d.ask(SMALL, connection=connection))
            statuses = [reply.status for reply in replies]
            assert set(statuses) == {200, 429} and statuses[:10] == [200] * 10, statuses
            refused = [reply for reply in replies if reply.status == 429]
            assert all(reply.headers["Retry-After"] == "1" for reply in refused)
            assert said in refused[0].json()["detail"] and refused[0].json()["type"] == "urn:splatd:error:rate"
            while (status := d.ask("/v1/status")).status == 429:
                refused.append(status)
                time.sleep(0.3)
            assert status.status == 200 and status.json()["counters"]["refused_rate"] == len(refused)


def test_each_view_of_a_batch_counts():
    with Daemon(FAKE, "--rate-limit", "1", FAKE_FRAME_MS=0) as d:
        batch = {"width": 16, "height": 16, "container": "zip", "views": [{"lod": 1 + i / 100} for i in range(200)]}
        assert d.post({**batch, "views": [5]}, VIEW + "s").status == 400  # which costs one
        assert d.post(batch, VIEW + "s").status == 200
        refused = d.ask(SMALL)
        assert refused.status == 429 and int(refused.headers["Retry-After"]) > 50, refused.headers


def test_a_batch_has_no_more_of_what_all_may_ask_than_others():
    """Its views wait until there is one for each, and whoever asks meanwhile waits no longer for that."""
    with Daemon(FAKE, "--rate-limit-total", "20", FAKE_FRAME_MS=0) as d:
        batch = {"width": 16, "height": 16, "container": "zip", "views": [{"lod": 1 + i / 100} for i in range(100)]}
        began, replies = time.monotonic(), []
        maker = threading.Thread(target=lambda: replies.append(d.post(batch, VIEW + "s")))
        maker.start()
        others = []
        while maker.is_alive():
            others.append(d.ask(SMALL))
            time.sleep(0.02)
        assert replies[0].status == 200 and time.monotonic() - began > (100 - 2 * 20) / 20
        assert {reply.headers["Retry-After"] for reply in others} <= {None, "1"} and 200 in {reply.status for reply in others}


def test_connections_are_capped():
    import socket
    with Daemon(FAKE, "--connections", "40", "--connections-per-address", "20") as d:
        all_know = threading.Barrier(30)

        def outcome(i):
            with socket.create_connection(("127.0.0.1", d.port), 150) as s:
                try:
                    s.sendall(b"GET /v1/openapi.yaml HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    answer = s.recv(12)
                except OSError:
                    answer = b""
                all_know.wait(150)
                return answer
        served = [bool(result) for result in together(30, outcome)]
        assert 1 <= served.count(False) <= 29, served
        eventually(lambda: b"\nsplatd_connections 0\n" in d.ops("/metrics").body)  # whose listener has no such cap
        assert d.status()["connections"] == 1


def test_what_is_cached_is_still_guarded():
    with guarded() as d:
        version = d.ask("/v1/datasets/wall", headers=bearer(VIEWER)).json()["version"]
        first = d.ask(f"{SMALL}&v={version}", headers=bearer(VIEWER))
        assert first.headers["Cache-Control"] == "private, max-age=31536000, immutable"
        assert d.ask(SMALL, headers=bearer(VIEWER)).headers["Splatd-Cache"] == "hit"
        tag = {"If-None-Match": first.headers["ETag"]}
        assert d.ask(SMALL, headers=bearer(VIEWER, **tag)).status == 304
        assert d.ask(SMALL, headers=tag).status == 401 and d.ask(SMALL, "HEAD").status == 401


run(globals())
