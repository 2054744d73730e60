"""One run by hand: what the terminal shows while it goes on, and what is kept at its end."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, cast

import numpy as np

from bns.bootstrap.loop import RunResult, run
from bns.console import live_view
from bns.errors import ModelError, SpecError
from bns.measurements import check_table_name
from bns.plotting.style import path_figure
from bns.robots import load_robot
from bns.robots.simulator import StaticSimulator, check_writable, save_simulator
from bns.spec import RADII_CM, RunSpec
from bns.store.reader import finished
from bns.sweep import memory
from bns.sweep.digests import WorldDigests
from bns.sweep.single_run import keep_run, patient_writer
from bns.tasks import load_task
from bns.worlds import build_world
from bns.worlds.base import RenderableWorld, World
from bns.worlds.logged import LoggedWorld


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
    with patient_writer(results, sweep):  # what does not fit is better found before the run than after it
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
        cast(RenderableWorld, world).render(robot.plan(result.fittest, result.weights, task), render)  # checked above
        told += f"\nmoving picture: {render}"
    return told


def check_gpu(spec: RunSpec, measurements: Path | None) -> None:
    """SpecError or DeviceError if the GPU cannot do this run, before anything is written."""
    from bns.cuda.device import device_name  # as below
    from bns.cuda.support import check_supported

    if measurements is not None:
        raise SpecError("a GPU does not tell what was driven; leave out --measurements or --device.")
    check_supported([spec])
    device_name()


def _run_on_gpu(spec: RunSpec, progress: Callable[[Mapping[str, Any]], None]) -> RunResult:
    from bns.cuda.single import run as run_there  # loads numba's CUDA support, which need not be installed

    return run_there(spec, progress)


def check_renderable(spec: RunSpec, world: World, path: Path) -> None:
    """ModelError if this world has no picture of its robot, or none in such a file."""
    if not world.renderable:
        raise ModelError(f"the {spec.world} world of {spec.robot} has nothing to render; leave --render out.")
    check_writable(path)
    cast(RenderableWorld, world).check_picture(path)


def _check_world(spec: RunSpec, results: Path, sweep: str, digest: str) -> None:
    if finished(results, sweep):
        digests = WorldDigests(results, sweep)
        digests.read()
        digests.compare(spec.task, spec.world, digest)


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
