"""The page's server: on loopback alone, under an address that nobody can guess, with all its files its own."""

from __future__ import annotations

import asyncio
import logging
import secrets
import signal
import socket
import threading
import webbrowser
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

from panel.io.server import get_server
from tornado.ioloop import IOLoop
from tornado.iostream import StreamClosedError
from tornado.websocket import WebSocketClosedError

from bns.app.web.guard import LOOPBACK, Guard
from bns.errors import BnsError

LARGEST_UPLOAD = 1 << 29
"""Bytes of one message of the browser: a log of a million poses as text is about 100 MB."""
_SCRIPTS = ("bokeh", "bokeh-widgets", "bokeh-tables")  # the last because Panel's own script asks for it
_ENDING = (signal.SIGINT, signal.SIGTERM)


class PageServer:
    """Serves pages that ``page`` makes, one for every tab, until it is stopped.

    ``port`` 0: any that is free. BnsError if the port is taken.
    """

    def __init__(self, page: Callable[[], Any], port: int = 0) -> None:
        _check_free(port)
        self._loop = asyncio.new_event_loop()
        self.token = secrets.token_urlsafe(16)
        with ThreadPoolExecutor(1) as elsewhere:  # else a loop that runs already, a notebook's, is listened on
            self._server = elsewhere.submit(self._made, page, port).result()
        self.port = int(self._server.port)
        http = self._server._http  # Bokeh has no public way to stand before its handlers
        application: Any = http.request_callback
        application.resources = _only_needed(application.resources)
        application.websocket_origins.update(f"{name}:{self.port}" for name in (LOOPBACK, "localhost"))
        http.request_callback = Guard(application, self.port, self.token)

    def _made(self, page: Callable[[], Any], port: int) -> Any:
        asyncio.set_event_loop(self._loop)
        return get_server(
            {"/": page},
            port=port,
            address=LOOPBACK,
            title="bns explore",
            prefix=self.token,
            use_xheaders=False,
            websocket_max_message_size=LARGEST_UPLOAD,
            loop=IOLoop.current(),
        )

    @property
    def address(self) -> str:
        """To be opened in a browser on this machine."""
        return f"http://{LOOPBACK}:{self.port}/{self.token}/"

    def serve(self, browser: bool = False) -> None:
        """Answer until Ctrl-C, SIGTERM or `stop`."""
        asyncio.set_event_loop(self._loop)
        self._loop.set_exception_handler(_unless_closed)
        logging.getLogger("bokeh.server.views.ws").addFilter(_not_of_closed)
        self._server.start()
        if threading.current_thread() is threading.main_thread():
            with suppress(NotImplementedError):  # on Windows Ctrl-C raises KeyboardInterrupt
                for ending in _ENDING:
                    self._loop.add_signal_handler(ending, self._loop.stop)
        if browser:
            self._loop.call_soon(webbrowser.open, self.address)
        try:
            self._loop.run_forever()
        except KeyboardInterrupt:
            pass
        finally:
            self._server.stop()
            self._loop.run_until_complete(self._loop.shutdown_asyncgens())
            self._loop.close()

    def stop(self) -> None:
        """End `serve`, from any thread."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._loop.stop)


def _unless_closed(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """A tab that was closed while the page spoke to it is no fault: nobody wants a traceback of it in the terminal."""
    if not isinstance(context.get("exception"), WebSocketClosedError | StreamClosedError):
        loop.default_exception_handler(context)


def _not_of_closed(record: logging.LogRecord) -> bool:
    """Everything but Bokeh's warning of the same."""
    return "connection was closed" not in record.getMessage()


def _only_needed(resources: Callable[..., Any]) -> Callable[..., Any]:
    """Without Bokeh's scripts for formulas and graphics cards: 2 MB that a browser would read and never use."""

    def needed(*arguments: Any, **more: Any) -> Any:
        made = resources(*arguments, **more)
        made.components = [name for name in made.components if name in _SCRIPTS]
        return made

    return needed


def _check_free(port: int) -> None:
    """BnsError if nobody can listen there."""
    with socket.socket() as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            tried.bind((LOOPBACK, port))
        except OSError as fault:
            raise BnsError(
                f"Port {port} of this machine is not available ({fault.strerror}); give another one: --port N."
            ) from fault
