"""The page of ``cranktrain explore`` in a browser: who is admitted, what clicks do, what is asked of a network."""

import asyncio
import gc
import os
import re
import signal
import socket
import subprocess
import sys
import time
import weakref
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from browser import needs_browser
from explored import FIGURES, TORSIONAL, differing, in_a_loop, served, visited
from strange_requests import attacked

from cranktrain.engine.file import load_engine
from cranktrain_lab.explore.live import LiveTorsion

pytest.importorskip("panel")

from cranktrain.results.run_up.run_up import TORSION
from cranktrain_lab.explore import server as server_module
from cranktrain_lab.explore.balance import Balance
from cranktrain_lab.explore.knobs import LOAD, Chosen
from cranktrain_lab.explore.page import Explored, Page

FIRST_SLIDERS = """(() => { const l = []; for (const e of within(document)) if (e.matches('.noUi-handle')) {
  const r = e.getBoundingClientRect(); l.push([r.x + r.width / 2, r.y + r.height / 2]) } return l })()"""


async def status(address, **headers):
    """HTTP status of a request."""
    from tornado.httpclient import AsyncHTTPClient

    answer = await AsyncHTTPClient().fetch(address, raise_error=False, follow_redirects=False, headers=headers)
    return answer.code


SERVED = """
import signal, sys
from cranktrain.cli.main import main

signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job is started with it ignored
sys.exit(main(["explore", "single_petrol", "--no-balance"]))
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize(("number", "code", "said"), [
    (signal.SIGINT, 0, "cranktrain: explore ended"), (signal.SIGTERM, 143, "cranktrain: interrupted; nothing was"),
])  # fmt: skip
def test_an_interrupt_is_the_usual_end_of_the_page_and_a_termination_is_not(number, code, said):
    with subprocess.Popen(
        [sys.executable, "-c", SERVED], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as page:
        assert page.stdout.readline().startswith("http://127.0.0.1:")
        assert page.stdout.readline() == "Ctrl-C ends it.\n"
        page.send_signal(number)
        _, errors = page.communicate(timeout=120)
    assert page.returncode == code and errors.splitlines()[-1].startswith(said)


@in_a_loop
async def test_only_the_token_opens_the_page():
    """No token, a wrong one, another host and a bare websocket are refused; the cookie is for this site alone."""
    from tornado.httpclient import AsyncHTTPClient, HTTPClientError
    from tornado.websocket import websocket_connect

    async with served() as (_, address):
        bare = address.partition("?")[0]
        assert await status(bare) == 403
        assert await status(f"{bare}?token=wrong") == 403
        assert await status(f"{bare}?token=") == 403
        assert await status(address, Host="evil.example") == 403
        answer = await AsyncHTTPClient().fetch(address)
        cookie = answer.headers["Set-Cookie"]
        assert address.partition("token=")[2] not in cookie  # every port of this host is sent the cookie
        assert answer.code == 200 and "HttpOnly" in cookie and "SameSite=Strict" in cookie
        assert "default-src 'self'" in answer.headers["Content-Security-Policy"]
        assert await status(bare, Cookie=cookie.partition(";")[0]) == 200
        with pytest.raises(HTTPClientError, match="403"):
            await websocket_connect(f"ws{bare.removeprefix('http')}ws")
        for path in ("autoload.js?bokeh-autoload-element=x", "metadata"):
            assert await status(bare + path) == 403


STRANGE = [
    ("GET", "static/%00"), ("GET", "static/%00?v=1"), ("GET", "static/extensions/panel/%00"), ("GET", "%ff"),
    ("GET", "?bokeh-token=abc"), ("GET", "?bokeh-session-id=abc"), ("GET", "?bokeh-token=%00"), ("GET", "?x=%00"),
    ("GET", "ws"), ("GET", "ws?bokeh-token=abc"), ("GET", "static/../../etc/passwd"), ("GET", "static/" + "a/" * 2000),
    ("GET", "components/panel/__doc__/%00"), ("GET", "?token=%ff"), ("GET", "?token=a&token=b"), ("GET", "liveness"),
    *((method, path) for method in ("OPTIONS", "PUT", "DELETE", "PATCH", "POST", "HEAD", "TRACE", "STRANGE")
      for path in ("", "ws", "static/js/bokeh.min.js", "autoload.js", "nowhere")),
]  # fmt: skip


@in_a_loop
async def test_requests_that_no_page_makes_are_refused():
    """None of them is a fault of the server, with or without the cookie."""
    from tornado.httpclient import AsyncHTTPClient

    async with served() as (_, address):
        client, bare = AsyncHTTPClient(), address.partition("?")[0]
        cookie = (await client.fetch(address)).headers["Set-Cookie"].partition(";")[0]
        for method, path in STRANGE:
            for headers in ({}, {"Cookie": cookie}):
                answer = await client.fetch(
                    bare + path, method=method, headers=headers, raise_error=False, follow_redirects=False,
                    allow_nonstandard_methods=True, body=None,
                )  # fmt: skip
                assert answer.code < 500, (method, path, answer.code)
                assert method == "GET" or answer.code == 405, (method, path, answer.code)


@in_a_loop
async def test_websockets_of_other_protocols_are_refused():
    """Bokeh's own protocol with a session that it can read opens one; anything else is none of the page's."""
    from bokeh.util.token import generate_jwt_token
    from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
    from tornado.websocket import websocket_connect

    async with served() as (_, address):
        cookie = (await AsyncHTTPClient().fetch(address)).headers["Set-Cookie"].partition(";")[0]
        socket_address = f"ws{address.partition('?')[0].removeprefix('http')}ws"

        def opened(*protocols):
            request = HTTPRequest(socket_address, headers={"Cookie": cookie, "Origin": address.partition("/?")[0]})
            return websocket_connect(request, subprotocols=list(protocols) or None)

        token = generate_jwt_token("a" * 44)
        for protocols in ((), ("bokeh",), ("other", token), ("bokeh", "abc"), ("bokeh", "e30"), ("bokeh", token, "x")):
            with pytest.raises(HTTPClientError, match="403"):
                await opened(*protocols)
        connection = await opened("bokeh", token)
        assert connection.selected_subprotocol == "bokeh"
        connection.close()


@pytest.mark.slow
def test_480_strange_requests_are_no_fault_of_the_server():
    wrong, statuses, grown = attacked(1, 480)
    assert not wrong and statuses.total() == 480 and grown <= 300.0


@in_a_loop
async def test_half_open_connections_are_closed(monkeypatch):
    """A connection that sends nothing, or half a request, ends by itself."""
    monkeypatch.setattr(server_module, "IDLE", 0.5)
    async with served() as (_, address):
        for sent in (b"", b"GET / HTTP/1.1\r\nHost: "):
            reader, writer = await asyncio.open_connection("127.0.0.1", urlsplit(address).port)
            writer.write(sent)
            assert await asyncio.wait_for(reader.read(), 60) == b""
            writer.close()


@pytest.mark.parametrize("path", ["/dev/shm/new.toml", "~/new.toml", "../new.toml", "link/new.toml", "new.txt"])
def test_engine_files_are_written_below_the_folder_alone(tmp_path, monkeypatch, path):
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    (tmp_path / "work" / "link").symlink_to(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    page = Page(Explored("single_petrol", LiveTorsion(load_engine("single_petrol"))))
    page._sliders["pulley.polar_inertia"].value *= 1.1
    page._path.value = path
    page._write_file()
    assert "lies outside of" in page._written.object or "ends in .toml" in page._written.object
    assert list(tmp_path.rglob("new.*")) == []


def test_a_page_that_is_closed_leaves_nothing():
    explored = Explored("single_petrol", LiveTorsion(load_engine("single_petrol")))
    page = Page(explored)
    explored.closed(page.close)
    assert explored.closing == []
    gone = weakref.ref(page)
    del page
    gc.collect()
    assert gone() is None


@in_a_loop
async def test_other_machines_find_nothing():
    """The port is open at 127.0.0.1, and at no other address of this machine."""
    async with served() as (_, address):
        port = urlsplit(address).port
        with socket.create_connection(("127.0.0.1", port), 5):
            pass
        with pytest.raises(OSError):
            socket.create_connection(("127.0.0.2", port), 2)


@needs_browser
@in_a_loop
async def test_turning_a_knob_moves_the_curves_and_undo_brings_them_back():
    """A drag by the mouse answers anew; what changed is listed; undo."""
    async with visited(height=1000) as (_, page):
        await page.until("said().includes('Undo')")
        await page.until("!!find('canvas')")
        x, y = (await page.until(FIRST_SLIDERS))[1]
        before = await page.picture()
        await page.mouse("mousePressed", x, y)
        for k in range(1, 13):
            await page.mouse("mouseMoved", x + 5 * k, y)
        await page.mouse("mouseReleased", x + 60, y)
        await page.until("said().includes('pulley.polar_inertia: 0.0104 kg m^2 ->')")
        await page.until("/linear run-up of 91 speeds . 48 orders: \\d+ ms/.test(said())")
        assert differing(before, await page.picture()) > 0.002
        await page.click("button", "Undo")
        await page.until("said().includes('nothing changed')")
        assert not await page.run("!!find('input[type=file]')")


@needs_browser
@pytest.mark.parametrize(("width", "columns"), [(1300, 2), (800, 1)])
@in_a_loop
async def test_page_fits_its_window(width, columns):
    """Two columns of charts in a wide window, one in a narrow one; nothing to scroll sideways; charts are drawn."""
    async with visited(width, 1000) as (_, page):
        await page.until("[...within(document)].filter(e => e.matches('canvas')).length >= 3")
        await page.until("said().includes('order')")
        assert len(set(lefts := await page.run(FIGURES))) == columns, lefts
        assert await page.run("document.documentElement.scrollWidth") <= width


@needs_browser
@in_a_loop
async def test_full_model_runs_behind_shows_its_speeds_and_stops(tmp_path, monkeypatch):
    """Started by a click it goes on while knobs turn, its finished speeds are drawn; the button stops it."""
    monkeypatch.chdir(tmp_path)
    async with visited() as (_, page):
        await page.until("said().includes('Run full model')")
        await page.run(TORSIONAL)
        await page.click("button", "Run full model")
        await page.until("/done, \\d+ s/.test(said())", 180)
        await page.run(
            "(() => { const s = [...within(document)].filter(e => e.matches('input.bk-input')).find("
            "e => e.value === '9'); s.value = '500'; s.dispatchEvent(new Event('change')) })()"
        )
        await page.click("button", "Run full model")
        await page.until("!find('button', 'Stop').disabled")
        await page.click("button", "Stop")
        await page.until("said().includes('finished speeds are kept')", 60)


@needs_browser
@in_a_loop
async def test_engine_file_is_written_by_a_click(tmp_path, monkeypatch):
    """A value that is typed reaches the file; without a change there is one line and no file."""
    monkeypatch.chdir(tmp_path)
    async with visited() as (_, page):
        await page.until("said().includes('Write engine file')")
        await page.click("button", "Write engine file")
        await page.until("said().includes('no value of the engine file is changed')")
        await page.run(
            "(() => { const i = [...within(document)].filter(e => e.matches('input.bk-input'))[1]; i.focus(); "
            "i.value = '0.0200'; i.dispatchEvent(new Event('change')) })()"
        )
        await page.until("said().includes('pulley.polar_inertia: 0.0104 kg m^2 -> 0.02 kg m^2')")
        await page.click("button", "Write engine file")
        await page.until("said().includes('single_petrol_explored.toml written')")
    assert load_engine(tmp_path / "single_petrol_explored.toml").pulley.polar_inertia == 0.02


@needs_browser
@in_a_loop
async def test_measured_orders_and_another_engine_are_shown_beside():
    """Marks of a measured order, and the other engine's orders with a table of peaks."""
    speeds = np.linspace(300.0, 600.0, 5)
    measured = {TORSION: {1.0: (speeds, np.full(5, 1e-4))}}
    other = "the twin", LiveTorsion(load_engine("v_twin")).answer(Chosen())
    async with visited(measured=measured, other=other) as (_, page):
        await page.until("said().includes('Compared: pulley torsion by order')")
        await page.until("said().includes('the twin')")
        await page.until("[...within(document)].filter(e => e.matches('td')).length > 12")


def test_the_page_of_a_notebook_shows_itself():
    """The example of the documentation: the page is an object that a notebook shows."""
    text = (Path(__file__).parents[2] / "docs" / "how-to" / "explore.md").read_text("utf-8")
    found = {}
    exec(re.findall(r"```python\n(.*?)```", text, re.DOTALL)[0], found)
    assert found["page"].engine == load_engine("single_petrol")
    assert found["page"]._repr_mimebundle_()


def test_harmonic_balance_comes_from_a_process_of_its_own():
    """The answer belongs to the choice that was asked last, and is that of ``runup --method harmonic-balance``."""
    live = LiveTorsion(load_engine("single_petrol"))
    balance, wanted = Balance(live), Chosen({LOAD: 0.5})
    try:
        for load in (0.9, 0.7, 0.5):
            balance.ask(Chosen({LOAD: load}))
        found, end = None, time.monotonic() + 120.0
        while (found is None or found[0] != wanted) and time.monotonic() < end:
            found = balance.found() or found
            time.sleep(0.05)
    finally:
        balance.close()
    assert found is not None and found[0] == wanted
    assert np.allclose(found[1].torsion, live.balanced(wanted).torsion, rtol=1e-9, atol=1e-12)
