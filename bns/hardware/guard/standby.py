"""Who stands by for a guard: looks after it while it looks after the robot, and says when it is lost. Standard library alone."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import time
from typing import NamedTuple

from .signs import GONE_BOTH, STOPPED, not_running

TICK_S = 0.05
"""A guard gives a sign of life so often, and who stands by looks for one."""
_HANGS_S = 1.0
"""So long a guard may give none, while who stands by was running all the time: a busy computer delays both."""
_OPENS_S = 30.0
"""So long it may take to open or close a port: a Bluetooth link is made then, or what was written last waits to be sent."""
_RAN_S = 4 * TICK_S
"""A process that looks less often did not run."""
ENDED = "the guard of the robot's port had ended"


class Lost(NamedTuple):
    """Why nobody stops the robot, whether it might move, and whether its trial is gone, too."""

    why: str
    armed: bool
    gone: bool = False


class Standby:
    """Watches the process `guard`. Over `control` its trial says whether the robot may move, over `watched` the guard that it
    lives (`.`), opens or closes a port (`o`), or ends (`d`)."""

    def __init__(self, guard: int, control: socket.socket, watched: socket.socket) -> None:
        self._guard, self._control, self._watched = guard, control, watched
        self._poll = select.poll()
        for one in (control, watched):
            self._poll.register(one, select.POLLIN)
        self._armed = self._gone = self._needless = self._stopped = False
        self._why = ""
        self._patience_s = _HANGS_S
        self._looked_s = self._lived_s = time.monotonic()

    def lost(self) -> Lost | None:
        """That the guard is lost, once it is; None if nobody needs one any more."""
        while not (self._needless or self._why):
            self._turn()
        return None if self._needless else Lost(self._why, self._armed, self._gone)

    def _turn(self) -> None:
        ready = {number for number, _ in self._poll.poll(1000 * TICK_S)}
        now_s = time.monotonic()
        if now_s - self._looked_s > _RAN_S:
            self._lived_s, self._stopped = now_s, False
        self._looked_s = now_s
        if self._control.fileno() in ready:
            self._from_trial()
        if self._watched.fileno() in ready:
            self._from_guard()
        elif self._armed or self._gone:
            self._look(now_s)

    def _from_trial(self) -> None:
        said = _heard(self._control)
        for letter in said:
            self._armed = letter == b"a"[0] if letter in b"as" else self._armed
        self._needless = b"g" in said
        if not said:
            self._gone = True
            self._poll.unregister(self._control)

    def _from_guard(self) -> None:
        said = _heard(self._watched)
        self._lived_s, self._patience_s = self._looked_s, _OPENS_S if said.endswith(b"o") else _HANGS_S
        if b"d" in said:
            self._needless = self._needless or self._gone
            self._why = ENDED
        elif not said:
            self._why = f"the trial's process and its guard {GONE_BOTH}" if self._gone else "the robot's guard was killed"

    def _look(self, now_s: float) -> None:
        """Kill a guard that is stopped at two looks, or hangs: it has the port, and would go on when it continues."""
        before, self._stopped = self._stopped, not_running(self._guard) == STOPPED
        stopped = before and self._stopped
        if stopped or now_s - self._lived_s > self._patience_s:
            with contextlib.suppress(OSError):
                os.kill(self._guard, signal.SIGKILL)
            self._why = f"the robot's guard {STOPPED if stopped else 'hung'}"


def _heard(line: socket.socket) -> bytes:
    try:
        return line.recv(4096)
    except OSError:
        return b""
