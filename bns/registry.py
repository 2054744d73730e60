"""One way to add a part: a file in its folder here, or an object that an installed package announces as an entry point.

A file is a part where its text defines the registry's marker at the left margin (``EFFECT = ...``, ``def build(...)``); its
name is the file's, with hyphens. An entry point of the registry's group has the part's name and points at such a module, or at
an object of the same kind. Listing names reads texts and entry points and imports no part.
"""

from __future__ import annotations

import pkgutil
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from bns.errors import BnsError, ClusterError, HardwareError, ModelError, SpecError, unknown_name

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


@dataclass(frozen=True)
class Part:
    """A part that is known by name and not loaded yet: the module it is in, or the entry point that leads to it."""

    name: str
    module: str = ""
    entry: EntryPoint | None = None

    @property
    def origin(self) -> str:
        """Where it comes from, for messages."""
        if self.entry is None:
            return f"the module {self.module}"
        package = self.entry.dist
        known = f"the package {package.name} {package.version}" if package else "an installed package"
        return f"{known} ({self.entry.value})"


class Registry:
    """The parts of one kind: those of a folder of ours, then those of installed packages (``bns.GROUP``), each by name.

    ``marker``: how the line begins that makes a module a part; its first group, if it has one, is the part's name.
    ``attribute`` is the object in such a module ("": the module itself is the part). A part must have the attributes ``needs``.
    """

    def __init__(
        self, kind: str, group: str, folder: str, marker: str, attribute: str, needs: Iterable[str], error: type[BnsError]
    ) -> None:
        self.kind, self.group, self._folder, self._error = kind, f"bns.{group}", folder, error
        self._marker, self._attribute, self._needs = re.compile(f"^{marker}", re.MULTILINE), attribute, tuple(needs)
        self._loaded: dict[str, Any] = {}

    @cached_property
    def own(self) -> Mapping[str, tuple[Part, ...]]:
        """Name -> parts of ours with that name, in alphabetical order."""
        return _by_name(self._files())

    @cached_property
    def announced(self) -> Mapping[str, tuple[Part, ...]]:
        """Name -> parts of that name that installed packages bring, in alphabetical order."""
        from importlib.metadata import entry_points  # noqa: PLC0415  # a twentieth of a second

        return _by_name(Part(entry.name, entry=entry) for entry in entry_points(group=self.group))

    def names(self) -> tuple[str, ...]:
        """All names: ours in alphabetical order, then those of packages."""
        return (*self.own, *(name for name in self.announced if name not in self.own))

    def is_plugin(self, name: str) -> bool:
        """Does an installed package bring a part of that name?"""
        return name not in self.own and name in self.announced

    def part(self, name: str) -> Part:
        """The one part of that name, not loaded; an error lists the names there are, or both parts that share it."""
        found = (*self.own.get(name, ()), *self.announced.get(name, ()))
        if not found:
            raise self._error(unknown_name(self.kind, name, self.names()))
        if len(found) > 1:
            origins = " and ".join(part.origin for part in found)
            raise self._error(f"two parts are called {self.kind} {name!r}: {origins}. Uninstall one, or rename it.")
        return found[0]

    def load(self, name: str) -> Any:
        """The part itself. An error names the package whose part cannot be imported or is no such part."""
        if name not in self._loaded:
            self._loaded[name] = self._opened(self.part(name))
        return self._loaded[name]

    def _opened(self, part: Part) -> Any:
        if part.entry is None:
            module = import_module(part.module)
            return getattr(module, self._attribute) if self._attribute else module
        try:
            return self._checked(part, part.entry.load())
        except Exception as fault:
            told = str(fault) if isinstance(fault, BnsError) else f"{type(fault).__name__}: {fault}"
            raise self._error(
                f"{self.kind} {part.name!r} of {part.origin} cannot be used: {told.rstrip('.')}. Fix or uninstall that package."
            ) from fault

    def _checked(self, part: Part, found: Any) -> Any:
        """What an entry point led to, if it is such a part and has its name."""
        if isinstance(found, ModuleType) and self._attribute:
            found = getattr(found, self._attribute)
        missing = [name for name in self._needs if not hasattr(found, name)]
        if missing:
            raise self._error(f"it lacks {', '.join(missing)}; docs/extending.md has an example")
        own = getattr(found, "name", getattr(found, "NAME", part.name))
        if own != part.name:
            raise self._error(f"it calls itself {own!r}; the entry point must have the same name")
        return found

    def _files(self) -> Iterable[Part]:
        """The parts of ours: modules with the marker."""
        place = find_spec(self._folder)
        for folder in (place.submodule_search_locations or ()) if place else ():
            for module in pkgutil.iter_modules([folder]):
                file = Path(folder) / (f"{module.name}/__init__.py" if module.ispkg else f"{module.name}.py")
                if marked := self._marker.search(file.read_text(encoding="utf-8")):
                    name = marked.group(1) if self._marker.groups else module.name.replace("_", "-")
                    yield Part(name, f"{self._folder}.{module.name}")


def _by_name(parts: Iterable[Part]) -> dict[str, tuple[Part, ...]]:
    found: dict[str, list[Part]] = {}
    for part in sorted(parts, key=lambda one: (one.name, one.origin)):
        found.setdefault(part.name, []).append(part)
    return {name: tuple(same) for name, same in found.items()}


EFFECTS = Registry("effect", "effects", "bns.physics.effects", "EFFECT = ", "EFFECT", ("name", "stage", "apply"), ModelError)
JOINT_EFFECTS = Registry(
    "effect of a body on joints", "joint_effects", "bns.physics.jointed.effects", "EFFECT = ", "EFFECT",
    ("name", "stage", "apply"), ModelError,
)  # fmt: skip
WORLDS = Registry("world", "worlds", "bns.worlds", r"def build\(", "", ("build",), SpecError)
ROBOTS = Registry("robot", "robots", "bns.robots", "ROBOT = ", "ROBOT", ("name", "networks", "bounds"), SpecError)
EXECUTORS = Registry("executor", "executors", "bns.sweep.executors", r"def carry_out\(", "", ("carry_out",), ClusterError)
TRACKERS = Registry(
    "kind of tracker", "trackers", "bns.hardware.tracking", "SETTINGS = ", "", ("SETTINGS", "open_tracker", "emulate"),
    HardwareError,
)  # fmt: skip
PLATFORMS = Registry(
    "robot with a driver", "platforms", "bns.hardware.platforms", r"def open_platform\(", "", ("open_platform", "emulate", "RIG"),
    HardwareError,
)  # fmt: skip
FIGURES = Registry("figure", "figures", "analysis", r'NAME = "([^"]+)"', "", ("NAME", "PAPER", "draw"), SpecError)
APPROACHES = Registry(
    "approach", "approaches", "bns.approaches", "APPROACH = ", "APPROACH", ("options", "networked", "start"), SpecError
)  # fmt: skip
