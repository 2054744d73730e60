"""The commands that hold models against measurements: import, compare, diagnose, add."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import yaml

from bns.errors import DataError, ModelError

if TYPE_CHECKING:
    from bns.diagnose.data.load import Measured
    from bns.diagnose.diagnosis import Diagnosis
    from bns.diagnose.predict.base import Predictor
    from bns.diagnose.predict.wheels import WheelPredictor
    from bns.physics.model import Model

Adder = Callable[[str, Callable[[argparse.Namespace], int], str], argparse.ArgumentParser]


def add_commands(command: Adder) -> None:
    """The parsers of these commands; ``command`` makes one of a name, a function and a text."""
    read = command("import", import_, "turn a log with other columns or units into a table of measurements")
    read.add_argument("data", type=Path, metavar="LOG", help="a .csv or .parquet file")
    read.add_argument(
        "--map", type=Path, metavar="FILE", help="mapping (YAML); default: LOG.import.yaml beside the log"
    )
    read.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FILE", help="table to write (.csv or .parquet)"
    )
    held = command("compare", compare, "hold a model against measurements: how far it is off, and where")
    found = command(
        "diagnose", diagnose, "which physical effect a model lacks, how sure that is, and what else it could be"
    )
    more = command("add", add, "add effects to a model, fit it to measurements, and show the error before and after")
    more.add_argument(
        "effects", nargs="+", metavar="EFFECT", help="names of effects, Python files, or one name with --term"
    )
    more.add_argument("--term", metavar="FORMULA", help="a formula instead of a listed effect: 'k * v * abs(w)'")
    more.add_argument(
        "--on", default="v", metavar="VELOCITY", help="what the formula is added to: v, w, s, east, north"
    )
    more.add_argument(
        "--per-trial",
        action="store_true",
        help="every trial has a value of its own (clock-offset: clocks set anew each time)",
    )
    more.add_argument("-o", "--output", type=Path, required=True, metavar="NEW.yaml", help="the mended model")
    more.add_argument("--data", type=Path, required=True, metavar="FILE", help="measurements (.csv or .parquet)")
    for one in (held, found):
        one.add_argument("data", type=Path, metavar="DATA", help="measurements (.csv or .parquet)")
        one.add_argument("--json", action="store_true", help="one JSON object on stdout")
        one.add_argument("--findings", action="store_true", help="list everything odd in the data")
    for one in (held, found, more):
        add_model_options(one)
        one.add_argument("--figures", type=Path, metavar="DIR", help="also draw figures into this folder")
    add_effect_options(found)


def add_model_options(parser: argparse.ArgumentParser) -> None:
    """Which model, and which robot of the data."""
    parser.add_argument(
        "--model",
        required=True,
        metavar="M",
        help="khepera, differential-drive, a YAML file; for compare also networks (.safetensors), snake, snake+changes",
    )
    parser.add_argument(
        "--wheelbase", type=float, metavar="METRES", help="distance of the wheels, for differential-drive"
    )
    parser.add_argument("--robot", metavar="NAME", help="which robot, where a column robot names several")
    parser.add_argument(
        "--more",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="further measurements, taken together with these",
    )


def add_effect_options(parser: argparse.ArgumentParser) -> None:
    """What is tried beside the listed effects."""
    parser.add_argument(
        "--also",
        action="append",
        default=[],
        metavar="FILE.py",
        help="an effect of your own to try beside the listed ones",
    )


def import_(options: argparse.Namespace) -> int:
    """A log as a table of measurements; the mapping is kept beside it."""
    from bns.diagnose.data.apply_mapping import applied
    from bns.diagnose.data.checks import checked
    from bns.diagnose.data.guess_mapping import drafted
    from bns.diagnose.data.load import read_table
    from bns.diagnose.data.mapping import load_mapping, mapping_beside
    from bns.diagnose.report.text import findings_text
    from bns.measurements import write_measurements

    table = read_table(options.data)
    mapping = load_mapping(options.map) if options.map else mapping_beside(options.data)
    if mapping is None:
        raise DataError(
            f"There is no mapping beside {options.data}, which has the columns {', '.join(map(str, table.columns))}. Write "
            f"{options.data.name}.import.yaml, or give such a file with --map; docs/logs.md has all that may stand in it. "
            f"A beginning, guessed from the names, to be checked line by line:\n\n{drafted(table)}"
        )
    table = applied(table, mapping, options.data.parent, read_table)
    checked_table, findings = checked(table)
    write_measurements(table, options.output)
    if options.map:
        beside = options.data.with_name(options.data.name + ".import.yaml")
        if not beside.exists():
            beside.write_text(yaml.safe_dump(mapping, sort_keys=False), encoding="utf-8")
    print(f"{len(table)} rows of {checked_table['trial'].nunique()} trials written to {options.output}")
    print(findings_text(tuple(findings)))
    return 0


def compare(options: argparse.Namespace) -> int:
    """Errors of a model as it is; of a run's networks also why they are wrong."""
    from bns.diagnose.comparison import compare as hold
    from bns.diagnose.predict.networks import NetworkPredictor
    from bns.diagnose.report.figures import comparison_figure
    from bns.diagnose.report.network_text import network_errors_figure, network_errors_text
    from bns.diagnose.report.text import comparison_text
    from bns.diagnose.residuals.network_errors import why_wrong

    networks = _networks(options)
    held: tuple[Measured, Predictor, Model]
    held = ready(options, slim=False) if networks is None else _ready_with_networks(options, *networks)
    measured, predictor, model = held
    with ticking("comparing"):
        result = hold(predictor, model)
        kept = isinstance(predictor, NetworkPredictor) and predictor.learned_from.size > 0
        why = why_wrong(cast("NetworkPredictor", predictor)) if kept else None
    if isinstance(predictor, NetworkPredictor) and not kept:
        print(
            "bns: these networks come without their training patterns, so why they are wrong is not said",
            file=sys.stderr,
        )
    if options.json:
        causes = {} if why is None else {"causes": why.as_json()}
        print(json.dumps({**result.as_json(), **causes, "findings": [vars(f) for f in measured.findings]}))
    else:
        print(comparison_text(result))
        if why is not None:
            print(f"\n{network_errors_text(why)}")
    _drawn(options, lambda folder: comparison_figure(result, folder / "comparison"))
    if why is not None:
        _drawn(options, lambda folder: network_errors_figure(why, folder / "network-errors"))
    return 0


def diagnose(options: argparse.Namespace) -> int:
    """The verdict on what a model lacks."""
    from bns.diagnose.report.figures import diagnosis_figure
    from bns.diagnose.report.text import diagnosis_text

    _, _, _, result = diagnosed(options)
    print(json.dumps(result.as_json()) if options.json else diagnosis_text(result))
    if result.selection is not None:
        _drawn(options, lambda folder: diagnosis_figure(result, folder / "diagnosis"))
    return 0


def diagnosed(options: argparse.Namespace) -> tuple[Measured, WheelPredictor, Model, Diagnosis]:
    """Data, predictor and model of the options, and the diagnosis of what the model lacks."""
    from bns.diagnose.diagnosis import diagnose as find
    from bns.physics.effects import effect_in_file

    own = {effect.name: effect for effect in map(effect_in_file, map(Path, options.also))}
    measured, predictor, model = ready(options)
    with ticking("diagnosing") as tick:
        return measured, predictor, model, find(predictor, model, extra=own, tick=tick)


def add(options: argparse.Namespace) -> int:
    """A mended model, as a new file."""
    from bns.diagnose.adding import add_effects, effect_from, model_yaml
    from bns.diagnose.report.figures import error_by_step_figure
    from bns.diagnose.report.text import extension_text
    from bns.store.files import publish

    if options.output.suffix not in {".yaml", ".yml"}:
        raise ModelError(f"The mended model cannot be written to {options.output}; let the name end in .yaml.")
    if options.term is not None and len(options.effects) != 1:
        raise ModelError(f"A formula needs one name, not {', '.join(options.effects)}: bns add NAME --term … --on …")
    effects = [effect_from(name, options.term, options.on) for name in options.effects]
    measured, predictor, model = ready(options)
    with ticking("fitting"):
        extended = add_effects(predictor, model, effects, measured, options.per_trial)
    publish(
        model_yaml(extended.model).encode(), options.output.with_name(f".{options.output.name}.part"), options.output
    )
    print(extension_text(extended))
    print(f"written to {options.output}; the model before is as it was ({options.model})")
    _drawn(options, lambda folder: error_by_step_figure(extended, folder / "ladder"))
    return 0


def ready(options: argparse.Namespace, *, slim: bool = True) -> tuple[Measured, WheelPredictor, Model]:
    """Data, predictor and model of the options; what is odd about the data goes to stderr.

    ``slim``: of very many poses only some are taken, as fits need.
    """
    from bns.diagnose.data.cycles import CycleTracks
    from bns.diagnose.predict.check_robot import check_named_robot, check_same_robot
    from bns.diagnose.predict.wheels import WheelPredictor, predictor_for_search

    if _networks(options) is not None:
        raise ModelError(f"{options.model} holds networks, which have no effects: they can be compared, not diagnosed.")
    model = _model(options)
    measured = _measured(options)
    check_named_robot(measured.robot, model)
    if isinstance(measured.tracks, CycleTracks):
        raise DataError(
            f"{options.data} holds cycles and markers, and the model {options.model} drives wheels; "
            "compare them with networks: --model snake, or a file (.safetensors) of bns run --robot snake --save-snn FILE."
        )
    predictor = predictor_for_search(measured.tracks) if slim else WheelPredictor(measured.tracks)
    used, there = len(predictor.tracks.t_s), len(measured.tracks.t_s)
    if used < there:
        print(f"{used} of {there} poses are used, evenly chosen; all commands are", file=sys.stderr)
        measured = replace(measured, tracks=predictor.tracks)
    check_same_robot(predictor, model)
    return measured, predictor, model


def _ready_with_networks(options: argparse.Namespace, file: Path, robot: str) -> tuple[Measured, Predictor, Model]:
    """Data and networks that predict them; the model has no effects of its own."""
    from bns.diagnose.predict.saved_networks import network_predictor
    from bns.physics.model import Model

    measured = _measured(options)
    return measured, network_predictor(file, measured.tracks, robot), Model(wheelbase_m=1.0, name=options.model)


def _networks(options: argparse.Namespace) -> tuple[Path, str] | None:
    from bns.diagnose.predict.saved_networks import networks_file
    from bns.physics.model import model_names

    return networks_file(options.model, model_names())


def _measured(options: argparse.Namespace) -> Measured:
    from bns.diagnose.data.load import load_measured
    from bns.diagnose.report.text import findings_text

    measured = load_measured(options.data, options.robot, options.more)
    if measured.findings:
        most = len(measured.findings) if getattr(options, "findings", False) else 5
        print(findings_text(measured.findings, most), file=sys.stderr)
    return measured


def _model(options: argparse.Namespace) -> Model:
    from bns.physics.model import Model, load_model

    if options.model == "differential-drive":
        if options.wheelbase is None:
            raise ModelError("The model differential-drive needs its wheelbase: --wheelbase METRES.")
        return Model(wheelbase_m=options.wheelbase, name="differential-drive")
    model = load_model(options.model)
    return model if options.wheelbase is None else replace(model, wheelbase_m=options.wheelbase)


def _drawn(options: argparse.Namespace, draw: Callable[[Path], Path]) -> None:
    if options.figures is not None:
        options.figures.mkdir(parents=True, exist_ok=True)
        print(f"figure: {draw(options.figures)}", file=sys.stderr)


@contextmanager
def ticking(text: str) -> Iterator[Callable[[str], None]]:
    """A line on stderr that says what is being looked at; nothing where stderr is no terminal."""
    from rich.console import Console
    from rich.status import Status

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _: None
        return
    with Status(text, console=console) as line:
        yield lambda what: line.update(f"{text}: {what}")
