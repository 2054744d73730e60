"""The model and the measurements of a command that compares the two: the options that name them, and what these mean."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from bns.cli.options.option_types import number
from bns.cli.parser import add_trust

if TYPE_CHECKING:
    from bns.api.measurements import Measurements
    from bns.api.model import Given

MINUTES = 10.0
"""Of driving, which an experiment takes where nothing else is asked for."""


def add_log(parser: argparse.ArgumentParser) -> None:
    """The log of a command that takes one."""
    parser.add_argument("data", type=Path, metavar="LOG", help="measurements: .csv, .parquet, or any file with a mapping")


def add_model(parser: argparse.ArgumentParser, *, networks: bool = False, default: str | None = None) -> None:
    """Which model; ``networks``: those of a run as well."""
    of_runs = "; or networks: .safetensors, snake-networks, snake+changes" if networks else ""
    parser.add_argument(
        "--model",
        required=default is None,
        default=default,
        metavar="MODEL",
        help="khepera, differential-drive, snake, a model file (.yaml) or an MJCF file (.xml)"
        f"{of_runs}{'' if default is None else f' (default: {default})'}",
    )
    parser.add_argument(
        "--wheelbase",
        type=number,
        metavar="METRES",
        help="distance between the wheels: needed for differential-drive, in place of its own for any other drive",
    )


def add_model_options(parser: argparse.ArgumentParser, *, networks: bool = False) -> None:
    """Which model, and which part of the log."""
    add_model(parser, networks=networks)
    parser.add_argument("--robot", metavar="NAME", help="robot to use, if the column 'robot' of the log names several")
    parser.add_argument(
        "--more",
        action="append",
        default=[],
        type=Path,
        metavar="LOG",
        help="further log to use together with the first (may be repeated)",
    )
    parser.add_argument(
        "--without",
        action="append",
        default=[],
        metavar="TRIAL",
        help="name of a trial to exclude (may be repeated)",
    )
    parser.add_argument("--findings", action="store_true", help="list all irregularities in the log, not only five")


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


def beside_of(options: argparse.Namespace) -> list[Given]:
    """The further models; the drive that has no wheelbase of its own takes that of the options."""
    from bns.api.model import Model

    wheels = {} if options.wheelbase is None else {"wheelbase_m": options.wheelbase}
    return [Model(name, **wheels) if wheels and name == "differential-drive" else name for name in options.beside]


def log_of(options: argparse.Namespace) -> Measurements:
    """The measurements of the options; what is odd about them goes to stderr."""
    from bns.api.measurements import Measurements
    from bns.diagnose.report.text import findings_text

    log = Measurements(options.data, *options.more, robot=options.robot).without(options.without)
    findings = log.measured.findings
    if findings:
        most = len(findings) if options.findings else 5
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
        trust_files=options.trust_file,
        without_effects=options.without_effect,
        settings=options.settings,
        trust=options.trust,
        **{name: value for name, value in limits.items() if (name, value) != ("minutes", MINUTES)},
    )
