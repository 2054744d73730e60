"""One run by hand: what the terminal shows while it goes on, and what is kept at its end."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from bns.errors import ModelError, SpecError
from bns.loop import RunResult, run
from bns.measurements import check_table_name
from bns.plotting import path_figure
from bns.recorder import RADII_CM
from bns.robots import load_robot
from bns.robots.simulator import StaticSimulator, check_writable, save_simulator
from bns.spec import RunSpec
from bns.store.lock import SweepLockedError
from bns.store.reader import finished
from bns.store.record import RunRecord
from bns.store.writer import Writer
from bns.sweep import memory
from bns.sweep.digests import WorldDigests
from bns.tasks import load_task
from bns.worlds import build_world
from bns.worlds.logged import LoggedWorld

_PATIENCE_S = 60.0


def run_by_hand(
    spec: RunSpec,
    results: Path,
    sweep: str,
    save_snn: Path | None = None,
    render: Path | None = None,
    measurements: Path | None = None,
    device: str = "cpu",
) -> str:
    """Carry out a run with a live view, store it, draw the path of its fittest controller; the report in words."""
    if device != "cpu":
        check_gpu(spec, measurements)
    robot, task = load_robot(spec.robot), load_task(spec.robot, spec.task)
    if render is not None:
        check_renderable(spec, build_world(spec.world, robot), render)
    if save_snn is not None:
        check_writable(save_snn)
    world = build_world(spec.world, robot)
    if measurements is not None:
        check_table_name(measurements)
        world = logged = LoggedWorld(world, robot)
    with _patient_writer(results, sweep):  # what does not fit is better found before the run than after it
        _check_world(spec, results, sweep, world.digest)
    started, wall, cpu = datetime.now(UTC), time.perf_counter(), time.process_time()
    memory.reset_peak()
    with live_view(spec) as show:
        result = run(spec, show, world) if device == "cpu" else _run_on_gpu(spec, show)
    wall_s = time.perf_counter() - wall
    keep_run(spec, result, results, sweep, started, wall_s, time.process_time() - cpu, device)
    if measurements is not None:
        logged.write(measurements)
    if save_snn is not None:
        save_simulator(
            StaticSimulator(
                result.networks,
                result.weights,
                np.empty(0),
                {"run_id": spec.run_id, "spec": spec.canonical_json()},
                result.learned_from,
            ),
            save_snn,
        )
    figure = path_figure(
        spec,
        task,
        robot,
        result,
        results / "figures" / f"run-{spec.task}-{spec.seed}-{spec.run_id}",
    )
    told = _report(spec, result, wall_s, figure)
    if render is not None:
        world.render(robot.plan(result.fittest, result.weights, task), render)  # type: ignore[attr-defined]  # checked above
        told += f"\nmoving picture: {render}"
    return told


def check_gpu(spec: RunSpec, measurements: Path | None) -> None:
    """SpecError or DeviceError if the GPU cannot do this run, before anything is written."""
    from bns.cuda.device import device_name  # noqa: PLC0415  # as below
    from bns.cuda.support import check_supported  # noqa: PLC0415

    if measurements is not None:
        raise SpecError("a GPU does not tell what was driven; leave out --measurements or --device.")
    check_supported([spec])
    device_name()


def _run_on_gpu(spec: RunSpec, progress: Callable[[Mapping[str, Any]], None]) -> RunResult:
    from bns.cuda.single import run as run_there  # noqa: PLC0415  # loads numba's CUDA support, which need not be installed

    return run_there(spec, progress)


def check_renderable(spec: RunSpec, world: Any, path: Path) -> None:
    """ModelError if this world has no picture of its robot, or none in such a file."""
    if not hasattr(world, "render"):
        raise ModelError(f"the {spec.world} world of {spec.robot} has nothing to render; leave --render out.")
    check_writable(path)
    world.check_picture(path)


def _check_world(spec: RunSpec, results: Path, sweep: str, digest: str) -> None:
    if finished(results, sweep):
        digests = WorldDigests(results, sweep)
        digests.read()
        digests.compare(spec.task, spec.world, digest)


def keep_run(
    spec: RunSpec,
    result: RunResult,
    results: Path,
    sweep: str,
    started: datetime,
    wall_s: float,
    cpu_s: float = float("nan"),
    device: str = "cpu",
) -> None:
    """Put a run that ended well into the store."""
    row = {
        "status": "ok",
        "error": None,
        "world_digest": result.world_digest,
        "started_at": started,
        "wall_s": wall_s,
        "cpu_s": cpu_s,
        "peak_memory_mib": memory.peak_mib(),
        "attempts": 1,
    }
    if device != "cpu":
        from bns.sweep.batches import gpu_columns  # noqa: PLC0415  # as below

        row |= gpu_columns()
    with _patient_writer(results, sweep) as writer:
        writer.append(RunRecord(spec, row, result.tables))


@contextmanager
def _patient_writer(results: Path, sweep: str) -> Iterator[Writer]:
    """Runs by hand share one sweep's name; each holds its lock for an instant only."""
    deadline = time.monotonic() + _PATIENCE_S
    while True:
        writer = Writer(results, sweep)
        try:
            writer.__enter__()
            break
        except SweepLockedError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.1)
    try:
        yield writer
    finally:
        writer.__exit__(*sys.exc_info())


def _report(spec: RunSpec, result: RunResult, wall_s: float, figure: Path) -> str:
    evals = result.tables["evals"]
    names = [f"success_{cm}cm" for cm in RADII_CM]
    within = [f"within {cm} cm " for cm in RADII_CM]
    if evals[names[0]][0] is None:
        names, within = ["success"], [""]
    reached = [text + _first(evals[name], evals["evaluation"]) for text, name in zip(within, names, strict=True)]
    return "\n".join(
        [
            f"run {spec.run_id}: {spec.robot}, {spec.task}, seed {spec.seed}, {spec.evaluations} evaluations in {wall_s:.1f} s",
            "all goals reached by the fittest controller: " + "; ".join(reached),
            f"fitness of the fittest at the end: {evals['fitness_simulation'][-1]:.3f} in simulation, "
            f"{evals['fitness_world'][-1]:.3f} in the world ({spec.world})",
            f"path: {figure}",
        ]
    )


def _first(success: Any, evaluation: Any) -> str:
    return f"first at evaluation {evaluation[success][0]}, {success.mean():.0%} of them" if success.any() else "never"


@contextmanager
def live_view(
    spec: RunSpec, more: Callable[[], Mapping[str, str]] = dict
) -> Iterator[Callable[[Mapping[str, Any]], None]]:
    """A table on stderr that follows the evaluations; nothing where stderr is no terminal. `more`: further headings and texts."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda row: None
        return
    with Live(console=console, refresh_per_second=4) as live:
        yield lambda row: live.update(view(spec, row, more()))


def view(spec: RunSpec, row: Mapping[str, Any], more: Mapping[str, str]) -> Table:
    """The table: how the run stands after the evaluation of this row."""
    table = Table(title=f"{spec.robot}, {spec.task}, seed {spec.seed}, world {spec.world}", min_width=64)
    for heading in (
        "evaluation",
        "fitness: simulation",
        "world",
        "goals",
        *_radii(row),
        "diversity",
        "training error",
        *more,
    ):
        table.add_column(heading, justify="right")
    marks = [_mark(row, f"success_{name.replace(' ', '')}" if name in _CM else "success") for name in _radii(row)]
    table.add_row(
        f"{row['evaluation']}/{spec.evaluations}",
        f"{row['fitness_simulation']:.3f}",
        f"{row['fitness_world']:.3f}",
        str(row["goals_reached"]),
        *marks,
        f"{row['diversity']:.2f}",
        f"{row['training_error']:.5f}",
        *more.values(),
    )
    return table


_CM = tuple(f"{cm} cm" for cm in RADII_CM)


def _radii(row: Mapping[str, Any]) -> tuple[str, ...]:
    """Headings of success: a radius each, or one where goals have none."""
    return ("success",) if row[f"success_{RADII_CM[0]}cm"] is None else _CM


def _mark(row: Mapping[str, Any], name: str) -> str:
    return "yes" if row[name] else "ever" if row[f"ever_{name}"] else "no"


@contextmanager
def counting(text: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on stderr to be told (done, of); nothing where stderr is no terminal."""
    console = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
        disable=not console.is_terminal,
    ) as bar:
        task = bar.add_task(text, total=None)
        yield lambda done, of: bar.update(task, completed=done, total=of)
