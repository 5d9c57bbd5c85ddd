"""Bad input over HTTP: each is refused with 4xx, a problem document, and the parameter's name; the daemon goes on as if
nothing had happened."""
import json
import os
import re
import socket
import subprocess
import tempfile

from harness import FAKE, REAL, VIEW, WALL, Daemon, break_page, run

# query, field; the parser's unit test has many more
QUERIES = [
    ("eye=1,2", "eye"), ("eye=a,b,c", "eye"), ("eye=nan,0,0", "eye"), ("eye=inf,0,0", "eye"), ("eye=1e999,0,0", "eye"),
    ("eye=1,2,3&target=1,2,3", "target"), ("eye=0,0,9&target=0,0,0&up=0,0,1", "up"), ("up=0,0,0", "up"),
    ("target=nan,0,0", "target"), ("fov=0", "fov"), ("fov=180", "fov"), ("fov=60&fx=100", "fov"), ("fx=-1", "fx"),
    ("fy=100", "fx"), ("fx=100&fy=nan", "fy"), ("cx=left", "cx"), ("cy=1,2", "cy"), ("width=0&height=0", "width"),
    ("width=1000000&height=1000000", "width"), ("width=-4", "width"), ("width=4.5", "width"), ("height=0", "height"),
    ("height=9e99", "height"), ("near=0", "near"), ("near=-1", "near"), ("near=2&far=1", "far"), ("far=nan", "far"),
    ("method=raytrace", "method"), ("lod=-1", "lod"), ("lod=much", "lod"), ("layer=smell", "layer"),
    ("supersample=3", "supersample"), ("format=gif", "format"), ("quality=0", "quality"), ("quality=101", "quality"),
    ("background=rad", "background"), ("transparent=2", "transparent"), ("margin=-1", "margin"),
    ("margin=1e9", "margin"), ("atoms=9", "atoms"), ("atoms=1.5", "atoms"), ("atoms=-1", "atoms"), ("maps=no", "maps"),
    ("primitives=some", "primitives"), ("primitives=on", "primitives"),
    ("soft=", "soft"), ("soft=uncertainty", "soft"), ("soft=uncertainty>", "soft"), ("soft=uncertainty>q2", "soft"),
    ("soft=nothing>1", "soft"), ("soft=nothing>1&budget=500ms", "soft"), ("soft=class:5-3", "soft"), ("soft=class:1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17", "soft"),
    ("soft=axis:1,2,3,0,0,0<4", "soft"), ("soft=axis:1,2,3<4", "soft"), ("soft=box:1,1,1,0,0,0", "soft"),
    ("soft=plane:0,0,0,0,0,1", "soft"), ("soft=uncertainty>1%20and%20class:3", "soft"), ("soft=%3e", "soft"), ("soft=%zz", "soft"),
    ("soft=uncertainty>" + "1" * 5000, "soft"), ("soft=uncertainty>1&soft=x", "soft"), ("soft", "soft"),
    ("soft_model=exact", "soft_model"), ("soft_model=", "soft_model"), ("soft_opacity=2", "soft_opacity"), ("soft_opacity=-0.1", "soft_opacity"),
    ("soft_opacity=nan", "soft_opacity"), ("soft_cover=1.5", "soft_cover"), ("soft_cover=-0.1", "soft_cover"),
    ("soft_cover=nan", "soft_cover"), ("soft_cover=", "soft_cover"), ("soft_blend=-1", "soft_blend"), ("soft_blend=2e9", "soft_blend"), ("soft_of=first", "soft_of"),
    ("of=second", "of"), ("of=", "of"), ("of=FIRST", "of"), ("of=1", "of"), ("of=first&of=median", "of"), ("of", "of"), ("soft=class:3&of=both", "of"),
    ("budget=0", "budget"), ("budget=-5", "budget"), ("budget=fast", "budget"), ("budget=5m", "budget"),
    ("budget=", "budget"), ("budget=1e3", "budget"), ("budget=nan", "budget"), ("budget=601s", "budget"),
    ("budget=.", "budget"), ("budget=5%20ms", "budget"), ("budget=5&budget=6", "budget"), ("psnr=101", "psnr"),
    ("psnr=-1", "psnr"), ("psnr=nan", "psnr"), ("psnr=high", "psnr"), ("psnr=30&layer=depth", "psnr"),
    ("depth_scale=0", "depth_scale"), ("colour=red", "colour"), ("eye=1,2,3&eye=1,2,3", "eye"),
    ("POC=1,2,3&eye=1,2,3", "eye"),
    ("width", "width"), ("width=", "width"), ("width=%zz", "width"), ("width=%4", "width"), ("width=%00", "width"),
    ("width=1%0d%0aX:1", "width"), ("%ff%fe=1", None), ("matrix=1", "matrix"),
]
BODIES = [
    ('{"camera":', "body"), ("[1,2]", "body"), ("no", "body"), ("\xff\xfe", "body"), ('{"lod": NaN}', "body"),
    ('{"lod":1,"lod":2}', "body"), ('{"colour":1}', "colour"), ('{"camera":5}', "camera"), ('{"width":"640"}', "width"),
    ('{"width":0}', "width"), ('{"eye":[1,2,3]}', "eye"), ('{"camera":{"eye":[1,2]}}', "eye"),
    ('{"camera":{"eye":[0,0,0],"target":[0,0,0]}}', "target"),
    ('{"camera":{"matrix":[1],"convention":"opengl"}}', "matrix"),
    ('{"camera":{"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}}', "convention"),
    ('{"camera":{"q":[0,0,0,0],"t":[0,0,0]}}', "q"), ('{"camera":{"q":[1,0,0,0]}}', "t"),
    ('{"camera":{"model":"OPENCV","params":[1,1,1,1,0.1,0,0]}}', "params"),
    ('{"camera":{"gltf":{"perspective":{"yfov":60,"znear":1}}}}', "gltf.perspective.yfov"),
    ('{"camera":{"gltf":{"orthographic":{}}}}', "gltf.orthographic.xmag"), ('{"camera":{"projection":"panini"}}', "projection"), ('{"camera":{"view_height":"4"}}', "view_height"),
    ('{"camera":{"view_height":4,"fov":50}}', "fov"), ('{"camera":{"projection":"perspective","units_per_pixel":4}}', "units_per_pixel"), ('{"projection":"orthographic"}', "projection"),
    ('{"camera":{"gltf":{"matrix":[0]}}}', "gltf.matrix"),
    ('{"camera":{"gltf":{"perspective":{"yfov":1,"znear":1,"aspectRatio":2}}},"width":8,"height":8}',
     "gltf.perspective.aspectRatio"), ('{"camera":{"open3d":{}}}', "open3d.intrinsic"),
    ('{"camera":{"ros":{"k":[5,0,2,0,5,2,0,0,1],"d":[0.1],"distortion_model":"plumb_bob","width":4,"height":4}}}', "ros.d"),
    ('{"camera":{"nerfstudio":{"transform_matrix":[[1,0,0,0]],"fl_x":5,"w":4,"h":4}}}', "nerfstudio.transform_matrix"), ('{"gltf":{}}', "gltf"),
    ('{"soft":5}', "soft"), ('{"soft":""}', "soft"), ('{"soft":["uncertainty>1",2]}', "soft"), ('{"soft":[""]}', "soft"),
    ('{"soft":[["uncertainty>1"]]}', "soft"), ('{"soft":["nothing>1"]}', "soft"), ('{"camera":{"soft":"uncertainty>1"}}', "soft"),
    ('{"soft":{"uncertainty":1}}', "soft"), ('{"soft_opacity":"0.5"}', "soft_opacity"), ('{"soft_model":0}', "soft_model"),
    ('{"soft_cover":"1"}', "soft_cover"), ('{"soft_cover":2}', "soft_cover"), ('{"soft_blend":[1]}', "soft_blend"), ('{"of":1}', "of"), ('{"of":"none"}', "of"), ('{"of":["first"]}', "of"), ('{"camera":{"of":"first"}}', "of"), ('{"soft":"uncertainty>\\u00fc"}', "soft"),
    ('{"budget":0}', "budget"), ('{"budget":"0ms"}', "budget"), ('{"budget":[5]}', "budget"),
    ('{"budget":true}', "budget"), ('{"psnr":"38"}', "psnr"), ('{"camera":{"psnr":38}}', "psnr"), ("[" * 100000, "body"),
]


def test_every_bad_query_is_refused_by_name():
    with Daemon(FAKE) as d:
        for query, field in QUERIES:
            reply = d.ask(f"{VIEW}?{query}")
            assert reply.status == 400, (query, reply.status)
            assert field is None or reply.json()["field"] == field, (query, reply.body)
        status = d.status()
        assert status["counters"]["frames"] == 0 and status["counters"]["replies_4xx"] == len(QUERIES)
        assert d.view(width=8, height=8).status == 200


def test_every_bad_body_is_refused_by_name():
    with Daemon(FAKE) as d:
        for body, field in BODIES:
            reply = d.post(body.encode("latin-1"))
            assert reply.status == 400 and reply.json()["field"] == field, (body[:80], reply.body)
        reply = d.post('{\n "width": 64,\n "height" 48\n}')
        assert re.search(r"line 3, column \d+", reply.json()["detail"]), reply.body
        assert d.ask(VIEW + "?width=8", "POST", "{}").json()["field"] == "width"


def test_unknown_things_are_not_found():
    with Daemon(FAKE) as d:
        for path in ["/v1/datasets/none", "/v1/datasets/none/view", "/v1/datasets/wall.spld", "/v1/datasets/..%2fwall",
                     "/v1/datasets/%2e%2e/view", "/v1/datasets/Wall"]:
            reply = d.ask(path)
            assert reply.status == 404 and reply.json()["field"] == "id", (path, reply.body)
        for path in ["/v1", "/v2/datasets", "/v1/datasets/", "/v1/datasets/wall/", "/v1/datasets/wall/view/",
                     "/v1/datasets//view",
                     "/v1/datasets/wall/../wall", "/etc/passwd", "//"]:
            assert d.ask(path).status == 404, path
        for path in ["/v1/datasets/%zz", "/v1/datasets/a%00b/view", "/v1/datasets/" + "a" * 300]:
            reply = d.ask(path)
            assert reply.status == 400 and reply.json()["field"] == "id", (path, reply.body)
        for path in ["/v1/status?x=1", "/v1/datasets?limit=3", "/?x", "/v1/datasets/wall?x=1"]:
            reply = d.ask(path)
            assert reply.status == 400 and reply.json()["field"] in ("x", "limit"), (path, reply.body)


def test_wrong_methods_say_what_is_allowed():
    with Daemon(FAKE) as d:
        for path, methods, allow in [("/", ["POST", "DELETE", "OPTIONS"], "GET, HEAD"),
                                     ("/v1/status", ["POST", "PUT"], "GET, HEAD"),
                                     ("/v1/datasets/wall", ["PATCH", "POST"], "GET, HEAD, PUT, DELETE"),
                                     (VIEW, ["PUT", "DELETE", "OPTIONS", "BREW"], "GET, HEAD, POST")]:
            for method in methods:
                reply = d.ask(path, method)
                assert reply.status == 405 and reply.headers["Allow"] == allow, (path, method, reply.status)


def test_sizes_are_capped():
    with Daemon(FAKE, "--max-pixels", "10000") as d:
        assert d.view(width=100, height=100).status == 200
        assert d.view(width=101, height=100).json()["field"] == "width"
        assert d.view(height=8192).json()["field"] == "height"
        for length in (9000, 12000):
            reply = d.ask(VIEW + "?" + "a" * length)
            assert reply.status == 414 and reply.json()["field"] == "url", length
        for length in (20000, 60000):  # libmicrohttpd's own
            assert raw(d, f"GET {VIEW}?{'a' * length} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())[:12] == b"HTTP/1.1 414"
        for pairs in (100, 300, 4000):
            reply = d.ask(VIEW + "?" + "a&" * pairs)
            assert reply.status == 414 and reply.json()["field"] == "url", pairs
        reply = d.ask(VIEW + "?background=" + "a" * 4000)
        assert reply.status == 400 and reply.json()["field"] == "background"


def raw(d, data, timeout=150):
    with socket.create_connection(("127.0.0.1", d.port), timeout) as s:
        s.sendall(data)
        answer = b""
        try:
            while chunk := s.recv(65536):
                answer += chunk
        except ConnectionResetError:
            pass
        return answer


def test_headers_of_every_size_are_answered():
    with Daemon(FAKE) as d:
        for count in (1, 40):
            said = []
            for length in range(0, 19000, 400):
                headers = "".join(f"X-{i}: {'y' * (length // count)}\r\n" for i in range(count))
                answer = raw(d, f"GET {VIEW}?width=8&height=8&layer=depth HTTP/1.1\r\nHost: localhost\r\n"
                             f"Connection: close\r\n{headers}\r\n".encode())
                kind = "problem" if b"problem+json" in answer else "plain" if b"<html>" in answer else "view"
                said += [(answer[:12], kind)]
            assert said == sorted(said, key=lambda s: (s[0], s[1] != "problem")), said  # in this order, and never silence
            assert set(said) == {(b"HTTP/1.1 200", "view"), (b"HTTP/1.1 431", "problem")}, said
            assert said.count((b"HTTP/1.1 200", "view")) > 20, said


def test_large_bodies_are_refused():
    with Daemon(FAKE) as d:
        assert d.post(b'{"lod":1' + b" " * (1024 * 1024 - 9) + b"}").status == 200
        assert d.post(b'\xef\xbb\xbf{"lod":1}').status == 200  # as editors on Windows write it
        reply = d.post(b'{"lod":1' + b" " * (1024 * 1024 - 8) + b"}")
        assert reply.status == 413 and reply.json()["field"] == "body"
        head = f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n".encode()
        assert b" 413 " in raw(d, head + b"Content-Length: 2000000\r\nExpect: 100-continue\r\n\r\n")
        assert b" 413 " in raw(d, head + b"Content-Length: 99999999999\r\n\r\n")
        chunk = b"10000\r\n" + b"x" * 65536 + b"\r\n"
        chunked = head + b"Transfer-Encoding: chunked\r\n\r\n" + chunk * 20 + b"0\r\n\r\n"
        assert b" 413 " in raw(d, chunked)
        assert d.status()["counters"]["frames"] == 1


def test_broken_http_is_survived():
    with Daemon(FAKE) as d:
        for data in [b"\r\n\r\n", b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n",
                     b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\n\n",
                     b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n", b"G" * 300000,
                     b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 50000 + b"\r\n",
                     b"GET " + b"a" * 300000 + b" HTTP/1.1\r\n\r\n",
                     b"GET /v1/status?" + b"a&" * 4000 + b" HTTP/1.1\r\n\r\n",
                     b"GET /\x01 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"]:
            try:
                with socket.create_connection(("127.0.0.1", d.port), 150) as s:  # half a request is cut after 10 s
                    s.sendall(data)
                    s.shutdown(socket.SHUT_WR)
                    answer = s.recv(65536)  # a reply or a close, never silence
                    assert not answer or answer[:10] in (b"HTTP/1.1 4", b"HTTP/1.1 5"), (data[:40], answer[:100])
            except OSError as error:
                assert not isinstance(error, TimeoutError), data[:40]
        assert d.view(width=8, height=8).status == 200


def refused(*arguments, binary=(FAKE,)):
    done = subprocess.run([*binary, *arguments], capture_output=True, text=True, timeout=150,
                          env={**os.environ, "RES_OPTIONS": "timeout:1 attempts:1"})  # a name that is looked up in vain
    assert done.stdout == "", done.stdout
    return done.returncode, done.stderr


def test_the_command_line_is_checked():
    with tempfile.TemporaryDirectory() as folder:
        second = os.path.join(folder, "wall.spld")
        broken = os.path.join(folder, "broken.spld")
        flipped = bytearray(open(WALL, "rb").read())
        break_page(flipped)
        open(broken, "wb").write(flipped)
        os.symlink(WALL, second)
        for arguments, said in [
            ([], "at least one"), (["/nowhere/x.spld"], "/nowhere/x.spld"),
            ([WALL, second], "two datasets are called 'wall'"), ([broken], "broken.spld"),
            (["--listen", "nonsense", WALL], "--listen"), (["--listen", "127.0.0.1:99999", WALL], "--listen"),
            (["--listen", "::1:8080", WALL], "--listen"), (["--queue", "0", WALL], "--queue"),
            (["--deadline", "soon", WALL], "--deadline"), (["--encoders", "99", WALL], "--encoders"),
            (["--max-pixels", "-1", WALL], "--max-pixels"), (["--frobnicate", WALL], "--help"),
        ]:
            code, text = refused(*arguments)
            assert code == 2 and said in text, (arguments, code, text)
        code, text = refused("--require-gpu", "--listen", "127.0.0.1:0", WALL)
        assert code == 1 and "no usable device" in text, (code, text)
        with Daemon(FAKE) as d:
            code, text = refused("--listen", f"127.0.0.1:{d.port}", WALL)
            assert code == 1 and str(d.port) in text, (code, text)
        with Daemon(FAKE, "--no-verify", datasets=[broken]) as d:
            assert d.ask("/v1/datasets/broken").status == 200


def lines_of_json(text):
    return [json.loads(line) for line in text.splitlines()]


def test_a_mistake_in_the_file_is_said_with_file_and_line_before_anything_is_opened():
    with tempfile.TemporaryDirectory() as folder:
        conf, tokens, key = (os.path.join(folder, name) for name in ("s.conf", "tokens", "key"))
        with open(tokens, "w") as f:
            f.write("# mine\nshort view\n")
        with open(key, "w") as f:
            f.write("short")
        os.chmod(tokens, 0o600), os.chmod(key, 0o600)
        for text, said in [
            ("listen = nonsense", ("listen takes ADDR:PORT", "'nonsense'")), ("tokens = /nowhere", ("tokens", "/nowhere")),
            (f"tokens = {tokens}", ("tokens, line 2",)), (f"tokens = {folder}", ("tokens", folder)),
            ("url-key = /nowhere", ("url-key", "tokens")), ("listen = 0.0.0.0:0", ("listen", "--allow-anonymous")),
            ("tours = /nowhere/x", ("tours", "/nowhere/x")), (f"tours = {tokens}", ("tours", tokens, "is no folder")),
            ("listen = no-such-name.invalid:80", ("listen", "no-such-name.invalid")), ("queue = 0", ("queue", "1 to 4096")),
        ]:
            for log_format in ("text", "json"):
                with open(conf, "w") as f:
                    f.write(f"\ufeff# mine\r\nlog-format = {log_format}\r\n{text}\r\n")
                args = [] if "listen =" in text else ["--listen", "127.0.0.1:0"]
                code, got = refused("--config", conf, "--ops-listen", "127.0.0.1:0", *args, WALL)
                assert code == 2 and f"{conf}, line 3: " in got, (text, code, got)
                assert all(word in got for word in said) and "health" not in got and got.count("\n") == 1, (text, got)
                assert log_format == "text" or lines_of_json(got)[0]["level"] == "error", got
        for text, args, said in [
            ("queue = 5\nqueu = 5\nqueue = 6\noops", (), ("line 2: there is no", "line 3: queue is given", "line 4: 'oops'")),
            ("listen = a\nlisten = b:1", (), ("line 1: listen takes", "line 2: listen is given a second time")),
            ("queue = 5", ("--queue", "x"), ("splatd: --queue takes",)),  # not the file's fault
        ]:
            with open(conf, "w") as f:
                f.write(text)
            code, got = refused("--config", conf, *args, WALL)
            lines = got.splitlines()
            assert code == 2 and len(lines) == len(said), got
            assert all(word in line and line.count(conf) <= 1 for word, line in zip(said, lines)), got
            assert args == () or conf not in got, got
        with open(conf, "w") as f:
            f.write("# mine\ndataset = /nowhere/d\n")
        code, got = refused("--config", conf, "--listen", "127.0.0.1:0", "--ops-listen", "127.0.0.1:0")  # opening tells
        assert code == 2 and f"{conf}, line 2: /nowhere/d: there is no such file or directory" in got, got
        big, fifo = os.path.join(folder, "big"), os.path.join(folder, "fifo")
        with open(big, "wb") as f:
            f.truncate(1 << 30)
        os.mkfifo(fifo)
        for path in (folder, fifo, big, "/dev/zero", os.path.join(folder, "none")):
            for flag in ("--config", "--tokens"):
                code, got = refused(flag, path, "--listen", "127.0.0.1:0", "--ops-listen", "127.0.0.1:0", WALL)
                assert code == 2 and path in got and "health" not in got, (flag, path, got)


def test_every_line_is_json_where_that_is_asked_for():
    with tempfile.TemporaryDirectory() as folder, Daemon(FAKE, "--log-format", "json") as other:
        usual = ("--listen", "127.0.0.1:0", "--ops-listen", "127.0.0.1:0")
        for arguments, code, said in [
            (("--frobnicate", WALL), 2, "--frobnicate"), (("-x", WALL), 2, "-x"), (("--queue",), 2, "--queue"),
            (("--verify=1", WALL), 2, "--verify"), (("--queue", "0", WALL), 2, "queue"), ((), 2, "at least one"),
            (("/nowhere/x.spld", *usual), 2, "/nowhere/x.spld"), ((os.path.join(folder, "a\n\"b\\.spld"), *usual), 2, "b"),
            (("--require-gpu", *usual, WALL), 1, "no usable device"),
            (("--listen", f"127.0.0.1:{other.port}", "--ops-listen", "127.0.0.1:0", WALL), 1, str(other.port)),
            (("--ops-listen", f"127.0.0.1:{other.port}", "--listen", "127.0.0.1:0", WALL), 1, str(other.port)),
            (("--tokens", "/nowhere", *usual, WALL), 2, "/nowhere"),
        ]:
            got_code, got = refused("--log-format", "json", *arguments)
            lines = lines_of_json(got)
            assert got_code == code and lines[-1]["level"] == "error" and said in lines[-1]["message"], (arguments, got)
        code, got = refused("--log-format", "json", "--device", 'x"y', *usual, WALL, binary=(REAL, "serve"))
        assert code == 1 and "no device matches" in lines_of_json(got)[-1]["message"], got
        assert other.stop() == 0
        lines_of_json("".join(other.lines))


def test_what_the_device_has_no_room_for_is_no_body_too_large():
    with Daemon(FAKE, FAKE_ROOM_PX="0") as d:
        pick = VIEW.replace("view", "pick")
        for reply in (d.view(width=640, height=480), d.post({"width": 64, "height": 48}),
                      d.ask(pick + "?x=3&y=4"), d.post({"x": 3, "y": 4}, pick),
                      d.post({"directions": [[0, 0, 1]]}, VIEW.replace("view", "rays"))):
            assert reply.status == 507 and reply.json()["type"] == "urn:splatd:error:limit", (reply.status, reply.body)
            assert "no room" in reply.json()["detail"] and reply.headers["Retry-After"] is None, reply.body
    with Daemon(FAKE, FAKE_ROOM_PX=str(64 * 48)) as d:
        assert d.view(width=640, height=480).status == 507 and d.view(width=64, height=48).status == 200


def test_the_least_memory_limit_is_said_and_works():
    def start(limit):
        done = subprocess.run([REAL, "serve", "--log-format", "json", "--memory-limit", str(limit), "--listen",
                               "127.0.0.1:0", "--ops-listen", "127.0.0.1:0", WALL], capture_output=True, text=True, timeout=150)
        last = lines_of_json(done.stderr)[-1]["message"]
        assert done.returncode == 2 and "memory-limit" in last and str(limit) in last, done.stderr
        assert "largest that device" not in last, last
        exact, mib = map(int, re.search(r"at least (\d+), say (\d+)M", last).groups())
        assert 0 <= (mib << 20) - exact < 1 << 20, last
        return exact
    least = start("20971520")
    assert start(1) == least > 20 << 20
    with Daemon(REAL, "--memory-limit", str(least - 1)) as d:  # enough to work with: a page without room is its dataset's state
        wall, = d.ask("/v1/datasets").json()["datasets"]
        assert wall["state"] != "ready" and "memory limit" in wall["reason"], wall
    with Daemon(REAL, "--memory-limit", str(least)) as d:
        assert d.view(width=1280, height=720, method="splat").status == 200
        assert d.view(width=1280, height=720, layer="depth", format="png", method="points").status == 200
        for query in (dict(method="fill"), dict(lod=0, supersample=4), dict(eye="0.02,0,1", target="0,0.1,1", fov=150, lod=0)):
            assert d.view(width=1280, height=720, **query).status == 200, query


run(globals())
