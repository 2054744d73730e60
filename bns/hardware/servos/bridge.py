"""A servo chain behind an Arduino: the same calls as `DynamixelChain`, over framed and checksummed packets of our own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.serial_link import open_port
from bns.hardware.link.terminal_error import TerminalError
from bns.hardware.servos.ax12_table import AX12, CENTRE, RAD_PER_STEP, RAD_S_PER_STEP, errors_in
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
    STARTED_S,
    STATE,
    STILL_SPOKEN,
    STOP,
    STOPPED,
    VERSION,
    WATCHDOG_S,
    Frame,
    encoded,
    searched,
)
from bns.hardware.servos.servo_chain import (
    Health,
    RestartedServoError,
    ServoAlarmError,
    ServoError,
    ServoLimits,
    narrow,
)
from bns.hardware.stop import Stop

with extra("robot"):
    import serial

BAUD = 115200
ATTEMPTS = 6
_TIMEOUT_S = 0.15
_HELLOS = range(2, 2 + 16 * ANGLES.size + 1, ANGLES.size)
"""Sizes of the answer to a hello: version and number of servos, and the angle limits of up to 16 (none of them in version 3)."""
_STOP_TIMEOUT_S = 0.06
"""Twelve servos read take 12 ms, one of them silent nine more; the frames 4 ms."""
_BETWEEN_S = 0.02
_LISTEN_S = 0.02
_QUESTIONS = {HELLO: "to say what it is", ARM: "to turn the torque on", MOVE: "to move", STATE: "to report", STOP: "to stop"}
_NOT_TAKEN = "a servo does not take what it is told"
_WHY = {
    ARM: f" ({_NOT_TAKEN})",
    MOVE: f" (its watchdog took the torque off when it heard nothing for {WATCHDOG_S:g} s: a busy computer, a bad cable; or the "
    f"board restarted: check its power; or {_NOT_TAKEN})",
}


class BridgeChain:
    """Driver of `count` servos behind a bridge. Opening checks the bridge's version, how many servos it has found, and that
    their angle limits leave `reach_rad` to both sides."""

    step_rad = RAD_PER_STEP

    def __init__(
        self,
        port: str,
        count: int,
        clock: Clock,
        journal: HardwareLog,
        limits: ServoLimits | None = None,
        reach_rad: float = 0.0,
    ) -> None:
        self._clock, self._journal, self.count = clock, journal, count
        self.limits = limits or ServoLimits()
        self._sequence, self.retries = 0, 0
        self._port = port
        self._serial: serial.Serial | None = None
        try:
            self._open()
            version, found, *limits_of = self._ask(HELLO, b"", _HELLOS)
        except ServoError as error:
            self.close()
            raise HardwareError(f"no bridge answers at {port} ({error}). Is its sketch loaded, is it powered?") from error
        if version not in STILL_SPOKEN or found != count:
            self.close()
            raise HardwareError(
                f"the bridge speaks version {version} and has found {found} servos; version {VERSION} and {count} servos are "
                "needed. Load the sketch of this bns; check cables and ids."
            )
        if version < VERSION:
            self._journal.note("bridge-version", spoken=version, newest=VERSION, lacks="angle limits, servos that restart")
        pairs = enumerate(ANGLES.iter_unpack(bytes(limits_of)), 1)
        if wrong := [why for place, pair in pairs if (why := narrow(place, pair, AX12, reach_rad))]:
            self.close()
            cure = "With the servos on a bus adapter, bns servos check --fix --port PORT sets them."
            raise HardwareError(f"{'; '.join(wrong)}. {cure}")

    def _open(self) -> None:
        """Open the port, and say nothing until the board has said hello or cannot be starting any more (see `STARTED_S`)."""
        self._serial = open_port(self._port, BAUD, self._clock)
        data, answer, began_s = b"", None, self._clock.now_s()
        while (answer is None or answer.kind != HELLO | ANSWER) and self._clock.now_s() - began_s < STARTED_S:
            self._clock.sleep(_LISTEN_S)
            data += self._serial.read(self._serial.in_waiting)
            answer, data = searched(data)
        self._journal.note("bridge-started", said_hello=answer is not None, seconds=self._clock.now_s() - began_s)

    def close(self) -> None:
        """Give the port free."""
        if self._serial is not None:
            self._serial.close()

    def arm(self, meanwhile: Callable[[], object] = lambda: None) -> None:
        """Torque on where the joints are, grown in steps by the bridge up to the limits' share of it, after this one question."""
        meanwhile()
        self._ask(ARM, bytes([round(100 * self.limits.torque)]), 0)

    def move(self, angles_rad: Sequence[float], speeds_rad_s: Sequence[float]) -> list[float]:
        """Set goals and speeds; the angles that the bridge has set, after clipping."""
        goals = [max(0, min(1023, CENTRE + round(angle / RAD_PER_STEP))) for angle in angles_rad]
        steps = [max(1, min(1023, round(abs(speed) / RAD_S_PER_STEP))) for speed in speeds_rad_s]
        payload = b"".join(GOAL.pack(g, s) for g, s in zip(goals, steps, strict=True))
        answer = self._ask(MOVE, payload, len(payload))
        return [(goal - CENTRE) * RAD_PER_STEP for goal, _ in GOAL.iter_unpack(answer)]

    def health(self) -> dict[int, Health]:
        """What every servo says, by its place from 1; ServoError if one reports an alarm or is beyond its limits."""
        found = {}
        for place, (position, load, celsius, decivolts, bits) in enumerate(SERVO.iter_unpack(self._state()), 1):
            if bits == RESTARTED:
                raise RestartedServoError(place, "its torque is off, or its limit is not what was set")
            if bits & NO_ANSWER:
                raise ServoError(f"servo {place} does not answer the bridge")
            if bits:
                raise ServoAlarmError(place, ", ".join(errors_in(bits)))
            share = (load & 1023) / 1023 * (-1 if load & 1024 else 1)
            found[place] = Health((position - CENTRE) * RAD_PER_STEP, share, decivolts / 10, float(celsius))
        self.limits.check(found)
        return found

    def check_torque(self) -> None:
        """Nothing is left to ask: the bridge looks at all torques whenever it is asked for the state."""

    def stop(self, patience_s: float = 5.0) -> Stop:
        """Torque off; confirmed when every servo has read it back, and no joint moves between two looks. Never raises.

        One question does all of it: the bridge takes the torque off again each time, and answers with what it reads back.
        """
        began_s, acknowledged_s = self._clock.now_s(), None
        places: list[int] = []
        while True:
            round_s, before = self._clock.now_s(), places
            try:
                answer = self._ask(STOP, b"", STOPPED + POSITION.size * self.count, 1, _STOP_TIMEOUT_S)
                left, here = int.from_bytes(answer[:STOPPED], "little"), [p for (p,) in POSITION.iter_unpack(answer[STOPPED:])]
                places = [] if left else here
                silent = [i + 1 for i in range(self.count) if left >> i & 1]
                problem = f"servos {silent} did not stop" if left else "the joints still move"
            except ServoError as error:
                problem = str(error)
            now_s = self._clock.now_s()
            if places and acknowledged_s is None:
                acknowledged_s = now_s - began_s
            still = places is not before and len(before) == len(places) > 0
            if still and all(abs(a - b) <= AX12.still_steps for a, b in zip(places, before, strict=True)):
                return self._stopped(Stop(True, now_s - began_s, acknowledged_s))
            if now_s - began_s > patience_s:
                return self._stopped(Stop(False, now_s - began_s, acknowledged_s, problem))
            self._clock.sleep(round_s + _BETWEEN_S - now_s)

    def _state(self) -> bytes:
        return self._ask(STATE, b"", self.count * SERVO.size)

    def _stopped(self, stop: Stop) -> Stop:
        self._journal.note("stop", **asdict(stop))
        return stop

    def _ask(
        self, kind: int, payload: bytes, size: int | range, attempts: int = ATTEMPTS, timeout_s: float = _TIMEOUT_S
    ) -> bytes:
        """Payload of the answer, of that size or one of these; asked again when nothing or something else comes."""
        sizes = range(size, size + 1) if isinstance(size, int) else size
        problem = ""
        for attempt in range(attempts):
            self.retries += attempt > 0
            self._sequence = (self._sequence + 1) % 256
            try:
                answer = self._once(Frame(kind, self._sequence, payload), timeout_s)
            except (OSError, TerminalError, HardwareError) as error:
                self._lose(error)
                raise ServoError(f"the port is gone ({error})") from error
            if answer is not None and answer.kind == kind | ANSWER and len(answer.payload) in sizes:
                return answer.payload
            problem = "no answer" if answer is None else f"the answer was {answer}"
            if answer is not None and answer.kind == REFUSED | ANSWER:
                problem = f"it refuses {_QUESTIONS[kind]}{_WHY.get(kind, '')}"
        raise ServoError(f"bridge: {problem}; asked {attempts} times")

    def _lose(self, error: Exception) -> None:
        if self._serial is not None:  # else it was gone before
            self._journal.note("link-lost", port=self._port, error=str(error))
        with suppress(OSError, TerminalError):
            self.close()
        self._serial = None

    def _once(self, frame: Frame, timeout_s: float) -> Frame | None:
        if self._serial is None:  # it had vanished, and may be back
            self._open()
        assert self._serial is not None
        self._serial.reset_input_buffer()
        in_vain = self._clock.in_vain(timeout_s)
        self._journal.note("sent", data=encoded(frame).hex())
        self._serial.write(encoded(frame))
        data, answer = b"", None
        while answer is None or answer.sequence != frame.sequence:  # an answer to an older question is passed over
            data += self._serial.read(max(1, self._serial.in_waiting))
            answer, data = searched(data)
            if answer is None and in_vain():
                self._clock.waited(timeout_s)
                return None
        self._journal.note("received", data=encoded(answer).hex())
        return answer
