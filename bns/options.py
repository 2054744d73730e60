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


Options = Mapping[str, Option]


def parsed_options(name: str, options: Options) -> dict[str, float]:
    """Values of an approach's options in a name such as ``on-robot+population=10``; those not given at their defaults.

    SpecError for an option that there is none of, twice the same, or a value that is not allowed.
    """
    approach, *given = name.split(OPTION_MARK)
    values = {option: known.default for option, known in options.items()}
    for number, part in enumerate(given):
        option, _, text = part.partition("=")
        if not options:
            raise SpecError(f"approach {name!r}: {approach} has no options; write {approach}.")
        if option not in options:
            raise SpecError(unknown_name(f"option of approach {approach}", option, options))
        if option in {earlier.partition("=")[0] for earlier in given[:number]}:
            raise SpecError(f"approach {name!r}: {option} is given twice; keep one of them.")
        values[option] = _value(f"approach {name!r}: {option}", text, options[option])
    return values


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
