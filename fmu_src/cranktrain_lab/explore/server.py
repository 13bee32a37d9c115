"""Server of the page, on 127.0.0.1 only, protected by a token, with all resources from this machine.

The first request has the token in its address. The response sets a cookie with a separate secret, which scripts cannot
read and other sites cannot send. The secret is valid only for this start of the server, because browsers send cookies
to every port of a host. Pages and websockets without token or cookie are refused (403), and so are requests with
another ``Host`` name, which a foreign site could point to this machine. Only GET requests of the page's own resources
are answered. Uploads are impossible, because the page has no file field and requests have a small size limit.
"""

import hmac
import secrets
from collections.abc import Callable
from typing import Any
from urllib.parse import unquote

import panel as pn
from bokeh.server.auth_provider import AuthProvider
from bokeh.util.token import get_session_id, get_token_payload
from tornado.httputil import HTTPMessageDelegate, HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.routing import Router
from tornado.web import Application, ErrorHandler, HTTPError, RequestHandler

from cranktrain.core.errors import InputError
from cranktrain_lab.explore.page import POLL_MS, Explored, Page

ADDRESS = "127.0.0.1"
LARGEST = 2 * 1024 * 1024
"""Largest message of a page, bytes."""
IDLE = 30
"""Time after which an idle connection is closed, s; an open page keeps its websocket."""
_POLICY = (
    "default-src 'self'; connect-src 'self' blob: ws://{host}; img-src 'self' data: blob:; font-src 'self' data:; "
    "style-src 'self' 'unsafe-inline'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; worker-src 'self' blob:; "
    "form-action 'none'; frame-ancestors 'none'; base-uri 'none'"
)


class Token(AuthProvider):
    """Authentication by the token."""

    def __init__(self, token: str) -> None:
        self.token = token
        self.cookie = secrets.token_urlsafe(24)
        self.hosts: tuple[str, ...] = ()
        super().__init__()

    def get_login_url(self, handler: Any) -> str:
        """Return the page's own address, because there is no login page."""
        return "/"

    def get_user(self, handler: RequestHandler) -> str:
        """Admit a request, or raise ``HTTPError`` 403."""
        request = handler.request
        if request.host not in self.hosts:
            raise HTTPError(403, "another host")
        name = f"cranktrain-explore-{request.host.rpartition(':')[2]}"
        given = handler.get_query_argument("token", "")
        if given and hmac.compare_digest(given.encode(), self.token.encode()):
            handler.set_cookie(name, self.cookie, httponly=True, samesite="Strict")
        else:
            kept = handler.get_cookie(name, "") or ""
            if given or not hmac.compare_digest(kept.encode(), self.cookie.encode()):
                raise HTTPError(403, "no token")
        handler.set_header("Content-Security-Policy", _POLICY.format(host=request.host))
        handler.set_header("Referrer-Policy", "no-referrer")
        handler.set_header("X-Content-Type-Options", "nosniff")
        return "local"


class Gate(Router):
    """Router that passes on requests of the page, and answers all others with an error.

    Bokeh's handlers fail on other requests: session tokens in the address, null bytes, unusual methods or protocols.
    """

    def __init__(self, application: Application) -> None:
        self._application = application

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> HTTPMessageDelegate | None:
        """Return the delegate of a request, as Tornado's routers do."""
        path = unquote(request.path, errors="replace")
        if request.method != "GET":
            refused = 405
        elif (
            not path.isprintable()
            or any(name.startswith("bokeh-") for name in request.arguments)
            or "Bokeh-Session-Id" in request.headers
            or ("Upgrade" in request.headers and not _opens_a_session(request))
        ):
            refused = 403
        else:
            return self._application.find_handler(request, **kwargs)
        return self._application.get_handler_delegate(request, ErrorHandler, {"status_code": refused})


def _opens_a_session(request: HTTPServerRequest) -> bool:
    """True if a websocket request names Bokeh's protocol and a session that Bokeh can read."""
    named = [one.strip() for one in request.headers.get("Sec-WebSocket-Protocol", "").split(",")]
    if len(named) != 2 or named[0] != "bokeh":
        return False
    try:
        get_token_payload(named[1])
        return isinstance(get_session_id(named[1]), str)
    except Exception:  # errors of JSON, Base64 or compressed data
        return False


def _document(explored: Explored) -> Any:
    """Return a new page as a Bokeh document for one visitor."""
    page = Page(explored)
    pn.state.add_periodic_callback(page.look, POLL_MS)
    pn.state.on_session_destroyed(lambda context: explored.closed(page.close))
    return page.view


def serve(explored: Explored, port: int, started: Callable[[str], None], wait: bool = True) -> Any:
    """Serve the page until interrupted; ``started`` is called with its address. Without ``wait`` return the server.

    Raises ``InputError`` for a port that is taken.
    """
    pn.extension(notifications=False)
    token = Token(secrets.token_urlsafe(24))
    try:
        server = pn.io.server.get_server(
            lambda: _document(explored), port=port, address=ADDRESS, show=False, start=False, verbose=False,
            title=f"cranktrain explore: {explored.live.whole.name}", auth_provider=token, websocket_origin=[],
            websocket_max_message_size=LARGEST, use_xheaders=False, index=None,
            http_server_kwargs={"max_buffer_size": LARGEST, "idle_connection_timeout": IDLE, "body_timeout": IDLE},
        )  # fmt: skip
    except OSError:
        raise InputError(f"--port {port} is taken or not allowed; give another one, or leave it out") from None
    server._http.request_callback = Gate(server._tornado)
    host = f"{ADDRESS}:{server.port}"
    token.hosts = (host, f"localhost:{server.port}")
    server.start()
    started(f"http://{host}/?token={token.token}")
    if not wait:
        return server
    try:
        IOLoop.current().start()
    finally:
        explored.close()
        server.stop()
    return server
