"""The interface's document is sound, served as it stands, and complete: what it names has been used by the tests beside this
one. That sum is made of what the others have left when they passed, so run the whole suite: meson test --suite http.

usage: test_openapi.py NAME…   the other tests"""
import http.client
import os
import pathlib
import subprocess
import sys
import tempfile

import jsonschema

import harness
import openapi


def refs(node):
    if isinstance(node, dict):
        if isinstance(node.get("$ref"), str):
            yield node["$ref"]
        for inner in node.values():
            yield from refs(inner)
    elif isinstance(node, list):
        for inner in node:
            yield from refs(inner)


def test_the_document_is_sound():
    document = openapi.DOCUMENT
    assert document["openapi"].startswith("3.1.")
    for name, schema in document["components"]["schemas"].items():
        jsonschema.Draft202012Validator.check_schema(schema)
    targets = set(refs(document))
    for ref in targets:
        openapi.resolve({"$ref": ref})
    for kind in ("schemas", "responses", "parameters", "headers"):
        for name in document["components"].get(kind, {}):
            everywhere = document["components"][kind][name].get("x-everywhere")
            assert everywhere or f"#/components/{kind}/{name}" in targets, f"components/{kind}/{name} is used nowhere"
    ids = [operation["operationId"] for _, _, operation, _ in openapi.operations()]
    assert len(ids) == len(set(ids)), ids
    for template, method, operation, parameters in openapi.operations():
        holes = set(openapi.re.findall(r"\{(\w+)\}", template))
        assert holes == {p["name"] for p in parameters if p["in"] == "path"}, (template, method)
        assert all(p.get("required") for p in parameters if p["in"] == "path"), (template, method)


def test_what_is_not_documented_is_found():
    def fault_of(method, target, status=200, headers={}, body=b"", sent=None):
        message = http.client.HTTPMessage()  # names without regard to case
        for name, text in {"Content-Type": "application/json", "X-Request-Id": "1", "X-Content-Type-Options": "nosniff",
                           **headers}.items():
            message[name] = text
        reply = harness.Reply(status, message, body)
        try:
            openapi.check(method, target, {"Content-Type": "application/json"}, sent, reply)
        except AssertionError as fault:
            return str(fault)
        return ""
    image, camera, used = {"Content-Type": "image/png"}, '{"eye": [0, 0]}', set(openapi.used)
    index = b'{"name": "splatd", "version": "1", "openapi": "", "clients": "", "datasets": "", "methods": "", "status": "", "views": []}'
    for request, said in [
        (("GET", "/", 200, {}, index), ""), (("HEAD", "/", 200), ""), (("GET", "/", 200, {}, b"{}"), "name"),
        (("GET", "/", 200, {}, index.replace(b"[]", b"5")), "views: 5 is not of type 'array'"),
        (("GET", "/", 204), "204"), (("POST", "/"), "POST /"), (("GET", "/nowhere"), "/nowhere"),
        (("GET", "/", 404), "application/problem+json"), (("GET", "/", 200, {"X-New": "1"}, index), "X-New"),
        (("GET", "/", 200, image, index), "image/png"),
        (("GET", "/", 200, {"X-Request-Id": "a b"}, index), "X-Request-Id"), (("GET", harness.VIEW + "?width=64", 200, image), ""),
        (("GET", harness.VIEW + "?poi=1,2,3", 200, image), ""), (("GET", harness.VIEW + "?poi=1,2", 200, image), "poi"),
        (("GET", harness.VIEW + "?width=0", 200, image), "width"),
        (("GET", harness.VIEW + "?tint=1", 200, image), "'?tint'"),
        (("GET", harness.VIEW, 200, {**image, "Splatd-Camera": camera}), "Splatd-Camera"),
        (("POST", harness.VIEW, 200, image, b"", b'{"lod": 1}'), ""),
        (("POST", harness.VIEW, 200, image, b"", b'{"lod": "much"}'), "lod"),
        (("POST", harness.VIEW, 200, image, b"", b'{"tint": 1}'), "tint"),
    ]:
        fault = fault_of(*request)
        assert said in fault and bool(said) == bool(fault), (request, fault)
    openapi.used.clear()
    openapi.used.update(used)


def test_signed_urls_are_documented_where_they_work():
    """Of every GET, what `splatd sign` takes is what the document says."""
    holes = {"id": "wall", "name": "a", "z": "1", "x": "0", "y": "0.png", "n": "0"}
    with tempfile.TemporaryDirectory() as home:
        key = pathlib.Path(home, "key")
        key.write_text("0123456789abcdef0123456789abcdef0123456789abcdef")
        key.chmod(0o600)
        for template, method, operation, _ in openapi.operations():
            documented = {"signedUrl": []} in operation.get("security", [])
            assert method == "get" or not documented, (method, template)
            if method == "get":
                url = "http://127.0.0.1" + openapi.re.sub(r"\{(\w+)\}", lambda hole: holes[hole[1]], template)
                signed = subprocess.run([harness.REAL, "sign", url, "--key", str(key)], capture_output=True)
                assert (signed.returncode == 0) == documented, (template, documented, signed.stderr)


def test_what_a_reference_leaves_out_is_not_asked_for():
    rays = set(openapi.all_properties({"$ref": "#/components/schemas/RaysRequest"}))
    assert {"camera.eye", "camera.gltf.matrix"} <= rays and not {"camera.fov", "camera.ros", "camera.gltf.perspective"} & rays
    assert openapi.faults({"$ref": "#/components/schemas/RaysRequest"}, {"directions": [[0, 0, 1]], "camera": {"fov": 50}})
    assert "camera.fov" in set(openapi.all_properties({"$ref": "#/components/schemas/ViewRequest"}))


def test_it_is_served():
    with harness.Daemon(harness.FAKE) as d:
        reply = d.ask("/v1/openapi.yaml")
        assert reply.status == 200 and reply.body == openapi.PATH.read_bytes()
        assert d.ask("/v1/openapi.json").json() == openapi.DOCUMENT
        assert d.ask("/").json()["openapi"] == "/v1/openapi.json"
        assert d.ask("/v1/openapi.json?x=1").status == 400 and d.ask("/v1/openapi.yaml?x=1").status == 400


def test_everything_documented_is_used():
    folder = pathlib.Path(os.environ["SPLATD_EXERCISED"])
    used, here, missing = set(openapi.used), pathlib.Path(__file__).parent, []
    for name in OTHERS:
        log = folder / f"test_{name}.py.json"
        newest = max(openapi.PATH.stat().st_mtime, (here / f"test_{name}.py").stat().st_mtime)
        if not log.exists() or log.stat().st_mtime < newest:
            missing.append(f"http-{name}")
        else:
            used |= set(openapi.json.loads(log.read_text()))
    unused = [what for what in openapi.documented() if what not in used]
    if unused and missing:
        raise harness.Skipped(f"{len(unused)} things documented may be used by {', '.join(missing)}, not passed since it or "
                              "the document was changed: mend that first, or run --suite http")
    assert not unused, "documented in api/openapi.yaml, but used by no HTTP test with success:\n  " + "\n  ".join(unused)


OTHERS, sys.argv[1:] = sys.argv[1:], []
harness.run(globals())
