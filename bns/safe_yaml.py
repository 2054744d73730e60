"""YAML of users as plain data: nothing in it is carried out, and neither its size, its depth nor its aliases are without bounds.

It departs from ``yaml.safe_load`` in three things: a key that YAML 1.1 takes for a truth value (``on``, ``off``, ``yes``) stays
the text that it is, ``1e-3`` is a number as in YAML 1.2, and of two equal keys none is dropped silently.
"""

from __future__ import annotations

import re
import reprlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from bns.errors import BnsError

MOST_BYTES = 1 << 17
MOST_NODES = 50_000
"""Keys, values and elements, each alias counted with all that it stands for."""
DEEPEST = 20
CONFUSED = (yaml.YAMLError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError)
"""What PyYAML raises for ``!!int ""``, ``!!bool x``, ``!!timestamp x``, endless sexagesimals and deep nesting."""


class Loader(yaml.SafeLoader):
    """SafeLoader that takes ``1e-3`` for a number."""


Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"^[-+]?[0-9]+(\.[0-9]*)?[eE][-+]?[0-9]+$"), list("-+0123456789")
)


class Lines:
    """Which line each piece of a file stands on; a piece is named by the keys and numbers that lead to it.

    Without a ``root`` there is no file, and no line is named.
    """

    def __init__(self, root: yaml.Node | None = None) -> None:
        self._root = root

    def of(self, *path: str | int) -> int:
        """1-based line of the piece, or of the last one on the way that is there."""
        node = self._root
        line = node.start_mark.line if node is not None else 0
        for step in path:
            below = _below(node, step)
            if below is None:
                break
            mark, node = below
            line = mark.start_mark.line
        return int(line) + 1

    def line(self, *path: str | int) -> int | None:
        """The same; None where there is no file, or none of the piece in it."""
        return None if self._root is None or not path else self.of(*path)

    @contextmanager
    def at(self, *path: str | int) -> Iterator[None]:
        """Name the line of the piece in the error that is met with it."""
        try:
            yield
        except BnsError as error:
            text = str(error)
            if self._root is None or text.startswith("line "):
                raise
            raise type(error)(f"line {self.of(*path)}: {text}") from error


def read_yaml(text: str, where: str, fault: type[BnsError]) -> tuple[Any, Lines]:
    """The data in a YAML text, and the lines; ``fault`` names ``where`` and the line, if it is too large or no YAML."""
    if len(text) > MOST_BYTES:
        raise fault(f"{where} has {len(text)} characters; {MOST_BYTES} are allowed. It is no file that bns reads.")
    loader = _loader(text, where, fault)
    try:
        root = loader.get_single_node()
        _check_keys(root, set())
        too_much = None if root is None else excess(root)
        tree = None if root is None or too_much else loader.construct_document(root)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else 1
        raise fault(
            f"{where}, line {line}: no valid YAML: {error.problem or error.context}. "
            "Look at indentation, colons and brackets of this line and the one above."
        ) from error
    except RecursionError:
        raise fault(f"{where}, line {loader.line + 1}: nested too deeply: {DEEPEST} levels are allowed.") from None
    except CONFUSED as error:
        raise fault(f"{where}, line {loader.line + 1}: cannot be understood: {_first_line(error)}.") from error
    if too_much:
        raise fault(f"{where}, {too_much}")
    return tree, Lines(root)


def _loader(text: str, where: str, fault: type[BnsError]) -> Loader:
    try:
        return Loader(text)
    except yaml.YAMLError as error:  # letters that no YAML may have
        raise fault(f"{where}: no valid YAML: {_first_line(error)}.") from error


def read_yaml_file(path: Path, what: str, fault: type[BnsError]) -> tuple[Any, Lines]:
    """`read_yaml` of a file; ``what`` says of what kind it is: "the rig"."""
    return read_yaml(text_of(path, what, fault), f"{what} {path}", fault)


def text_of(path: Path, what: str, fault: type[BnsError]) -> str:
    """The text of a file that a user names; ``fault`` if it cannot be read, is too large or no UTF-8."""
    try:
        if path.stat().st_size > 4 * MOST_BYTES:
            raise fault(f"cannot read {what} {path}: it has {path.stat().st_size} bytes; {MOST_BYTES} are allowed.")
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise fault(f"cannot read {what} {path}: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise fault(f"cannot read {what} {path}: it is no UTF-8 text (byte {error.start}). Save it as UTF-8.") from error


def shown(value: object) -> str:
    """``value`` as it may stand in a message: the first letters of it, if it is long."""
    short = reprlib.Repr()
    short.maxstring = short.maxother = 80
    text = short.repr(value)
    return text if len(text) <= 200 else f"{text[:197]}..."


def excess(root: yaml.Node, *, loops: bool = True) -> str:
    """What is beyond the bounds in a tree of nodes, with its line; "" if nothing is.

    ``loops``: an alias within what it stands for is one of those things.
    """
    try:
        nodes, depth = _size(root, {}, set())
    except RecursionError:
        return f"line {root.start_mark.line + 1}: nested too deeply: {DEEPEST} levels are allowed."
    except _LoopError as loop:
        return f"line {loop.line}: an alias contains itself. Write it out." if loops else ""
    if depth > DEEPEST:
        return f"line {root.start_mark.line + 1}: nested too deeply: {depth} levels, and {DEEPEST} are allowed."
    if nodes > MOST_NODES:
        return f"line {root.start_mark.line + 1}: {nodes} keys and values with all aliases; {MOST_NODES} are allowed."
    return ""


class _LoopError(Exception):
    def __init__(self, line: int) -> None:
        self.line = line


def _size(node: yaml.Node, known: dict[int, tuple[int, int]], above: set[int]) -> tuple[int, int]:
    """Nodes and levels at and below a node, aliases laid out; each node is looked at once."""
    if id(node) in above:
        raise _LoopError(node.start_mark.line + 1)
    if id(node) not in known:
        below = _children(node)
        sizes = [_size(child, known, above | {id(node)}) for child in below]
        known[id(node)] = 1 + sum(size for size, _ in sizes), 1 + max((depth for _, depth in sizes), default=0)
    return known[id(node)]


def _children(node: yaml.Node) -> list[yaml.Node]:
    if isinstance(node, yaml.MappingNode):
        return [one for pair in node.value for one in pair]
    return list(node.value) if isinstance(node, yaml.SequenceNode) else []


def _below(node: yaml.Node | None, step: str | int) -> tuple[yaml.Node, yaml.Node] | None:
    """Where the piece begins, and the piece."""
    if isinstance(node, yaml.MappingNode):
        pairs = ((key, value) for key, value in node.value if isinstance(key, yaml.ScalarNode) and key.value == step)
        return next(pairs, None)
    if isinstance(node, yaml.SequenceNode) and isinstance(step, int) and step < len(node.value):
        return node.value[step], node.value[step]
    return None


def _check_keys(node: yaml.Node | None, seen: set[int]) -> None:
    """Keys stay texts; a fault of YAML if one comes twice."""
    if node is None or id(node) in seen:
        return
    seen.add(id(node))
    given: dict[str, int] = {}
    for key in [key for key, _ in node.value] if isinstance(node, yaml.MappingNode) else []:
        if not isinstance(key, yaml.ScalarNode):
            continue
        if key.tag == "tag:yaml.org,2002:bool":
            key.tag = "tag:yaml.org,2002:str"
        if key.value in given and key.tag != "tag:yaml.org,2002:merge":
            problem = f"the key {key.value!r} is already given on line {given[key.value]}"
            raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
        given[key.value] = key.start_mark.line + 1
    for child in _children(node):
        _check_keys(child, seen)


def _first_line(fault: BaseException) -> str:
    return str(fault).strip().splitlines()[0] if str(fault).strip() else type(fault).__name__
