"""A sweep file (YAML) read into parameter combinations.

Keys: ``name``, ``robot`` (required); ``seeds`` (how many, 0..N-1; default 1); ``fixed`` (parameter: value);
``grid`` (parameter: list; the product); ``zip`` (parameter: list; taken in step, multiplied with the grid);
``exclude`` (list of mappings; combinations of the product that have all these values are left out);
``include`` (list of mappings; further combinations, on top of ``fixed``, added after ``exclude``).
"""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bns.errors import SpecError, unknown_name
from bns.robots import robot_names
from bns.spec import FIELDS, RunSpec, checked
from bns.sweep.yaml_lines import Located, parse_yaml, read_text
from bns.tasks import task_names

KEYS = ("name", "robot", "seeds", "fixed", "grid", "zip", "include", "exclude")
PARAMETERS = tuple(name for name in FIELDS if name not in ("robot", "seed"))
_ELSEWHERE = {
    "robot": "'robot' is a key of the file itself: one robot a sweep.",
    "seed": "'seed' is not a parameter of a sweep; write 'seeds: 30' for the seeds 0..29.",
}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


@dataclass(frozen=True)
class Sweep:
    """One sweep file: ``seeds`` runs of every combination (parameter -> value, without robot and seed)."""

    name: str
    robot: str
    seeds: int
    combos: tuple[dict[str, Any], ...]
    text: str
    path: Path

    @property
    def total(self) -> int:
        """Number of runs."""
        return self.seeds * len(self.combos)

    def runs_by_task(self) -> dict[str, int]:
        """How many of the runs are of which task."""
        tasks = Counter(str(combo.get("task", FIELDS["task"].default)) for combo in self.combos)
        return {task: count * self.seeds for task, count in tasks.items()}


@dataclass
class _Parts:
    """What the file says, checked value by value; the places are kept for later complaints."""

    name: str = ""
    robot: str = ""
    seeds: int = 1
    fixed: dict[str, Any] = field(default_factory=dict)
    grid: dict[str, list[Any]] = field(default_factory=dict)
    zip: dict[str, list[Any]] = field(default_factory=dict)
    include: list[dict[str, Any]] = field(default_factory=list)
    exclude: list[tuple[Located, dict[str, Any]]] = field(default_factory=list)
    tasks: list[tuple[Located, str]] = field(default_factory=list)


def load_sweep(path: str | Path) -> Sweep:
    """Read a sweep file; SpecError that begins with ``file:line:`` for whatever is wrong in it."""
    path = Path(path)
    return parse_sweep(read_text(path), path)


def parse_sweep(text: str, path: Path) -> Sweep:
    """The sweep that a file's text describes; ``path`` is for messages."""
    root = parse_yaml(text, path)
    places = _places(root)
    parts = _Parts()
    for name, (_key, value) in places.items():
        _READERS[name](parts, value)
    _check_once(places)
    _check_tasks(parts)
    combos = _combinations(root, parts)
    return Sweep(parts.name, parts.robot, parts.seeds, combos, text, path)


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


def _read_name(parts: _Parts, value: Located) -> None:
    name = value.value()
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        value.fail(
            f"name is {name!r}; it must begin with a letter and have only letters, digits, '-' and "
            "'_', because it becomes the name of a folder."
        )
    parts.name = name


def _read_robot(parts: _Parts, value: Located) -> None:
    robot = value.value()
    if robot not in robot_names():
        value.fail(unknown_name("robot", robot, robot_names()))
    parts.robot = robot


def _read_seeds(parts: _Parts, value: Located) -> None:
    seeds = value.value()
    if not isinstance(seeds, int) or isinstance(seeds, bool) or not 1 <= seeds <= 2**32:
        value.fail(f"seeds is {seeds!r}; it must be a whole number from 1 to {2**32}: how many, from 0 on.")
    parts.seeds = seeds


def _read_fixed(parts: _Parts, value: Located) -> None:
    parts.fixed = _mapping(parts, value, "fixed")


def _read_grid(parts: _Parts, value: Located) -> None:
    parts.grid = _lists(parts, value, "grid")


def _read_zip(parts: _Parts, value: Located) -> None:
    parts.zip = _lists(parts, value, "zip")
    lengths = {name: len(values) for name, values in parts.zip.items()}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        value.fail(f"the lists under zip are taken in step and must be equally long, but {listed}.")


def _read_include(parts: _Parts, value: Located) -> None:
    parts.include = [_mapping(parts, each, "an element of include") for each in value.elements("include")]


def _read_exclude(parts: _Parts, value: Located) -> None:
    for each in value.elements("exclude"):
        parts.exclude.append((each, _mapping(parts, each, "an element of exclude")))
        if not parts.exclude[-1][1]:
            each.fail("an element of exclude is empty and would leave everything out. Give a parameter.")


_READERS: Mapping[str, Callable[[_Parts, Located], None]] = {
    "name": _read_name,
    "robot": _read_robot,
    "seeds": _read_seeds,
    "fixed": _read_fixed,
    "grid": _read_grid,
    "zip": _read_zip,
    "include": _read_include,
    "exclude": _read_exclude,
}


def _mapping(parts: _Parts, value: Located, what: str) -> dict[str, Any]:
    return {name: _checked(parts, name, key, each) for name, key, each in value.items(what)}


def _lists(parts: _Parts, value: Located, what: str) -> dict[str, list[Any]]:
    lists = {}
    for name, key, each in value.items(what):
        _check_parameter(name, key)
        elements = each.elements(f"{name} under {what}")
        lists[name] = [_checked(parts, name, key, element) for element in elements]
    return lists


def _check_parameter(name: str, key: Located) -> None:
    if name in _ELSEWHERE:
        key.fail(_ELSEWHERE[name])
    if name not in PARAMETERS:
        key.fail(unknown_name("parameter", name, PARAMETERS))


def _checked(parts: _Parts, name: str, key: Located, value: Located) -> Any:
    _check_parameter(name, key)
    given = value.value()
    try:
        result = checked(name, given)
    except SpecError as fault:
        hint = f" Lists belong under grid: '{name}: {given!r}' there." if isinstance(given, list) else ""
        value.fail(f"{fault}{hint}")
    if name == "task":
        parts.tasks.append((value, result))
    return result


def _check_once(places: Mapping[str, tuple[Located, Located]]) -> None:
    """A parameter in two of fixed, grid and zip would silently lose one of its values."""
    seen: dict[str, tuple[str, int]] = {}
    for part in ("fixed", "grid", "zip"):
        if part not in places:
            continue
        for name, key, _value in places[part][1].items(part):
            if name in seen:
                other, line = seen[name]
                key.fail(f"{name!r} is given under {part} and, on line {line}, under {other}. Keep one.")
            seen[name] = part, key.line


def _check_tasks(parts: _Parts) -> None:
    valid = task_names(parts.robot)
    for place, task in parts.tasks:
        if task not in valid:
            place.fail(unknown_name(f"task of robot {parts.robot!r}", task, valid))


def _combinations(root: Located, parts: _Parts) -> tuple[dict[str, Any], ...]:
    """Product, exclusions, inclusions, in this order; combinations that describe the same run are merged."""
    product = _product(parts) if parts.grid or parts.zip or not parts.include else ()
    combos = {RunSpec(robot=parts.robot, **combo): combo for combo in product}
    for spec in _excluded(parts, combos):
        del combos[spec]
    for combo in (parts.fixed | more for more in parts.include):
        combos.setdefault(RunSpec(robot=parts.robot, **combo), combo)
    if not combos:
        root.fail("exclude leaves no combination of the grid. Remove an element of exclude.")
    valid = task_names(parts.robot)
    for spec in combos:  # only a task that was not given can be wrong here: the default of another robot
        if spec.task not in valid:
            root.fail(
                f"no task is given, and robot {parts.robot!r} has no task {spec.task!r}. "
                f"Give 'task' under fixed or grid. Valid: {', '.join(valid)}."
            )
    return tuple(combos.values())


def _excluded(parts: _Parts, combos: Iterable[RunSpec]) -> set[RunSpec]:
    excluded: set[RunSpec] = set()
    for place, pattern in parts.exclude:
        matching = [spec for spec in combos if all(getattr(spec, key) == pattern[key] for key in pattern)]
        if not matching:
            place.fail(f"exclude {pattern} matches no combination of the grid. Correct it or remove it.")
        excluded.update(matching)
    return excluded


def _product(parts: _Parts) -> Iterable[dict[str, Any]]:
    in_step = zip(*parts.zip.values(), strict=True)
    steps = [dict(zip(parts.zip, values, strict=True)) for values in in_step] or [{}]
    for values in itertools.product(*parts.grid.values()):
        for step in steps:
            yield parts.fixed | dict(zip(parts.grid, values, strict=True)) | step
