"""What the words behind options are read as."""

from __future__ import annotations

import argparse
import json
import math
import re
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path

from bns.errors import SpecError
from bns.spec import FIELDS, evolvable, field_type


def number(text: str) -> float:
    """A number, written with a point."""
    try:
        return float(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number; write it with digits and a point, such as 0.0884") from error


def positive(text: str) -> int:
    """A whole number of 1 or more."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of 1 or more")
    return int(text)


def duration(text: str) -> float:
    """Seconds of ``90``, ``90s``, ``10m``, ``1h30m``."""
    match = re.fullmatch(r"(?:(\d+(?:\.\d+)?)h)?(?:(\d+(?:\.\d+)?)m)?(?:(\d+(?:\.\d+)?)s?)?", text)
    if not text or match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a time; write 90s, 10m or 1h30m")
    hours, minutes, seconds = (float(part or 0) for part in match.groups())
    return 3600 * hours + 60 * minutes + seconds


def interval(text: str) -> float:
    """A `duration` of a second or more: how often to look."""
    seconds = duration(text)
    if seconds < 1.0:
        raise argparse.ArgumentTypeError(f"{text!r} is too short; look every 1s or less often")
    return seconds


def folder(text: str) -> Path:
    """A folder that is there or is still to be made: said before anything is computed for it."""
    path = Path(text)
    if path.exists() and not path.is_dir():
        raise argparse.ArgumentTypeError(f"{text!r} is a file; give a folder")
    return path


def add_spec_options(parser: argparse.ArgumentParser, without: tuple[str, ...] = ()) -> None:
    """One option a parameter, named and explained as in `RunSpec`."""
    for name, field in FIELDS.items():
        if name in without:
            continue
        allowed = field.metadata["choices"]
        text = field.metadata["help"] + (f": {', '.join(allowed)}" if allowed else "")
        parser.add_argument(
            "--" + name.replace("_", "-"),
            type=_of_parameter(name),
            default=None if name == "task" else field.default,
            metavar={int: "N", float: "FRACTION", str: "NAME"}[field_type(name)],
            help=f"{text} (default: {'the first task of the robot' if name == 'task' else field.default})",
        )


def _of_parameter(name: str) -> Callable[[str], object]:
    def convert(text: str) -> object:
        kind = field_type(name)
        try:
            value = text if kind is str else float(text)
        except ValueError:
            value = text
        try:
            return evolvable(name, value)
        except SpecError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return convert


def as_json(value: object) -> str:
    """JSON of tables and rows: what is not a number, or unknown, is null, and times are in ISO 8601."""
    return json.dumps(_plain(value))


def _plain(value: object) -> object:
    if isinstance(value, dict):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if hasattr(value, "tolist"):  # numpy's numbers and arrays
        return _plain(value.tolist())
    if isinstance(value, float | Decimal):
        return float(value) if math.isfinite(value) else None
    if hasattr(value, "isoformat"):
        return None if value != value else value.isoformat()  # noqa: PLR0124  # pandas' time that is none
    return value if value is None or isinstance(value, bool | int | str) else str(value)
