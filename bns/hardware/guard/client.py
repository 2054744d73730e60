"""A robot's guard as its trial sees it: a process that owns the port, and must hear from the trial while the robot may move."""

from __future__ import annotations

import json
import os
import select
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from bns.errors import HardwareError, StopNotConfirmedError
from bns.hardware.clock import RealClock
from bns.hardware.guard.holder import CODE
from bns.hardware.guard.line import twins_of
from bns.hardware.guard.recipe import StopRecipe
from bns.hardware.guard.signs import STOPPED, not_running
from bns.hardware.guard.standby import ENDED
from bns.hardware.link.serial_link import no_port, why_not_opened
from bns.hardware.platform import Driven, Platform
from bns.hardware.safety import Stopping
from bns.hardware.stop import Stop

_FOLDER = Path(__file__).parent
_BEAT_S = 0.02
_READY_S = 10.0
_HERE_S = 1.0
"""So long who stands by may take to say that it has taken over; then it is replaced: it was stopped, or killed as well."""
_ENDS_S = 2.0
_AGAIN_S = 1.0
_SLICE_S = 0.05


class _Process(NamedTuple):
    """A guard's process, which waits for its set-up, and the socket to it.

    One stands by while another guards: to start the interpreter takes a busy computer longer than to stop a robot.
    """

    process: subprocess.Popen[bytes]
    control: socket.socket
    watch: socket.socket
    """Tells who stands by whether it ended, or was killed."""

    @classmethod
    def begun(cls, watched: socket.socket | None = None) -> Self:
        """A new one; it ends when the socket is closed. ``watched``: over which it hears of the process that it stands by for.

        OSError where the system lets no further process begin.
        """
        with ExitStack() as far_ends, ExitStack() as near_ends:
            control, far = socket.socketpair()
            near_ends.enter_context(control)
            far_ends.enter_context(far)
            ends, watch = socket.socketpair()
            near_ends.enter_context(watch)
            far_ends.enter_context(ends)
            inherited = [ends.fileno(), *([] if watched is None else [watched.fileno()])]
            script = [sys.executable, "-I", "-S", "-c", CODE, str(_FOLDER.parent), str(os.getpid()), *map(str, inherited)]
            process = subprocess.Popen(
                script,
                stdin=far.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
                pass_fds=inherited,
            )
            near_ends.pop_all()  # they stay open
        return cls(process, control, watch)

    def say(self, what: bytes) -> None:
        """Tell it; one that was killed hears nothing."""
        with suppress(OSError):
            self.control.send(what)

    def first_word(self, within_s: float) -> bytes:
        """What it says first; nothing if it says nothing in time, was killed, or was stopped at two looks in a row."""
        end_s, stopped = time.monotonic() + within_s, False
        while (left_s := end_s - time.monotonic()) > 0:
            before, stopped = stopped, not_running(self.process.pid) == STOPPED
            if before and stopped:
                break
            self.control.settimeout(min(left_s, _SLICE_S))
            try:
                return self.control.recv(4096)
            except TimeoutError:
                continue
            except OSError:
                break
        return b""

    def let_go(self) -> None:
        """Its trial ends: it stays as long as there is a guard to stand by for."""
        self.control.close()
        self.watch.close()

    def end(self) -> None:
        """Not needed."""
        self.say(b"g")
        self.let_go()
        self.gone()

    def gone(self) -> None:
        """Wait until it has ended; one that was stopped (SIGSTOP) is killed."""
        try:
            self.process.wait(_ENDS_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Guard:
    """Starts the process, tells it that the trial lives, and hears when it has stopped the robot.

    `path` is the port to give to the robot's driver. A trial that gives no sign of life for `silent_s` is taken to hang. What
    the guard does is written into `log`. A guard that was killed or stopped is replaced by one that stands by, which stops the
    robot at once; who stands by is replaced, too. One whose trial is gone goes on trying to stop the robot until that has not
    been heard for `gives_up_s`. `sysfs` is where the system tells which device a port is.
    """

    def __init__(
        self,
        port: str,
        recipe: StopRecipe,
        silent_s: float,
        log: Path | None = None,
        gives_up_s: float = 14400.0,
        sysfs: str = "/sys",
    ) -> None:
        self._port, self._recipe, self._log = port, recipe, log
        self._setup: dict[str, Any] = {"silent_s": silent_s, "gives_up_s": gives_up_s, "sysfs": sysfs, "identity": None}
        self.path = ""
        self._armed, self._told_s, self._tried_s, self._replaced_s = False, 0.0, 0.0, 0.0
        self._stopped = self._next_stopped = False
        self._why: str | None = None
        self.left: list[int] = []
        """Processes that go on trying to stop the robot when the trial ends, the guard's first."""
        self._next: _Process | None = None
        if not Path(port).exists():
            raise HardwareError(no_port(port))
        self._setup["twins"] = twins_of(port, sysfs)
        self._start()
        self._next = self._standing_by()

    def _standing_by(self) -> _Process | None:
        """A process that takes over by itself where the guard is lost; without one, the drive ends."""
        try:
            begun = _Process.begun(self._watch)
        except OSError as error:
            self._why = self._why or f"no process can be started that stands by for the robot's guard: {error}"
            return None
        begun.say((json.dumps(self._told() | {"standby": True, "guard": self._process.pid}) + "\n").encode())
        if self._armed:
            begun.say(b"a")
        return begun

    def _told(self) -> dict[str, Any]:
        """The set-up of a guard's process."""
        told = self._setup | {"port": self._port, "link": self.path, "process": os.getpid()}
        return told | {"log": self._log and str(self._log.absolute()), "stop": self._recipe.as_json()}

    def _start(self) -> None:
        folder = Path(self.path).parent if self.path else Path(tempfile.mkdtemp(prefix="bns-guard-"))
        self.path = str(folder / (Path(self._port).name or "port"))  # messages name it
        answer = self._begin(folder)
        self._control.setblocking(False)
        if answer["kind"] == "refused":
            self._gone(folder)
            raise HardwareError(why_not_opened(self._port, OSError(answer["errno"], answer["what"])))
        self._setup["identity"] = answer["identity"]

    def _begin(self, folder: Path) -> dict[str, Any]:
        """What a new process answers to its set-up."""
        try:
            self._process, self._control, self._watch = _Process.begun()
        except OSError as error:
            raise HardwareError(f"no process can be started that guards {self._port}: {error}. End other programs.") from error
        self._said = b""
        folder.mkdir(exist_ok=True)
        self._control.sendall((json.dumps(self._told()) + "\n").encode())
        return self._first_answer()

    def _gone(self, folder: Path) -> None:
        self._control.close()
        self._watch.close()
        self._process.wait(_READY_S)
        with suppress(OSError):
            folder.rmdir()

    def _first_answer(self) -> dict[str, Any]:
        self._control.settimeout(_READY_S)
        while b"\n" not in self._said:
            with suppress(TimeoutError):
                said = self._control.recv(4096)
                self._said += said
                if said:
                    continue
            self._process.kill()
            self._gone(Path(self.path).parent)
            raise HardwareError(f"the guard of {self._port} did not start within {_READY_S:g} s; is the computer overloaded?")
        line, self._said = self._said.split(b"\n", 1)
        return dict(json.loads(line))

    @property
    def process(self) -> int:
        """Number of the guard's process."""
        return self._process.pid

    def beat(self) -> None:
        """The trial lives; often enough at most."""
        now_s = time.monotonic()
        if now_s - self._told_s >= _BEAT_S:
            self._told_s = now_s
            before, self._stopped = self._stopped, not_running(self._process.pid) == STOPPED
            if before and self._stopped:
                self._process.kill()  # who stands by takes over
            self._tell(b".")
            self._listen()
            self._keep_next()

    def arm(self) -> None:
        """The robot may move from now on."""
        self._armed = True
        if self._next is not None:  # first: a robot that stands is stopped rather than one that moves left alone
            self._next.say(b"a")
        self._tell(b"a")

    def still(self) -> None:
        """It was confirmed to stand."""
        self._armed = False
        self._tell(b"s")
        if self._next is not None:
            self._next.say(b"s")

    def stop_now(self) -> None:
        """Have the robot stopped at once, if it may move; the driver's own stop follows. For signal handlers."""
        with suppress(OSError):
            self._control.send(b"t")

    def tripped(self) -> str | None:
        """Why the guard has stopped the robot, if it has."""
        self._listen()
        return self._why

    def close(self) -> bool:
        """Say goodbye; whether the guard has ended. One that goes on still tries to stop the robot; who stands by stays."""
        self._listen()
        standby, self._next = self._next, None
        if standby is not None:  # first: a guard that ends then needs nobody in its place
            standby.let_go()
        with suppress(OSError):
            self._control.send(b"g")
        self._control.close()
        self._watch.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_ENDS_S)
        if self._process.returncode is not None:
            if standby is not None:
                standby.gone()
            return True
        for process in (self._process, *([] if standby is None else [standby.process])):
            self.left.append(process.pid)
            process.returncode = 0  # it outlives this process on purpose
        return False

    def _tell(self, what: bytes) -> None:
        try:
            self._control.send(what)
        except BlockingIOError:
            pass  # it has many signs of life to read already
        except OSError:
            self._restart()

    def _listen(self) -> None:
        if self._control.fileno() < 0 or not select.select([self._control], [], [], 0)[0]:
            return
        try:
            said = self._control.recv(4096)
        except OSError:
            said = b""
        if not said:
            self._restart()
            return
        *lines, self._said = (self._said + said).split(b"\n")
        for line in lines:
            event = json.loads(line)
            if event["kind"] == "tripped":
                self._why = self._why or f"the guard stopped the robot: {event['why']}"

    def _keep_next(self) -> None:
        """Replace who stands by, if it was killed or stopped."""
        if self._next is None or time.monotonic() - self._replaced_s < _AGAIN_S:
            return
        before, self._next_stopped = self._next_stopped, not_running(self._next.process.pid) == STOPPED
        if before and self._next_stopped:
            self._next.process.kill()
        try:
            said = self._next.control.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT)
        except BlockingIOError:
            return
        except OSError:
            said = b""
        if not said:
            self._replaced_s = time.monotonic()
            self._next.end()
            self._next = self._standing_by()

    def _restart(self) -> None:
        """The guard is lost, and the drive ends: who stood by has the port; if that was lost as well, a new process takes it."""
        self._why = ENDED
        if time.monotonic() - self._tried_s < _AGAIN_S:
            return
        self._tried_s = time.monotonic()
        self._control.close()
        self._watch.close()
        _killed(self._process)
        standby, self._next = self._next, None
        if (standby is not None and self._adopted(standby, _HERE_S)) or self._anew():
            self._next = self._standing_by()

    def _anew(self) -> bool:
        """Whether a new process takes the port and stops the robot; else the driver finds no port, and says so."""
        try:
            begun = _Process.begun()
        except OSError:
            return False
        begun.say((json.dumps(self._told() | {"lost": {"why": self._why, "armed": self._armed}}) + "\n").encode())
        return self._adopted(begun, _READY_S)

    def _adopted(self, begun: _Process, within_s: float) -> bool:
        """Whether a process says in time that it stops the robot; it is the guard then, and else it is killed."""
        self._process, self._control, self._watch = begun
        self._said = begun.first_word(within_s)
        if self._said:
            self._control.setblocking(False)
            return True
        _killed(begun.process)
        self._control.close()
        self._watch.close()
        return False


def _killed(process: subprocess.Popen[bytes]) -> None:
    """Kill a process, and wait until it is gone: not for ever, a port that hangs may hold it."""
    process.kill()
    with suppress(subprocess.TimeoutExpired):
        process.wait(_ENDS_S)


class GuardedClock(RealClock):
    """The computer's clock; whoever asks it for the time in the thread that made it gives a sign of life.

    A driver asks it all the time, waiting for an answer too; a trial that hangs does not.
    """

    def __init__(self, guard: Guard) -> None:
        self._guard, self._owner = guard, threading.get_ident()

    def now_s(self) -> float:
        """Seconds of the steady clock."""
        self._alive()
        return super().now_s()

    def sleep(self, seconds: float) -> None:
        """Sleep, with signs of life in between."""
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0:
            self._alive()
            time.sleep(min(left_s, _SLICE_S))
        self._alive()

    def _alive(self) -> None:
        if threading.get_ident() == self._owner:
            self._guard.beat()


class GuardedPlatform:
    """Implements `bns.hardware.platform.Platform`: another one, whose guard is told when its robot may move."""

    def __init__(self, platform: Platform, guard: Guard, stopping: Stopping) -> None:
        self._platform, self._guard, self._stopping = platform, guard, stopping
        stopping.causes.append(guard.tripped)
        stopping.alarms.append(guard.stop_now)

    @property
    def retries(self) -> int:
        """How often a question was asked again so far."""
        return self._platform.retries

    def pose(self) -> np.ndarray | None:
        """Where the robot stands."""
        return self._platform.pose()

    def readings(self) -> dict[str, float]:
        """Voltages, temperatures."""
        return self._platform.readings()

    def drive(self, commands: np.ndarray) -> Driven:
        """Carry out a controller, guarded until the robot was confirmed to stand.

        Where the guard has stopped the robot, nothing that the drive left counts, and what its driver missed is not the cause.
        """
        return self._guarded(lambda: self._platform.drive(commands))

    @property
    def move_about(self) -> Callable[[float], Any]:
        """Move to and fro, guarded likewise; there is none where the robot's platform has none."""
        move = self._platform.move_about  # type: ignore[attr-defined]
        return lambda seconds: self._guarded(lambda: move(seconds))

    @property
    def lasts_s(self) -> Callable[[np.ndarray], float]:
        """How long commands are expected to take; there is none where the robot's platform has none."""
        lasts: Callable[[np.ndarray], float] = self._platform.lasts_s  # type: ignore[attr-defined]
        return lasts

    def _guarded(self, move: Callable[[], Any]) -> Any:
        self._stopping.check()
        self._guard.arm()
        try:
            driven = move()
        except StopNotConfirmedError:
            raise
        except BaseException:
            self._stands()
            raise
        self._stands()
        return driven

    def _stands(self) -> None:
        self._guard.still()
        if self._guard.tripped():
            self._stopping.check()

    def stop(self) -> Stop:
        """Stop and confirm."""
        self._guard.arm()
        stop = self._platform.stop()
        if stop.confirmed:
            self._guard.still()
        return stop

    def close(self) -> None:
        """Give port and tracker free."""
        self._platform.close()
