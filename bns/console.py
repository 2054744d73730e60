"""What the terminal shows while work goes on: a live table of a run, progress bars. Nothing where stderr is no terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from bns.spec import RADII_CM, RunSpec


@contextmanager
def live_view(
    spec: RunSpec | None, more: Callable[[], Mapping[str, str]] = dict, now: Callable[[], str] = str
) -> Iterator[LiveView]:
    """A table on stderr that follows the evaluations; nothing where stderr is no terminal.

    `more`: further headings and texts, asked for at each evaluation; `now`: lines beneath, asked for again and again.
    """
    console = Console(stderr=True)
    shown = LiveView(spec, more, now)
    if not console.is_terminal:
        yield shown
        return
    shown.live = Live(console=console, refresh_per_second=4, get_renderable=shown.picture)
    with shown.live:
        yield shown


class LiveView:
    """Is called with each evaluation's row. Without a terminal it has no `live` and shows nothing."""

    def __init__(self, spec: RunSpec | None, more: Callable[[], Mapping[str, str]], now: Callable[[], str]) -> None:
        self._spec, self._more, self._now = spec, more, now
        self._table: Table | str = ""
        self.live: Live | None = None

    def __call__(self, row: Mapping[str, Any]) -> None:
        """Show the table as it stands after this evaluation."""
        if self.live is not None and self._spec is not None:
            self._table = view(self._spec, row, self._more())
            self.live.refresh()

    def picture(self) -> Group:
        """What stands on the terminal."""
        return Group(self._table, Text(self._now()))

    @contextmanager
    def suspended(self) -> Iterator[None]:
        """The terminal is somebody else's: a question is not drawn over."""
        if self.live is None:
            yield
            return
        self.live.stop()
        try:
            yield
        finally:
            self.live.start()


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
