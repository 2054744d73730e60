"""One run, measured, and with whatever goes wrong in it turned into a row."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from bns.change import change_of
from bns.errors import ModelError
from bns.spec import RunSpec
from bns.store.record import RunRecord
from bns.sweep.jobs import memory

_FRAMES = 3


def run_job(spec: RunSpec) -> RunRecord:
    """Carry out one run: status ``ok`` with its tables, or ``failed`` with what went wrong and no tables.

    wall_s and cpu_s cover the run alone, without the start of the process; peak_memory_mib is the process's
    resident memory, interpreter and libraries included.
    """
    meter, tables, row = _Meter(), {}, {}
    try:
        # Imported here: the parent of a sweep has no need of the kernels and their libraries.
        from bns.bootstrap.loop import run  # noqa: PLC0415

        warm(spec.robot, spec.world)
        meter = _Meter()
        result = run(spec)
        tables, row = result.tables, {"status": "ok", "error": None, "world_digest": result.world_digest}
    except Exception as fault:  # one run must not end a sweep; its row keeps the fault
        tables, row = {}, {"status": "failed", "error": describe(fault)}
    return RunRecord(spec, row | meter.columns(), tables)


@cache
def warm(robot: str = "khepera", world: str = "substitute") -> None:
    """Compile the robot's kernels or load them from disk, once a process, so that no run is charged with it."""
    from bns.bootstrap.loop import run  # noqa: PLC0415
    from bns.engine.jit import note_compiled  # noqa: PLC0415
    from bns.tasks import default_task  # noqa: PLC0415

    if change := change_of(world):
        for one in (change.before, change.after):
            warm(robot, one)
        note_compiled(robot, world)
        return
    run(
        RunSpec(
            robot=robot,
            task=default_task(robot),
            world=world,
            population_size=4,
            evaluations=2,
            generations_per_evaluation=1,
            training_iterations_per_evaluation=1,
        )
    )
    note_compiled(robot, world)


def prepare(specs: Iterable[RunSpec]) -> None:
    """Before workers are started: kernels compiled, once and not by each of them, and all worlds of these runs there.

    Raises:
        ModelError: a world's file is missing or no such file; the message names the command that makes it.
    """
    # Imported here for the reason given above.
    from bns.engine.jit import compiled  # noqa: PLC0415
    from bns.robots import load_robot  # noqa: PLC0415
    from bns.worlds import build_world  # noqa: PLC0415

    for world, robot in sorted({(spec.world, spec.robot) for spec in specs}):
        build_world(world, load_robot(robot))
        if not compiled(robot, world):
            warm(robot, world)


def check_world_files(specs: Iterable[RunSpec], place_of: Callable[[str], str] = lambda _world: "") -> None:
    """Before anything is written: the model files that these runs name as worlds are there, and are models of the robot.

    ``place_of`` says where a world is named, to stand before what is wrong with it.

    Raises:
        ModelError: one is missing or cannot be used.
    """
    from bns.robots import load_robot  # noqa: PLC0415  # as above
    from bns.worlds import build_world  # noqa: PLC0415

    for world, robot in sorted({(spec.world, spec.robot) for spec in specs if names_a_file(spec.world)}):
        try:
            build_world(world, load_robot(robot))
        except ModelError as error:
            raise ModelError(f"{place_of(world)}{error}") from error


def names_a_file(world: str) -> bool:
    """Whether a world is a model file, or changes from or to one."""
    change = change_of(world)
    return any(name.endswith((".yaml", ".yml")) for name in (change[:2] if change else (world,)))


class _Meter:
    """Time and memory from its making on."""

    def __init__(self) -> None:
        self._started_at, self._wall, self._cpu = datetime.now(UTC), time.perf_counter(), time.process_time()
        memory.reset_peak()

    def columns(self) -> dict[str, Any]:
        return {
            "started_at": self._started_at,
            "wall_s": time.perf_counter() - self._wall,
            "cpu_s": time.process_time() - self._cpu,
            "peak_memory_mib": memory.peak_mib(),
            "attempts": 1,
        }


def describe(fault: BaseException) -> str:
    """A fault in one line and, below it, the innermost places it came through."""
    text = " ".join(str(fault).split())
    frames = traceback.extract_tb(fault.__traceback__)[-_FRAMES:]
    places = [f"  at {Path(f.filename).name}:{f.lineno} in {f.name}: {f.line}" for f in reversed(frames)]
    return "\n".join([f"{type(fault).__name__}: {text}" if text else type(fault).__name__, *places])
