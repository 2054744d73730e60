"""Settings that are not the default, for one question: checked, and in force in every module of the diagnosis while it lasts.

Modules name the settings that they use where they begin (``STILL_M_S = DEFAULTS.data.still_m_s``). Under other settings these
lines are read again with the others in the place of `DEFAULTS`, and afterwards the old values are put back. Questions under the
default settings may be asked by several threads at once; one under others waits for those under way, and is alone then.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import math
import pkgutil
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, replace
from functools import cache
from os import PathLike
from pathlib import Path
from typing import Any

from bns.diagnose.settings import DEFAULTS, Settings
from bns.errors import DataError, unknown_name
from bns.safe_yaml import read_yaml_file

Chosen = Settings | Mapping[str, Any] | str | PathLike[str]
"""Settings, a mapping of room -> name -> value, or a YAML file of one."""
PACKAGE = "bns.diagnose"


def settings_of(chosen: Chosen | None) -> Settings:
    """The settings; DataError names what is no room, no setting or no value of its kind, and what is allowed."""
    if chosen is None:
        return DEFAULTS
    if isinstance(chosen, Settings):
        return chosen
    if isinstance(chosen, Mapping):
        return _checked("settings", chosen)
    tree, _ = read_yaml_file(Path(chosen), "the settings", DataError)
    return _checked(str(chosen), tree)


def changed(settings: Settings) -> dict[str, dict[str, Any]]:
    """Room -> name -> value of what differs from the default; plain values."""
    now, usual = settings.as_json(), DEFAULTS.as_json()
    out = {room: {n: v for n, v in values.items() if v != usual[room][n]} for room, values in now.items()}
    return {room: values for room, values in out.items() if values}


def changes_text(settings: Settings) -> str:
    """A line for each setting that differs from the default; "" for none."""
    usual = DEFAULTS.as_json()
    return "".join(
        f"setting {room}.{name}: {value} (default: {usual[room][name]})\n"
        for room, values in changed(settings).items()
        for name, value in values.items()
    )


def _checked(where: str, tree: Any) -> Settings:
    rooms = {room.name: getattr(DEFAULTS, room.name) for room in fields(DEFAULTS)}
    if not isinstance(tree, Mapping):
        raise DataError(f"{where}: settings are rooms ({', '.join(rooms)}), each with lines of name: value.")
    out = {}
    for room, given in tree.items():
        if room not in rooms:
            raise DataError(f"{where}: " + unknown_name("room of settings", room, rooms))
        if not isinstance(given, Mapping):
            raise DataError(f"{where}: {room} is {given!r}; it must be lines of name: value.")
        known = [one.name for one in fields(rooms[room])]
        for name in given:
            if name not in known:
                raise DataError(f"{where}: {room}: " + unknown_name("setting", name, known))
        out[room] = replace(
            rooms[room], **{n: _like(f"{where}: {room}.{n}", v, getattr(rooms[room], n)) for n, v in given.items()}
        )
    return replace(DEFAULTS, **out)


def _like(where: str, value: Any, usual: Any) -> Any:
    """The value, if it is of the kind of the usual one."""
    if isinstance(usual, tuple):
        if isinstance(value, list | tuple) and (len(value) == len(usual) or isinstance(usual[0], tuple)) and len(value):
            return tuple(_like(where, one, usual[min(at, len(usual) - 1)]) for at, one in enumerate(value))
        raise DataError(f"{where} is {value!r}; it must be a list like {_plain(usual)}.")
    wrong = isinstance(value, bool) != isinstance(usual, bool)
    if isinstance(usual, float):
        wrong |= not isinstance(value, int | float) or not math.isfinite(value)
    else:
        wrong |= not isinstance(value, type(usual))
    if wrong:
        kind = {float: "a finite number", int: "a whole number", str: "a text", bool: "true or false"}[type(usual)]
        raise DataError(f"{where} is {value!r}; it must be {kind}, such as {usual!r}.")
    if isinstance(usual, int | float) and usual > 0 and value < 0:
        raise DataError(f"{where} is {value!r}; it must not be below 0 (default: {usual!r}).")
    return float(value) if isinstance(usual, float) else value


def _plain(value: Any) -> Any:
    return [_plain(one) for one in value] if isinstance(value, tuple) else value


class _Turns:
    """Default questions together, others alone; a thread that has its turn keeps it for what it asks on the way."""

    def __init__(self) -> None:
        self._free, self._own = threading.Condition(), threading.local()
        self._together, self._alone = 0, False

    @contextmanager
    def turn(self, alone: bool) -> Iterator[bool]:
        """Yields whether this is the outermost question of the thread."""
        if getattr(self._own, "asking", False):
            yield False
            return
        with self._free:
            self._free.wait_for(lambda: not self._alone and not (alone and self._together))
            self._alone, self._together = alone, self._together + (not alone)
        self._own.asking = True
        try:
            yield True
        finally:
            self._own.asking = False
            with self._free:
                self._alone, self._together = False, self._together - (not alone)
                self._free.notify_all()


_TURNS = _Turns()


@contextmanager
def in_force(settings: Settings) -> Iterator[None]:
    """These settings in every module of the diagnosis, for a question of this thread (and what it asks on the way)."""
    with _TURNS.turn(alone=settings != DEFAULTS) as outermost:
        if settings == DEFAULTS or not outermost:
            yield
            return
        before = [(owner, name, getattr(owner, name)) for owner, name, _, _ in _lines()]
        try:
            _bind(settings)
            yield
        finally:
            for owner, name, value in before:
                setattr(owner, name, value)


def _bind(settings: Settings) -> None:
    """Read all lines that name settings with these."""
    for owner, name, module, code in _lines():
        space = {**vars(sys.modules[module]), "DEFAULTS": settings}
        setattr(owner, name, eval(code, space))  # of our own source


@cache
def _lines() -> tuple[tuple[Any, str, str, Any], ...]:
    """Owner (a module or class), name, module and code of every line that a setting decides, each behind those it needs."""
    package = importlib.import_module(PACKAGE)
    names = [one.name for one in pkgutil.walk_packages(package.__path__, f"{PACKAGE}.")]
    modules = [importlib.import_module(name) for name in names if not name.endswith("__main__") and ".settings" not in name]
    trees = {module.__name__: ast.parse(inspect.getsource(module)) for module in modules}
    found: dict[tuple[str, str], tuple[Any, str, str, Any]] = {}
    while True:  # until no line depends on one that was found
        count = len(found)
        for module in modules:
            for owner, name, value in _assigned(module, trees[module.__name__], found):
                where = (f"{module.__name__}:{getattr(owner, '__qualname__', '')}", name)
                if where not in found:
                    found[where] = owner, name, module.__name__, compile(ast.Expression(value), module.__name__, "eval")
        if len(found) == count:
            return tuple(found.values())


def _assigned(module: Any, tree: ast.Module, found: Mapping[tuple[str, str], Any]) -> Iterator[tuple[Any, str, ast.expr]]:
    """Assignments and imports of a module, and of its classes, that follow from settings."""
    own = {name for where, name in found if where == f"{module.__name__}:"} | {"DEFAULTS"}
    classes = [(getattr(module, node.name), node.body) for node in tree.body if isinstance(node, ast.ClassDef)]
    for owner, body in [(module, tree.body), *classes]:
        for node in body:
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(PACKAGE):
                for alias in node.names:
                    if (f"{node.module}:", alias.name) in found:
                        of = ast.parse(f"__import__('sys').modules[{node.module!r}].{alias.name}", mode="eval").body
                        yield owner, alias.asname or alias.name, of
            elif isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
                target = node.targets[0] if isinstance(node, ast.Assign) else node.target
                used = {one.id for one in ast.walk(node.value) if isinstance(one, ast.Name)}
                if not used & own:
                    continue
                if isinstance(target, ast.Name) and target.id != "DEFAULTS":
                    yield owner, target.id, node.value
                elif isinstance(target, ast.Tuple):  # A, B = two settings, or one of two values
                    for at, one in enumerate(target.elts):
                        assert isinstance(one, ast.Name)
                        part = ast.Subscript(node.value, ast.Constant(at), ast.Load())
                        yield owner, one.id, ast.fix_missing_locations(ast.copy_location(part, node.value))
