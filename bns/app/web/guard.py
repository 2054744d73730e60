"""Who may talk to the page: only somebody on this machine who was given its address.

A web page that is open in the same browser may send requests to 127.0.0.1 too, under its own name (Origin) or, by a name server
that lies, under a name of its own for this machine (Host). Both are refused, as is whoever lacks the address's token.
"""

from __future__ import annotations

from collections.abc import Awaitable

from tornado.httputil import (
    HTTPConnection,
    HTTPHeaders,
    HTTPMessageDelegate,
    HTTPServerConnectionDelegate,
    RequestStartLine,
    ResponseStartLine,
)

LOOPBACK = "127.0.0.1"
_REFUSED = b"403: open the address that bns explore printed, on the machine that it runs on.\n"


class Guard(HTTPServerConnectionDelegate):
    """Stands before every request, of pages, files and the socket alike; answers 403 or hands it on to ``application``."""

    def __init__(self, application: HTTPServerConnectionDelegate, port: int, token: str) -> None:
        self._application, self._token = application, token
        self._hosts = {f"{name}:{port}" for name in (LOOPBACK, "localhost")}

    def start_request(self, server_conn: object, request_conn: HTTPConnection) -> HTTPMessageDelegate:
        """What takes one request's headers and body."""
        return _Checked(self, request_conn, self._application.start_request(server_conn, request_conn))

    def on_close(self, server_conn: object) -> None:
        """Passed on."""
        self._application.on_close(server_conn)

    def lets_in(self, path: str, headers: HTTPHeaders) -> bool:
        """Whether a request for ``path`` was sent to this machine, from this page, by somebody who knows the token."""
        origin = headers.get("Origin")
        ours = headers.get("Host", "") in self._hosts
        from_here = origin is None or origin.removeprefix("http://") in self._hosts
        known = path.partition("?")[0].split("/")[1:2] == [self._token]
        return ours and from_here and known


class _Checked(HTTPMessageDelegate):
    """One request: its headers decide whether the rest is looked at."""

    def __init__(self, guard: Guard, connection: HTTPConnection, inner: HTTPMessageDelegate) -> None:
        self._guard, self._connection, self._inner = guard, connection, inner
        self._refused = False

    def headers_received(
        self, start_line: RequestStartLine | ResponseStartLine, headers: HTTPHeaders
    ) -> Awaitable[None] | None:
        path = start_line.path if isinstance(start_line, RequestStartLine) else ""
        if self._guard.lets_in(path, headers):
            return self._inner.headers_received(start_line, headers)
        self._refused = True
        answer = HTTPHeaders(
            {"Content-Length": str(len(_REFUSED)), "Content-Type": "text/plain", "Connection": "close"}
        )
        self._connection.write_headers(ResponseStartLine("HTTP/1.1", 403, "Forbidden"), answer, _REFUSED)
        self._connection.finish()
        return None

    def data_received(self, chunk: bytes) -> Awaitable[None] | None:
        return None if self._refused else self._inner.data_received(chunk)

    def finish(self) -> None:
        if not self._refused:
            self._inner.finish()

    def on_connection_close(self) -> None:
        if not self._refused:
            self._inner.on_connection_close()
