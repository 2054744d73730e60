"""An Arduino bridge at the level of bytes, in front of emulated servos; with its watchdog."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

from bns.hardware.bridge_frames import (
    ANSWER,
    ARM,
    GOAL,
    HELLO,
    MOVE,
    NO_ANSWER,
    POSITION,
    REFUSED,
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
from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.faults import Faults
from bns.hardware.emulators.servo import Servo

_LATENCY_S = 0.002
_BYTE_S = 10 / 115_200
_SERVO_S = 0.001
"""To ask one of the servos something: some twenty bytes at 1 Mbaud, and the time after which a servo answers by default."""


class BridgeEmulator:
    """The device at the far end of a line."""

    def __init__(self, servos: Sequence[Servo], clock: EmulatedClock, faults: Faults | None = None) -> None:
        self.servos, self._clock, self._faults = list(servos), clock, faults or Faults()
        self._buffer, self._heard_s, self._byte_s = b"", clock.now_s(), clock.now_s()
        self._armed = False
        self._lock = threading.Lock()
        self._answers: dict[int, Callable[[bytes], bytes | None]] = {
            HELLO: lambda _p: bytes([VERSION, len(self.servos)]),
            ARM: self._arm,
            MOVE: self._move,
            STATE: lambda _p: b"".join(self._state(s) for s in self.servos),
            STOP: lambda _p: self._stop(),
        }
        self.cut_line: Callable[[float], None] = lambda _seconds: None
        clock.listeners.append(self.moved_on)

    def moved_on(self, now_s: float) -> None:
        """Called by the clock: the watchdog."""
        if now_s - self._heard_s > WATCHDOG_S and any(s.get("torque_enable") for s in self.servos):
            self._stop()

    def close(self) -> None:
        """Take it away."""
        self._clock.listeners.remove(self.moved_on)

    def written(self) -> None:
        """The answer is on the line."""

    def receive(self, data: bytes) -> bytes:
        """Bytes in, bytes out."""
        with self._lock:
            now_s = self._clock.now_s()
            if now_s - self._byte_s > TORN_S:
                self._buffer = b""
            frame, self._buffer, self._byte_s = *decoded(self._buffer + data), now_s
            if frame is None:
                return self._nothing()
            self._heard_s = now_s
            if self._faults.strikes("hang-up", now_s):
                self.cut_line(self._faults.length_s("hang-up"))
                return self._nothing()
            if self._faults.strikes("lost-request", now_s):
                return self._nothing()
            for servo in self.servos:
                servo.update()
            payload = self._answers.get(frame.kind, lambda _p: None)(frame.payload)
            kind = REFUSED if payload is None else frame.kind
            answer = encoded(Frame(kind | ANSWER, frame.sequence, payload or b""))
            self._clock.sleep(_LATENCY_S + (len(data) + len(answer)) * _BYTE_S + len(self.servos) * _SERVO_S)
            return self._nothing() if self._faults.strikes("lost-reply", now_s) else answer

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
        self._armed = True
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
        return SERVO.pack(*(servo.get(name) for name in names), servo.errors())

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
