"""Requests that no page makes, from a seed, to a server of ``cranktrain explore`` in a process of its own.

    python tests/strange_requests.py --seed 1 --count 480    # a line for each that failed; exit code 1 where one did

Each is answered with a status below 500, or its connection is closed; the server says no traceback, lives on, answers a
right request at the end, and ends with the exit code of an interrupt.
"""

import argparse
import base64
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from urllib.parse import urlsplit

SERVED = """
import signal, sys
from cranktrain.cli.main import main

signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job is started with it ignored
sys.exit(main(["explore", "single_petrol", "--no-balance"]))
"""
METHODS = (*12 * ("GET",), "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "CONNECT", "X", "")
PATHS = (
    "", "ws", "metadata", "autoload.js", "static/js/bokeh.min.js", "static/", "static/extensions/panel/", "favicon.ico",
    "components/panel/", "components/panel/__doc__/", "liveness", "nowhere", "static/js/../../../../etc/passwd",
    "ws/ws",
)  # fmt: skip
PIECES = (
    "%00", "%ff", "%", "%zz", "..", "../..", "%2e%2e/", "\\", ";", "?", "#", "a" * 300, "a/" * 3000, "é", "\x01", " ",
    "{}", "'", "[]", "*", "%0d%0aX: y", "//evil.example/", "~", "$x", "\u202e",
)  # fmt: skip
KEYS = ("token", "bokeh-token", "bokeh-session-id", "bokeh-autoload-element", "bokeh-absolute-url", "resources", "x")
HEADERS = (
    "Origin: http://evil.example", "Host: evil.example", "Host:", "Host: 127.0.0.1:99999999", "Content-Length: -1",
    "Content-Length: 9999999999999", "Content-Length: a", "Transfer-Encoding: chunked", "Range: bytes=5-1",
    "Range: bytes=0-99999999999999999999", "If-Modified-Since: yesterday", "If-None-Match: \"", "Cookie: a",
    "Cookie: =;;", "Accept-Encoding: gzip;q=x", "Upgrade: websocket\r\nConnection: Upgrade", "Expect: 100-continue",
    "no colon", "X-Forwarded-For: ::1", "Content-Type: application/json", "X: " + 20000 * "y",
    "\x00: \x00", "Connection: close",
)  # fmt: skip


def request(rng, host, query, cookie):
    """Bytes of one request; some hold the token, some the cookie, some are cut short or no HTTP at all."""
    if rng.random() < 0.05:
        return bytes(rng.randrange(256) for _ in range(rng.randrange(1, 400))) + b"\r\n\r\n"
    path = rng.choice(PATHS) + "".join(rng.choice(PIECES) for _ in range(rng.choice((0, 0, 1, 1, 2))))
    asked = [query] if rng.random() < 0.3 else []
    asked += [f"{rng.choice(KEYS)}={rng.choice((*PIECES, ''))}" for _ in range(rng.choice((0, 0, 1, 2)))]
    path += ("?" + "&".join(asked)) * bool(asked)
    heads = [f"Host: {host}"] * (rng.random() < 0.95)
    heads += [f"Cookie: {cookie}"] * (rng.random() < 0.5)
    heads += [rng.choice(HEADERS) for _ in range(rng.choice((0, 0, 0, 1, 1, 3)))]
    if rng.random() < 0.15:  # a websocket, with messages that are none of the protocol's
        key = base64.b64encode(bytes(16)).decode()
        heads += ["Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]
        heads += [f"Sec-WebSocket-Protocol: bokeh, {rng.choice(PIECES)}"] * (rng.random() < 0.7)
        heads += [f"Origin: http://{host}"] * (rng.random() < 0.7)
    version = rng.choice((*20 * ("HTTP/1.1",), "HTTP/1.0", "HTTP/9.9", "", "SPDY"))
    head = "\r\n".join([f"{rng.choice(METHODS)} /{path} {version}", *heads])
    body = rng.choice((b"", b"", b"", b"{}", b"\x81\xfe\xff\xff", bytes(5000), b"0\r\n\r\n", b"fffffffff\r\n"))
    sent = head.encode("utf-8") + b"\r\n\r\n" + body
    return sent[: rng.randrange(len(sent))] if rng.random() < 0.08 else sent


def answered(port, sent, wait=2.0):
    """Status of the answer to these bytes; 0 where there is none."""
    with socket.create_connection(("127.0.0.1", port), 30) as connection:
        try:
            connection.sendall(sent)
            if b"websocket" not in sent:
                connection.shutdown(socket.SHUT_WR)
            connection.settimeout(wait)
            answer = connection.recv(65536)
        except (TimeoutError, ConnectionError):
            return 0, b""
    found = re.match(rb"HTTP/1\.\d (\d{3})", answer)
    return int(found[1]) if found else 0, answer


def resident(process):
    """Memory of a process, MB; 0 where the system does not say."""
    try:
        return int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{process.pid}/status").read_text())[1]) / 1024.0
    except (OSError, TypeError):
        return 0.0


def attacked(seed, count):
    """What was wrong, how often each status came, and memory over that at the start, MB."""
    wrong, statuses = [], Counter()
    with tempfile.TemporaryDirectory() as folder, (Path(folder) / "said.txt").open("w+") as errors, subprocess.Popen(
        [sys.executable, "-c", SERVED], stdout=subprocess.PIPE, stderr=errors, text=True, cwd=folder,
    ) as page:  # fmt: skip
        try:
            where = urlsplit(page.stdout.readline().strip())
            right = f"GET /?{where.query} HTTP/1.1\r\nHost: {where.netloc}\r\nConnection: close\r\n\r\n".encode()
            status, answer = answered(where.port, right, 60.0)
            cookie = re.search(rb"Set-Cookie: ([^;]+)", answer)[1].decode()
            begin = resident(page)
            for number in range(count):
                sent = request(random.Random(f"{seed} {number}"), where.netloc, where.query, cookie)
                status, _ = answered(where.port, sent)
                statuses[status] += 1
                if status >= 500 or page.poll() is not None:
                    wrong.append(f"{number}: status {status}, {sent[:200]!r}")
            grown = resident(page) - begin
            status, _ = answered(where.port, right, 60.0)
            wrong += [] if status == 200 else [f"a right request afterwards: status {status}"]
            page.send_signal(signal.SIGINT)
            page.wait(120)
            said = (Path(folder) / "said.txt").read_text("utf-8", "replace")
            wrong += [f"exit code {page.returncode}"] if page.returncode else []
            wrong += [said[said.index("Traceback") :][:1500]] if "Traceback" in said else []
        finally:
            page.kill()
    return wrong, statuses, grown


def main():
    """Ask the requests of a seed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=480)
    options = parser.parse_args()
    wrong, statuses, grown = attacked(options.seed, options.count)
    print(f"statuses {dict(sorted(statuses.items()))}; memory {grown:.0f} MB over the start")
    for line in wrong:
        print(f"FAILED {line}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
