"""The whole description of one run. Its hash is the run's name.

Every parameter is declared once, here: the command line, the sweep files and the result tables take
names, bounds and help texts from the fields of `RunSpec`.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import numbers
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bns.change import Change, change_of
from bns.errors import SpecError, unknown_name
from bns.options import OPTION_MARK, parsed_options
from bns.registry import APPROACHES, WORLDS, Registry

ENGINE_VERSION = 3
"""Raised whenever the same spec would give other numbers; part of every run's name."""

APPROACH_VERSIONS: Mapping[str, int] = {
    "anytime": 2,
    "back-to-reality": 2,
    "estimation-exploration": 3,
    "transferability": 2,
}
"""Raised where a spec would give other numbers with one approach alone; part of its runs' names. The others have 1, unsaid.

2: physics models are integrated in graded steps (`bns.bootstrap.simulators.GROWTH`). 3: in a model, a turn rate that is added
while the robot moves comes and goes as late as wheels that lag.
"""

MOST_COMMANDS = 20_000_000
"""Commands that all controllers of a population may have together: 40 bytes each, so that a run takes less than a gigabyte."""
RADII_CM = (7, 10, 14, 20)
"""Radii of the goals, cm, at which success is recorded."""


def robot_and_options(name: str) -> tuple[str, tuple[str, ...]]:
    """The robot and the options of its model that a name such as ``snake+changes+rigid`` switches on."""
    robot, *options = name.split(OPTION_MARK)
    return robot, tuple(options)


def _field(
    default: Any,
    text: str,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] | None = None,
    or_file: tuple[str, ...] = (),
    parts: Registry | None = None,
    later: bool = False,
    changes: bool = False,
) -> Any:
    """``or_file``: endings of file names that may stand instead of one of the choices; ``parts``: so may a package's part.

    ``later``: the parameter came after runs had been named without it, so that its default is left out of their names.
    ``changes``: two values may follow one another, as `bns.change` says.
    """
    bounds = {"low": low, "high": high, "choices": choices, "or_file": or_file, "parts": parts}
    bounds |= {"later": later, "changes": changes}
    return dataclasses.field(default=default, metadata={"help": text, **bounds})


@dataclass(frozen=True)
class RunSpec:
    """One run: robot, task, world, parameters and seed.

    The defaults are the prototype settings of the dissertation (table 4.1, section 4.3) with 100 evaluations
    (section 4.5). Shares are fractions of the population, 0..1.
    """

    robot: str = _field("khepera", "robot, with options of its simulator behind its name (snake+changes+rigid)")
    task: str = _field("circle", "goal task of the robot")
    world: str = _field(
        "substitute",
        "world used in place of the robot, or a model file (.yaml) for the physics world; 'physics>worn.yaml@50' changes at "
        "evaluation 50",
        choices=("substitute", "physics", "robot"),
        or_file=(".yaml", ".yml"),
        parts=WORLDS,
        changes=True,
    )
    seed: int = _field(0, "seed of this run", low=0, high=2**32 - 1)
    root_seed: int = _field(0, "seed of the whole study", low=0, high=2**32 - 1)
    population_size: int = _field(400, "number of controllers in the population", low=1, high=100_000)
    tournament_size: float = _field(0.5, "tournament size for parents, as a fraction of the population", low=0.0, high=1.0)
    mutation_rate: float = _field(0.1, "probability that a component of a command mutates", low=0.0, high=1.0)
    real_world_selection_size: float = _field(
        0.7, "tournament size for the controller that is driven, as a fraction of the population", low=0.0, high=1.0
    )
    evaluations: int = _field(100, "number of controllers driven in the world", low=1, high=65_535)
    generations_per_evaluation: int = _field(20, "number of generations after each evaluation", low=0, high=100_000)
    training_iterations_per_evaluation: int = _field(
        1000, "number of Rprop iterations after each evaluation", low=0, high=10_000_000
    )
    training_algorithm: str = _field("rprop+", "training rule", choices=("rprop+", "irprop-"))
    min_commands: int = _field(4, "shortest command list that crossover may make", low=1, high=10_000)
    max_commands: int = _field(100, "longest command list that crossover may make", low=1, high=10_000)
    record: str = _field(
        "evals",
        "tables to store: one row per evaluation; also paths; or also generations and probes (extra drives)",
        choices=("evals", "paths", "full"),
    )
    approach: str = _field(
        "bns",
        "method that learns from drives and picks the next one, with its options (bns+margin=0.03+ensemble=3)",
        parts=APPROACHES,
        later=True,
    )
    overhead_s: int = _field(
        30, "robot time in seconds that each evaluation takes in addition to driving: putting the robot back, starting it",
        low=0, high=86_400, later=True,
    )  # fmt: skip

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            object.__setattr__(self, field.name, checked(field.name, getattr(self, field.name)))
        if self.min_commands > self.max_commands:
            raise SpecError(
                f"min_commands is {self.min_commands} and max_commands {self.max_commands}; "
                "the shortest list must not be longer than the longest: set both."
            )
        if self.population_size * self.max_commands > MOST_COMMANDS:
            raise SpecError(
                f"population_size is {self.population_size} and max_commands {self.max_commands}; together a population may have "
                f"{MOST_COMMANDS} commands, which take {40 * MOST_COMMANDS / 1e9:.1f} GB of memory: lower one of them."
            )
        if (change := change_of(self.world)) and change.at > self.evaluations:
            raise SpecError(
                f"world is {self.world!r}, which changes at evaluation {change.at}; the run has {self.evaluations} evaluations: "
                "let it change earlier, or set more evaluations."
            )

    def canonical_json(self) -> str:
        """The spec and the engine's version as JSON with sorted keys: what the run's name is the hash of."""
        given = {name: value for name, value in dataclasses.asdict(self).items() if not _left_out(name, value)}
        given |= {"engine_version": ENGINE_VERSION}
        if version := APPROACH_VERSIONS.get(self.approach.split(OPTION_MARK)[0]):
            given |= {"approach_version": version}
        return json.dumps(given, sort_keys=True, separators=(",", ":"))

    @property
    def run_id(self) -> str:
        """Name of the run: ``r`` and 20 hexadecimal digits (a letter first, so that no reader takes it for a number)."""
        return "r" + hashlib.sha256(self.canonical_json().encode()).hexdigest()[:20]


def parameters_in(canonical: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters that a `RunSpec.canonical_json`, read back, was made from: all but the versions."""
    return {name: value for name, value in canonical.items() if name not in {"engine_version", "approach_version"}}


FIELDS: Mapping[str, dataclasses.Field[Any]] = {f.name: f for f in dataclasses.fields(RunSpec)}


def _left_out(name: str, value: Any) -> bool:
    """Is the parameter younger than the names of runs, and at its default?"""
    return bool(FIELDS[name].metadata["later"]) and value == FIELDS[name].default


def field_type(name: str) -> type:
    """int, float or str: the type that a parameter's values have."""
    return type(FIELDS[name].default)


def checked(name: str, value: Any) -> Any:
    """``value`` in the parameter's own type; SpecError if there is no such parameter or the value is not allowed."""
    if name not in FIELDS:
        raise SpecError(unknown_name("parameter", name, FIELDS))
    wanted, meta = field_type(name), FIELDS[name].metadata
    value = _plain(value)
    fits = isinstance(value, wanted) and not isinstance(value, bool)
    if wanted is float and isinstance(value, int) and not isinstance(value, bool):
        value, fits = float(value), True
    elif wanted is int and isinstance(value, float) and value.is_integer():
        value, fits = int(value), True
    if not fits:
        raise SpecError(f"{name} is {value!r}; it must be {_allowed(name)}.{unquoted(value) if wanted is not str else ''}")
    if wanted is str:
        if meta["changes"] and (change := change_of(value)):
            _check_change(name, value, change)
            return value
        if meta["parts"] and not meta["choices"] and value != FIELDS[name].default:
            _check_part(meta["parts"], value)
        if meta["choices"] and value not in meta["choices"] and not value.endswith(meta["or_file"] or ("\0",)):
            valid = (*meta["choices"], *(meta["parts"].announced if meta["parts"] else ()))
            if value not in valid:
                raise SpecError(unknown_name(name, value, valid))
        return value
    low, high = meta["low"], meta["high"]
    if not math.isfinite(value) or (low is not None and value < low) or (high is not None and value > high):
        raise SpecError(f"{name} is {value!r}; it must be {_allowed(name)}.{_percent_hint(name, value)}")
    return value


_NONE_DRAWN = "a tournament of none has no winner. The smallest has one controller, drawn at random: any fraction up to 1 / "
_NOTHING_EVOLVES: Mapping[str, tuple[float, str, str]] = {
    "population_size": (1, "a whole number of 2 or more", "crossover takes two parents, and a single one would never change"),
    **dict.fromkeys(
        ("tournament_size", "real_world_selection_size"),
        (0.0, "a number above 0, up to 1", f"{_NONE_DRAWN}population_size"),
    ),
}
"""Values up to which nothing evolves, or not as the parameter says; what is allowed; and why. A stored run may have them."""


def evolvable(name: str, value: Any) -> Any:
    """As `checked`, for what is still to be run: SpecError also for a value with which nothing would evolve."""
    least, allowed, why = _NOTHING_EVOLVES.get(name, (-math.inf, "", ""))
    if allowed and isinstance(value, numbers.Real) and not isinstance(value, bool) and value <= least:
        raise SpecError(f"{name} is {_plain(value)!r}; it must be {allowed}: {why}.")
    return checked(name, value)


def _plain(value: Any) -> Any:
    """Numbers of numpy and other libraries as Python's own; all else as it is."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return value
    return int(value) if isinstance(value, numbers.Integral) else float(value)


def unquoted(value: Any) -> str:
    """What to do about a text that is a number, as a sentence behind an error; "" for all else."""
    try:
        float(value if isinstance(value, str) else "")
    except ValueError:
        return ""
    return f" It is a text: write {value.strip()}, without quotes."


def _check_change(name: str, value: str, change: Change) -> None:
    """SpecError if one of the two is no such value, or a robot that nobody can swap."""
    for world in (change.before, change.after):
        if checked(name, world) == "robot":
            raise SpecError(f"{name} is {value!r}; a real robot does not change by itself: take simulated worlds.")


def _check_part(parts: Registry, value: str) -> None:
    """SpecError for a part that there is none of, or an option that it has not. Without options no part is imported."""
    name, *options = value.split(OPTION_MARK)
    parts.part(name)
    if options:
        parsed_options(value, parts.load(name).options)


def _allowed(name: str) -> str:
    meta, kind = FIELDS[name].metadata, {int: "a whole number", float: "a number", str: "a text"}[field_type(name)]
    if meta["choices"]:
        return "one of " + ", ".join(meta["choices"])
    form = "d" if field_type(name) is int else "g"
    return kind if meta["low"] is None else f"{kind} from {meta['low']:{form}} to {meta['high']:{form}}"


def _percent_hint(name: str, value: float) -> str:
    share = field_type(name) is float and FIELDS[name].metadata["high"] == 1.0
    return f" For {value:g} percent write {value / 100:g}." if share and 1 < value <= 100 else ""
