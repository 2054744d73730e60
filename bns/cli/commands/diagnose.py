"""The commands that compare models with measurements: compare, diagnose, add."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from bns.cli.options.measuring_options import (
    add_effect_options,
    add_fresh,
    add_log,
    add_model_options,
    beside_of,
    log_of,
    model_of,
    refuse_sources,
    words_of,
)
from bns.cli.options.option_types import folder
from bns.cli.parser import Adder, add_trust, data_first
from bns.cli.progress_bar import ticking

if TYPE_CHECKING:
    from bns.api.diagnose import DiagnoseResult


def add_commands(command: Adder) -> None:
    """The parsers of these commands; ``command`` makes one of a name, a function and a text."""
    held = command("compare", compare, "show how large the errors of a model are, and where they occur")
    held.add_argument(
        "--beside",
        type=str,
        action="append",
        default=[],
        metavar="MODEL",
        help="a further model: its error on the same windows, and the change with its 95 %% interval (may be repeated)",
    )
    found = command(
        "diagnose", diagnose, "name the physical effect that a model lacks, with its certainty and its alternatives"
    )
    more = command("add", add, "add effects to a model, fit them to measurements, and show the error before and after")
    more.rewrite = data_first
    add_log(more)
    more.add_argument(
        "effects",
        nargs="+",
        metavar="EFFECT",
        help="names of effects or Python files; with --term, one of them is a new name, for the formula",
    )
    more.add_argument("--term", metavar="FORMULA", help="a formula for the name that is no listed effect's: 'k * v * abs(w)'")
    more.add_argument(
        "--on",
        default="v",
        metavar="VELOCITY",
        help="velocity that the formula is added to: v (forward), w (turn rate), s (sideways), east, north, "
        "share (relative change of all three), wheels (each by itself), left, right (default: v)",
    )
    more.add_argument(
        "--per-trial",
        action="store_true",
        help="fit a separate value for each trial (for clock-offset: clocks that are set again each time)",
    )
    more.add_argument("-o", "--output", type=Path, required=True, metavar="NEW.yaml", help="file to write: the extended model")
    more.add_argument("--json", action="store_true", help="print one JSON object")
    for one in (held, found):
        add_log(one)
        one.add_argument("--json", action="store_true", help="print one JSON object")
    for one in (held, found, more):
        add_model_options(one, networks=one is held)
        one.add_argument("--figures", type=folder, metavar="DIR", help="also write figures into this folder")
    add_effect_options(found)
    add_fresh(held)
    found.add_argument(
        "-o", "--output", type=Path, metavar="NEW.yaml", help="also write the model with all effects and terms that were found"
    )
    for one in (held, more):
        add_trust(one, once_also=True)


def compare(options: argparse.Namespace) -> int:
    """Errors of a model as it is; of a run's networks also why they are wrong."""
    from bns.api.compare import compare as held_against

    model, log = model_of(options), log_of(options)
    with ticking("comparing") as tick:
        seen = held_against(log, model, beside=beside_of(options), fresh=options.fresh, progress=tick)
    _say_used(seen.used)
    if seen.of_networks and seen.causes is None:
        print(
            "bns: these networks come without their training patterns, so the causes of their errors cannot be given",
            file=sys.stderr,
        )
    print(json.dumps(seen.to_json()) if options.json else seen.summary())
    causes = seen.causes

    def draw(folder: Path) -> Iterator[Path]:
        from bns.diagnose.report.figures import comparison_figure
        from bns.diagnose.report.network_figure import network_errors_figure

        yield comparison_figure(seen.comparison, folder / "comparison")
        if causes is not None:
            yield network_errors_figure(causes, folder / "network-errors")

    _drawn(options, draw)
    return 0


def diagnose(options: argparse.Namespace) -> int:
    """The verdict on what a model lacks."""
    from bns.api.model import checked_target

    if options.output is not None:
        checked_target(options.output)
        refuse_sources(options)
    found = diagnosed(options)
    extended = found.extended
    if options.output is not None and extended is not None:
        extended.save(options.output)
    print(json.dumps(found.to_json()) if options.json else found.summary(words_of(options)))
    if not options.json:
        print(_where_written(options, found), end="")

    def draw(folder: Path) -> Iterator[Path]:
        from bns.diagnose.report.figures import diagnosis_figure

        if found.diagnosis.selection is not None:
            yield diagnosis_figure(found.diagnosis, folder / "diagnosis")

    _drawn(options, draw)
    return 0


def _which(found: DiagnoseResult) -> str:
    """Which of several explanations a model has that was written."""
    if not found.diagnosis.selection or not found.diagnosis.selection.competing_models:
        return ""
    return (
        f"\nOf the explanations that cannot be told apart it has the first: {', '.join(found.effects)}. For another one, name "
        "its effects to `bns add`."
    )


def _where_written(options: argparse.Namespace, found: DiagnoseResult) -> str:
    """Where the model with all that was found is, or how to have it written; "" if nothing was found and nothing asked for."""
    extended = found.extended
    if options.output is not None:
        if extended is None:
            return f"\n{_why_not(found)}, so {options.output} was not written.\n"
        return f"\n{_written(options)}{_which(found)}\n"
    if extended is None:
        return ""
    return f"\nTo write the model with all this: {shlex.join(['bns', *options.command_line, '-o', 'extended.yaml'])}\n"


def _why_not(found: DiagnoseResult) -> str:
    """Why there is no model with more than the given one has."""
    if found.verdict != "unlisted":
        return "Nothing was found to add"
    with_terms = found.diagnosis.errors_with_terms
    if with_terms is not None and with_terms.fell_in_the_end:
        return "What was found lowers some errors and raises others (see the notes)"
    return "Nothing that was found lowers the error"


def _written(options: argparse.Namespace) -> str:
    """Where the new model is, and what became of the old one."""
    given = Path(options.model)
    replaced = given.exists() and given.resolve() == options.output.resolve()
    old = "in the place of the model as given" if replaced else f"the old model is unchanged ({options.model})"
    return f"written to {options.output}; {old}"


def diagnosed(options: argparse.Namespace) -> DiagnoseResult:
    """The diagnosis of what the options' model lacks on their data."""
    from bns.api.diagnose import diagnose as find

    model, log = model_of(options), log_of(options)
    with ticking("diagnosing") as tick:
        found = find(
            log,
            model,
            also=options.also,
            without_effects=options.without_effect,
            settings=options.settings,
            fresh=options.fresh,
            progress=tick,
        )
    _say_used(found.ready.thinned)
    return found


def add(options: argparse.Namespace) -> int:
    """An extended model, as a new file."""
    from bns.api.add import add as fitted
    from bns.api.model import checked_target

    checked_target(options.output)
    refuse_sources(options)
    model, log = model_of(options), log_of(options)
    with ticking("fitting") as tick:
        result = fitted(
            log,
            options.effects,
            model,
            term=options.term,
            on=options.on,
            per_trial=options.per_trial,
            progress=tick,
        )
    _say_used(result.ready.thinned)
    result.model.save(options.output)
    print(json.dumps(result.to_json()) if options.json else result.summary())
    if not options.json:
        print(_written(options))

    def draw(folder: Path) -> Iterator[Path]:
        from bns.diagnose.report.figures import error_by_step_figure

        yield error_by_step_figure(result.extended, folder / "ladder")

    _drawn(options, draw)
    return 0
def _say_used(how_much: str) -> None:
    if how_much:
        print(how_much, file=sys.stderr)


def _drawn(options: argparse.Namespace, draw: Callable[[Path], Iterator[Path]]) -> None:
    """Figures only where they are asked for: matplotlib takes half a second to load."""
    if options.figures is not None:
        options.figures.mkdir(parents=True, exist_ok=True)
        for figure in draw(options.figures):
            print(f"figure: {figure}", file=sys.stderr)
