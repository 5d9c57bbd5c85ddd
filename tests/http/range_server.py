"""A server of files by byte ranges that fails as it is told: what tests/http/test_remote.py puts datasets on, and
tests/bench/remote.py delays. Each file is a path with a list of faults; a fault is taken from it by the request that it
spoils. S3's signatures are computed anew from what came."""
import hashlib
import hmac
import http.server
import re
import socket
import struct
import threading
import time
import urllib.parse


class File:
    """What lies at a path. `faults`: what the next requests meet, each once: a status, (status, Retry-After), "reset",
    "cut" (two thirds of the body), "flip" (a byte of it is wrong), "stall" (no more of it comes), "extra" (bytes before its head,
    as of an answer before it that was longer than it said). `always`: the same of every
    request; there "drip", too (four bytes a second of it come)."""

    def __init__(self, data, etag='"1"', faults=(), always=None, ranges=True, conditions=True, delay_s=0, gzip=False,
                 account=None, gate=None, content_range="bytes {0}-{1}/{2}"):
        self.data, self.etag, self.faults, self.always = data, etag, list(faults), always
        self.ranges, self.conditions, self.delay_s, self.gzip, self.account = ranges, conditions, delay_s, gzip, account
        self.content_range = content_range  # of the first and last byte and of how many there are
        self.gate = gate  # an event: until it is set, nothing is answered
        self.requests, self.lock = [], threading.Lock()  # (first, last) of each, or None


def signature(account, method, path, headers, signed, stamp):
    """AWS Signature Version 4 of a request, from the specification alone."""
    key_id, secret, region = account
    day = stamp[:8]
    canonical = "\n".join([
        method, urllib.parse.quote(urllib.parse.unquote(path), safe="/-_.~"), "",
        *(f"{name}:{' '.join(headers[name].split())}" for name in signed), "", ";".join(signed),
        headers.get("x-amz-content-sha256") or hashlib.sha256(b"").hexdigest()])
    scope = f"{day}/{region}/s3/aws4_request"
    text = "\n".join(["AWS4-HMAC-SHA256", stamp, scope, hashlib.sha256(canonical.encode()).hexdigest()])
    key = b"AWS4" + secret.encode()
    for part in (day, region, "s3", "aws4_request"):
        key = hmac.new(key, part.encode(), hashlib.sha256).digest()
    return hmac.new(key, text.encode(), hashlib.sha256).hexdigest(), scope


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version, disable_nagle_algorithm = "HTTP/1.1", True  # a head and a short body are two packets

    def log_message(self, *_):
        pass

    def refuse(self, status, body=b"", **headers):
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def is_signed(self, account):
        found = re.fullmatch(r"AWS4-HMAC-SHA256 Credential=([^/]+)/(\S+), ?SignedHeaders=(\S+), ?Signature=([0-9a-f]{64})",
                             self.headers.get("Authorization", ""))
        if not found:
            return False
        headers = {name.lower(): value for name, value in self.headers.items()}
        signed = found[3].split(";")
        must = {"host", "x-amz-date"} | {name for name in headers if name.startswith("x-amz-")}
        mine, scope = signature(account[:3], self.command, self.path, headers, signed, headers["x-amz-date"])
        token = account[3] if len(account) > 3 else None
        return found[1] == account[0] and found[2] == scope and must <= set(signed) and found[4] == mine and \
            headers.get("x-amz-security-token") == token

    def do_GET(self):
        self.server.connections.add(self.client_address)
        self.server.agents.add(self.headers.get("User-Agent"))
        self.server.asked.append((self.headers.get("Host"), self.path, self.headers.get("Authorization")))
        path = self.path.split("?")[0]
        if path in self.server.moved:
            return self.refuse(302, Location=self.server.moved[path])
        file = self.server.files.get(urllib.parse.unquote(path))
        if not file:
            return self.refuse(404, b"<Error><Code>NoSuchKey</Code></Error>")
        found = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers.get("Range", ""))
        with file.lock:
            fault = file.always or (file.faults.pop(0) if file.faults else None)
            file.requests.append((int(found[1]), int(found[2])) if found else None)
            data, etag = file.data, file.etag
        time.sleep(file.delay_s)
        if file.gate:
            file.gate.wait()
        if file.account and not self.is_signed(file.account):
            return self.refuse(403, b"<Error><Code>SignatureDoesNotMatch</Code></Error>")
        if fault == "extra":
            self.wfile.write(b"z" * 100000)
        if fault == "reset":  # RST, not FIN
            self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self.connection.close()
            self.close_connection = True
            return None
        if isinstance(fault, tuple):
            return self.refuse(fault[0], Retry_After=str(fault[1]))
        if isinstance(fault, int):
            return self.refuse(fault, b"<Error><Code>Nothing &amp; Much</Code></Error>")
        if file.conditions and self.headers.get("If-Match", etag) != etag:
            return self.refuse(412)
        if not file.ranges or not found:
            return self.refuse(200, data, ETag=etag)
        first, last = int(found[1]), min(int(found[2]), len(data) - 1)
        if first >= len(data):
            return self.refuse(416, Content_Range=f"bytes */{len(data)}")
        body = bytearray(data[first:last + 1])
        if fault == "flip":
            body[len(body) // 2] ^= 16
        self.send_response(206)
        self.send_header("Content-Range", file.content_range.format(first, last, len(data)))
        self.send_header("Content-Length", str(len(body)))
        if etag:
            self.send_header("ETag", etag)
        if file.gzip:
            self.send_header("Content-Encoding", "gzip")
        self.end_headers()
        if fault == "drip":
            for at in range(len(body)):
                if file.always != fault:
                    break
                self.wfile.write(body[at:at + 1])
                self.wfile.flush()
                time.sleep(0.25)
            self.close_connection = True
            return None
        if fault in ("cut", "stall"):
            self.wfile.write(body[:len(body) * 2 // 3])
            self.wfile.flush()
            if fault == "stall":
                time.sleep(60)
            self.close_connection = True
            self.connection.shutdown(socket.SHUT_RDWR)
            return None
        self.wfile.write(body)
        return None


class Server(http.server.ThreadingHTTPServer):
    """with Server({"/hall.spld": File(data)}) as server: … server.url("hall.spld", user="me:secret")"""
    daemon_threads, request_queue_size = True, 64

    def __init__(self, files, port=0, moved=()):
        super().__init__(("127.0.0.1", port), Handler)
        self.files, self.moved, self.connections, self.agents, self.asked = files, dict(moved), set(), set(), []
        self.port = self.server_address[1]

    def handle_error(self, request, client_address):  # who asked has left
        pass

    def url(self, path, user=""):
        return f"http://{user}{'@' if user else ''}127.0.0.1:{self.port}/{path}"

    def __enter__(self):
        threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        return self

    def __exit__(self, *_):
        self.shutdown()
        self.server_close()
