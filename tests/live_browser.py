"""A page in headless Chromium that is clicked, typed into and looked at: Chromium's own protocol over a websocket."""

import asyncio
import base64
import json
import subprocess
import tempfile
import time
from pathlib import Path

from browser import FOUND

FIND = """
function* within(root) {
  for (const e of root.querySelectorAll('*')) { yield e; if (e.shadowRoot) yield* within(e.shadowRoot) }
}
function find(selector, text) {
  for (const e of within(document))
    if (e.matches(selector) && (!text || e.textContent.trim() === text)) return e
  return null
}
function said() { let t = ''; for (const e of within(document)) for (const n of e.childNodes)
  if (n.nodeType === 3 && !['STYLE', 'SCRIPT'].includes(e.tagName)) t += n.data + ' '; return t }
"""


class LivePage:
    """A page that stays open; requests, console and failures are recorded."""

    def __init__(self, url, width=1300, height=1000):
        from tornado.websocket import websocket_connect

        self._connect, self._url, self._size = websocket_connect, url, (width, height)
        self.requests, self.console, self.blocked = [], [], []

    async def __aenter__(self):
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        command = [
            FOUND, "--headless=new", "--no-sandbox", "--hide-scrollbars", "--remote-debugging-port=0",
            "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
            f"--user-data-dir={self._folder.name}/profile", "--remote-allow-origins=*", "--no-first-run",
            "--disable-background-networking", "about:blank",
        ]  # fmt: skip
        self._browser = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        place = Path(self._folder.name) / "profile" / "DevToolsActivePort"
        for _ in range(300):
            if place.exists() and len(place.read_text().splitlines()) > 1:
                break
            await asyncio.sleep(0.1)
        port, path = place.read_text().splitlines()
        self._number, self._waiting, self._session = 0, {}, None
        self._socket = await self._connect(f"ws://127.0.0.1:{port}{path}", max_message_size=1 << 28)
        self._reader = asyncio.ensure_future(self._read())
        target = (await self._send("Target.createTarget", url="about:blank"))["targetId"]
        self._session = (await self._send("Target.attachToTarget", targetId=target, flatten=True))["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            await self._send(f"{domain}.enable")
        await self.resize(*self._size)
        await self._send("Page.navigate", url=self._url)
        return self

    async def __aexit__(self, *_):
        self._reader.cancel()
        self._socket.close()
        self._browser.terminate()
        self._browser.wait(20)
        self._folder.cleanup()

    async def _send(self, method, **arguments):
        self._number += 1
        self._waiting[self._number] = future = asyncio.get_running_loop().create_future()
        session = {"sessionId": self._session} if self._session else {}
        await self._socket.write_message(
            json.dumps({"id": self._number, "method": method, "params": arguments, **session})
        )
        return await asyncio.wait_for(future, 60)

    async def _read(self):
        while (text := await self._socket.read_message()) is not None:
            message = json.loads(text)
            if "id" in message:
                future = self._waiting.pop(message["id"])
                if "error" in message:
                    future.set_exception(RuntimeError(str(message["error"])))
                else:
                    future.set_result(message["result"])
                continue
            kind, found = message["method"], message["params"]
            if kind == "Network.requestWillBeSent":
                self.requests.append(found["request"]["url"])
            elif kind == "Network.webSocketCreated":
                self.requests.append(found["url"])
            elif kind == "Runtime.consoleAPICalled" and found["type"] in ("error", "assert"):
                self.console.append(" ".join(str(one.get("value", one.get("description"))) for one in found["args"]))
            elif kind == "Runtime.exceptionThrown":
                self.console.append(str(found["exceptionDetails"].get("exception", {}).get("description")))
            elif kind == "Log.entryAdded" and found["entry"]["level"] == "error":
                self.console.append(f"{found['entry']['text']} {found['entry'].get('url', '')}")

    async def resize(self, width, height):
        """Another window."""
        await self._send(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )

    async def run(self, script):
        """Value of an expression, with ``find`` and ``said`` for elements in shadow roots too."""
        found = await self._send(
            "Runtime.evaluate", expression=f"{FIND}; {script}", returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in found:
            raise AssertionError(found["exceptionDetails"]["exception"].get("description"))
        return found["result"].get("value")

    async def until(self, script, seconds=90):
        """Wait until an expression is true."""
        end = time.monotonic() + seconds
        while not (found := await self.run(script)):
            assert time.monotonic() < end, (
                f"not within {seconds} s: {script}; the page says: {await self.run('said()')}"
            )
            await asyncio.sleep(0.1)
        return found

    async def place(self, selector, text=""):
        """Middle of an element, scrolled into sight."""
        name = json.dumps(text)
        await self.until(f"!!find({json.dumps(selector)}, {name})")
        return await self.run(
            f"(() => {{ const e = find({json.dumps(selector)}, {name}); e.scrollIntoView({{block: 'center'}});"
            "const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2] })()"
        )

    async def mouse(self, kind, x, y):
        """A mouse event."""
        held = {"buttons": 1, "button": "left", "clickCount": 1} if kind != "mouseReleased" else {
            "button": "left", "clickCount": 1}  # fmt: skip
        await self._send("Input.dispatchMouseEvent", type=kind, x=x, y=y, **held)

    async def click(self, selector, text=""):
        """Click on an element."""
        x, y = await self.place(selector, text)
        for kind in ("mousePressed", "mouseReleased"):
            await self.mouse(kind, x, y)

    async def picture(self):
        """The window as PNG."""
        found = await self._send("Page.captureScreenshot", format="png")
        return base64.b64decode(found["data"])
