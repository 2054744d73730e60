"""A camera on the loopback network: rendered frames as a stream of JPEG pictures (MJPEG), opened like any other."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Self

import numpy as np

from bns.extras import extra
from bns.hardware.clock import EmulatedClock

with extra("robot"):
    import cv2

_BOUNDARY = b"frame"
_QUALITY = 92
_AGAIN_S = 0.1  # by the computer's clock
_LONGEST_WAY_S = 10.0  # a viewer that has not taken a frame by then is gone


class CameraEmulator:
    """Films what `render()` gives, `rate_hz` times a second of the emulated clock; a frame that is None is dropped.

    Time does not go on before a frame has reached the one who looks, so that poses belong to their times at any speed.
    """

    def __init__(self, render: Callable[[], np.ndarray | None], clock: EmulatedClock, rate_hz: float = 15.0) -> None:
        self._render, self._clock, self._rate_hz = render, clock, rate_hz
        self._jpeg, self._number, self._frame = b"", 0, -1
        self._viewers = self._sent = self._taken = 0
        self._new, self._filming = threading.Condition(), threading.Lock()
        self._open = True
        self._gone_at: int | None = None
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())
        self._server.daemon_threads = True
        self.address = f"http://127.0.0.1:{self._server.server_address[1]}/stream.mjpg"
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
        self._thread.start()
        self._moved_on(clock.now_s())
        clock.listeners.append(self._moved_on)

    def close(self) -> None:
        """Unplug it."""
        if not self._open:
            return
        self._clock.listeners.remove(self._moved_on)
        with self._new:
            self._open = False
            self._new.notify_all()
        self._server.shutdown()
        self._thread.join(timeout=5)
        self._server.server_close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def film(self) -> None:
        """One frame now: what it shows has changed by other hands than time's."""
        with self._filming:
            self._film()

    def _moved_on(self, now_s: float) -> None:
        """Called by the clock."""
        with self._filming:
            frame = math.floor(now_s * self._rate_hz)
            if frame > self._frame:
                self._frame = frame
                self._film()

    def _film(self) -> None:
        picture = self._render()
        if picture is None:
            return
        _, coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        with self._new:
            self._jpeg, self._number = coded.tobytes(), self._number + 1
            self._new.notify_all()
        with self._clock.arrivals:
            if self._gone_at != self._clock.arrived_count:  # a viewer that is gone is not waited for again
                seen = self._clock.arrivals.wait_for(self._seen, timeout=_LONGEST_WAY_S)
                self._gone_at = None if seen else self._clock.arrived_count

    def _seen(self) -> bool:
        return not self._viewers or (self._taken == self._number and self._clock.arrived_count >= self._sent)

    def _next(self, after: int) -> tuple[int, bytes] | None:
        """The first frame after number `after`, or that one again: cameras send, moving or not. None once it is unplugged."""
        with self._new:
            self._new.wait_for(lambda: self._number > after or not self._open, timeout=_AGAIN_S)
            self._taken, self._sent = self._number, self._sent + 1
            return (self._number, self._jpeg) if self._open else None

    def _watched(self, more: int) -> None:
        with self._clock.arrivals:
            self._viewers += more
            self._clock.arrivals.notify_all()

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
                camera._watched(1)
                try:
                    while (found := camera._next(number)) is not None:
                        number, jpeg = found
                        self.wfile.write(b"--%s\r\nContent-Type: image/jpeg\r\n" % _BOUNDARY)
                        self.wfile.write(b"Content-Length: %d\r\n\r\n%s\r\n" % (len(jpeg), jpeg))
                except OSError:
                    return
                finally:
                    camera._watched(-1)

            def log_message(self, *_args: object) -> None:
                """Nothing: stderr is the trial's."""

        return Stream
