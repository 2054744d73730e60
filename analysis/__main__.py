"""Draw the figures: ``python -m analysis --results results [--from published] [--only NAME] [--out results/figures]``."""

from __future__ import annotations

import argparse
import sys
import traceback
from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track

from analysis.figure_result import FigureResult
from analysis.gallery import write_page
from analysis.labels import source_position
from analysis.publish import forget_all_but, forget_skipped, publish_figure, publish_skipped
from analysis.rendering import Renderer
from analysis.results import PUBLISHED, NoDataError, Results
from bns.errors import BnsError, SpecError
from bns.plotting.style import rendered
from bns.registry import FIGURES

_WAITING = 64
"""Figures that may be drawn and not yet written: each holds its points in memory."""


def figures(broken: list[str] | None = None) -> dict[str, Any]:
    """The figures of this folder and of installed packages by NAME, in the order of the dissertation's numbers.

    SpecError if a package's figure cannot be used; with ``broken`` that is said there, and the others are given.
    """
    found = {}
    for name in FIGURES.names():
        try:
            found[name] = FIGURES.load(name)
        except SpecError as fault:
            if broken is None:
                raise
            broken.append(str(fault))
    return dict(sorted(found.items(), key=lambda one: source_position(one[1].PAPER)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw what the store has data for; 0, 1 where a script failed at it, or 2 with one line on stderr."""
    wanted, failed = _parser().parse_args(arguments), False
    try:
        broken: list[str] = []
        modules = figures(broken) if wanted.only is None else {wanted.only: FIGURES.load(wanted.only)}
        out = wanted.out or wanted.results / "figures"
        for fault in broken:
            print(f"bns: {fault}", file=sys.stderr)
        if wanted.run is not None:
            modules = {name: module for name, module in modules.items() if getattr(module, "OF_A_RUN", False)}
        if not wanted.page:
            failed = not _draw_all(modules, _source(wanted), out, everything=wanted.only is None)
        print(f"page: {write_page(out, wanted.refresh)}")
    except BnsError as fault:
        print(f"bns: {fault}", file=sys.stderr)
        return fault.exit_code
    except KeyboardInterrupt:
        print("interrupted; what is drawn stays. Repeat the command for the rest.", file=sys.stderr)
        return 130
    return int(failed or bool(broken))


def _source(wanted: argparse.Namespace) -> Results:
    """The runs, or an archive of them."""
    if wanted.archive is None:
        return Results(wanted.results, wanted.run)
    place = wanted.results / PUBLISHED if wanted.archive == "published" else Path(wanted.archive)
    return Results(place, wanted.run, archived=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m analysis", description="Draw figures from stored results.")
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of the results (results)")
    parser.add_argument(
        "--from", dest="archive", metavar="FILE", help="draw from an archive (bns archive) instead; published: RESULTS/published"
    )
    parser.add_argument("--only", metavar="NAME", help="one figure: " + ", ".join(FIGURES.names()))
    parser.add_argument("--run", metavar="ID", help="figures and table rows of one run alone")
    parser.add_argument("--out", type=Path, help="folder of the figures (RESULTS/figures)")
    parser.add_argument("--refresh", type=int, metavar="S", help="let the page reload itself every S seconds")
    parser.add_argument("--page", action="store_true", help="write the page from the figures there are; draw none")
    return parser


def _draw_all(modules: dict[str, Any], store: Results, out: Path, *, everything: bool) -> bool:
    """Whether every script could be carried through: one that cannot does not cost the others their figures."""
    console = Console(stderr=True)
    with Renderer(jobs=None if len(modules) > 1 else 1) as renderer:
        drawing = _Drawing(store, out, renderer)
        for name, module in track(modules.items(), "figures", console=console, disable=not console.is_terminal):
            drawing.draw(name, module)
        drawing.publish_all()
    if everything:
        forget_all_but(drawing.made, out)
    return not drawing.failed


class _Drawing:
    """Draws script after script; what is drawn is published, in the order of drawing, once it is rendered."""

    def __init__(self, store: Results, out: Path, renderer: Renderer) -> None:
        self.made: set[str] = set()
        self.failed = False
        self._store, self._out, self._renderer = store, out, renderer
        self._waiting: deque[tuple[str, str, FigureResult, Future[Any] | None]] = deque()

    def draw(self, name: str, module: Any) -> None:
        """What a script draws; where it cannot, that is written down."""
        forget_skipped(name, self._out)
        try:
            for drawn in module.draw(self._store):
                figure = drawn.figure
                rendering = None if figure is None else self._renderer.submit(rendered, figure)
                self._waiting.append((name, module.PAPER, drawn, rendering))
                while len(self._waiting) > _WAITING or (self._waiting and _is_ready(self._waiting[0][3])):
                    self._publish_next()
        except NoDataError as reason:
            self._publish_of(name)
            print(f"{name} ({module.PAPER}) skipped: {reason}")
            self._skip(name, module.PAPER, str(reason))
        except BnsError:
            raise
        except Exception as fault:
            self._publish_of(name)
            self._note_failure(name, module.PAPER, fault)

    def _publish_of(self, name: str) -> None:
        """All that waits, where something of this script does: what is said of the script comes after its figures."""
        if any(name == waiting[0] for waiting in self._waiting):
            self.publish_all()

    def publish_all(self) -> None:
        """Whatever is drawn and not yet written."""
        while self._waiting:
            self._publish_next()

    def _publish_next(self) -> None:
        name, paper, drawn, rendering = self._waiting.popleft()
        try:
            pictures = None if rendering is None else rendering.result()
            place = publish_figure(drawn, pictures, paper, self._store, self._out)
        except BnsError:
            raise
        except Exception as fault:
            self._note_failure(name, paper, fault)
            return
        print(f"{place}  ({paper}, n = {drawn.n:,} runs)")
        self.made.add(drawn.name)

    def _note_failure(self, name: str, paper: str, fault: Exception) -> None:
        self.failed = True
        traceback.print_exception(fault)
        print(f"bns: {name} ({paper}) could not be drawn; the others are", file=sys.stderr)
        self._skip(name, paper, f"its script failed: {type(fault).__name__}: {fault}")

    def _skip(self, name: str, paper: str, why: str) -> None:
        publish_skipped(name, paper, why, self._out)
        self.made.add(name)


def _is_ready(rendering: Future[Any] | None) -> bool:
    return rendering is None or rendering.done()


if __name__ == "__main__":
    sys.exit(main())
