"""A sweep file (YAML) read into parameter combinations.

Keys: ``name``, ``robot`` (required); ``seeds`` (how many; default 1); ``first_seed`` (default 0); ``fixed`` (parameter: value);
``grid`` (parameter: list; the product); ``zip`` (parameter: list; taken in step, multiplied with the grid);
``sample`` (combinations drawn from ranges, multiplied with the grid: `sample.py`);
``exclude`` (list of mappings; combinations of the product that have all these values are left out);
``include`` (list of mappings; further combinations, on top of ``fixed``, added after ``exclude``).
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bns.errors import SpecError, SweepWarning, unknown_name
from bns.robots import load_robot
from bns.spec import FIELDS, RunSpec, checked, evolvable, unquoted
from bns.sweep.expand.combos import Parts, check_size, combinations
from bns.sweep.expand.sample import range_names, read_sample
from bns.sweep.expand.shipped_sweeps import sweep_file
from bns.sweep.expand.yaml_lines import Located, parse_yaml, read_text
from bns.tasks import task_names

KEYS = ("name", "robot", "seeds", "first_seed", "fixed", "grid", "zip", "sample", "include", "exclude")
PARAMETERS = tuple(name for name in FIELDS if name not in ("robot", "seed"))
_ELSEWHERE = {
    "robot": "'robot' is a key of the file itself: one robot a sweep.",
    "seed": "'seed' is not a parameter of a sweep; write 'seeds: 30' for the seeds 0..29.",
}
RESERVED = ("by-hand",)
"""Names that no sweep file may have: the store keeps the single runs of ``bns run`` under it."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_SEEDS = int(FIELDS["seed"].metadata["high"]) + 1
_LONGEST_NAME = 80
"""With what the store adds it must still be the name of a file."""


@dataclass(frozen=True)
class Sweep:
    """One sweep file: ``seeds`` runs of every combination (parameter -> value, without robot and seed)."""

    name: str
    robot: str
    seeds: int
    combos: tuple[dict[str, Any], ...]
    text: str
    path: Path
    first_seed: int = 0
    chosen: tuple[tuple[int, int], ...] | None = None
    """Only these of its runs (number of the combination, seed), in this order; None: all."""
    world_lines: Mapping[str, int] = field(default_factory=dict, compare=False)
    """The line of the file on which a world is named."""

    def place_of(self, world: str) -> str:
        """``file:line: `` of a world, for messages; "" where the file does not name it."""
        return f"{self.path}:{self.world_lines[world]}: " if world in self.world_lines else ""

    @property
    def all_seeds(self) -> range:
        """The seeds of every combination."""
        return range(self.first_seed, self.first_seed + self.seeds)

    @property
    def total(self) -> int:
        """Number of runs."""
        return self.described if self.chosen is None else len(self.chosen)

    @property
    def described(self) -> int:
        """Number of runs that the file describes."""
        return self.seeds * len(self.combos)

    def runs_by_task(self) -> dict[str, int]:
        """How many of the runs are of which task."""
        tasks = Counter(str(combo.get("task", FIELDS["task"].default)) for combo in self.combos)
        return {task: count * self.seeds for task, count in tasks.items()}


def load_sweep(path: str | Path) -> Sweep:
    """Read a sweep file, or a shipped one by its name; SpecError that begins with ``file:line:`` for whatever is wrong in it."""
    path = sweep_file(path)
    return parse_sweep(read_text(path), path)


def load_sweeps(paths: Iterable[str | Path]) -> list[Sweep]:
    """Several sweep files that are carried out or estimated together; SpecError where two have one name."""
    found: dict[str, Sweep] = {}
    for path in paths:
        sweep = load_sweep(path)
        other = found.setdefault(sweep.name, sweep)
        if other is not sweep:
            raise SpecError(
                f"{path}: the sweep is named {sweep.name}, like that of {other.path}, so their runs would count as those of one "
                "sweep. Give one of them another name, or carry them out one after the other."
            )
    return list(found.values())


def parse_stored(text: str, sweep: str) -> Sweep:
    """The sweep that a text of the results describes, ``sweep`` is its name there.

    A value under grid that is there twice, as older versions let it be, is run once as it was then, with one SweepWarning.
    """
    return _parsed(text, Path(f"{sweep}.yaml"), Parts(stored=True))


def parse_sweep(text: str, path: Path) -> Sweep:
    """The sweep that a file's text describes; ``path`` is for messages."""
    return _parsed(text, path, Parts())


def _parsed(text: str, path: Path, parts: Parts) -> Sweep:
    root = parse_yaml(text, path)
    places = _places(root)
    for name, (_key, value) in places.items():
        _READERS[name](parts, value)
    parts.keys = _check_once(places)
    _check_tasks(parts)
    combos = combinations(root, parts)
    _check_default_task(root, parts, combos)
    check_size(parts.seeds * len(combos), places["seeds"][1] if "seeds" in places else root)
    _check_seeds(root, parts, places)
    if parts.doubled:
        warnings.warn(
            f"the file of sweep {parts.name!r} that the results hold has values twice ({', '.join(parts.doubled)}), which an "
            "older bns allowed: each counts once, as it was run.",
            SweepWarning,
            stacklevel=4,
        )
    return Sweep(
        parts.name,
        parts.robot,
        parts.seeds,
        tuple(combos.values()),
        text,
        path,
        parts.first_seed,
        world_lines=parts.world_lines,
    )


def _places(root: Located) -> dict[str, tuple[Located, Located]]:
    places = {}
    for name, key, value in root.items("a sweep file"):
        if name not in KEYS:
            moved = f" {name!r} is a parameter: it belongs under fixed or grid." if name in PARAMETERS else ""
            key.fail(unknown_name("key", name, KEYS) + moved)
        places[name] = key, value
    for name in ("name", "robot"):
        if name not in places:
            root.fail(f"the key {name!r} is missing. A sweep file needs 'name' and 'robot'.")
    return places


def _read_name(parts: Parts, value: Located) -> None:
    name = value.value()
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        value.fail(
            f"name is {name!r}; it must begin with a letter and have only letters, digits, '-' and "
            "'_', because it becomes the name of a folder."
        )
    if len(name) > _LONGEST_NAME:
        value.fail(f"name has {len(name)} characters; it may have {_LONGEST_NAME} at most. Shorten it.")
    if name in RESERVED:
        value.fail(f"the name {name!r} is kept for the single runs of 'bns run'. Give the sweep another name.")
    parts.name = name


def _read_robot(parts: Parts, value: Located) -> None:
    robot = value.value()
    try:
        load_robot(str(robot))
    except SpecError as unknown:
        value.fail(str(unknown))
    parts.robot = robot


def _read_seeds(parts: Parts, value: Located) -> None:
    seeds = value.value()
    if not isinstance(seeds, int) or isinstance(seeds, bool) or not 1 <= seeds <= _SEEDS:
        value.fail(
            f"seeds is {seeds!r}; it must be a whole number from 1 to {_SEEDS}: how many, from first_seed on.{unquoted(seeds)}"
        )
    parts.seeds = seeds


def _read_first_seed(parts: Parts, value: Located) -> None:
    first = value.value()
    if not isinstance(first, int) or isinstance(first, bool) or not 0 <= first < _SEEDS:
        value.fail(f"first_seed is {first!r}; it must be a whole number from 0 to {_SEEDS - 1}.{unquoted(first)}")
    parts.first_seed = first


def _check_seeds(root: Located, parts: Parts, places: Mapping[str, tuple[Located, Located]]) -> None:
    if parts.first_seed + parts.seeds > _SEEDS:
        place = places["first_seed"][1] if "first_seed" in places else root
        place.fail(
            f"{parts.seeds} seeds from {parts.first_seed} on go beyond the last seed, {_SEEDS - 1}. Begin with a smaller one."
        )


def _read_fixed(parts: Parts, value: Located) -> None:
    parts.fixed = _mapping(parts, value, "fixed")


def _read_grid(parts: Parts, value: Located) -> None:
    parts.grid = _lists(parts, value, "grid")


def _read_zip(parts: Parts, value: Located) -> None:
    parts.zip = _lists(parts, value, "zip")
    lengths = {name: len(values) for name, values in parts.zip.items()}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        value.fail(f"the lists under zip are taken in step and must be equally long, but {listed}.")


def _read_sample(parts: Parts, value: Located) -> None:
    parts.sample = read_sample(value)


def _read_include(parts: Parts, value: Located) -> None:
    for each in value.elements("include"):
        parts.include.append((each, _mapping(parts, each, "an element of include")))


def _read_exclude(parts: Parts, value: Located) -> None:
    for each in value.elements("exclude"):
        parts.exclude.append((each, _mapping(parts, each, "an element of exclude")))
        if not parts.exclude[-1][1]:
            each.fail("an element of exclude is empty and would leave everything out. Give a parameter.")


_READERS: Mapping[str, Callable[[Parts, Located], None]] = {
    "name": _read_name,
    "robot": _read_robot,
    "seeds": _read_seeds,
    "first_seed": _read_first_seed,
    "fixed": _read_fixed,
    "grid": _read_grid,
    "zip": _read_zip,
    "sample": _read_sample,
    "include": _read_include,
    "exclude": _read_exclude,
}


def _mapping(parts: Parts, value: Located, what: str) -> dict[str, Any]:
    return {name: _checked(parts, name, key, each) for name, key, each in value.items(what)}


def _lists(parts: Parts, value: Located, what: str) -> dict[str, list[Any]]:
    lists = {}
    for name, key, each in value.items(what):
        _check_parameter(name, key)
        elements = each.elements(f"{name} under {what}")
        lists[name] = [_checked(parts, name, key, element) for element in elements]
        if what == "grid":  # under zip a value may be taken with several of another parameter
            _check_different(parts, name, elements, lists[name])
    return lists


def _check_different(parts: Parts, name: str, elements: list[Located], values: list[Any]) -> None:
    """SpecError where a value is there twice: it would be run once, which is not what somebody meant."""
    for number, (element, value) in enumerate(zip(elements, values, strict=True)):
        if value in values[:number]:
            if parts.stored:
                parts.doubled.append(f"{name}: {value!r}")
                continue
            first = elements[values.index(value)].line
            element.fail(
                f"{name} has the value {value!r} twice (first on line {first}). Keep one of the two; runs are repeated by seeds."
            )


def _check_parameter(name: str, key: Located) -> None:
    if name in _ELSEWHERE:
        key.fail(_ELSEWHERE[name])
    if name not in PARAMETERS:
        key.fail(unknown_name("parameter", name, PARAMETERS))


def _checked(parts: Parts, name: str, key: Located, value: Located) -> Any:
    _check_parameter(name, key)
    given = value.value()
    try:
        result = (checked if parts.stored else evolvable)(name, given)
    except SpecError as fault:
        hint = f" Lists belong under grid: '{name}: {given!r}' there." if isinstance(given, list) else ""
        value.fail(f"{fault}{hint}")
    if name == "task":
        parts.tasks.append((value, result))
    elif name == "world":
        parts.world_lines.setdefault(result, value.line)
    return result


def _check_once(places: Mapping[str, tuple[Located, Located]]) -> dict[str, Located]:
    """Key of every parameter; in two of fixed, grid, zip and sample it would silently lose one of its values."""
    seen: dict[str, tuple[str, Located]] = {}
    for part in ("fixed", "grid", "zip", "sample"):
        if part not in places:
            continue
        for name, key in _names(part, places[part][1]):
            if name in seen:
                other, former = seen[name]
                key.fail(f"{name!r} is given under {part} and, on line {former.line}, under {other}. Keep one.")
            seen[name] = part, key
    return {name: key for name, (_part, key) in seen.items()}


def _names(part: str, value: Located) -> Iterable[tuple[str, Located]]:
    return range_names(value) if part == "sample" else ((name, key) for name, key, _ in value.items(part))


def _check_tasks(parts: Parts) -> None:
    valid = task_names(parts.robot)
    for place, task in parts.tasks:
        if task not in valid:
            place.fail(f"robot {parts.robot}: " + unknown_name("task", task, valid))


def _check_default_task(root: Located, parts: Parts, combos: Iterable[RunSpec]) -> None:
    """Tasks that were given are checked already: this is about the default, which is another robot's."""
    valid = task_names(parts.robot)
    for spec in combos:
        if spec.task not in valid:
            root.fail(
                f"no task is given, and robot {parts.robot!r} has no task {spec.task!r}. "
                f"Give 'task' under fixed or grid. Valid: {', '.join(valid)}."
            )
