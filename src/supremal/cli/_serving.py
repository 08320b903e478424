"""A server for one page and its questions, on this machine only.

It listens on the loopback address and answers to no other name, so that a page from elsewhere whose name is
made to point here (*DNS rebinding*) is refused.  It reads nothing but small JSON documents, and has no files.
It keeps no state: each question brings all the moves that led to it.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Lock
from typing import Any, Final

from supremal.errors import ModelError

HOST: Final = "127.0.0.1"
_NAMES: Final = (HOST, "localhost")
_MOST: Final = 1 << 16
"""The most bytes of a question."""
_PATIENCE: Final = 30.0
"""How many seconds somebody may take over a request."""

Answer = Callable[[Sequence[int]], Mapping[str, Any]]


class RequestError(Exception):
    """A request that is refused, with its status."""

    def __init__(self, status: HTTPStatus, message: str) -> None:
        self.status = status
        super().__init__(message)


class PageServer(ThreadingHTTPServer):
    """Serves a page at ``/``, and answers what it asks at ``/moment``.

    Parameters
    ----------
    port
        Where to listen; 0: at a free one.
    page
        The page.
    policy
        Its Content-Security-Policy.
    answer
        What is answered to ``{"moves": [...]}``; it is asked one question at a time.
    """

    daemon_threads = True

    def __init__(self, port: int, page: str, policy: str, answer: Answer) -> None:
        self.page, self.policy = page.encode(), policy
        self._answer, self._lock = answer, Lock()
        super().__init__((HOST, port), _Handler)

    @property
    def url(self) -> str:
        """The address of the page."""
        return f"http://{HOST}:{self.server_port}/"

    def answer(self, moves: Sequence[int]) -> Mapping[str, Any]:
        """Answer a question, while no other is being answered."""
        with self._lock:
            return self._answer(moves)

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - the library's types
        """Say nothing of a connection that was left; anything else is a mistake of ours, and told."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """One connection."""

    server: PageServer
    server_version, sys_version = "supremal", ""
    protocol_version = "HTTP/1.1"
    timeout = _PATIENCE

    def do_GET(self) -> None:
        """Send the page."""
        self._respond(self._page)

    def do_POST(self) -> None:
        """Answer a question."""
        self._respond(self._moment)

    def log_message(self, *_: object) -> None:
        """Say nothing of what is asked."""

    def _respond(self, found: Callable[[], tuple[str, bytes]]) -> None:
        """Send what is found, or why it is refused."""
        status = HTTPStatus.OK
        try:
            self._check_host()
            kind, body = found()
        except RequestError as error:
            status, kind, body = error.status, "application/json", _json({"error": str(error)})
            self.close_connection = True  # of what it sent, some may not have been read
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", self.server.policy)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(body)

    def _check_host(self) -> None:
        host = self.headers.get("Host", "").removesuffix(f":{self.server.server_port}")
        if host not in _NAMES:
            message = f"the host {host!r} is not served here; open {self.server.url}"
            raise RequestError(HTTPStatus.FORBIDDEN, message)

    def _page(self) -> tuple[str, bytes]:
        if self.path.partition("?")[0] != "/":
            message = f"there is no {self.path}; open {self.server.url}"
            raise RequestError(HTTPStatus.NOT_FOUND, message)
        return "text/html", self.server.page

    def _moment(self) -> tuple[str, bytes]:
        if self.path != "/moment":
            message = f"nothing is asked at {self.path}; ask at /moment"
            raise RequestError(HTTPStatus.NOT_FOUND, message)
        if self.headers.get_content_type() != "application/json":  # what no form of another page can send
            message = f"the content is {self.headers.get_content_type()}; send application/json"
            raise RequestError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, message)
        moves = _moves(self.rfile.read(self._length()))
        try:
            return "application/json", _json(self.server.answer(moves))
        except ModelError as error:
            raise RequestError(HTTPStatus.BAD_REQUEST, str(error)) from None

    def _length(self) -> int:
        said = self.headers.get("Content-Length", "")
        if not (said.isascii() and said.isdecimal()):
            message = "how long the content is was not said; send a Content-Length"
            raise RequestError(HTTPStatus.LENGTH_REQUIRED, message)
        if len(said) > len(str(_MOST)) or int(said) > _MOST:
            message = f"the content has {said} bytes; at most {_MOST} are read"
            raise RequestError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, message)
        return int(said)


def _moves(body: bytes) -> list[int]:
    """Return the moves of a question."""
    try:
        asked = json.loads(body)
    except (ValueError, RecursionError):
        asked = None
    moves = asked.get("moves") if isinstance(asked, dict) else None
    if not isinstance(moves, list) or not all(type(move) is int and move >= 0 for move in moves):
        message = 'the content is no question; send {"moves": [...]} with the numbers of options, from 0'
        raise RequestError(HTTPStatus.BAD_REQUEST, message)
    return moves


def _json(value: object) -> bytes:
    return json.dumps(value, ensure_ascii=False, allow_nan=False).encode()
