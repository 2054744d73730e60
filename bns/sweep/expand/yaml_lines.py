"""YAML in which every key and value still knows the line it stands on.

``yaml.safe_load`` keeps the last of two equal keys silently and forgets the lines; a sweep file that starts
a day of computing deserves better.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import yaml

from bns.errors import SpecError
from bns.safe_yaml import CONFUSED, MOST_BYTES, Loader, excess


class Located:
    """A piece of a YAML file: its value on demand, and errors that begin with ``file:line:``."""

    def __init__(self, node: yaml.Node, loader: Loader, path: Path) -> None:
        self._node, self._loader, self.path = node, loader, path

    @property
    def line(self) -> int:
        """1-based line in the file."""
        return int(self._node.start_mark.line) + 1

    def fail(self, text: str) -> NoReturn:
        """Raise SpecError with the place in front."""
        raise SpecError(f"{self.path}:{self.line}: {text}")

    def value(self) -> Any:
        """The piece as plain Python data."""
        try:
            return self._loader.construct_object(self._node, deep=True)
        except CONFUSED as fault:
            self.fail(f"cannot be understood: {_first_line(fault)}. Write a plain number or text here.")

    def items(self, what: str) -> Iterator[tuple[str, Located, Located]]:
        """``(key, place of the key, value)`` of a mapping; SpecError if it is none or a key comes twice."""
        if not isinstance(self._node, yaml.MappingNode):
            self.fail(f"{what} must be a mapping (lines of 'key: value'), but this is {self._kind()}.")
        seen: dict[str, int] = {}
        for key_node, value_node in self._node.value:
            key = Located(key_node, self._loader, self.path)
            name = str(key_node.value) if isinstance(key_node, yaml.ScalarNode) else str(key.value())
            if name in seen:
                key.fail(f"key {name!r} is already given on line {seen[name]}. Keep one of the two.")
            seen[name] = key.line
            yield name, key, Located(value_node, self._loader, self.path)

    def elements(self, what: str) -> list[Located]:
        """The elements of a list that is not empty; SpecError otherwise."""
        if not isinstance(self._node, yaml.SequenceNode):
            self.fail(f"{what} must be a list, such as [1, 2], but this is {self._kind()}.")
        if not self._node.value:
            self.fail(f"{what} is an empty list: nothing would be run. Give a value or remove the key.")
        return [Located(node, self._loader, self.path) for node in self._node.value]

    def _kind(self) -> str:
        if isinstance(self._node, yaml.ScalarNode):
            return f"the value {self._node.value!r}" if self._node.value else "empty"
        return "a list" if isinstance(self._node, yaml.SequenceNode) else "a mapping"


def parse_yaml(text: str, path: Path) -> Located:
    """The root of a YAML text; SpecError with ``path`` and the line if it cannot be parsed."""
    if len(text) > MOST_BYTES:
        raise SpecError(f"{path}:1: the file has {len(text)} characters; {MOST_BYTES} are allowed. It is no sweep file.")
    try:
        loader = Loader(text)
        node = _root_node(loader, path)
    except yaml.MarkedYAMLError as fault:
        mark = fault.problem_mark or fault.context_mark
        line = mark.line + 1 if mark else 1
        raise SpecError(
            f"{path}:{line}: not valid YAML: {fault.problem or fault.context}. "
            "Look at indentation, colons and brackets of this line and the one above."
        ) from None
    except yaml.YAMLError as fault:
        raise SpecError(f"{path}:1: not valid YAML: {_first_line(fault)}.") from None
    if node is None:
        raise SpecError(f"{path}:1: the file is empty. It needs at least the keys 'name' and 'robot'.")
    beyond = excess(node, loops=False)
    if beyond:
        raise SpecError(f"{path}:{beyond.removeprefix('line ')}")
    return Located(node, loader, path)


def _root_node(loader: Loader, path: Path) -> yaml.Node | None:
    try:
        return loader.get_single_node()
    except RecursionError:
        raise SpecError(
            f"{path}:{loader.line + 1}: brackets or lists are nested too deeply to be read. "
            "A sweep file needs three levels: look for brackets that are never closed."
        ) from None


def read_text(path: Path) -> str:
    """The text of a file; SpecError if there is none, or it cannot be read."""
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SpecError(
            f"there is no sweep file {path}. Give a YAML file, or the name of a sweep that comes with bns: khepera, snake, …"
        ) from None
    except OSError as fault:
        raise SpecError(f"sweep file {path} cannot be read: {fault.strerror}.") from None
    except UnicodeDecodeError:
        raise SpecError(f"sweep file {path} is not UTF-8 text. Save it as UTF-8.") from None


def _first_line(fault: BaseException) -> str:
    return str(fault).strip().splitlines()[0] if str(fault).strip() else type(fault).__name__
