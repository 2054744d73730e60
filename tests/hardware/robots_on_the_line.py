"""Emulated robots in this process at real time, for a trial in another one: what is there when the trial is gone."""

import fcntl
import os
import termios
import threading
import time

import numpy as np

from bns.engine.philox import Key
from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.body import DifferentialBody
from bns.hardware.emulators.devices.bridge import BridgeEmulator
from bns.hardware.emulators.devices.bus import Bus
from bns.hardware.emulators.devices.khepera import KheperaEmulator
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.emulators.faults import Faults
from bns.hardware.servos.bridge_frames import WATCHDOG_S
from bns.hardware.wheels.khepera import firmware
from bns.physics.model import load_model
from bns.robots.khepera import START

from .manual_bus import DELAY, TORQUE, ManualBus, ManualServo
from .manual_khepera import ManualKhepera

LINKS = ("serial", "bus", "bridge")
_WAY_S = 0.01
"""Of a manual's Khepera, one way."""
STILL_M_S = 0.005


class WorldsClock(EmulatedClock):
    """The computer's clock for emulated devices: they act by themselves while somebody else waits."""

    def __init__(self):
        super().__init__()
        self._began_s = time.monotonic()
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._tick, daemon=True)
        self._thread.start()

    def now_s(self):
        return time.monotonic() - self._began_s

    def sleep(self, seconds):
        time.sleep(max(seconds, 0.0))

    def waited(self, seconds):
        pass

    def _tick(self):
        while not self._ends.wait(0.01):
            self._tell()

    def close(self):
        self._ends.set()
        self._thread.join()


class Robot:
    """A robot at the end of a link; `path` is its port. All that was written to it is in `heard`, with times.

    `watchdog_s` is a bridge's.
    """

    def __init__(self, link, folder, watchdog_s=WATCHDOG_S):
        self.link, self.clock, self.heard = link, WorldsClock(), []
        self._bridge = None
        if link == "serial":
            self.body = DifferentialBody(load_model("khepera-world"), Key.of_run(1, 0, "khepera", "circle"), START)
            self.body.put_down(START, self.clock.now_s())
            self._device = KheperaEmulator(self.body, self.clock, firmware(2, 4), latency_s=0.02)
        else:
            self.servos = [Servo(n, self.clock, Faults()) for n in range(1, 13)]
            if link == "bridge":
                self._device = self._bridge = BridgeEmulator(self.servos, self.clock, watchdog_s=watchdog_s)
            else:
                self._device = Bus(self.servos, self.clock)
        self.line = PseudoTerminal(self, folder, link)
        self.path = self.line.path
        if self._bridge is not None:
            self._bridge.send = lambda data: os.write(self.line._master, data)  # the guard reads at once: nothing to wait for

    def plug_in(self):
        """After `line.cut`; a bridge begins anew."""
        if self._bridge is not None:
            self._bridge.opened()
        self.line.plug_in()

    def receive(self, data):
        self.heard.append((time.monotonic(), data))
        return self._device.receive(data)

    def written(self):
        self._device.written()

    def moves(self):
        """Whether it goes, or has the power to."""
        if self.link == "serial":
            return max(np.abs(self.body.wheel_speeds_m_s(self.clock.now_s()))) > STILL_M_S
        return any(servo.get("torque_enable") for servo in self.servos)

    def until(self, moving, patience_s=60.0, why_never=lambda: ""):
        """Wait until it moves or stands; when that was. AssertionError after a time that only a hang can take, or with what
        `why_never` says."""
        end_s = time.monotonic() + patience_s
        while self.moves() != moving:
            assert not (why := why_never()), f"the robot {'never moved' if moving else 'never stood'}: {why}"
            assert time.monotonic() < end_s, f"the robot {'never moved' if moving else 'never stood'}"
            time.sleep(0.002)
        return time.monotonic()

    def close(self):
        if self._bridge is not None:
            self._bridge.close()
        self.line.close()
        self.clock.close()


class ManualRobot(Robot):
    """A robot written from the makers' manuals alone: a Khepera, or twelve servos on a bus."""

    def __init__(self, link, folder):
        self.link, self.clock, self.heard, self._bridge = link, WorldsClock(), [], None
        self._khepera = ManualKhepera() if link == "serial" else None
        self._bus = None if link == "serial" else ManualBus([ManualServo(number) for number in range(1, 13)])
        if self._bus is not None:
            for servo in self._bus.servos:
                servo.table[DELAY] = 0
        self._turning = threading.Lock()
        self.line = PseudoTerminal(self, folder, link)
        self.path = self.line.path

    def receive(self, data):
        self.heard.append((time.monotonic(), data))
        if self._bus is None:
            time.sleep(_WAY_S)  # there; and back, below
            self.moves()
            answer = self._khepera.hears(data)
            time.sleep(_WAY_S)
            return answer
        answers = b""
        for byte in data:
            later_s, answer = self._bus.heard(self.clock.now_s(), byte)
            answers += answer
            time.sleep(later_s if answer else 0.0)
        return answers

    def written(self):
        pass

    def moves(self):
        if self._bus is not None:
            return any(servo.table[TORQUE] for servo in self._bus.servos)
        with self._turning:
            self._khepera.turn(self.clock.now_s())
        return max(np.abs(self._khepera.wheels_m_s)) > STILL_M_S


class DistantRobot(Robot):
    """A Khepera whose link takes its time: `delay_s` there and back, `jitter` of that (an exponential tail), in order.

    `loss` of the messages never arrive, either way.
    """

    def __init__(self, folder, delay_s, jitter, loss, seed=0):
        self._delay_s, self._jitter, self._loss = delay_s, jitter, loss
        self._draw = np.random.default_rng(seed)
        self._due, self._turn, self._ends = [], threading.Condition(), False
        self._last_s = {"there": 0.0, "back": 0.0}
        super().__init__("serial", folder)
        self._device._latency_s = 0.0
        self._carrier = threading.Thread(target=self._carry, daemon=True)
        self._carrier.start()

    def receive(self, data):
        self._send("there", data)
        return b""

    def _send(self, way, data):
        with self._turn:
            if self._draw.random() < self._loss:
                return
            late_s = self._delay_s / 2 + self._draw.exponential(self._jitter * self._delay_s / 2)
            self._last_s[way] = max(time.monotonic() + late_s, self._last_s[way])
            self._due.append((self._last_s[way], way, data))
            self._due.sort(key=lambda one: one[0])
            self._turn.notify()

    def _carry(self):
        while not self._ends:
            with self._turn:
                wait_s = self._due[0][0] - time.monotonic() if self._due else 0.1
                if wait_s > 0:
                    self._turn.wait(min(wait_s, 0.1))
                    continue
                _, way, data = self._due.pop(0)
            if way == "back":
                self.line.send(data)
            elif answer := super().receive(data):
                self._send("back", answer)

    def close(self):
        self._ends = True
        self._carrier.join()
        super().close()


def hold_terminal(slave):
    """Make the terminal that of this process: for a child, after fork."""
    os.setsid()
    fcntl.ioctl(slave, termios.TIOCSCTTY, 0)
    for number in (0, 1, 2):
        os.dup2(slave, number)
