"""The page and the clients as files: who gets HTML and who gets JSON, types, ETags, policies, and that no other name
reaches anything. What they do in a browser is tested in tests/e2e/."""
import os
import pathlib
import re

from harness import FAKE, Daemon, lines, run

ROOT = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"])
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".js": "text/javascript; charset=utf-8",
    ".py": "text/x-python; charset=utf-8",
    ".sh": "text/x-shellscript; charset=utf-8",
}
BROWSER = {"Accept": "text/html,application/xhtml+xml,application/xml;q=0.9,image/avif,*/*;q=0.8"}


def files():
    for folder in ("viewer", "clients"):
        for file in sorted((ROOT / "api" / folder).iterdir()):
            if file.suffix in TYPES:
                yield f"/{folder}/{file.name}", file


def test_html_is_for_those_who_ask_for_it():
    with Daemon(FAKE) as d:
        for accept, kind in [
            (BROWSER["Accept"], "text/html"),
            ("text/html", "text/html"),
            ("TEXT/HTML;level=1", "text/html"),
            ("application/json, text/html", "text/html"),
            ("application/json;q=0.5,text/html ; q=0.6", "text/html"),
            (None, "application/json"),
            ("*/*", "application/json"),
            ("application/json", "application/json"),
            ("", "application/json"),
            ("text/html;q=0.1, application/json", "application/json"),
            ("text/html;q=0", "application/json"),
            ("text/html;seq=0, application/json;q=0.5", "text/html"),
            ("text/htmlish, text/*", "application/json"),
            (";;,,q=1", "application/json"),
        ]:
            reply = d.ask("/", headers={} if accept is None else {"Accept": accept})
            assert reply.status == 200 and reply.headers["Content-Type"].split(";")[0] == kind, (accept, reply.headers)
            assert reply.headers["Vary"] == "Accept"
        for first, second, kind in [  # several lines are one list
            ("application/xml", "text/html", "text/html"),
            ("text/html;q=0.1", "application/json", "application/json"),
            ("application/json;q=0.5", "*/*, text/html", "text/html"),
            ("text/html;q=0", "text/html", "application/json"),
        ]:
            reply = d.ask("/", headers=lines(("Accept", first), ("accept", second)))
            assert reply.headers["Content-Type"].split(";")[0] == kind, (first, second, reply.headers)
        assert d.ask("/", headers=BROWSER).body == (ROOT / "api/viewer/index.html").read_bytes()


def test_every_file_is_served_as_it_lies_there():
    with Daemon(FAKE) as d:
        names = [name for name, _ in files()]
        assert len(names) > 12 and "/clients/splatd.py" in names and "/viewer/main.js" in names
        tags = set()
        for name, file in files():
            reply = d.ask(name)
            assert reply.status == 200 and reply.body == file.read_bytes(), name
            assert reply.headers["Content-Type"] == TYPES[file.suffix]
            assert reply.headers["X-Content-Type-Options"] == "nosniff" and reply.headers["Cache-Control"] == "no-cache"
            shared = name.startswith("/clients/")
            assert reply.headers["Access-Control-Allow-Origin"] == ("*" if shared else None)
            tags.add(reply.headers["ETag"])
        assert len(tags) == len(names)


def test_a_file_that_is_held_is_not_sent_again():
    with Daemon(FAKE) as d:
        for name, headers in [("/", BROWSER), ("/clients/", BROWSER), ("/clients/", {}), ("/viewer/main.js", {}), ("/clients/splatd.py", {}), ("/embed/wall", {})]:
            tag = d.ask(name, headers=headers).headers["ETag"]
            for held in (tag, "*", f'"0", W/{tag}'):
                reply = d.ask(name, headers={**headers, "If-None-Match": held})
                assert (reply.status, reply.body, reply.headers["ETag"]) == (304, b"", tag), (name, held)
            several = lines(*headers.items(), ("If-None-Match", '"0"'), ("If-None-Match", tag))
            assert d.ask(name, headers=several).status == 304, name
            for wanted in (tag, "*", f'"0", {tag}'):
                assert d.ask(name, headers={**headers, "If-Match": wanted}).status == 200, (name, wanted)
                assert d.ask(name, headers={**headers, "If-Match": wanted, "If-None-Match": tag}).status == 304, (name, wanted)
            for other in () if headers else ('"0"', "W/" + tag, ""):  # a browser would be told on a page
                reply = d.ask(name, headers={"If-Match": other, "If-None-Match": tag})
                assert reply.status == 412 and reply.json()["field"] == "If-Match", (name, other)
            for other in ('"0123456789abcdef"', tag[:-2], ""):
                assert d.ask(name, headers={**headers, "If-None-Match": other}).status == 200, other
            head = d.ask(name, "HEAD", headers=headers)
            assert head.status == 200 and int(head.headers["Content-Length"]) > 100 and not head.body
        assert d.ask("/", headers={"If-None-Match": "*"}).status == 200  # JSON has no tag


def test_no_other_name_reaches_anything():
    with Daemon(FAKE) as d:
        for name in [
            "/viewer/",
            "/viewer/none.js",
            "/viewer/main.js/",
            "/viewer/..%2fclients%2fsplatd.py",
            "/clients/main.js",
            "/viewer/%2e%2e%2f%2e%2e%2fREADME.md",
            "/viewer/main.js%00",
            "/clients/../viewer/main.js",
            "/embed/",
            "/embed/a/b",
            "/viewer/viewer/main.js",
        ]:
            assert 400 <= d.ask(name).status < 500, name
        for name in ("/", "/viewer/main.js", "/embed/wall", "/clients/splatd.py"):
            assert d.ask(name + "?x=1").status == 400 and d.ask(name, "POST", b"").status == 405


def test_what_the_page_may_do():
    with Daemon(FAKE) as d:
        for name, frames in [
            ("/", "'none'"),
            ("/embed/wall", "*"),
            ("/embed/none", "*"),
            ("/viewer/embed.html", "'none'"),
        ]:
            reply = d.ask(name, headers=BROWSER)
            policy = dict(part.strip().split(" ", 1) for part in reply.headers["Content-Security-Policy"].split(";"))
            assert policy["default-src"] == "'none'" and policy["script-src"] == "'self'", policy
            assert policy["frame-ancestors"] == frames and "unsafe" not in str(policy), policy


def test_files_name_only_files_that_are_there():
    """A page, a module or a style that names another one by its path."""
    with Daemon(FAKE) as d:
        for name, file in files():
            if file.suffix not in (".html", ".js", ".css"):
                continue
            text = file.read_text(encoding="utf-8")
            named = re.findall(r'(?:src|href)="(/[^"]*)"', text) + [
                f"/viewer/{n}" for n in re.findall(r'from "\./([^"]*)"', text)
            ]
            for other in named:
                assert d.ask(other).status == 200, f"{name} names {other}"
            assert file.suffix == ".js" or "http://" not in text.replace("http://www.w3.org", ""), name


run(globals())
