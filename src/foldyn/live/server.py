"""The viewer's server: one page, and answers, for browsers on this machine only.

It listens on 127.0.0.1, serves two paths, and reads no file named by a request. It answers only
requests that name this host and carry the key of this run. Pages of other origins and other users
of the machine do not know the key.
"""

from __future__ import annotations

import hmac
import json
import secrets
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

HOST = "127.0.0.1"
MOST_BYTES = 100_000
"""Largest body of a request, in bytes; a table of numbers needs a hundredth of this."""
MOST_CONNECTIONS = 32
"""Largest number of simultaneous connections, each with a thread; a browser uses six for a page."""
PATIENCE = 30.0
"""Seconds after which a silent connection is closed."""
KEY_HEADER = "X-Foldyn-Key"
HEADERS: Mapping[str, str] = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}
TOO_MANY = (
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain; charset=utf-8\r\n"
    b"Connection: close\r\nRetry-After: 30\r\n\r\n"
    b"too many connections at once: close other windows of this page\n"
)
Answer = Callable[[Any], dict[str, Any]]


class Server(ThreadingHTTPServer):
    """A server of a single page.

    Parameters
    ----------
    page : callable
        Returns the text of the page, given the key that its requests carry.
    answers : mapping of callables, optional
        Functions from a table to a table, by the path of the request: {"/compute": ...}. They run
        in their own threads and raise nothing.
    port : int
        0 takes any free port.

    Raises
    ------
    OSError
        The port is taken.

    Attributes
    ----------
    key : str
        Random, new for each server.
    """

    daemon_threads = True

    def __init__(
        self, page: Callable[[str], str], answers: Mapping[str, Answer] | None = None, port: int = 0
    ) -> None:
        self.key = secrets.token_urlsafe(16)
        self.page = page(self.key).encode()
        self.answers = dict(answers or {})
        self._free = threading.BoundedSemaphore(MOST_CONNECTIONS)
        super().__init__((HOST, port), _Handler)

    @property
    def address(self) -> str:
        """Address of the page; whoever knows it may see the page."""
        return f"http://{HOST}:{self.server_port}/{self.key}"

    @property
    def hosts(self) -> tuple[str, ...]:
        """Names of this host that a request may use; no other machine can redirect them here."""
        return tuple(f"{name}:{self.server_port}" for name in (HOST, "localhost"))

    def process_request(self, request: Any, client_address: Any) -> None:
        """Serve a connection in a thread, or refuse it if too many are open."""
        if not self._free.acquire(blocking=False):
            with suppress(OSError):
                request.settimeout(0.0)
                request.sendall(TOO_MANY)
                request.recv(MOST_BYTES)  # if data stayed unread, the answer would be lost
            self.shutdown_request(request)
            return
        super().process_request(request, client_address)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve a connection in its thread."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore browsers that close the connection before they are answered."""


class _Handler(BaseHTTPRequestHandler):
    """One connection."""

    server: Server
    protocol_version = "HTTP/1.1"
    server_version = "foldyn"
    sys_version = ""
    timeout = PATIENCE
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """Send the page."""
        if self._is_foreign():
            return
        if not self._is_key(self.path.partition("?")[0].removeprefix("/")):
            self._refuse(HTTPStatus.NOT_FOUND, "open the address that foldyn view has printed")
            return
        self._send(HTTPStatus.OK, "text/html; charset=utf-8", self.server.page)

    def do_POST(self) -> None:
        """Answer a JSON table with a JSON table."""
        if self._is_foreign():
            return
        if not self._is_key(self.headers.get(KEY_HEADER, "")):
            self._refuse(HTTPStatus.FORBIDDEN, "this is not the page of this run: open it anew")
            return
        answer = self.server.answers.get(self.path)
        if answer is None:
            return self._refuse(HTTPStatus.NOT_FOUND, "there is nothing here")
        if self.headers.get_content_type() != "application/json":
            return self._refuse(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "send application/json")
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()):
            return self._refuse(HTTPStatus.LENGTH_REQUIRED, "say how long the body is")
        if len(length) > 9 or int(length) > MOST_BYTES:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"send at most {MOST_BYTES} bytes")
            return
        try:
            wish = json.loads(self.rfile.read(int(length)))
        except (ValueError, RecursionError):
            return self._refuse(HTTPStatus.BAD_REQUEST, "this is no JSON")
        self._send(HTTPStatus.OK, "application/json", json.dumps(answer(wish)).encode())

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing."""

    def _is_foreign(self) -> bool:
        """Whether a request names another host or comes from another origin; if so, refuse it."""
        origin = self.headers.get("Origin")
        known = [f"http://{host}" for host in self.server.hosts]
        if self.headers.get("Host") in self.server.hosts and origin in (None, *known):
            return False
        self._refuse(HTTPStatus.FORBIDDEN, f"this server answers only as {self.server.hosts[0]}")
        return True

    def _is_key(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.server.key.encode())

    def _refuse(self, status: HTTPStatus, why: str) -> None:
        self.close_connection = True  # the request's body may still be arriving
        self._send(status, "text/plain; charset=utf-8", f"{why}\n".encode())

    def _send(self, status: HTTPStatus, kind: str, content: bytes) -> None:
        self.send_response(status)
        for name, value in {**HEADERS, "Content-Type": kind}.items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(content)))
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(content)
