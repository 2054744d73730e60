"""The process that owns a robot's port while a trial goes on, and stops the robot when the trial does not look after it any more.

`client` starts it without site packages: it needs the standard library alone, stands at once and shares no fault with the
trial. So this module and those that it imports (relatively: its folder is a package of its own there) import nothing else.
Standard input is the control socket: first a line of JSON (the set-up), then single bytes: `.` a heartbeat, `a` the robot may
move from now on, `s` it was confirmed to stand, `t` stop it now, `g` goodbye. Answers are lines of JSON.

A process whose set-up says so stands by. It hears `a`, `s` and `g`, too, and over a socket of their own signs of life of the
process that guards (`.`, and `o` before what may take long), and its end (`d`). Where that one was killed or stopped, or hangs,
it takes over by itself, at once and whatever the trial does, and stops the robot; a trial that lives finds it behind the same
sockets and the same link.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import signal
import socket
import sys
import time
from pathlib import Path
from typing import Any

from .line import Line, OtherDeviceError
from .notes import Notes
from .order import StopOrder
from .signs import GONE, not_running, slept_s
from .standby import TICK_S, Lost, Standby

_BUSY_S = 3.0
"""So long another process may still hold the port: the guard of an earlier trial that ends."""
_AGAIN_S = 0.2
_SLEPT_S = 0.2
_STANDS_S = 1.0
"""So long a robot that was not moving is asked to stand when its trial is gone."""
_MOST_HEARD = 4096


class Guard:
    """Forwards bytes between the port and a pseudo-terminal that `link` points to, and stops the robot."""

    def __init__(self, setup: dict[str, Any], control: socket.socket, ends: socket.socket, notes: Notes) -> None:
        self._setup, self._control, self._ends, self._notes = setup, control, ends, notes
        self._order = StopOrder(setup["stop"])
        self._poll = select.poll()
        self._poll.register(control, select.POLLIN)
        self._line = Line(setup["port"], setup["stop"]["baud"], setup["link"], self._poll, setup["sysfs"], setup["twins"])
        self._line.identity = setup["identity"]
        self._heard = b""
        self._armed = self._gone = self._done = self._terminated = self._spoke = self._other = self._away = False
        self.why = ""
        """What made it stop the robot; empty while it forwards."""
        self._tripped_s = self._beat_s = self._tried_s = self._plugged_s = self._answered_s = self._lived_s = 0.0
        self._slept_s = slept_s()

    def run(self) -> None:
        """Until the trial has said goodbye, or is gone, and the robot stands."""
        while not (self._gone and (self._done or not self.why)):
            self._turn(TICK_S)
            self._judge()
            if self._line.port < 0:
                self._reopen()
            elif self.why and not self._done and self._listens():
                self._round()
            self._give_up()

    def first_open(self) -> None:
        """Open the port, waiting a little for one that is busy; OSError."""
        end_s = time.monotonic() + _BUSY_S
        while True:
            try:
                return self._plug()
            except BlockingIOError:
                if time.monotonic() > end_s:
                    raise
                time.sleep(TICK_S)

    def takes_over(self, lost: Lost) -> None:
        """Stop the robot: nobody else will."""
        signal.signal(signal.SIGTERM, self._terminate)
        self._armed, self._gone, self._beat_s = lost.armed, lost.gone, time.monotonic()
        if lost.gone:
            self._poll.unregister(self._control)
        self._trip(lost.why)
        self.run()

    def ready(self) -> None:
        """Say so, and what is at the port. From then on the robot may move, and a SIGTERM has it stopped."""
        signal.signal(signal.SIGTERM, self._terminate)
        self._control.sendall((json.dumps({"kind": "ready", "identity": self._line.identity}) + "\n").encode())

    @property
    def needless(self) -> bool:
        """Whether nobody has to take over when this process ends."""
        return self._done or not self._armed

    def close(self) -> None:
        """Give the port free."""
        self._line.close()
        with contextlib.suppress(OSError):
            Path(self._setup["link"]).parent.rmdir()

    def _terminate(self, *_signal: object) -> None:
        self._terminated = True

    def _judge(self) -> None:
        """Trip if the trial does not look after the robot."""
        # before the clocks: a trial whose computer slept in between is found stopped, and that is no cause of its own
        state = not_running(self._setup["process"]) if self._armed and not self.why else ""
        now_s, slept = time.monotonic(), slept_s()
        slept, self._slept_s = slept - self._slept_s, slept
        if self._terminated and not self._gone:
            self._gone = True
            self._trip("the guard was terminated")
        if not self._armed or self.why:
            return
        if slept > _SLEPT_S:
            self._trip(f"the computer slept for {slept:.1f} s")
        elif state:
            self._trip(f"the trial's process {state}")
        elif now_s - self._beat_s > self._setup["silent_s"]:
            allowed_s = self._setup["silent_s"]
            silent_s = now_s - self._beat_s
            self._trip(f"the trial gave no sign of life for {silent_s:.2f} s (the rig's silent_s allows {allowed_s:g} s)")

    def _trip(self, why: str) -> None:
        if not self.why:
            self.why, self._tripped_s, self._done = why, time.monotonic(), False
            self._answered_s = self._tripped_s
            self._order.begin()
            self._tell("tripped", why=why, guard=os.getpid())

    def _tell(self, kind: str, **what: Any) -> None:
        line = (json.dumps({"kind": kind, "wall_s": round(time.time(), 3), **what}) + "\n").encode()
        with contextlib.suppress(OSError):
            self._control.send(line, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        self._notes.write(line)

    def _turn(self, wait_s: float) -> None:
        """Wait for something to come, and pass it on; say that this process lives."""
        if time.monotonic() - self._lived_s >= TICK_S:
            self._lived_s = time.monotonic()
            self._says(b".")
        for ready, events in self._poll.poll(1000 * wait_s):
            if ready == self._control.fileno():
                self._told()
            elif ready == self._line.near:
                self._from_driver()
            elif ready == self._line.port:
                self._from_robot(events)

    def _says(self, letter: bytes) -> None:
        """To who stands by: `.` it lives, `o` the next may take long (to open or close a port is the system's)."""
        with contextlib.suppress(OSError):  # nobody stands by, or does not listen
            self._ends.send(letter, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)

    def _told(self) -> None:
        try:
            said = self._control.recv(4096)
        except OSError:
            said = b""
        if not said:
            self._poll.unregister(self._control)
        self._beat_s = time.monotonic()
        for letter in said:
            if letter in b"as":
                self._armed = letter == b"a"[0]
            elif letter in b"t" and self._armed:
                self._trip("the trial was asked to stop")
        if said and b"g" not in said:
            return
        self._gone = True
        if self._armed or not said:
            self._trip(f"the trial's process {GONE}" if not said else "the trial ended without a confirmed stop")

    def _from_driver(self) -> None:
        data = os.read(self._line.near, 4096)
        if self.why and not self._gone and self._order.is_in(data):
            self._tell("taken-back", why=self.why)
            self.why = ""
        if not self.why:
            self._write(data)

    def _from_robot(self, events: int) -> None:
        try:
            data = os.read(self._line.port, 4096) if events & select.POLLIN else b""
        except BlockingIOError:
            return
        except OSError:
            data = b""
        self._spoke |= bool(data)
        if not data:
            self._lose()
        elif self.why:
            self._heard = (self._heard + data)[-_MOST_HEARD:]
        else:
            self._line.to_driver(data)

    def _write(self, data: bytes) -> None:
        if not self._line.to_robot(data):
            self._lose()

    def _lose(self) -> None:
        self._says(b"o")
        self._line.close()
        self._away = True
        self._tell("port-lost")
        if self._armed:
            self._trip("the port is gone")

    def _plug(self) -> None:
        self._says(b"o")
        self._line.open()
        self._plugged_s, self._spoke = time.monotonic(), False

    def _reopen(self) -> None:
        if time.monotonic() - self._tried_s < _AGAIN_S:
            return
        self._tried_s = time.monotonic()
        try:
            self._plug()
        except OtherDeviceError as error:
            if not self._other:
                self._tell("other-device", what=str(error))
            self._other = True
        except BlockingIOError:
            pass  # the guard that was lost has not ended yet
        except OSError:
            self._away = True
        else:
            if self._away:
                self._tell("port-back", port=self._line.at)
            self._other = self._away = False

    def _give_up(self) -> None:
        """Nobody is left to tell, and nothing answers: the robot was not moving, or it has not been heard for too long."""
        if not self._gone or self._done or not self.why:
            return
        now_s = time.monotonic()
        if not self._armed and now_s - self._tripped_s > _STANDS_S:
            self._done = True
        elif now_s - self._answered_s > self._setup["gives_up_s"]:
            self._done = True
            self._tell("gave-up", why=self.why, seconds=round(now_s - self._tripped_s, 1))

    def _listens(self) -> bool:
        """Whether the robot may be spoken to: a board that starts when its port is opened must not be disturbed."""
        return self._spoke or time.monotonic() - self._plugged_s >= self._order.quiet_s

    def _round(self) -> None:
        """Order the robot to stand, ask whether it does; twice in a row, and it is confirmed."""
        values: list[int] | None = []
        for send, reply in self._order.steps:
            found = self._asked(send, reply)
            if not self.why or self._line.port < 0:
                return
            values = values + found if values is not None and found is not None else None
        if self._order.confirmed(values):
            self._done, self._armed = True, False
            self._tell("stopped", why=self.why, seconds=round(time.monotonic() - self._tripped_s, 4))

    def _asked(self, send: bytes, reply: re.Pattern[bytes] | None) -> list[int] | None:
        """The numbers in the answer; None if none comes in time, or the driver has taken the robot back."""
        self._heard = b""
        self._write(send)
        if reply is None:
            return []
        end_s = time.monotonic() + self._order.wait_s
        while self.why and self._line.port >= 0:
            if (match := reply.search(self._heard)) is not None:
                self._answered_s = time.monotonic()
                return self._order.numbers(match)
            if (left_s := end_s - time.monotonic()) <= 0:
                return None
            self._turn(min(left_s, TICK_S))
        return None


def main() -> None:
    """Take the set-up from standard input, guard, end."""
    for name in ("HUP", "INT", "QUIT", "TSTP", "TTIN", "TTOU", "PIPE", "TERM"):
        signal.signal(getattr(signal, f"SIG{name}"), signal.SIG_IGN)
    control, ends = socket.socket(fileno=os.dup(0)), socket.socket(fileno=int(sys.argv[3]))
    ends.set_inheritable(False)  # who stands by learns from its end that this process is gone
    line = b""
    while not line.endswith(b"\n"):
        byte = control.recv(1)
        if not byte:
            return
        line += byte
    setup = json.loads(line)
    notes, lost = Notes(setup["log"]), Lost(**setup["lost"]) if "lost" in setup else None
    if setup.get("standby"):
        watched = socket.socket(fileno=int(sys.argv[4]))
        watched.set_inheritable(False)
        lost = Standby(setup["guard"], control, watched).lost()
        if lost is None:
            return
    guard = Guard(setup, control, ends, notes)
    try:
        _guarded(guard, control, lost)
    finally:
        guard.close()
        with ends, contextlib.suppress(OSError):
            if guard.needless:
                ends.send(b"d", socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        notes.close()


def _guarded(guard: Guard, control: socket.socket, lost: Lost | None) -> None:
    if lost is not None:
        guard.takes_over(lost)
        return
    try:
        guard.first_open()
        guard.ready()
    except OSError as error:
        control.sendall((json.dumps({"kind": "refused", "errno": error.errno, "what": str(error)}) + "\n").encode())
        return
    guard.run()
