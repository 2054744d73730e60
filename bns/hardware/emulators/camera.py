"""A camera on the loopback network: rendered frames as a stream of JPEG pictures (MJPEG), opened like any other."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Self

import cv2
import numpy as np

_BOUNDARY = b"frame"
_QUALITY = 92


class CameraEmulator:
    """Serves what `render()` gives, `rate_hz` times a second of the computer's clock; a frame that is None is dropped."""

    def __init__(self, render: Callable[[], np.ndarray | None], rate_hz: float = 15.0) -> None:
        self._render, self._period_s = render, 1.0 / rate_hz
        self._jpeg, self._number = b"", 0
        self._new = threading.Condition()
        self._open = True
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())
        self._server.daemon_threads = True
        self.address = f"http://127.0.0.1:{self._server.server_address[1]}/stream.mjpg"
        self._threads = [
            threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True),
            threading.Thread(target=self._film, name="emulated camera", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Unplug it."""
        with self._new:
            self._open = False
            self._new.notify_all()
        self._server.shutdown()
        for thread in self._threads:
            thread.join(timeout=5)
        self._server.server_close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def _film(self) -> None:
        while self._open:
            began = time.monotonic()
            picture = self._render()
            if picture is not None:
                _, coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
                with self._new:
                    self._jpeg, self._number = coded.tobytes(), self._number + 1
                    self._new.notify_all()
            time.sleep(max(0.0, began + self._period_s - time.monotonic()))

    def _next(self, after: int) -> tuple[int, bytes] | None:
        """The first frame after number `after`; None when the camera is unplugged."""
        with self._new:
            self._new.wait_for(lambda: self._number > after or not self._open)
            return (self._number, self._jpeg) if self._open else None

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        camera = self

        class Stream(BaseHTTPRequestHandler):
            """One viewer."""

            def do_GET(self) -> None:
                """Send frames until the viewer has gone."""
                self.send_response(200)
                self.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={_BOUNDARY.decode()}")
                self.end_headers()
                number = 0
                try:
                    while (found := camera._next(number)) is not None:
                        number, jpeg = found
                        self.wfile.write(b"--%s\r\nContent-Type: image/jpeg\r\n" % _BOUNDARY)
                        self.wfile.write(b"Content-Length: %d\r\n\r\n%s\r\n" % (len(jpeg), jpeg))
                except OSError:
                    return

            def log_message(self, *_args: object) -> None:
                """Nothing: stderr is the trial's."""

        return Stream
