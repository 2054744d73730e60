"""Fault plans: what goes wrong, when and how often, as data; the same seed brings the same faults.

```yaml
seed: 3
faults:
  - {kind: lost-reply, rate: 0.02}             # chance at every exchange
  - {kind: hang-up, at_s: 40, for_s: 1.5}      # once, at this time of the trial
```
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bns.errors import HardwareError, unknown_name
from bns.safe_yaml import Lines, read_yaml_file, shown

KINDS: Mapping[str, str] = {
    "lost-request": "a command does not reach the robot",
    "lost-reply": "the robot obeys, its answer is lost",
    "corrupt-reply": "a byte of the answer is another one",
    "bus-fault": "the robot's inner bus fails: the command is not carried out and nothing answers",
    "late-reply": "the answer comes after the host has given up",
    "hang-up": "the link breaks; the robot drives on",
    "brown-out": "the robot's processor restarts: wheels stop, counters at zero, silence for a while",
    "lost-marker": "the tracker sees no marker",
    "stuck-marker": "the tracker shows an old picture as if it were new",
    "late-tracker": "the tracker's poses are older than their time stamps, by for_s, from at_s on",
    "frozen-picture": "the camera sends one picture again and again; only a clock in its corner goes on",
    "frozen-scene": "the tracker keeps showing the scene of when this began",
    "swapped-markers": "lights change places in the report",
    "reflection": "a light that is no marker appears",
    "silent-servo": "one servo does not answer",
    "restart": "a servo restarts, as when its supply dips: torque off, the torque limit at its highest",
    "overload": "a servo shuts down by overload",
    "overheat": "a servo's temperature rises beyond its limit",
}
"""Kind of fault -> what it is."""
_OF_TIMES = {"frozen-scene", "late-tracker"}
"""Kinds that change which time a tracker shows."""
_ALLOWED = {"kind", "rate", "at_s", "for_s", "id"}


@dataclass(frozen=True)
class Fault:
    """One line of a plan: either `rate` (chance at every exchange or look) or `at_s` (once), lasting `for_s`.

    `servo` is the id it is meant for, where it is meant for one.
    """

    kind: str
    rate: float = 0.0
    at_s: float = math.inf
    for_s: float = 0.0
    servo: int = 0

    def __str__(self) -> str:
        of = f" of servo {self.servo}" if self.servo else ""
        return self.kind + of + (f" at {self.at_s:g} s" if math.isfinite(self.at_s) else "")


class Faults:
    """Answers whether a fault strikes now. Each emulated device has one, seeded by the plan and its own name.

    ``happened`` counts how often each line of the plan has begun.
    """

    def __init__(
        self, plan: tuple[Fault, ...] = (), seed: int = 0, device: str = "", happened: Counter[int] | None = None
    ) -> None:
        self._plan = plan
        self._happened: Counter[int] = Counter() if happened is None else happened
        self._draw = np.random.default_rng([seed, *device.encode()])
        self._begun: dict[int, float] = {}

    def strikes(self, kind: str, t_s: float, servo: int = 0) -> bool:
        """Whether a fault of this kind is there at this exchange or look."""
        return any(self._struck(i, f, t_s) for i, f in enumerate(self._plan) if f.kind == kind and f.servo == servo)

    def length_s(self, kind: str) -> float:
        """How long a fault of this kind lasts."""
        return max((f.for_s for f in self._plan if f.kind == kind), default=0.0)

    def filmed_s(self, t_s: float) -> float:
        """When a tracker's pose of that time was really taken."""
        for number, fault in enumerate(self._plan):
            if fault.kind in _OF_TIMES and t_s >= fault.at_s and number not in self._begun:
                self._begin(number, t_s)
        frozen = [f.at_s for f in self._plan if f.kind == "frozen-scene" and f.at_s <= t_s < f.at_s + f.for_s]
        late_s = max((f.for_s for f in self._plan if f.kind == "late-tracker" and t_s >= f.at_s), default=0.0)
        return min(frozen, default=t_s) - late_s

    def _struck(self, number: int, fault: Fault, t_s: float) -> bool:
        began = self._begun.get(number, -math.inf)
        if t_s < began + fault.for_s:
            return True
        due = t_s >= fault.at_s and number not in self._begun
        if due or (fault.rate > 0.0 and self._draw.random() < fault.rate):
            self._begin(number, t_s)
            return True
        return False

    def _begin(self, number: int, t_s: float) -> None:
        self._begun[number] = t_s
        self._happened[number] += 1

    def byte(self, data: bytes) -> bytes:
        """`data` with one byte changed."""
        if not data:
            return data
        place = int(self._draw.integers(len(data)))
        other = data[place] ^ int(self._draw.integers(1, 256))
        return data[:place] + bytes([other]) + data[place + 1 :]


@dataclass(frozen=True)
class FaultPlan:
    """A whole plan. ``happened``: how often each fault of it (by its place) has begun on any device."""

    faults: tuple[Fault, ...] = ()
    seed: int = 0
    happened: Counter[int] = field(default_factory=Counter, compare=False, repr=False)

    def of(self, device: str) -> Faults:
        """The faults as one device meets them."""
        return Faults(self.faults, self.seed, device, self.happened)

    def outcome(self) -> str:
        """Which of these faults have happened and which have not, in words; "" for an empty plan."""
        if not self.faults:
            return ""
        counts = [(fault, self.happened[number]) for number, fault in enumerate(self.faults)]
        came = [str(fault) + (f" ({count} times)" if count > 1 else "") for fault, count in counts if count]
        missed = [str(fault) for fault, count in counts if not count]
        parts = [f"happened: {', '.join(came)}"] * bool(came) + [f"did not happen: {', '.join(missed)}"] * bool(missed)
        return f"planned faults that {'; that '.join(parts)}"


def load_plan(path: Path) -> FaultPlan:
    """A plan from a YAML file; HardwareError names what is wrong in it."""
    content, lines = read_yaml_file(path, "the fault plan", HardwareError)
    if not isinstance(content, dict) or not isinstance(content.get("faults"), list) or set(content) - {"seed", "faults"}:
        raise HardwareError(f"the fault plan {path} must hold `faults:`, a list, and may hold `seed:`; nothing else.")
    seed = content.get("seed", 0)
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise HardwareError(f"{path}: seed is {shown(seed)}; it must be a whole number from 0.")
    return FaultPlan(tuple(_located(path, content["faults"], at, lines) for at in range(len(content["faults"]))), seed)


def _located(path: Path, entries: list[Any], at: int, lines: Lines) -> Fault:
    with lines.at("faults", at):
        return _fault(path, entries[at])


def _fault(path: Path, entry: Any) -> Fault:
    if not isinstance(entry, dict) or set(entry) - _ALLOWED or "kind" not in entry:
        raise HardwareError(
            f"{path}: {shown(entry)} is no fault; it has a kind and of {', '.join(sorted(_ALLOWED))} what it needs."
        )
    if not isinstance(entry["kind"], str) or entry["kind"] not in KINDS:
        raise HardwareError(f"{path}: {unknown_name('fault', entry['kind'], KINDS)}")
    if ("rate" in entry) == ("at_s" in entry):
        raise HardwareError(f"{path}: {entry['kind']} needs either rate (0 to 1) or at_s (seconds).")
    numbers = {name: _number(path, name, entry[name]) for name in ("rate", "at_s", "for_s") if name in entry}
    if numbers.get("rate", 0.0) > 1.0:
        raise HardwareError(f"{path}: rate is {entry['rate']!r}; a chance is from 0 to 1.")
    servo = entry.get("id", 0)
    if type(servo) is not int or not 0 <= servo <= 253:
        raise HardwareError(f"{path}: id is {servo!r}; it must be the number of a servo, from 0 to 253.")
    return Fault(entry["kind"], servo=servo, **numbers)


def _number(path: Path, name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < math.inf:
        raise HardwareError(f"{path}: {name} is {shown(value)}; it must be a number from 0.")
    return float(value)
