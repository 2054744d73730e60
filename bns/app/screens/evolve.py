"""Evolve in this model: a short run of Bootstrapped Neuro-Simulation in the world that the model describes, and its path."""

from __future__ import annotations

import panel as pn

from bns.api.run import RunResult, run
from bns.app.figures.floor import GoalFigure
from bns.app.html import table
from bns.app.names import called
from bns.app.parts import WIDE, Problem, drawn, heading, html, row
from bns.app.screens.working import Working
from bns.app.tab import Tab
from bns.plotting.style import floor_poses
from bns.robots import load_robot
from bns.tasks import load_task, task_names

ROBOT = "khepera"
MOST_EVALUATIONS = 200
"""A run of these settings takes seconds to a minute: a look, not a study."""


class EvolvePart:
    """Of the Next screen. The run is that of `bns run --world MODEL.yaml` with the same numbers."""

    def __init__(self, tab: Tab) -> None:
        self._tab, self._problem = tab, Problem()
        self._task = pn.widgets.Select(**called("Task"), options=list(task_names(ROBOT)), width=140)
        self._evaluations = pn.widgets.IntInput(**called("Evaluations"), value=30, start=1, end=MOST_EVALUATIONS, width=110)
        self._seed = pn.widgets.IntInput(**called("Seed"), value=0, start=0, width=90)
        self._said, self._picture = html(), GoalFigure()
        self._work = Working("Evolve in this model", self._begin, lambda: tab.evolution, self._show)
        self._canvas = pn.Column(**WIDE)  # a picture that is hidden has no size to begin with, which Bokeh complains of
        words = (
            "<p>Evolves controllers of a Khepera while networks learn from what the robot does in <b>this model</b>, then drives "
            "the fittest one.</p>"
        )
        self.view = pn.Column(
            heading("Evolve in this model"),
            html(words),
            row(self._task, self._evaluations, self._seed, self._work.buttons, align_items="end"),
            self._problem.view,
            self._work.said,
            self._said,
            self._canvas,
            **WIDE,
        )

    def enter(self) -> None:
        """As the run stands."""
        bench = self._tab.bench
        self.view.visible = bench is not None and bench.on_wheels
        if self.view.visible:
            self._work.enter()

    def _begin(self) -> None:
        bench, state = self._tab.bench, self._tab.now
        if bench is None:
            self._problem.show("Open a log first, on the Data screen.")
            return
        self._problem.show("")
        task, evaluations, seed = self._task.value, int(self._evaluations.value), int(self._seed.value)
        world = self._tab.folder / "evolve.yaml"

        def work(tell: object) -> RunResult:
            bench.shown(state).model.save(world)
            return run(ROBOT, task, world=world, seed=seed, evaluations=evaluations, progress=tell)  # type: ignore[arg-type]

        self._tab.evolution.start("evolving", work)

    def _show(self, result: RunResult) -> None:
        spec, evals = result.spec, result.evals
        robot, task = load_robot(spec.robot), load_task(spec.robot, spec.task)
        reached = "all goals reached" if result.success else "not all goals reached"
        row_ = evals.iloc[-1]
        rows = [[f"{spec.task}, seed {spec.seed}", spec.evaluations, reached, f"{row_['fitness_error']:.3g}"]]
        columns = ["run", "evaluations", "the fittest controller", "fitness error"]
        self._said.object = table(columns, rows, "In the model with the present switches", "bns-evolved")
        driven, foreseen = (floor_poses(robot, poses) for poses in (result.result.world_poses, result.result.snn_poses))
        self._picture.fill(f"{task.title}: the fittest controller", task.goals_m, driven, foreseen)
        self._canvas.objects = [drawn(self._picture.figure)]
