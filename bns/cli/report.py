"""The commands that make something of a diagnosis: propose the next experiment, report to people."""

from __future__ import annotations

import argparse
import json
import math
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from bns.cli.diagnose import Adder, add_effect_options, add_model_options, diagnosed, ticking
from bns.errors import DataError

if TYPE_CHECKING:
    from bns.diagnose.data.tracks import Tracks
    from bns.diagnose.design.proposal import Proposal
    from bns.diagnose.diagnosis import Diagnosis
    from bns.physics.model import Model

_MOST_MINUTES = 600.0


def add_commands(command: Adder) -> None:
    """The parsers of these commands; ``command`` makes one of a name, a function and a text."""
    next_one = command("propose", propose, "the next experiment: commands that tell rival explanations apart")
    next_one.add_argument("-o", "--output", type=Path, metavar="FILE.csv", help="trial file for bns trial --commands")
    next_one.add_argument("--json", action="store_true", help="one JSON object on stdout")
    page = command("report", report, "one HTML page for people: what is missing, how sure that is, what to do next")
    page.add_argument("-o", "--output", type=Path, metavar="FILE.html", default=Path("report.html"), help="the page")
    for one in (next_one, page):
        one.add_argument("data", type=Path, metavar="DATA", help="measurements (.csv or .parquet)")
        add_experiment_options(one)
        add_model_options(one)
        add_effect_options(one)


def add_experiment_options(parser: argparse.ArgumentParser) -> None:
    """How long, where and how fast."""
    parser.add_argument("--minutes", type=float, default=10.0, metavar="N", help="of driving (default: 10)")
    parser.add_argument("--arena", metavar="WxH", help="where the robot may be, metres (default: where it was seen)")
    parser.add_argument(
        "--start", metavar="X,Y,DEG", help="where each trial starts: metres, degrees from east (--start=0,0,90)"
    )
    parser.add_argument("--speeds", metavar="LOW,HIGH", help="of a wheel, m/s (default: the robot's, and those seen)")


def propose(options: argparse.Namespace) -> int:
    """Trials that tell the rivals apart, as a file that `bns trial` drives."""
    from bns.diagnose.report.proposal_text import proposal_text
    from bns.store.files import publish

    _check(options, "The commands", ".csv")
    out = options.output
    _, predictor, model, found = diagnosed(options)
    proposal = proposed(options, found, predictor.tracks, model)
    written = ""
    if out is not None and len(proposal.plan):
        publish(proposal.commands().to_csv(index=False).encode(), out.with_name(f".{out.name}.part"), out)
        written = str(out)
    print(json.dumps(proposal.as_json()) if options.json else proposal_text(proposal, written))
    if out is not None and not written:
        print(f"{out} is not written: no commands would decide anything", file=sys.stderr)
    return 0


def report(options: argparse.Namespace) -> int:
    """The page."""
    from bns.diagnose.report.page import gathered, report_html
    from bns.store.files import publish

    _check(options, "The report", ".html")
    out = options.output
    measured, predictor, model, found = diagnosed(options)
    with ticking("reporting") as tick:
        material = gathered(
            measured, predictor, model, found, lambda: proposed(options, found, predictor.tracks, model), tick
        )
    page = report_html(material, _repeated(options)).encode()
    publish(page, out.with_name(f".{out.name}.part"), out)
    print(
        f"verdict: {found.verdict}\nwritten to {out} ({len(page) / 1e6:.1f} MB): one file, to be opened in a browser or mailed"
    )
    return 0


def _repeated(options: argparse.Namespace) -> dict[str, str]:
    """Words of this command that the next ones repeat."""
    base = [] if options.wheelbase is None else ["--wheelbase", f"{options.wheelbase:g}"]
    return {"data": shlex.quote(str(options.data)), "model": shlex.join(["--model", str(options.model), *base])}


def proposed(options: argparse.Namespace, found: Diagnosis, tracks: Tracks, model: Model) -> Proposal:
    """The experiment for a diagnosis, within what the options allow."""
    from bns.diagnose.design.limits import arena_of, bounds_of
    from bns.diagnose.design.proposal import propose as search

    arena, bounds = arena_of(tracks, options.arena, options.start), bounds_of(tracks, model, options.speeds)
    with ticking("planning") as tick:
        return search(found, arena, bounds, options.minutes, tick=tick)


def _check(options: argparse.Namespace, what: str, ending: str) -> None:
    """What can be seen to be wrong before the work begins."""
    if not (math.isfinite(options.minutes) and 0 < options.minutes <= _MOST_MINUTES):
        raise DataError(f"--minutes is {options.minutes:g}; it must be above 0 and at most {_MOST_MINUTES:g}.")
    out = options.output
    if out is not None and (out.suffix != ending or not out.parent.is_dir()):
        raise DataError(
            f"{what} cannot be written to {out}; give a name that ends in {ending}, in a folder that is there."
        )
