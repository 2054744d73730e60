"""Draw the figures: ``python -m analysis --results results [--from published] [--only NAME] [--out results/figures]``."""

from __future__ import annotations

import argparse
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track

from analysis.gallery import write_page
from analysis.labels import source_position
from analysis.publish import forget_all_but, forget_skipped, publish_figure, publish_skipped
from analysis.results import PUBLISHED, NoDataError, Results
from bns.errors import BnsError, SpecError
from bns.registry import FIGURES


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
    made, failed = set(), False
    console = Console(stderr=True)
    for name, module in track(modules.items(), "figures", console=console, disable=not console.is_terminal):
        try:
            forget_skipped(name, out)
            for drawn in module.draw(store):
                place = publish_figure(drawn, module.PAPER, store, out)
                print(f"{place}  ({module.PAPER}, n = {drawn.n:,} runs)")
                made.add(drawn.name)
        except NoDataError as reason:
            print(f"{name} ({module.PAPER}) skipped: {reason}")
            publish_skipped(name, module.PAPER, str(reason), out)
            made.add(name)
        except BnsError:
            raise
        except Exception as fault:
            failed = True
            traceback.print_exc()
            print(f"bns: {name} ({module.PAPER}) could not be drawn; the others are", file=sys.stderr)
            publish_skipped(name, module.PAPER, f"its script failed: {type(fault).__name__}: {fault}", out)
            made.add(name)
    if everything:
        forget_all_but(made, out)
    return not failed


if __name__ == "__main__":
    sys.exit(main())
