"""The commands that compare models with measurements: import, compare, diagnose, add."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from bns.cli.options.option_types import folder
from bns.cli.parser import Parser, add_trust, data_first

if TYPE_CHECKING:
    from bns.api.common.progress import Progress
    from bns.api.diagnose import DiagnoseResult
    from bns.api.measurements import Measurements
    from bns.api.model import Given

SAYS_LITTLE = 0.03
"""A share so small says nothing yet of how long the whole takes."""
MINUTES = 10.0
"""Of driving, which an experiment takes where nothing else is asked for."""
Adder = Callable[[str, Callable[[argparse.Namespace], int], str], Parser]


def add_commands(command: Adder) -> None:
    """The parsers of these commands; ``command`` makes one of a name, a function and a text."""
    read = command("import", import_, "turn a log with other columns or units into a table of measurements")
    read.add_argument(
        "data",
        type=Path,
        nargs="+",
        metavar="LOG",
        help="a .csv, .tsv, .dat, .txt, .parquet or .tuple file, or a ROS recording (.bag, .mcap, .db3 or its folder); further "
        "files are joined with the first by time",
    )
    read.add_argument(
        "--map", type=Path, metavar="FILE", help="mapping (YAML); default: LOG.import.yaml next to the log"
    )
    read.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="table to write (.csv or .parquet); with --propose the mapping (.yaml)",
    )
    read.add_argument(
        "--propose",
        action="store_true",
        help="print a proposed mapping (YAML), or write it to -o FILE: bns import LOG --propose -o LOG.import.yaml",
    )
    held = command("compare", compare, "show how large the errors of a model are, and where they occur")
    held.add_argument(
        "--beside",
        type=str,
        action="append",
        default=[],
        metavar="M",
        help="a further model: its error on the same windows, and the change with its 95 %% interval (may be repeated)",
    )
    found = command(
        "diagnose", diagnose, "name the physical effect that a model lacks, with its certainty and its alternatives"
    )
    more = command("add", add, "add effects to a model, fit them to measurements, and show the error before and after")
    more.rewrite = data_first
    more.add_argument("data", type=Path, metavar="DATA", help="log: .csv, .parquet, or any file with a mapping")
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
        one.add_argument("data", type=Path, metavar="DATA", help="log: .csv, .parquet, or any file with a mapping")
        one.add_argument("--json", action="store_true", help="print one JSON object")
        one.add_argument("--findings", action="store_true", help="list all irregularities in the data, not only five")
    for one in (held, found, more):
        add_model_options(one)
        one.add_argument("--figures", type=folder, metavar="DIR", help="also write figures into this folder")
    add_effect_options(found)
    add_fresh(held)
    found.add_argument(
        "-o", "--output", type=Path, metavar="NEW.yaml", help="also write the model with all effects and terms that were found"
    )
    for one in (held, more):
        add_trust(one, also=True)


def add_model_options(parser: argparse.ArgumentParser) -> None:
    """Which model, and which robot of the data."""
    parser.add_argument(
        "--model",
        required=True,
        metavar="M",
        help="khepera, differential-drive, snake, a YAML file or an MJCF file (.xml); compare also takes networks (.safetensors, "
        "snake-networks, snake+changes)",
    )
    parser.add_argument(
        "--wheelbase",
        type=float,
        metavar="METRES",
        help="distance between the wheels: needed for differential-drive, in place of its own for any other drive",
    )
    parser.add_argument("--robot", metavar="NAME", help="robot to use, if the column 'robot' of the data names several")
    parser.add_argument(
        "--more",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="further measurements to use together with these (may be repeated)",
    )
    parser.add_argument(
        "--without",
        action="append",
        default=[],
        metavar="TRIAL",
        help="name of a trial to exclude (may be repeated)",
    )


def add_fresh(parser: argparse.ArgumentParser) -> None:
    """Whether an answer from before may be shown."""
    parser.add_argument(
        "--fresh", action="store_true", help="compute the answer again instead of taking it from the cache"
    )


def add_effect_options(parser: argparse.ArgumentParser) -> None:
    """What is tried beside the listed effects."""
    parser.add_argument(
        "--also",
        action="append",
        default=[],
        metavar="FILE.py",
        help="Python file with an effect of your own, tried in addition to the listed ones (may be repeated)",
    )
    parser.add_argument(
        "--without-effect",
        action="append",
        default=[],
        metavar="NAME",
        help="listed effect to exclude, for example because you measured it separately (may be repeated)",
    )
    parser.add_argument(
        "--settings", type=Path, metavar="FILE.yaml", help="file with thresholds that differ from the defaults"
    )
    add_fresh(parser)
    add_trust(parser)


def import_(options: argparse.Namespace) -> int:
    """A log as a table of measurements; the mapping is kept beside it."""
    import yaml

    from bns.diagnose.data.import_log import check_new_mapping, import_log, proposal
    from bns.diagnose.data.mapping import files_behind, load_mapping, refuse_to_replace
    from bns.diagnose.report.text import findings_text
    from bns.errors import DataError
    from bns.measurements import check_table_name, write_measurements

    if options.propose:
        if options.output is not None:
            check_new_mapping(options.output)
        proposed = proposal(options.data)
        if options.output is None:
            print(proposed, end="")
        else:
            options.output.write_text(proposed, encoding="utf-8")
            print(f"Wrote {options.output}, a proposed mapping: check it line by line.")
        return 0
    if options.output is None:
        raise DataError("Give -o FILE, the table to write (.csv or .parquet), or --propose, which prints a mapping.")
    check_table_name(options.output)
    first = options.data[0]
    given = load_mapping(options.map) if options.map else None
    sources = [*files_behind(options.data, given), *([options.map] if options.map else ())]
    refuse_to_replace(options.output, sources, "imported")
    found = import_log(options.data, given)
    write_measurements(found.table, options.output)
    if options.map:
        beside = first.with_name(first.name + ".import.yaml")
        if not beside.exists():
            beside.write_text(yaml.safe_dump(dict(found.mapping or {}), sort_keys=False), encoding="utf-8")
    print(found.summary(str(options.output)))
    print(findings_text(found.findings))
    return 0


def compare(options: argparse.Namespace) -> int:
    """Errors of a model as it is; of a run's networks also why they are wrong."""
    from bns.api.compare import compare as held_against

    model, log = model_of(options), log_of(options)
    with ticking("comparing") as tick:
        seen = held_against(log, model, beside=_beside(options), fresh=options.fresh, progress=tick)
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
            return f"\nNothing was found to add, so {options.output} was not written.\n"
        return f"\n{_written(options)}{_which(found)}\n"
    if extended is None:
        return ""
    return f"\nTo write the model with all this: {shlex.join(['bns', *options.command_line, '-o', 'extended.yaml'])}\n"


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


def log_of(options: argparse.Namespace) -> Measurements:
    """The measurements of the options; what is odd about them goes to stderr."""
    from bns.api.measurements import Measurements
    from bns.diagnose.report.text import findings_text

    log = Measurements(options.data, *options.more, robot=options.robot).without(options.without)
    findings = log.measured.findings
    if findings:
        most = len(findings) if getattr(options, "findings", False) else 5
        print(findings_text(findings, most), file=sys.stderr)
    return log


def refuse_sources(options: argparse.Namespace) -> None:
    """DataError, before anything is computed, if the output would replace the measurements, a mapping or the settings."""
    from bns.diagnose.data.mapping import files_behind, refuse_to_replace

    settings = getattr(options, "settings", None)
    refuse_to_replace(options.output, [*files_behind([options.data, *options.more]), *([settings] if settings else ())])


def words_of(options: argparse.Namespace) -> dict[str, str]:
    """What the commands that follow one of diagnose, propose or report repeat of it."""
    from bns.api.common.next_command import repeated

    limits = {name: getattr(options, name, None) for name in ("minutes", "arena", "start", "speeds")}
    return repeated(
        options.data,
        options.model,
        options.wheelbase,
        options.more,
        robot=options.robot,
        without=options.without,
        also=options.also,
        without_effects=options.without_effect,
        settings=options.settings,
        trust=options.trust,
        **{name: value for name, value in limits.items() if (name, value) != ("minutes", MINUTES)},
    )


def model_of(options: argparse.Namespace) -> Given:
    """The model of the options; the name as it is where it means networks. ModelError also where a wheelbase has no wheels."""
    from bns.api.common.prepared import are_networks
    from bns.api.model import Model, no_wheels
    from bns.errors import ModelError

    if are_networks(options.model):
        if options.wheelbase is not None:
            raise ModelError(no_wheels(str(options.model)))
        return str(options.model)
    return Model(options.model, **({} if options.wheelbase is None else {"wheelbase_m": options.wheelbase}))


def _beside(options: argparse.Namespace) -> list[Given]:
    """The further models; the drive that has no wheelbase of its own takes that of the options."""
    from bns.api.model import Model

    wheels = {} if options.wheelbase is None else {"wheelbase_m": options.wheelbase}
    return [Model(name, **wheels) if wheels and name == "differential-drive" else name for name in options.beside]


def _say_used(how_much: str) -> None:
    if how_much:
        print(how_much, file=sys.stderr)


def _drawn(options: argparse.Namespace, draw: Callable[[Path], Iterator[Path]]) -> None:
    """Figures only where they are asked for: matplotlib takes half a second to load."""
    if options.figures is not None:
        options.figures.mkdir(parents=True, exist_ok=True)
        for figure in draw(options.figures):
            print(f"figure: {figure}", file=sys.stderr)


@contextmanager
def ticking(text: str) -> Iterator[Progress]:
    """A bar on stderr: the share that is done, the time left and what is being looked at; nothing where stderr is no terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _share, _what: None
        return
    began = time.monotonic()
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TextColumn("{task.fields[left]}"))
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task(text, total=1.0, left="")

        def told(share: float | None, what: str) -> None:
            done = bar.tasks[0].completed if share is None else share
            left = time_left(time.monotonic() - began, done)
            bar.update(task, completed=done, description=f"{text}: {what}", left=left)

        yield told


def time_left(lasted_s: float, share: float) -> str:
    """What a piece of work will still take, by what it took so far; "" while that says too little."""
    if share <= SAYS_LITTLE or lasted_s < 1.0:
        return ""
    left = lasted_s * (1.0 - share) / share
    return f"{left:.0f} s left" if left < 90 else f"{left / 60:.0f} min left"
