"""`bns.run`: one run of Bootstrapped Neuro-Simulation."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack, cast

import numpy as np
import pandas as pd

from bns.api.common.progress import Progress, silent
from bns.api.common.shown import Shown, counted
from bns.approaches import check_networked
from bns.bootstrap import loop
from bns.errors import ModelError, SpecError, unknown_name
from bns.measurements import check_table_name
from bns.physics.model import Model
from bns.robots import load_robot
from bns.robots.simulator import StaticSimulator, check_writable, save_simulator
from bns.spec import FIELDS, RADII_CM, RunSpec, evolvable
from bns.sweep.jobs import memory
from bns.sweep.single_run import check_keepable, keep_run
from bns.tasks import default_task, load_task
from bns.worlds import build_world
from bns.worlds.base import RenderableWorld, World
from bns.worlds.logged import LoggedWorld

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BY_HAND = "by-hand"
"""The sweep under whose name the store keeps single runs."""
Row = Mapping[str, Any]
_Path = str | PathLike[str]


class Parameters(TypedDict, total=False):
    """Every other parameter of a run; bounds and meaning as in `bns.spec.RunSpec` (bns run --help)."""

    root_seed: int
    population_size: int
    tournament_size: float
    mutation_rate: float
    real_world_selection_size: float
    evaluations: int
    generations_per_evaluation: int
    training_iterations_per_evaluation: int
    training_algorithm: str
    min_commands: int
    max_commands: int
    record: str
    approach: str
    overhead_s: int


@dataclass(frozen=True, repr=False)
class RunResult(Shown):
    """A run.

    ``result`` holds the arrays of the loop; ``files`` the files that were written, by kind (path, film).
    """

    spec: RunSpec
    result: loop.RunResult
    wall_s: float
    files: Mapping[str, Path]

    @property
    def run_id(self) -> str:
        """The name of the run: a hash of its spec."""
        return self.spec.run_id

    @cached_property
    def evals(self) -> pd.DataFrame:
        """A row an evaluation, with the columns of `bns.load(results)` but those of the spec."""
        return pd.DataFrame(self.result.tables["evals"])

    def table(self, name: str) -> pd.DataFrame:
        """Another table that the run recorded: paths, generations, probes (``record="paths"`` or ``"full"``)."""
        if name not in self.result.tables:
            known = ", ".join(self.result.tables)
            raise SpecError(f"The run has no table {name!r}; it has {known}. record='full' keeps all of them.")
        return pd.DataFrame(self.result.tables[name])

    @property
    def fittest(self) -> np.ndarray:
        """The fittest controller at the end: (commands, components), in the robot's units."""
        return self.result.fittest

    @property
    def success(self) -> bool:
        """Did the fittest controller at the end reach all goals in the world?"""
        return bool(self.result.tables["evals"]["success"][-1])

    def summary(self) -> str:
        """When the goals were first reached, and the fitness of the fittest controller."""
        return _text(self)

    def save_networks(self, path: _Path) -> Path:
        """Write the final networks with their training patterns (.safetensors); `bns.compare` takes them as a model."""
        target = Path(path)
        check_networked(self.spec)
        check_writable(target)
        origin = {"run_id": self.spec.run_id, "spec": self.spec.canonical_json()}
        kept = self.result
        save_simulator(StaticSimulator(kept.networks, kept.weights, np.empty(0), origin, kept.learned_from), target)
        return target

    def render(self, path: _Path) -> Path:
        """Film or draw the fittest controller (.mp4 or .png). ModelError if the world cannot draw it."""
        robot, task = load_robot(self.spec.robot), load_task(self.spec.robot, self.spec.task)
        world = build_world(self.spec.world, robot)
        check_renderable(self.spec, world, Path(path))
        plan = robot.plan(self.result.fittest, self.result.weights if self.result.networks else None, task)
        cast(RenderableWorld, world).render(plan, Path(path))  # checked above
        return Path(path)

    def plot(self, ax: Axes | None = None) -> Axes:
        """The path of the fittest controller: as the robot drove it (solid) and as its networks predict it (dashed), cm."""
        from bns.api.common.axes import drawn  # noqa: PLC0415  # matplotlib is slow to load
        from bns.plotting.style import COLUMN_IN, path_axes  # noqa: PLC0415  # matplotlib is slow to load

        robot, task = load_robot(self.spec.robot), load_task(self.spec.robot, self.spec.task)
        return drawn(
            ax, lambda axes: path_axes(axes, self.spec, task, robot, self.result), (COLUMN_IN, COLUMN_IN + 0.4)
        )

    def _line(self) -> str:
        s, reached = self.spec, "all goals reached" if self.success else "not all goals reached"
        evaluations = counted(s.evaluations, "evaluation")
        return f"{s.robot}, {s.task}, seed {s.seed}, {evaluations} in {self.wall_s:.1f} s: {reached}"


def run(
    robot: str = "khepera",
    task: str | None = None,
    *,
    world: _Path = "substitute",
    seed: int = 0,
    keep: _Path | None = None,
    measurements: _Path | None = None,
    device: str = "cpu",
    progress: Progress | None = None,
    on_evaluation: Callable[[Row], None] | None = None,
    **parameters: Unpack[Parameters],
) -> RunResult:
    """Carry out one run. The same arguments give the same numbers on every machine with the same kind of processor.

    Args:
        robot: khepera or snake; options of a robot follow its name (snake+changes).
        task: a goal task of that robot; by default the first of its study.
        world: substitute, physics, or the file of a model (.yaml) that physics drives.
        seed: of this run, 0 to 2³² - 1.
        keep: the folder of results in which the run is stored and its path is drawn; by default nothing is written.
        measurements: also write what was driven, as a table (.csv, .parquet).
        device: cpu, or cuda for a GPU.
        progress: called with the fraction done and the evaluation.
        on_evaluation: called with each evaluation's row.
        **parameters: all else, such as mutation_rate=0.2, evaluations=50 (`Parameters`).

    Raises:
        SpecError: an unknown parameter, or a value that is not allowed, such as a model in memory as the world.
        ModelError: a model or table that cannot be used.
        StoreError: the run cannot be stored in that folder.
        DeviceError: there is no such GPU.
    """
    given = {"robot": robot, "task": task or default_task(load_robot(robot).name), "world": _named(world), "seed": seed}
    return run_spec(
        asked_spec(given | dict(parameters)),
        keep=keep,
        measurements=measurements,
        device=device,
        progress=progress,
        on_evaluation=on_evaluation,
    )


def _named(world: Any) -> str:
    """The name or the file of a world; SpecError for anything else, since a run's name must say which world it was in."""
    if isinstance(world, str | PathLike):
        return fspath(world)
    what = f"the model {world.name} in memory" if isinstance(world, Model) else f"given as {type(world).__name__}"
    raise SpecError(
        f"world is {what}; give a name (substitute, physics) or the file of a model: model.save('mine.yaml'), then "
        "world='mine.yaml'. For a robot that changes during the run: world='physics>mine.yaml@50'."
    )


def spec_of(given: Mapping[str, Any]) -> RunSpec:
    """The spec of parameters by name; SpecError for a name that there is none of."""
    for name in given:
        if name not in FIELDS:
            raise SpecError(unknown_name("parameter", name, FIELDS))
    return RunSpec(**given)


def asked_spec(given: Mapping[str, Any]) -> RunSpec:
    """The spec of a run that is still to be carried out; SpecError also for values with which nothing would evolve."""
    for name, value in given.items():
        if name in FIELDS:
            evolvable(name, value)
    return spec_of(given)


def run_spec(
    spec: RunSpec,
    *,
    keep: _Path | None = None,
    sweep: str = BY_HAND,
    measurements: _Path | None = None,
    save_networks: _Path | None = None,
    render: _Path | None = None,
    device: str = "cpu",
    progress: Progress | None = None,
    on_evaluation: Callable[[Row], None] | None = None,
) -> RunResult:
    """Carry out the run of a spec; what cannot be written is found before it."""
    robot = load_robot(spec.robot)
    load_task(spec.robot, spec.task)
    table, networks, film = (None if each is None else Path(each) for each in (measurements, save_networks, render))
    if device != "cpu":
        check_gpu(spec, table)
    if film is not None:
        check_renderable(spec, build_world(spec.world, robot), film)
    if networks is not None:
        check_networked(spec)
        check_writable(networks)
    if table is not None:
        check_table_name(table)
    world = build_world(spec.world, robot)
    logged = LoggedWorld(world, robot) if table is not None else None
    if keep is not None:
        check_keepable(spec, Path(keep), sweep, world.digest)
    result = _carried_out(spec, logged or world, device, telling(spec, progress, on_evaluation), keep, sweep)
    if logged is not None and table is not None:
        logged.write(table)
    if networks is not None:
        result.save_networks(networks)
    files = _drawn(result, Path(keep)) if keep is not None else {}
    if film is not None:
        files["moving picture"] = result.render(film)
    return replace(result, files=files)


def _carried_out(
    spec: RunSpec, world: Any, device: str, tell: Callable[[Row], None], keep: _Path | None, sweep: str
) -> RunResult:
    started, wall, cpu = datetime.now(UTC), time.perf_counter(), time.process_time()
    memory.reset_peak()
    result = loop.run(spec, tell, world) if device == "cpu" else _on_gpu(spec, tell)
    wall_s = time.perf_counter() - wall
    if keep is not None:
        keep_run(spec, result, Path(keep), sweep, started, wall_s, time.process_time() - cpu, device)
    return RunResult(spec, result, wall_s, {})


def telling(
    spec: RunSpec, progress: Progress | None, on_evaluation: Callable[[Row], None] | None
) -> Callable[[Row], None]:
    """What is called with each evaluation's row: both of them."""
    told, seen = progress or silent, on_evaluation or (lambda _row: None)

    def tell(row: Row) -> None:
        seen(row)
        told(int(row["evaluation"]) / spec.evaluations, f"evaluation {row['evaluation']} of {spec.evaluations}")

    return tell


def _drawn(run_: RunResult, results: Path) -> dict[str, Path]:
    from bns.plotting.style import path_figure  # noqa: PLC0415  # matplotlib is slow to load

    spec, robot = run_.spec, load_robot(run_.spec.robot)
    stem = results / "figures" / f"run-{spec.task}-{spec.seed}-{spec.run_id}"
    return {"path": path_figure(spec, load_task(spec.robot, spec.task), robot, run_.result, stem)}


def check_gpu(spec: RunSpec, measurements: Path | None) -> None:
    """SpecError or DeviceError if the GPU cannot do this run, before anything is written."""
    from bns.cuda.device import device_name  # noqa: PLC0415  # as below
    from bns.cuda.support import check_supported  # noqa: PLC0415

    if measurements is not None:
        raise SpecError("with a GPU, --measurements is not available; leave out --measurements or --device.")
    check_supported([spec])
    device_name()


def _on_gpu(spec: RunSpec, tell: Callable[[Row], None]) -> loop.RunResult:
    from bns.cuda.single import run as run_there  # noqa: PLC0415  # numba's CUDA support need not be installed

    return run_there(spec, tell)


def check_renderable(spec: RunSpec, world: World, path: Path) -> None:
    """ModelError if this world has no picture of its robot, or none in such a file."""
    if not world.renderable:
        raise ModelError(f"the {spec.world} world of {spec.robot} has nothing to render; leave --render out.")
    check_writable(path)
    cast(RenderableWorld, world).check_picture(path)


def _text(r: RunResult) -> str:
    evals, spec = r.result.tables["evals"], r.spec
    names = [f"success_{cm}cm" for cm in RADII_CM]
    within = [f"  within {cm:2} cm: " for cm in RADII_CM]
    if evals[names[0]][0] is None:
        names, within = ["success"], ["  "]
    reached = [text + _first(evals[name], evals["evaluation"]) for text, name in zip(within, names, strict=True)]
    return "\n".join(
        [
            f"run {spec.run_id}: {spec.robot}, {spec.task}, seed {spec.seed}, {spec.evaluations} evaluations in {r.wall_s:.1f} s",
            "the fittest controller reaches all goals:",
            *reached,
            f"its fitness at the end: {evals['fitness_simulation'][-1]:.3f} in simulation, "
            f"{evals['fitness_world'][-1]:.3f} in the world ({spec.world})",
            *(f"{kind}: {path}" for kind, path in r.files.items()),
        ]
    )


def _first(success: Any, evaluation: Any) -> str:
    if not success.any():
        return "never"
    return f"first at evaluation {evaluation[success][0]}, in {success.mean():.0%} of the evaluations"
