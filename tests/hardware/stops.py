"""How long stops take, by what made them necessary: `python -m tests.hardware.stops khepera 5` measures five of each kind."""

import sys
import tempfile
from collections import defaultdict
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from bns.errors import BnsError
from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.faults import Fault, FaultPlan
from bns.hardware.link.hardware_log import HardwareLog, events
from bns.hardware.platform import platform_module
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping, Surface

AIM_S = 0.2
LINK = {"lost-request": 0.05, "lost-reply": 0.05, "corrupt-reply": 0.05}
SEEN = {"lost-marker": 3.0, "stuck-marker": 3.0}
RATES = {"khepera": LINK | {"late-reply": 0.03}, "snake": {name: rate / 5 for name, rate in LINK.items()}}
"""Kind -> chance at every exchange, the stop's own among them; of the snake's servos there are twelve to be asked."""
ONCE = {
    "khepera": SEEN | {"bus-fault": 0.7, "hang-up": 1.0, "brown-out": 1.0},
    "snake": SEEN | {"overload": 1.0, "overheat": 2.0, "silent-servo": 0.7, "hang-up": 1.0},
}
"""Kind -> how long it lasts, s."""
UNREACHABLE = {"bus-fault", "hang-up", "brown-out", "silent-servo"}
"""While these last nobody can hear an order to stop."""
OF_A_SERVO = {"overload", "overheat", "silent-servo"}
FROZEN_S = 60.0
CAUSES = {robot: ["end of the commands", "stop asked for", "off the surface", *ONCE[robot], *RATES[robot]] for robot in ONCE}


class Kept(FaultPlan):
    """A plan that keeps what its devices met."""

    kept = ()

    def of(self, device):
        faults = super().of(device)
        object.__setattr__(self, "kept", (*self.kept, faults))
        return faults


class Stopped(NamedTuple):
    """Seconds from the fault to the order to stop (NaN where there is no such moment); and, from the order on or from when the
    robot could hear it again, until it had taken it (a Khepera) or read back that its servos are off (a snake), and until it
    was confirmed to stand still."""

    noticed_s: float
    taken_s: float
    still_s: float


def stopped(robot, cause, seed, folder, **driver):
    """One drive that ends for this cause, and how its stop went; AssertionError if it was not confirmed."""
    draw = np.random.default_rng([seed, *cause.encode()])
    at_s = float(draw.uniform(2.0, 5.0))
    clock, stopping, path = EmulatedClock(np.inf), Stopping(), folder / f"{robot}-{cause}-{seed}.jsonl"
    rig = shipped_rig(robot)
    if cause == "off the surface":
        rig = replace(rig, limits=replace(rig.limits, surface=_small(robot, draw)))
    module = platform_module(robot)
    tracker = {**rig.tracker, **{name: driver.pop(name) for name in ("delay_s",) if name in driver}}
    rig = replace(rig, driver={**rig.driver, **driver}, tracker=tracker)
    plan = Kept(_faults(robot, cause, at_s, draw), seed)
    emulation = module.emulate(rig, Path(tempfile.mkdtemp(dir=folder)), clock, plan, seed)
    if cause == "stop asked for":
        clock.listeners.append(lambda now_s: stopping.request("asked for") if now_s >= at_s else None)
    try:
        with HardwareLog(path, clock) as journal:
            platform = module.open_platform(emulation.rig, clock, journal, stopping)
            try:
                journal.note("driving")
                platform.drive(_commands(robot, draw))
            except BnsError as error:
                journal.note("ended", why=str(error))
            finally:
                platform.close()
    finally:
        emulation.close()
    begun = [t_s for faults in plan.kept for t_s in faults._begun.values() if cause in ONCE[robot]]
    began_s = at_s if cause in {"stop asked for", "frozen-scene"} else min(begun, default=np.nan)
    gone_s = ONCE[robot][cause] if cause in UNREACHABLE else 0.0
    return _judged(path, began_s, gone_s)


def _judged(path, began_s, gone_s):
    kinds = list(events(path, "driving", "stop"))
    stop = next(e for before, e in pairwise(kinds) if before["kind"] == "driving")
    assert stop["confirmed"], (path, stop)
    ordered_s = stop["t_s"] - stop["seconds"]
    if not began_s <= ordered_s + 1e-5:  # a fault at every exchange, or none before the drive was over
        return Stopped(np.nan, stop["acknowledged_s"], stop["seconds"])
    deaf_s = max(0.0, began_s + gone_s - ordered_s)
    return Stopped(ordered_s - began_s, stop["acknowledged_s"] - deaf_s, stop["seconds"] - deaf_s)


def _faults(robot, cause, at_s, draw):
    servo = int(draw.integers(1, 13)) if cause in OF_A_SERVO else 0
    if cause == "frozen-scene":
        return (Fault(cause, at_s=at_s, for_s=FROZEN_S),)
    if cause in ONCE[robot]:
        return (Fault(cause, at_s=at_s, for_s=ONCE[robot][cause], servo=servo),)
    return (Fault(cause, rate=RATES[robot][cause]),) if cause in RATES[robot] else ()


def _small(robot, draw):
    x_m = 0.3 if robot == "snake" else 0.0
    half_m = float(draw.uniform(0.05, 0.15 if robot == "khepera" else 0.07))
    return Surface(x_m - half_m, x_m + half_m, -half_m, half_m)


def _commands(robot, draw):
    if robot == "khepera":
        return np.column_stack([draw.uniform(3000, 30000, (4, 2)), draw.uniform(400, 3000, 4)]).astype(np.float32)
    a_lat = draw.uniform(0.3, 1.5, 2)
    rest = draw.uniform([0.0, 0.0, 0.0, 1.0], [1.0, 2 * np.pi, 2 * np.pi, 1.0], (2, 4))
    return np.column_stack([a_lat, a_lat * rest[:, 0], rest[:, 1:]]).astype(np.float32)


def measured(robot, count, causes=None, **driver):
    """Cause -> so many stops."""
    found = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        for cause in causes or CAUSES[robot]:
            found[cause] = [stopped(robot, cause, seed, Path(folder), **driver) for seed in range(count)]
    return found


def report_lines(found):
    """Lines of a table."""
    everything = [stop for stops in found.values() for stop in stops]
    yield "| cause | stops | noticed after, ms | order taken, ms: median, worst | still, ms: median, worst | within 200 ms |"
    yield "|---|---|---|---|---|---|"
    for cause, stops in [*found.items(), ("all", everything)]:
        noticed = [s.noticed_s for s in stops if np.isfinite(s.noticed_s)] if cause != "all" else []
        first = f"{1000 * np.median(noticed):.0f}" if noticed else ""
        within = sum(s.still_s <= AIM_S + 1e-6 for s in stops)
        taken, still = (_spread([s[i] for s in stops]) for i in (1, 2))
        yield f"| {cause} | {len(stops)} | {first} | {taken} | {still} | {within} |"


def _spread(seconds):
    return f"{1000 * np.median(seconds):.0f}, {1000 * max(seconds):.0f}"


if __name__ == "__main__":
    robot, count, *driver = sys.argv[1:]
    causes = [each for each in driver if "=" not in each] or None
    settings = {name: yaml.safe_load(value) for name, _, value in (each.partition("=") for each in driver if "=" in each)}
    print(*report_lines(measured(robot, int(count), causes, **settings)), sep="\n")
