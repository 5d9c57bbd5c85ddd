"""Chromium, driven over its DevTools protocol through a pipe: JSON messages that end in NUL, on the file descriptors 3
and 4 of the browser. Standard library only: no driver, no web socket, no port."""
import base64
import itertools
import json
import os
import queue
import shutil
import signal
import subprocess
import tempfile
import threading
import time

BINARY = os.environ.get("CHROMIUM") or shutil.which("chromium")
PATIENCE = 120  # seconds; a busy machine may be slow, a broken page never gets there
APART = 0.5  # seconds between clicks that are no double click, for the page
# What the page asks for, as it asks. (The browser's own list of resources has a request some time after its reply.)
FETCHED = """(usual => { window.fetched = []; window.fetch = (path, how) => {
    fetched.push(new URL(path, location.href).href);
    return usual(path, how); }; })(fetch);"""
# Pointers that have come up again, as the page hears of it.
LIFTED = """window.lifted = 0;
    for (const name of ['pointerup', 'pointercancel']) addEventListener(name, () => lifted++, true);"""
KEYS = {
    "ArrowLeft": 37,
    "ArrowUp": 38,
    "ArrowRight": 39,
    "ArrowDown": 40,
    "Enter": 13,
    "Escape": 27,
    "Home": 36,
    "Tab": 9,
    "+": 187,
    "-": 189,
}


class Browser:
    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="splatd-e2e-")
        to_browser, self.out = os.pipe()
        self.into, from_browser = os.pipe()

        def plumb():  # in the child: the pipe's ends become 3 and 4
            a, b = os.dup2(to_browser, 100), os.dup2(from_browser, 101)
            os.dup2(a, 3)
            os.dup2(b, 4)

        self.log = open(os.path.join(self.folder, "log"), "w")
        self.process = subprocess.Popen(
            [
                BINARY,
                "--headless=new",
                "--remote-debugging-pipe",
                f"--user-data-dir={self.folder}",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-dev-shm-usage",
                "--no-first-run",
                "--disable-extensions",
                "--mute-audio",
                "--disable-background-networking",
                "--disable-component-update",
                "--hide-scrollbars",
                "--allow-pre-commit-input",
                "--disable-renderer-backgrounding",
                "--disable-background-timer-throttling",
                "--disable-hang-monitor",
                "about:blank",
            ],
            stdout=self.log,
            stderr=self.log,
            preexec_fn=plumb,
            close_fds=False,
            start_new_session=True,
        )
        os.close(to_browser)
        os.close(from_browser)
        self.numbers, self.replies, self.listeners = itertools.count(1), {}, {}
        self.writing = threading.Lock()  # long messages are no single write
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        rest = b""
        while chunk := os.read(self.into, 1 << 20):
            *messages, rest = (rest + chunk).split(b"\0")
            for message in map(json.loads, messages):
                if "id" in message:
                    self.replies.pop(message["id"]).put(message)
                elif handle := self.listeners.get(message.get("sessionId")):
                    handle(message["method"], message["params"])
        for waiting in list(self.replies.values()):
            waiting.put({"error": {"message": "Chromium has ended"}})

    def send(self, method, session=None, **params):
        number, answer = next(self.numbers), queue.Queue()
        self.replies[number] = answer
        message = {"id": number, "method": method, "params": params, **({"sessionId": session} if session else {})}
        with self.writing:
            data = json.dumps(message).encode() + b"\0"
            while data:
                data = data[os.write(self.out, data):]
        reply = answer.get(timeout=PATIENCE)
        if "error" in reply:
            raise AssertionError(f"{method}: {reply['error']['message']}")
        return reply["result"]

    def close(self):
        try:
            self.send("Browser.close")
            self.process.wait(PATIENCE)
        except Exception:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        self.log.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class Page:
    """One tab of `size` CSS pixels. `complaints`: errors of the console, exceptions and violations of policy. `before`: a
    script that runs before the page's own."""

    def __init__(self, browser, url, size=(900, 600), phone=False, dark=False, before=""):
        self.browser, self.complaints, self.clicked = browser, [], 0.0
        self.target = browser.send("Target.createTarget", url="about:blank")["targetId"]
        self.session = browser.send("Target.attachToTarget", targetId=self.target, flatten=True)["sessionId"]
        browser.listeners[self.session] = self._hear
        for domain in ("Runtime", "Log", "Page"):
            self.send(f"{domain}.enable")
        self.resize(size, phone)
        self.send(
            "Emulation.setEmulatedMedia",
            features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}],
        )
        self.send("Page.addScriptToEvaluateOnNewDocument", source=FETCHED + LIFTED + before)
        self.go(url)

    def _hear(self, method, params):
        if method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.complaints.append(details.get("exception", {}).get("description") or details["text"])
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.complaints.append(" ".join(str(a.get("value", a.get("description"))) for a in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.complaints.append(f"{params['entry']['text']} {params['entry'].get('url', '')}")

    def send(self, method, **params):
        return self.browser.send(method, self.session, **params)

    def go(self, url):
        self.send("Page.navigate", url=url)

    def resize(self, size, phone=False):
        self.send(
            "Emulation.setDeviceMetricsOverride",
            width=size[0],
            height=size[1],
            deviceScaleFactor=2 if phone else 1,
            mobile=phone,
        )
        self.send("Emulation.setTouchEmulationEnabled", enabled=phone)

    def run(self, script):
        """The value of an expression; promises are awaited."""
        done = self.send("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in done:
            raise AssertionError(f"{script}: {done['exceptionDetails']['exception'].get('description')}")
        return done["result"].get("value")

    def until(self, script, what=None):
        """Waits until an expression is true, and returns its value. Errors while the page loads count as false."""
        end = time.monotonic() + PATIENCE
        while True:
            try:
                if value := self.run(script):
                    return value
            except AssertionError:
                value = None
            assert time.monotonic() < end, (f"never became true: {what or script}; complaints: {self.complaints}; the page "
                                            f"says {self.run('document.body.innerText.slice(0, 500)')!r}")
            time.sleep(0.05)

    def text(self, selector):
        return self.run(f"document.querySelector({json.dumps(selector)}).textContent")

    def mouse(self, kind, x, y, **more):
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def click(self, x, y, times=1):
        """`times` clicks are a few hundredths of a second apart, whenever the browser gets to them; those of two calls are
        none that belong together."""
        time.sleep(max(0, self.clicked + APART - time.time()))
        begin = time.time()
        for count in range(1, times + 1):
            for i, kind in enumerate(("mousePressed", "mouseReleased")):
                self.mouse(kind, x, y, button="left", clickCount=count, timestamp=begin + 0.04 * (count - 1) + 0.02 * i)
        self.clicked = time.time()

    def drawn(self):
        """Waits for the page's parts and two frames: browsers drop what comes before a page's first picture."""
        self.run("""(async () => {
            if (document.readyState !== 'complete') await new Promise(done => addEventListener('load', done));
            for (let i = 0; i < 2; i++) await new Promise(requestAnimationFrame); })()""")

    def press_on(self, selector):
        """A click on an element's middle."""
        self.drawn()
        x, y = self.run(
            f"(e => {{ e.scrollIntoView({{block: 'center'}}); const b = e.getBoundingClientRect(); "
            f"return [b.x + b.width / 2, b.y + b.height / 2] }})(document.querySelector({json.dumps(selector)}))"
        )
        self.click(x, y)

    def drag(self, a, b, button="left", steps=4, hold="true"):
        """`hold` is checked before the button comes up."""
        self.mouse("mousePressed", *a, button=button, clickCount=1)
        for i in range(1, steps + 1):
            self.mouse("mouseMoved", *(p + (q - p) * i / steps for p, q in zip(a, b)), button=button)
        assert self.run(hold), f"not while dragging: {hold}"
        self.mouse("mouseReleased", *b, button=button, clickCount=1)

    def touch(self, *moves):
        """Fingers along `moves`, each a list of points, one a finger."""
        before = self.run("lifted")
        for i, points in enumerate([*moves, []]):
            kind = "touchStart" if i == 0 else "touchMove" if points else "touchEnd"
            self.send(
                "Input.dispatchTouchEvent",
                type=kind,
                touchPoints=[{"x": x, "y": y, "id": n} for n, (x, y) in enumerate(points)],
            )
        self.until(f"lifted >= {before + len(moves[0])}", "the page hears that fingers are up")

    def key(self, key, hold="true", shift=False):
        """It stays down until `hold` is true."""
        code = KEYS.get(key) or ord(key.upper())
        common = dict(key=key, windowsVirtualKeyCode=code, modifiers=8 if shift else 0)
        self.send("Input.dispatchKeyEvent", type="keyDown", **common, **({"text": "\r"} if key == "Enter" else {}))
        self.until(hold)
        self.send("Input.dispatchKeyEvent", type="keyUp", **common)

    def choose(self, selector, value):
        """Sets a control as a person would have."""
        self.run(
            f"(e => {{ e.value = {json.dumps(value)}; e.dispatchEvent(new Event('change', {{bubbles: true}})) }})"
            f"(document.querySelector({json.dumps(selector)}))"
        )

    def picture(self, file):
        with open(file, "wb") as out:
            out.write(base64.b64decode(self.send("Page.captureScreenshot", format="png")["data"]))

    def names(self):
        """[(role, name)] of everything that takes the focus, as a screen reader gets it."""
        nodes = self.send("Accessibility.getFullAXTree")["nodes"]
        found = []
        for node in nodes:
            properties = {p["name"]: p["value"].get("value") for p in node.get("properties", [])}
            if not node.get("ignored") and properties.get("focusable") and node["role"]["value"] != "RootWebArea":
                found.append((node["role"]["value"], node.get("name", {}).get("value", "").strip()))
        return found

    def close(self):
        self.browser.send("Target.closeTarget", targetId=self.target)
        self.browser.listeners.pop(self.session, None)
