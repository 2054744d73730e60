"""The trial of a robot that a test kills, stops, hangs or unplugs: a process forked by `python -m tests.hardware.forked_trial`.

It has a terminal of its own. A shell between it and the test tells what becomes of it.
"""

import json
import os
import pty
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from functools import partialmethod
from pathlib import Path

import numpy as np

from bns.errors import BnsError
from bns.hardware.clock import RealClock
from bns.hardware.guard import client as guard_client
from bns.hardware.guard.client import GuardedClock
from bns.hardware.platforms import khepera, snake
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping, Surface
from bns.hardware.servos.bridge import BridgeChain
from bns.hardware.servos.dynamixel import DynamixelChain
from bns.hardware.tracking.sight import Sight
from bns.hardware.wheels.khepera import KheperaIII
from bns.robots.khepera import UNITS_PER_M_S
from bns.trial.session import TrialSetup, open_rig

from .robots_on_the_line import hold_terminal

HANGS_S = 60.0
"""Only a hang takes so long."""


class Glances:
    """A tracker of a robot that goes about its business: a snake that wriggles, a Khepera on the circle that it was sent on.

    `frozen` is "bits" when the camera's last picture comes again and again, "scene" when only a clock in it goes on.
    """

    frozen = ""
    sent_s = None
    patient = False

    def __init__(self, clock, wheels):
        self._clock, self._wheels, self._filmed_s, self._last = clock, wheels, 0.0, None

    @property
    def picture_s(self):
        """A patient trial's camera that is not frozen has just sent one, however late this process comes to ask."""
        return self._clock.now_s() if self.patient and self.frozen != "bits" else self._last.t_s

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


def standing_after(stop):
    """The driver's stop, after which the tracker sees a robot that stands."""

    def stopped(self):
        found = stop(self)
        Glances.frozen = Glances.frozen or "scene"
        return found

    return stopped


def answered_or_over(self, seconds):
    """`GuardedClock.in_vain`, but that an answer is waited for until the guard passes none on any more.

    The robot is a thread of a test, and may have to wait for its turn for longer than a driver waits for a robot.
    """
    over = RealClock.in_vain(self, seconds)
    hangs = RealClock.in_vain(self, max(seconds, HANGS_S))
    return lambda: hangs() or (over() and self._guard.tripped() is not None)


def freeze(what):
    def freezes(*_):
        Glances.frozen = what

    return freezes


def drive(link, port, journal, patient):
    """The trial's process: drives for ever, and hangs when a signal says so.

    `patient`: a computer that is too busy for its limits stops nothing, so that only what befalls it does.
    """
    Glances.patient = patient
    robot = "khepera" if link == "serial" else "snake"
    wheels = np.array([15000.0, 20000.0]) / UNITS_PER_M_S if link == "serial" else None
    khepera.open_tracker = snake.open_tracker = lambda _settings, clock: Glances(clock, wheels)
    KheperaIII.set_speed_m_s = knowing_when(KheperaIII.set_speed_m_s)
    KheperaIII.stop = standing_after(KheperaIII.stop)
    rig = shipped_rig(robot)
    settings = {} if robot == "khepera" else {**rig.driver, "wiring": link}
    everywhere = replace(rig.limits, surface=Surface(-9.0, 9.0, -9.0, 9.0))
    if patient:
        everywhere = replace(everywhere, silent_s=HANGS_S, late_s=HANGS_S, lost_s=HANGS_S)
        settings = settings | ({"most_reply_s": HANGS_S} if robot == "khepera" else {})
        guard_client._READY_S = HANGS_S
        GuardedClock.in_vain = answered_or_over
        for chain in (DynamixelChain, BridgeChain):
            chain.stop = partialmethod(chain.stop, HANGS_S)
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
            code = drive(asked["link"], asked["port"], asked["journal"], asked["patient"])
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
        self._folder = tempfile.TemporaryDirectory()
        self.slept = Path(self._folder.name) / "slept"
        self._zygote = subprocess.Popen(
            [sys.executable, "-m", "tests.hardware.forked_trial"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | sleepless(Path(self._folder.name), self.slept),
        )

    def begin(self, link, port, journal, patient=False):
        """Process number and terminal of a new one."""
        terminal, far = pty.openpty()
        asked = {"link": link, "port": str(port), "journal": str(journal), "terminal": os.ttyname(far), "patient": patient}
        self._zygote.stdin.write(json.dumps(asked) + "\n")
        self._zygote.stdin.flush()
        while (said := self._zygote.stdout.readline()).startswith("{"):
            pass  # of one before whose test failed
        number = int(said)
        os.close(far)
        return number, terminal

    def tells(self):
        """Whether something became of it already."""
        return bool(select.select([self._zygote.stdout], [], [], 0)[0])

    def heard(self):
        """What became of it: it stopped, or ended."""
        assert select.select([self._zygote.stdout], [], [], HANGS_S)[0], "the trial's process hangs"
        return json.loads(self._zygote.stdout.readline())

    def close(self):
        self._zygote.stdin.close()
        self._zygote.stdout.close()
        self._zygote.wait(HANGS_S)
        self._folder.cleanup()


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


def sleepless(folder, slept):
    """The environment of processes that take the computer to have slept for so many seconds as stand in a file; empty where no
    compiler can make that."""
    if shutil.which("gcc") is None:
        return {}
    made = folder / "slept.so"
    source = Path(__file__).parent / "slept.c"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O1", "-Wall", "-Werror", str(source), "-o", str(made), "-ldl"], check=True)
    return {"LD_PRELOAD": str(made), "SLEPT": str(slept)}


if __name__ == "__main__":
    zygote()
