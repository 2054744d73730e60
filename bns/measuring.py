"""The commands that hold models against measurements: import, compare, diagnose, add."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from bns.errors import DataError, ModelError

if TYPE_CHECKING:
    from bns.diagnose.intake import Measured
    from bns.diagnose.wheels import WheelPredictor
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
        "--per-trial", action="store_true", help="every trial has a value of its own (clock-offset: clocks set anew each time)"
    )
    more.add_argument("-o", "--output", type=Path, required=True, metavar="NEW.yaml", help="the mended model")
    more.add_argument("--data", type=Path, required=True, metavar="FILE", help="measurements (.csv or .parquet)")
    found.add_argument(
        "--also", action="append", default=[], metavar="FILE.py", help="an effect of your own to try beside the listed ones"
    )
    for one in (held, found):
        one.add_argument("data", type=Path, metavar="DATA", help="measurements (.csv or .parquet)")
        one.add_argument("--json", action="store_true", help="one JSON object on stdout")
        one.add_argument("--findings", action="store_true", help="list everything odd in the data")
    for one in (held, found, more):
        one.add_argument(
            "--model",
            required=True,
            metavar="M",
            help="khepera, differential-drive, a YAML file; networks (.safetensors) for compare",
        )
        one.add_argument(
            "--wheelbase", type=float, metavar="METRES", help="distance of the wheels, for differential-drive"
        )
        one.add_argument("--robot", metavar="NAME", help="which robot, where a column robot names several")
        one.add_argument("--figures", type=Path, metavar="DIR", help="also draw figures into this folder")


def import_(options: argparse.Namespace) -> int:
    """A log as a table of measurements; the mapping is kept beside it."""
    from bns.diagnose.checks import checked
    from bns.diagnose.importing import applied, load_mapping, mapping_beside
    from bns.diagnose.intake import read_table
    from bns.diagnose.words import findings_text
    from bns.measurements import write_measurements

    table = read_table(options.data)
    mapping = load_mapping(options.map) if options.map else mapping_beside(options.data)
    if mapping is None:
        raise DataError(
            f"There is no mapping beside {options.data}, which has the columns {', '.join(map(str, table.columns))}. Write "
            f"{options.data.name}.import.yaml with an entry such as x_m: {{from: COLUMN, unit: cm}} for each column under "
            "the key columns, or give such a file with --map."
        )
    table = applied(table, mapping)
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
    """Errors of a model as it is."""
    from bns.diagnose.comparison import compare as hold
    from bns.diagnose.figures import comparison_figure
    from bns.diagnose.words import comparison_text

    measured, predictor, model = _ready(options, networks=True)
    with _ticking("comparing"):
        result = hold(predictor, model)
    if options.json:
        print(json.dumps({**result.as_json(), "findings": [vars(f) for f in measured.findings]}))
    else:
        print(comparison_text(result))
    _drawn(options, lambda folder: comparison_figure(result, folder / "comparison"))
    return 0


def diagnose(options: argparse.Namespace) -> int:
    """The verdict on what a model lacks."""
    from bns.diagnose.diagnosis import diagnose as find
    from bns.diagnose.figures import diagnosis_figure
    from bns.diagnose.words import diagnosis_text
    from bns.physics.effects import effect_in_file

    own = {effect.name: effect for effect in map(effect_in_file, map(Path, options.also))}
    _, predictor, model = _ready(options)
    with _ticking("diagnosing") as tick:
        result = find(predictor, model, extra=own, tick=tick)
    print(json.dumps(result.as_json()) if options.json else diagnosis_text(result))
    if result.found is not None:
        _drawn(options, lambda folder: diagnosis_figure(result, folder / "diagnosis"))
    return 0


def add(options: argparse.Namespace) -> int:
    """A mended model, as a new file."""
    from bns.diagnose.adding import add_effects, effect_from, model_yaml
    from bns.diagnose.figures import ladder_figure
    from bns.diagnose.words import mended_text
    from bns.store.files import publish

    if options.output.suffix not in {".yaml", ".yml"}:
        raise ModelError(f"The mended model cannot be written to {options.output}; let the name end in .yaml.")
    if options.term is not None and len(options.effects) != 1:
        raise ModelError(f"A formula needs one name, not {', '.join(options.effects)}: bns add NAME --term … --on …")
    effects = [effect_from(name, options.term, options.on) for name in options.effects]
    measured, predictor, model = _ready(options)
    with _ticking("fitting"):
        mended = add_effects(predictor, model, effects, measured, options.per_trial)
    publish(model_yaml(mended.model).encode(), options.output.with_name(f".{options.output.name}.part"), options.output)
    print(mended_text(mended))
    print(f"written to {options.output}; the model before is as it was ({options.model})")
    _drawn(options, lambda folder: ladder_figure(mended, folder / "ladder"))
    return 0


def _ready(options: argparse.Namespace, networks: bool = False) -> tuple[Measured, WheelPredictor, Model]:
    """Data, predictor and model of the options; what is odd about the data goes to stderr."""
    from bns.diagnose.fitting_robot import check_named_robot, check_same_robot
    from bns.diagnose.intake import load_measured
    from bns.diagnose.networks import NetworkPredictor
    from bns.diagnose.wheels import WheelPredictor, predictor_for_search
    from bns.diagnose.words import findings_text
    from bns.physics.model import Model

    of_networks = options.model.endswith(".safetensors")
    if of_networks and not networks:
        raise ModelError(f"{options.model} holds networks, which have no effects: they can be compared, not diagnosed.")
    model = Model(wheelbase_m=1.0, name=options.model) if of_networks else _model(options)
    measured = load_measured(options.data, options.robot)
    if measured.findings:
        most = len(measured.findings) if getattr(options, "findings", False) else 5
        print(findings_text(measured.findings, most), file=sys.stderr)
    if of_networks:
        return measured, NetworkPredictor(measured.tracks, Path(options.model)), model
    predictor = WheelPredictor(measured.tracks) if networks else predictor_for_search(measured.tracks)
    used, there = len(predictor.tracks.t_s), len(measured.tracks.t_s)
    if used < there:
        print(f"{used} of {there} poses are used, evenly chosen; all commands are", file=sys.stderr)
    check_named_robot(measured.robot, model)
    check_same_robot(predictor, model)
    return measured, predictor, model


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
def _ticking(text: str) -> Iterator[Callable[[str], None]]:
    """A line on stderr that says what is being looked at; nothing where stderr is no terminal."""
    from rich.console import Console
    from rich.status import Status

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _: None
        return
    with Status(text, console=console) as line:
        yield lambda what: line.update(f"{text}: {what}")
