"""Options that follow a part's name as ``NAME+OPTION=VALUE``: what there are, and how they are read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from bns.errors import SpecError, unknown_name

OPTION_MARK = "+"


class Option(NamedTuple):
    """A number that an approach lets one choose: ``NAME+OPTION=VALUE``; a whole one if its default is."""

    default: float
    low: float
    high: float
    text: str

    @property
    def whole(self) -> bool:
        """Must it be a whole number?"""
        return isinstance(self.default, int)


class Choice(NamedTuple):
    """A word out of some that an approach lets one choose; ``or_file``: endings of files that may stand instead of one."""

    default: str
    choices: tuple[str, ...]
    text: str
    or_file: tuple[str, ...] = ()


Options = Mapping[str, Option | Choice]


def parsed_options(name: str, options: Options) -> dict[str, float | str]:
    """Values of an approach's options in a name such as ``on-robot+population=10``; those not given at their defaults.

    SpecError for an option that there is none of, twice the same, or a value that is not allowed.
    """
    approach, *given = name.split(OPTION_MARK)
    values: dict[str, float | str] = {option: known.default for option, known in options.items()}
    for number, part in enumerate(given):
        option, _, text = part.partition("=")
        if not options:
            raise SpecError(f"approach {name!r}: {approach} has no options; write {approach}.")
        if option not in options:
            raise SpecError(unknown_name(f"option of approach {approach}", option, options))
        if option in {earlier.partition("=")[0] for earlier in given[:number]}:
            raise SpecError(f"approach {name!r}: {option} is given twice; keep one of them.")
        known, where = options[option], f"approach {name!r}: {option}"
        values[option] = _word(where, text, known) if isinstance(known, Choice) else _value(where, text, known)
    return values


def _word(where: str, text: str, option: Choice) -> str:
    if text not in option.choices and not text.endswith(option.or_file or ("\0",)):
        files = f", or a file ending in {' or '.join(option.or_file)}" if option.or_file else ""
        raise SpecError(f"{where} is {text!r}; it must be one of {', '.join(option.choices)}{files} ({option.text}).")
    return text


def _value(where: str, text: str, option: Option) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not option.low <= value <= option.high or (option.whole and not value.is_integer()):
        kind = "a whole number" if option.whole else "a number"
        raise SpecError(
            f"{where} is {text!r}; it must be {kind} from {option.low:g} to {option.high:g} ({option.text})."
        )
    return value
