"""The process that owns a robot's port while a trial goes on, and stops the robot when the trial does not look after it any more.

`bns.hardware.guard` starts it as a script, without site packages: it needs the standard library alone, stands at once and
shares no fault with the trial. Standard input is the control socket: first a line of JSON (the set-up), then single bytes:
`.` a heartbeat, `a` the robot may move from now on, `s` it was confirmed to stand, `t` stop it now, `g` goodbye. Answers are
lines of JSON.
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

with contextlib.suppress(ImportError):  # not on Windows, where a robot's port has no guard
    import fcntl
    import termios
    import tty

TICK_S = 0.05
_BUSY_S = 3.0
"""So long another process may still hold the port: the guard of an earlier trial that ends."""
_AGAIN_S = 0.2
_WRITE_S = 0.2
_SLEPT_S = 0.2
_STANDS_S = 1.0
"""So long a robot that was not moving is asked to stand when its trial is gone; one that was, for ever."""
_READINGS = 2
_MOST_HEARD = 4096


def slept_s() -> float:
    """Seconds since the boot that the computer was suspended: the steady clock stands still then."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    return 0.0 if boot is None else time.clock_gettime(boot) - time.monotonic()


def frozen(process: int) -> bool:
    """Whether a process was stopped (SIGSTOP, a debugger); False where the system does not tell."""
    try:
        stat = Path(f"/proc/{process}/stat").read_bytes()
    except OSError:
        return False
    return stat[stat.rfind(b")") + 2 : stat.rfind(b")") + 3] in {b"T", b"t", b"Z", b"X"}


def opened(port: str, baud: int) -> int:
    """The port, locked and raw; OSError."""
    line = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        fcntl.flock(line, fcntl.LOCK_EX | fcntl.LOCK_NB)
        tty.setraw(line)
        speed = getattr(termios, f"B{baud}")
        flags = termios.tcgetattr(line)
        flags[2] = termios.CS8 | termios.CREAD | termios.CLOCAL
        flags[4] = flags[5] = speed
        termios.tcsetattr(line, termios.TCSANOW, flags)
        termios.tcflush(line, termios.TCIFLUSH)
    except (OSError, termios.error) as error:
        os.close(line)
        raise OSError(*error.args[:2]) from error
    return line


class Guard:
    """Forwards bytes between the port and a pseudo-terminal that `link` points to, and knows how to stop the robot."""

    def __init__(self, setup: dict[str, Any], control: socket.socket) -> None:
        self._setup, self._control = setup, control
        stop = setup["stop"]
        self._steps = [(s.encode("latin-1"), r and re.compile(r.encode("latin-1"), re.DOTALL)) for s, r in stop["steps"]]
        self._own_stop = re.compile(stop["own_stop"].encode("latin-1"), re.DOTALL)
        self._port = self._near = self._far = -1
        self._poll = select.poll()
        self._poll.register(control, select.POLLIN)
        self._heard = b""
        self._armed = self._gone = self._still = self._terminated = self._spoke = False
        self.why = ""
        """What made it stop the robot; empty while it forwards."""
        self._tripped_s = self._beat_s = self._tried_s = self._plugged_s = 0.0
        self._slept_s, self._wait_s = slept_s(), stop["wait_s"]
        self._good = 0
        self._before: list[int] | None = None

    def run(self) -> None:
        """Until the trial has said goodbye, or is gone, and the robot stands."""
        signal.signal(signal.SIGTERM, self._terminate)
        while not (self._gone and (self._still or not self.why)):
            self._turn(TICK_S)
            self._judge()
            if self._port < 0:
                self._reopen()
            elif self.why and not self._still and self._listens():
                self._round()
                self._give_up()

    def first_open(self) -> None:
        """Open the port, waiting a little for one that is busy; OSError."""
        end_s = time.monotonic() + _BUSY_S
        while True:
            try:
                port = opened(self._setup["port"], self._setup["baud"])
            except BlockingIOError:
                if time.monotonic() > end_s:
                    raise
                time.sleep(TICK_S)
            else:
                return self._plug(port)

    def close(self) -> None:
        """Give everything free."""
        self._unplug()
        with contextlib.suppress(OSError):
            Path(self._setup["link"]).parent.rmdir()

    def _terminate(self, *_signal: object) -> None:
        self._terminated = True

    def _judge(self) -> None:
        """Trip if the trial does not look after the robot."""
        now_s, slept = time.monotonic(), slept_s()
        slept, self._slept_s = slept - self._slept_s, slept
        if self._terminated and not self._gone:
            self._gone = True
            self._trip("the guard was terminated")
        if not self._armed or self.why:
            return
        if slept > _SLEPT_S:
            self._trip(f"the computer slept for {slept:.1f} s")
        elif frozen(self._setup["process"]):
            self._trip("the trial's process was stopped")
        elif now_s - self._beat_s > self._setup["silent_s"]:
            self._trip(f"the trial gave no sign of life for {now_s - self._beat_s:.2f} s")

    def _trip(self, why: str) -> None:
        if not self.why:
            self.why, self._tripped_s, self._still, self._wait_s = why, time.monotonic(), False, self._setup["stop"]["wait_s"]
            self._good, self._before = 0, None
            self._tell("tripped", why=why, guard=os.getpid())

    def _tell(self, kind: str, **what: Any) -> None:
        line = (json.dumps({"kind": kind, "wall_s": round(time.time(), 3), **what}) + "\n").encode()
        with contextlib.suppress(OSError):
            self._control.send(line, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        if self._setup["log"]:
            with contextlib.suppress(OSError), Path(self._setup["log"]).open("ab") as log:
                log.write(line)

    def _turn(self, wait_s: float) -> None:
        """Wait for something to come, and pass it on."""
        for ready, events in self._poll.poll(1000 * wait_s):
            if ready == self._control.fileno():
                self._told()
            elif ready == self._near:
                self._from_driver()
            elif ready == self._port:
                self._from_robot(events)

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
            self._trip("the trial's process is gone" if not said else "the trial ended without a confirmed stop")

    def _from_driver(self) -> None:
        data = os.read(self._near, 4096)
        if self.why and self._own_stop.search(data):
            self._tell("taken-back", why=self.why)
            self.why = ""
        if not self.why:
            self._write(self._port, data)

    def _from_robot(self, events: int) -> None:
        try:
            data = os.read(self._port, 4096) if events & select.POLLIN else b""
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
            self._write(self._near, data)

    def _write(self, line: int, data: bytes) -> None:
        """All of it, but what a line that takes nothing for a while would hold up."""
        end_s = time.monotonic() + _WRITE_S
        while data and line >= 0:
            try:
                data = data[os.write(line, data) :]
            except BlockingIOError:
                if time.monotonic() > end_s:
                    return
                time.sleep(0.002)
            except OSError:
                if line == self._port:
                    self._lose()
                return

    def _lose(self) -> None:
        self._unplug()
        self._tell("port-lost")
        if self._armed:
            self._trip("the port is gone")

    def _reopen(self) -> None:
        if time.monotonic() - self._tried_s < _AGAIN_S:
            return
        self._tried_s = time.monotonic()
        with contextlib.suppress(OSError):
            self._plug(opened(self._setup["port"], self._setup["baud"]))
            self._tell("port-back")
        self._give_up()

    def _give_up(self) -> None:
        """Nothing was moving, and nothing answers: it stands, and keeping the port would serve nobody."""
        if self._gone and not self._armed and time.monotonic() - self._tripped_s > _STANDS_S:
            self._still = True

    def _listens(self) -> bool:
        """Whether the robot may be spoken to: a board that starts when its port is opened must not be disturbed."""
        return self._spoke or time.monotonic() - self._plugged_s >= self._setup["stop"]["quiet_s"]

    def _plug(self, port: int) -> None:
        """Take a port, and make the line that the driver opens instead of it."""
        self._port, self._plugged_s, self._spoke = port, time.monotonic(), False
        self._near, self._far = os.openpty()
        tty.setraw(self._far)
        os.set_blocking(self._near, False)
        for line in (self._port, self._near):
            self._poll.register(line, select.POLLIN)
        link = Path(self._setup["link"])
        with contextlib.suppress(OSError):
            new = link.with_suffix(".new")
            new.unlink(missing_ok=True)
            new.symlink_to(os.ttyname(self._far))
            new.replace(link)

    def _unplug(self) -> None:
        with contextlib.suppress(OSError):
            Path(self._setup["link"]).unlink(missing_ok=True)
        for line in (self._port, self._near):
            if line >= 0:
                self._poll.unregister(line)
        for line in (self._port, self._near, self._far):
            if line >= 0:
                os.close(line)
        self._port = self._near = self._far = -1

    def _round(self) -> None:
        """Order the robot to stand, ask whether it does; twice in a row, and it is confirmed."""
        values: list[int] | None = []
        for send, reply in self._steps:
            found = self._asked(send, reply)
            if not self.why or self._port < 0:
                return
            values = values + found if values is not None and found is not None else None
        self._good = self._good + 1 if values is not None and self._stands(values) else 0
        self._before = values
        if values is None:
            self._wait_s = min(2.0 * self._wait_s, self._setup["stop"]["longest_s"])
        if self._good >= _READINGS:
            self._still, self._armed = True, False
            self._tell("stopped", why=self.why, seconds=round(time.monotonic() - self._tripped_s, 4))

    def _asked(self, send: bytes, reply: re.Pattern[bytes] | None) -> list[int] | None:
        """The numbers in the answer; None if none comes in time, or the driver has taken the robot back."""
        self._heard = b""
        self._write(self._port, send)
        if reply is None:
            return []
        end_s = time.monotonic() + self._wait_s
        while self.why and self._port >= 0:
            if (match := reply.search(self._heard)) is not None:
                return [self._number(group) for group in match.groups()]
            if (left_s := end_s - time.monotonic()) <= 0:
                return None
            self._turn(min(left_s, TICK_S))
        return None

    def _number(self, group: bytes) -> int:
        return int(group) if self._setup["stop"]["text"] else int.from_bytes(group, "little")

    def _stands(self, values: list[int]) -> bool:
        """Every speed is small, or every place is that of the round before."""
        within = self._setup["stop"]["within"]
        if self._setup["stop"]["text"]:
            return all(abs(value) <= within for value in values)
        if self._before is None:
            return False
        return all(abs(a - b) <= within for a, b in zip(values, self._before, strict=True))


def main() -> None:
    """Take the set-up from standard input, guard, end."""
    for number in (signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU, signal.SIGPIPE):
        signal.signal(number, signal.SIG_IGN)
    control = socket.socket(fileno=os.dup(0))
    line = b""
    while not line.endswith(b"\n"):
        byte = control.recv(1)
        if not byte:
            return
        line += byte
    guard = Guard(json.loads(line), control)
    try:
        guard.first_open()
        control.sendall(b'{"kind": "ready"}\n')
    except OSError as error:
        control.sendall((json.dumps({"kind": "refused", "errno": error.errno, "what": str(error)}) + "\n").encode())
        guard.close()
        return
    try:
        guard.run()
    finally:
        guard.close()


if __name__ == "__main__":
    main()
    sys.exit(0)
