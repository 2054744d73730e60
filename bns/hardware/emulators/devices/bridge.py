"""An Arduino bridge at the level of bytes, in front of emulated servos; with its watchdog."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence

from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.faults import Faults
from bns.hardware.servos.bridge_frames import (
    ANGLES,
    ANSWER,
    ARM,
    GOAL,
    HELLO,
    MOVE,
    NO_ANSWER,
    POSITION,
    REFUSED,
    RESTARTED,
    SERVO,
    STATE,
    STOP,
    STOPPED,
    TORN_S,
    VERSION,
    WATCHDOG_S,
    Frame,
    decoded,
    encoded,
)

_LATENCY_S = 0.002
_BYTE_S = 10 / 115_200
BOOT_S = 0.84
"""From the opening of its port to its hello: measured with the boot loader of a Mega 2560 in simavr."""
_HELD_UP_S = 5.0
"""A byte that comes while the boot loader listens makes it wait for more, for so long."""
_SERVO_S = 0.001
"""To ask one of the servos something: some twenty bytes at 1 Mbaud, and the time after which a servo answers by default."""


class BridgeEmulator:
    """The device at the far end of a line. Opening its port starts it anew (`opened`): deaf for `boot_s`, it then says hello."""

    def __init__(
        self,
        servos: Sequence[Servo],
        clock: EmulatedClock,
        faults: Faults | None = None,
        boot_s: float = BOOT_S,
        watchdog_s: float = WATCHDOG_S,
    ) -> None:
        self.servos, self._clock, self._faults = list(servos), clock, faults or Faults()
        self._boot_s, self._awake_s, self._watchdog_s = boot_s, -math.inf, watchdog_s
        self.send: Callable[[bytes], None] = lambda _data: None
        """What it says unasked goes there: to its line."""
        self.boot_loader_heard = False
        """Whether something was said to it while it was starting."""
        self._buffer, self._heard_s, self._byte_s = b"", clock.now_s(), clock.now_s()
        self._armed = self._starting = False
        self._torque = 0
        self._lock = threading.Lock()
        self._answers: dict[int, Callable[[bytes], bytes | None]] = {
            HELLO: lambda _p: self._hello(),
            ARM: self._arm,
            MOVE: self._move,
            STATE: lambda _p: b"".join(self._state(s) for s in self.servos),
            STOP: lambda _p: self._stop(),
        }
        self.cut_line: Callable[[float], None] = lambda _seconds: None
        self.opened()
        clock.listeners.append(self.moved_on)

    def opened(self) -> None:
        """Somebody opens its port."""
        if self._boot_s > 0:
            self._awake_s, self._starting = self._clock.now_s() + self._boot_s, True

    def moved_on(self, now_s: float) -> None:
        """Called by the clock: the end of its start, a frame that is torn, the watchdog."""
        if not self._lock.acquire(blocking=False):  # it is at work on a question
            return
        try:
            if self._starting and now_s >= self._awake_s:
                self._starting = False
                self._stop()
                self.send(encoded(Frame(HELLO | ANSWER, 0, self._hello())))
            if self._buffer and now_s - self._byte_s > TORN_S:
                self.send(self._after_torn())
            silent = not self._starting and now_s - self._heard_s > self._watchdog_s
            if silent and any(servo.get("torque_enable") for servo in self.servos):
                self._stop()
        finally:
            self._lock.release()

    def _after_torn(self) -> bytes:
        """Answers to what stands behind a frame whose rest does not come."""
        answers, frame = b"", None
        while self._buffer:
            frame, self._buffer = decoded(self._buffer[1:] if frame is None else self._buffer)
            answers += b"" if frame is None else self._answered(frame)
        return answers

    def close(self) -> None:
        """Take it away."""
        self._clock.listeners.remove(self.moved_on)

    def written(self) -> None:
        """The answer is on the line."""

    def receive(self, data: bytes) -> bytes:
        """Bytes in, bytes out."""
        with self._lock:
            now_s = self._clock.now_s()
            if self._starting:
                self._awake_s, self.boot_loader_heard = now_s + _HELD_UP_S, True
                return self._nothing()
            frame, self._buffer, self._byte_s = *decoded(self._buffer + data), now_s
            if frame is None:
                return self._nothing()
            self._heard_s = now_s
            if self._faults.strikes("hang-up", now_s):
                self.cut_line(self._faults.length_s("hang-up"))
                return self._nothing()
            if self._faults.strikes("lost-request", now_s):
                return self._nothing()
            answer = self._answered(frame)
            self._clock.sleep(_LATENCY_S + (len(data) + len(answer)) * _BYTE_S + len(self.servos) * _SERVO_S)
            return self._nothing() if self._faults.strikes("lost-reply", now_s) else answer

    def _answered(self, frame: Frame) -> bytes:
        for servo in self.servos:
            servo.update()
        payload = self._answers.get(frame.kind, lambda _p: None)(frame.payload)
        kind = REFUSED if payload is None else frame.kind
        return encoded(Frame(kind | ANSWER, frame.sequence, payload or b""))

    def _hello(self) -> bytes:
        limits = (ANGLES.pack(s.get("cw_angle_limit"), s.get("ccw_angle_limit")) for s in self.servos)
        return bytes([VERSION, len(self.servos)]) + b"".join(limits)

    def _nothing(self) -> bytes:
        self._clock.fell_silent()
        return b""

    def _arm(self, payload: bytes) -> bytes | None:
        if len(payload) != 1 or payload[0] > 100:
            return None
        for servo in self.servos:
            servo.put("goal_position", servo.get("present_position"))
            servo.put("torque_limit", 1023 * payload[0] // 100)
            servo.put("torque_enable", 1)
        self._armed, self._torque = True, 1023 * payload[0] // 100
        return b""

    def _move(self, payload: bytes) -> bytes | None:
        if not self._armed or len(payload) != GOAL.size * len(self.servos):
            return None
        done = b""
        for servo, (goal, speed) in zip(self.servos, GOAL.iter_unpack(payload), strict=True):
            kept = max(servo.get("cw_angle_limit"), min(servo.get("ccw_angle_limit"), goal))
            servo.write(30, GOAL.pack(kept, max(1, speed)))
            done += GOAL.pack(kept, max(1, speed))
        return done

    def _state(self, servo: Servo) -> bytes:
        if self._faults.strikes("silent-servo", self._clock.now_s(), servo.get("id")):
            return SERVO.pack(0, 0, 0, 0, NO_ANSWER)
        names = ("present_position", "present_load", "present_temperature", "present_voltage")
        kept = servo.get("torque_enable") and servo.get("torque_limit") == self._torque
        bits = servo.errors() or (0 if kept or not self._armed else RESTARTED)
        return SERVO.pack(*(servo.get(name) for name in names), bits)

    def _stop(self) -> bytes:
        """Torque off; bits of the servos that are silent and so may not be, and where each of the others is."""
        left, places, self._armed = 0, b"", False
        for place, servo in enumerate(self.servos):
            if self._faults.strikes("silent-servo", self._clock.now_s(), servo.get("id")):
                left, places = left | 1 << place, places + POSITION.pack(0)
                continue
            servo.put("torque_enable", 0)
            servo.update()
            places += POSITION.pack(servo.get("present_position"))
        return left.to_bytes(STOPPED, "little") + places
