"""Whether a robot outlives its supervisor: `python -m tests.hardware.outlive 20` kills, stops, hangs and unplugs so often each.

The emulated robot lives in this process, the trial in another one, the guard in a third. Time is the computer's. With
`-o FILE` every drive is written there as a line of JSON.
"""

import argparse
import fcntl
import json
import os
import signal
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.guard.client import Guard
from bns.hardware.guard.recipe import khepera_recipe

from .forked_trial import HANGS_S, Nursery, end_of
from .robots_on_the_line import LINKS, ManualRobot, Robot


class Seen(NamedTuple):
    """Seconds from the cause until the robot stood; how the trial's process ended, and what it said; the guard's log.

    Where the link was away, `still_s` counts from its return; `alone_s` from the cause, of a robot that stood before that.
    """

    still_s: float
    ended: int
    said: str
    events: list
    alone_s: float = float("nan")


class Befalls(NamedTuple):
    """What a cause has to do with."""

    robot: Robot
    process: int
    terminal: int
    slept: Path


def _signalled(number):
    def cause(to):
        os.kill(to.process, number)

    return cause


def _guard_signalled(number):
    def cause(to):
        os.kill(guard_of(to.process, to.robot.path), number)

    return cause


def _typed(key):
    def cause(to):
        os.write(to.terminal, key)

    return cause


def _closed(to):
    os.close(to.terminal)


def _unplugged(to):
    to.robot.line.cut()


def _killed_and_unplugged(to):
    to.robot.line.cut()
    os.kill(to.process, signal.SIGKILL)


def _both_stopped(to):
    for process in (guard_of(to.process, to.robot.path), to.process):  # the guard first: else it would see that of the trial
        os.kill(process, signal.SIGSTOP)


def _asleep(to):
    """Trial, guard and who stands by stand still together, as on a computer that sleeps; the clock says for how long."""
    processes = [*_children(to.process), to.process]
    for process in processes:
        os.kill(process, signal.SIGSTOP)
    time.sleep(0.02)
    written = to.slept.with_suffix(".new")
    written.write_text(str(600.0 + (float(to.slept.read_text()) if to.slept.exists() else 0.0)))
    written.replace(to.slept)
    for process in processes:
        os.kill(process, signal.SIGCONT)


def _children(process):
    return [int(child) for child in Path(f"/proc/{process}/task/{process}/children").read_text().split()]


def guard_of(process, port):
    """The process number of a trial's guard: the child that has the port open. Another one stands by."""
    port = os.path.realpath(port)
    for child in _children(process):
        if any(os.path.realpath(file) == port for file in Path(f"/proc/{child}/fd").iterdir()):
            return child
    raise AssertionError("the trial has no guard")


HELD, SLEPT = "trial and guard stopped together", "the computer slept"
SUSPENDS = {"Ctrl-Z", "SIGTSTP"}
CAUSES = {
    "SIGKILL": _signalled(signal.SIGKILL),
    "SIGSTOP": _signalled(signal.SIGSTOP),
    "SIGHUP": _signalled(signal.SIGHUP),
    "SIGTERM": _signalled(signal.SIGTERM),
    "SIGQUIT": _signalled(signal.SIGQUIT),
    "SIGTSTP": _signalled(signal.SIGTSTP),
    "Ctrl-C": _typed(b"\x03"),
    "Ctrl-\\": _typed(b"\x1c"),
    "Ctrl-Z": _typed(b"\x1a"),
    "terminal closed": _closed,
    "hang": _signalled(signal.SIGUSR1),
    "camera frozen (bits)": _signalled(signal.SIGRTMIN),
    "camera frozen (scene)": _signalled(signal.SIGRTMIN + 1),
    "link gone": _unplugged,
    "link gone, then SIGKILL": _killed_and_unplugged,
    "the guard is killed": _guard_signalled(signal.SIGKILL),
    "the guard is terminated": _guard_signalled(signal.SIGTERM),
    "the guard is stopped": _guard_signalled(signal.SIGSTOP),
    HELD: _both_stopped,
    SLEPT: _asleep,
}
_ARMED_S = 4.0
"""By then the servos have their torque and the body is straight; before, nothing depends on the camera."""
SURVIVES = {"SIGSTOP", "hang"}
GONE_S = {"link gone": 1.0, "link gone, then SIGKILL": 1.0}
"""How long the link stays away; the time until the robot stands counts from its return."""


def outlived(nursery, link, cause, folder, gone_s=0.0, kind=Robot, patient=False):
    """One trial that this befell while its robot moved; AssertionError if the robot went on, or anything is left over.

    `patient`: as `forked_trial.drive` has it.
    """
    robot = kind(link, folder, **({"watchdog_s": HANGS_S} if patient and link == "bridge" else {}))
    try:
        still_s, alone_s, ended = _befell(nursery, robot, cause, folder, gone_s, patient)
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


def _befell(nursery, robot, cause, folder, gone_s, patient):
    process, terminal = nursery.begin(robot.link, robot.path, folder / "journal.jsonl", patient)
    try:
        robot.until(True, HANGS_S, lambda: _why_not(nursery, folder))
        time.sleep(_ARMED_S if cause.startswith("camera") and robot.link != "serial" else 0.25)
        began_s = time.monotonic()
        CAUSES[cause](Befalls(robot, process, terminal, nursery.slept))
        if cause == SLEPT:
            began_s = time.monotonic()
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


def _why_not(nursery, folder):
    """Why the robot will not move any more: what its trial said when it ended."""
    if not nursery.tells():
        return ""
    said = folder / "said"
    return f"{nursery.heard()} ({said.read_text() if said.exists() else 'it said nothing'})"


def _events(folder):
    log = folder / "guard.jsonl"
    return [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []


def _end(nursery, cause, process, terminal):
    if cause in SURVIVES:
        if cause == "SIGSTOP":
            assert "stopped" in nursery.heard()
        os.kill(process, signal.SIGKILL)
    if cause == HELD:
        os.kill(process, signal.SIGCONT)
    if cause in SUSPENDS:
        assert end_of(nursery, terminal) == {"stopped": signal.SIGTSTP}
        os.kill(process, signal.SIGCONT)
    while "ended" not in (found := end_of(nursery, terminal)):
        assert cause in {HELD, SLEPT}
    return found["ended"]


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


def main(count, causes=(), log=None, kind=Robot):
    with tempfile.TemporaryDirectory() as folder:
        median_s, most_s = latency_s(Path(folder))
    print(f"The guard adds {1000 * median_s:.2f} ms at the median, {1000 * most_s:.2f} ms at the 99th percentile.")
    nursery, causes = Nursery(), causes or CAUSES
    print("| cause | link | times | stood after, ms: median, worst | within 500 ms | the trial's process ended with |")
    print("|---|---|---|---|---|---|")
    for cause in causes:
        for link in LINKS if kind is Robot else LINKS[:2]:
            seen = []
            for _ in range(count):
                with tempfile.TemporaryDirectory() as folder:
                    seen.append(outlived(nursery, link, cause, Path(folder), kind=kind))
                if log is not None:
                    line = {"cause": cause, "link": link, "until_s": time.monotonic(), **seen[-1]._asdict()}
                    log.write(json.dumps(line) + "\n")
                    log.flush()
            took_ms = 1000 * np.array([s.still_s for s in seen])
            ends = ", ".join(sorted({str(s.ended) for s in seen}))
            took = f"{np.median(took_ms):.0f}, {took_ms.max():.0f} | {(took_ms <= 500).sum()}"
            alone_ms = 1000 * np.array([s.alone_s for s in seen])
            alone = f" by itself {np.median(alone_ms):.0f}, {alone_ms.max():.0f} after the cause"
            alone = alone if np.isfinite(alone_ms).all() else ""
            print(f"| {cause} | {link} | {count} | {took} | {ends} |{alone}", flush=True)
    nursery.close()


if __name__ == "__main__":
    asked = argparse.ArgumentParser()
    asked.add_argument("count", type=int, help="how often each")
    asked.add_argument("causes", nargs="*")
    asked.add_argument("-o", type=argparse.FileType("a"), dest="log")
    asked.add_argument("--manual", action="store_true", help="robots written from the makers' manuals alone; no bridge")
    given = asked.parse_args()
    main(given.count, given.causes, given.log, ManualRobot if given.manual else Robot)
