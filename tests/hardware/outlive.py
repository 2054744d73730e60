"""Whether a robot outlives its supervisor: `python -m tests.hardware.outlive 20` kills, stops, hangs and unplugs so often each.

The emulated robot lives in this process, the trial in another one, the guard in a third. Time is the computer's.
"""

import fcntl
import json
import os
import pty
import select
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bns.errors import BnsError
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.guard.client import Guard
from bns.hardware.guard.recipe import khepera_recipe
from bns.hardware.platforms import khepera, snake
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping, Surface
from bns.hardware.tracking.sight import Sight
from bns.hardware.wheels.khepera import KheperaIII
from bns.robots.khepera import UNITS_PER_M_S
from bns.trial.session import TrialSetup, open_rig

from .robots_on_the_line import LINKS, Robot, hold_terminal

HANGS_S = 60.0
"""Only a hang takes so long."""


class Seen(NamedTuple):
    """Seconds from the cause until the robot stood; how the trial's process ended, and what it said; the guard's log.

    Where the link was away, `still_s` counts from its return; `alone_s` from the cause, of a robot that stood before that.
    """

    still_s: float
    ended: int
    said: str
    events: list
    alone_s: float = float("nan")


class Glances:
    """A tracker of a robot that goes about its business: a snake that wriggles, a Khepera on the circle that it was sent on.

    `frozen` is "bits" when the camera's last picture comes again and again, "scene" when only a clock in it goes on.
    """

    frozen = ""
    sent_s = None

    def __init__(self, clock, wheels):
        self._clock, self._wheels, self._filmed_s, self._last = clock, wheels, 0.0, None

    @property
    def picture_s(self):
        return self._last.t_s

    def look(self):
        now_s = self._clock.now_s()
        if not self.frozen:
            self._filmed_s = now_s
        if self.frozen != "bits":
            self._last = self._seen(now_s)
        return self._last

    def _seen(self, now_s):
        if self._wheels is None:
            middle = 0.05 * np.array([np.sin(5.0 * self._filmed_s), np.cos(5.0 * self._filmed_s)])  # never at rest
            half = np.array([0.0, 0.3])
            points = {"yellow": middle - half, "green": middle + half}
            return Sight(now_s, np.array([*middle, np.pi / 2]), 0.0, points)
        left, right = self._wheels
        turned = (right - left) / 0.0884 * (0.0 if Glances.sent_s is None else self._filmed_s - Glances.sent_s)
        radius_m = 0.0884 / 2 * (right + left) / (right - left)
        middle = np.array([-radius_m, 0.0])
        place = middle + radius_m * np.array([np.cos(turned), np.sin(turned)])
        return Sight(now_s, np.array([*place, np.pi / 2 + turned]))

    def close(self):
        pass


def knowing_when(set_speed):
    """The driver's order, noted when it was carried out."""

    def ordered(self, left, right):
        sent = set_speed(self, left, right)
        Glances.sent_s = self._clock.now_s()
        return sent

    return ordered


def freeze(what):
    def freezes(*_):
        Glances.frozen = what

    return freezes


def drive(link, port, journal):
    """The trial's process: drives for ever, and hangs when a signal says so."""
    robot = "khepera" if link == "serial" else "snake"
    wheels = np.array([15000.0, 20000.0]) / UNITS_PER_M_S if link == "serial" else None
    khepera.open_tracker = snake.open_tracker = lambda _settings, clock: Glances(clock, wheels)
    KheperaIII.set_speed_m_s = knowing_when(KheperaIII.set_speed_m_s)
    rig = shipped_rig(robot)
    settings = {} if robot == "khepera" else {**rig.driver, "wiring": link}
    everywhere = replace(rig.limits, surface=Surface(-9.0, 9.0, -9.0, 9.0))
    rig = replace(rig, port=port, driver=settings, limits=everywhere)
    signal.signal(signal.SIGRTMIN, freeze("bits"))
    signal.signal(signal.SIGRTMIN + 1, freeze("scene"))
    signal.signal(signal.SIGUSR1, lambda *_: time.sleep(3600))
    commands = np.array([[15000.0, 20000.0, 1e6]] if robot == "khepera" else 999 * [[0.5, 0.3, 0.5, 0.5, 1.0]], np.float32)
    try:
        with Stopping() as stopping, open_rig(TrialSetup(rig, yes=True), 0, Path(journal), stopping) as opened:
            opened.platform.drive(commands)
    except BnsError as error:
        Path(journal).with_name("said").write_text(str(error))
        return error.exit_code
    return 0


def zygote():
    """Forks a shell and a trial for every line on standard input: imports cost a second, forks nothing."""
    for line in sys.stdin:
        asked = json.loads(line)
        shell = os.fork()
        if shell == 0:
            try:
                shell_of(asked, os.fdopen(os.dup(1), "w"))
            finally:
                os._exit(0)
        os.waitpid(shell, 0)


def shell_of(asked, out):
    """Holds the terminal, and tells what becomes of the process in its foreground; hands SIGHUP on, as shells do."""
    hold_terminal(os.open(asked["terminal"], os.O_RDWR | os.O_NOCTTY))
    child = os.fork()
    if child == 0:
        os.setpgid(0, 0)
        signal.signal(signal.SIGTTOU, signal.SIG_IGN)
        os.tcsetpgrp(0, os.getpgrp())
        code = 70
        try:
            code = drive(asked["link"], asked["port"], asked["journal"])
        finally:
            os._exit(code)
    signal.signal(signal.SIGHUP, lambda *_: os.kill(child, signal.SIGHUP))
    print(child, file=out, flush=True)
    _, status = os.waitpid(child, os.WUNTRACED)
    while os.WIFSTOPPED(status):
        print(json.dumps({"stopped": os.WSTOPSIG(status)}), file=out, flush=True)
        _, status = os.waitpid(child, os.WUNTRACED)
    print(json.dumps({"ended": os.waitstatus_to_exitcode(status)}), file=out, flush=True)


class Nursery:
    """Trials in processes of their own, each with a terminal of its own."""

    def __init__(self):
        self._zygote = subprocess.Popen(
            [sys.executable, "-m", "tests.hardware.outlive", "zygote"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def begin(self, link, port, journal):
        """Process number and terminal of a new one."""
        terminal, far = pty.openpty()
        asked = {"link": link, "port": str(port), "journal": str(journal), "terminal": os.ttyname(far)}
        self._zygote.stdin.write(json.dumps(asked) + "\n")
        self._zygote.stdin.flush()
        number = int(self._zygote.stdout.readline())
        os.close(far)
        return number, terminal

    def heard(self):
        """What became of it: it stopped, or ended."""
        assert select.select([self._zygote.stdout], [], [], HANGS_S)[0], "the trial's process hangs"
        return json.loads(self._zygote.stdout.readline())

    def close(self):
        self._zygote.stdin.close()
        self._zygote.stdout.close()
        self._zygote.wait(HANGS_S)


def end_of(nursery, terminal):
    """Exit status; what it prints until then is read, so that it does not wait for that."""
    end_s = time.monotonic() + HANGS_S
    while not select.select([nursery._zygote.stdout], [], [], 0.01)[0]:
        assert time.monotonic() < end_s, "the trial's process hangs"
        if terminal is not None and select.select([terminal], [], [], 0)[0]:
            try:
                os.read(terminal, 4096)
            except OSError:
                terminal = None
    return nursery.heard()


def _signalled(number):
    def cause(robot, process, terminal):
        os.kill(process, number)

    return cause


def _typed(key):
    def cause(robot, process, terminal):
        os.write(terminal, key)

    return cause


def _closed(robot, process, terminal):
    os.close(terminal)


def _unplugged(robot, process, terminal):
    robot.line.cut()


def _killed_and_unplugged(robot, process, terminal):
    robot.line.cut()
    os.kill(process, signal.SIGKILL)


CAUSES = {
    "SIGKILL": _signalled(signal.SIGKILL),
    "SIGSTOP": _signalled(signal.SIGSTOP),
    "SIGHUP": _signalled(signal.SIGHUP),
    "SIGTERM": _signalled(signal.SIGTERM),
    "Ctrl-C": _typed(b"\x03"),
    "Ctrl-\\": _typed(b"\x1c"),
    "Ctrl-Z": _typed(b"\x1a"),
    "terminal closed": _closed,
    "hang": _signalled(signal.SIGUSR1),
    "camera frozen (bits)": _signalled(signal.SIGRTMIN),
    "camera frozen (scene)": _signalled(signal.SIGRTMIN + 1),
    "link gone": _unplugged,
    "link gone, then SIGKILL": _killed_and_unplugged,
}
_ARMED_S = 4.0
"""By then the servos have their torque and the body is straight; before, nothing depends on the camera."""
SURVIVES = {"SIGSTOP", "hang"}
GONE_S = {"link gone": 1.0, "link gone, then SIGKILL": 1.0}
"""How long the link stays away; the time until the robot stands counts from its return."""


def outlived(nursery, link, cause, folder, gone_s=0.0):
    """One trial that this befell while its robot moved; AssertionError if the robot went on, or anything is left over."""
    robot = Robot(link, folder)
    try:
        still_s, alone_s, ended = _befell(nursery, robot, cause, folder, gone_s)
        _guard_ends(robot, folder)
    except BaseException:
        for event in _events(folder):  # it would try for ever, at a port that another one may have by then
            with suppress(KeyError, ProcessLookupError):
                os.kill(event["guard"], signal.SIGKILL)
        raise
    finally:
        moves = robot.moves()
        robot.close()
    assert not moves
    said = folder / "said"
    return Seen(still_s, ended, said.read_text() if said.exists() else "", _events(folder), alone_s)


def _befell(nursery, robot, cause, folder, gone_s):
    process, terminal = nursery.begin(robot.link, robot.path, folder / "journal.jsonl")
    try:
        robot.until(True, HANGS_S)
        time.sleep(_ARMED_S if cause.startswith("camera") and robot.link != "serial" else 0.25)
        began_s = time.monotonic()
        CAUSES[cause](robot, process, terminal)
        alone_s = float("nan")
        if cause in GONE_S:
            end_s = began_s + (gone_s or GONE_S[cause])
            while (now_s := time.monotonic()) < end_s and robot.moves():
                time.sleep(0.002)
            alone_s = now_s - began_s if now_s < end_s else alone_s
            time.sleep(max(0.0, end_s - time.monotonic()))
            robot.plug_in()
            began_s = time.monotonic()
        still_s = robot.until(False, HANGS_S) - began_s
        return still_s, alone_s, _end(nursery, cause, process, None if cause == "terminal closed" else terminal)
    finally:
        if cause != "terminal closed":
            os.close(terminal)


def _events(folder):
    log = folder / "guard.jsonl"
    return [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []


def _end(nursery, cause, process, terminal):
    if cause in SURVIVES:
        if cause == "SIGSTOP":
            assert "stopped" in nursery.heard()
        os.kill(process, signal.SIGKILL)
    if cause == "Ctrl-Z":
        assert end_of(nursery, terminal) == {"stopped": signal.SIGTSTP}
        os.kill(process, signal.SIGCONT)
    return end_of(nursery, terminal)["ended"]


def _guard_ends(robot, folder):
    """Whatever made it act has come to its end, and nobody holds the port any more."""
    end_s = time.monotonic() + HANGS_S
    while time.monotonic() < end_s:
        events = _events(folder)
        if not events or events[-1]["kind"] in {"stopped", "taken-back"}:
            line = os.open(robot.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            with suppress(BlockingIOError):
                fcntl.flock(line, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.close(line)
                return
            os.close(line)
        time.sleep(0.01)
    raise AssertionError("the guard never gave the port free")


def way_s(path, count=300):
    """Seconds that a byte takes to a device that answers at once, and back; sorted."""
    line, took = os.open(path, os.O_RDWR | os.O_NOCTTY), []
    for _ in range(count):
        began_s = time.perf_counter()
        os.write(line, b"x")
        os.read(line, 1)
        took.append(time.perf_counter() - began_s)
        time.sleep(0.002)
    os.close(line)
    return np.sort(took)


class Echo:
    """A device that answers what it hears."""

    def receive(self, data):
        return data

    def written(self):
        pass


def latency_s(folder):
    """What the guard adds to a question and its answer: median and 99th percentile."""
    with PseudoTerminal(Echo(), folder, "echo") as line:
        bare = way_s(line.path)
        guard = Guard(str(line.path), khepera_recipe(115200, 720), 0.3)
        guarded = way_s(guard.path)
        guard.close()
    return [float(np.quantile(guarded, q) - np.quantile(bare, q)) for q in (0.5, 0.99)]


def main(count, causes=()):
    with tempfile.TemporaryDirectory() as folder:
        median_s, most_s = latency_s(Path(folder))
    print(f"The guard adds {1000 * median_s:.2f} ms at the median, {1000 * most_s:.2f} ms at the 99th percentile.")
    nursery, causes = Nursery(), causes or CAUSES
    print("| cause | link | times | stood after, ms: median, worst | within 500 ms | the trial's process ended with |")
    print("|---|---|---|---|---|---|")
    for cause in causes:
        for link in LINKS:
            seen = []
            for _ in range(count):
                with tempfile.TemporaryDirectory() as folder:
                    seen.append(outlived(nursery, link, cause, Path(folder)))
            took_ms = 1000 * np.array([s.still_s for s in seen])
            ends = ", ".join(sorted({str(s.ended) for s in seen}))
            took = f"{np.median(took_ms):.0f}, {took_ms.max():.0f} | {(took_ms <= 500).sum()}"
            alone_ms = 1000 * np.array([s.alone_s for s in seen])
            alone = f" by itself {np.median(alone_ms):.0f}, {alone_ms.max():.0f} after the cause"
            alone = alone if np.isfinite(alone_ms).all() else ""
            print(f"| {cause} | {link} | {count} | {took} | {ends} |{alone}", flush=True)
    nursery.close()


if __name__ == "__main__":
    zygote() if sys.argv[1] == "zygote" else main(int(sys.argv[1]), sys.argv[2:])
