"""Data walks one way: no module imports one of a higher floor. Read from the source, so that lazy imports count too."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import bns

PACKAGE = Path(bns.__file__).parent
FLOORS = (
    {"change", "errors", "examples", "extras", "measurements", "options", "registry", "safe_yaml", "shipped", "spec", "targets"}
    | {"__init__"},
    {"engine"},
    {"tasks"},
    {"robots"},
    {"physics"},
    {"hardware"},
    {"worlds"},
    {"approaches", "bootstrap", "cuda", "static_simulator"},
    {"store"},
    {"sweep"},
    {"diagnose", "plotting", "console"},
    {"trial"},
    {"api"},
    {"app"},
    {"cli"},
    {"__main__"},
)
"""Rooms of the package, the ground first. Rooms on one floor may use each other."""
LEVEL = {room: level for level, rooms in enumerate(FLOORS) for room in rooms}
FRONT = "__init__.py"
"""What users import: it reaches upward when it is asked to, and for the type checker."""


def modules():
    """Without the package of a user's that `bns example robot` copies: it stands above all of ours."""
    found = (path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py"))
    return sorted(str(path) for path in found if path.parts[:2] != ("examples", "robot"))


def room_of(module: str) -> str:
    return module.split("/", maxsplit=1)[0].removesuffix(".py")


def imported(source: str, package: tuple[str, ...]) -> list[tuple[str, int]]:
    """Rooms of bns that a module's source imports, wherever in it, with their lines."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            start = ".".join(package[: len(package) - node.level + 1]) + "." if node.level else ""
            names = [f"{start}{node.module or ''}".rstrip(".") + f".{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            parts = name.split(".")
            if parts[0] == "bns":
                found.append((parts[1] if len(parts) > 1 and parts[1] in LEVEL else "__init__", node.lineno))
    return found


def of_module(module: str) -> list[tuple[str, int]]:
    return imported((PACKAGE / module).read_text(), ("bns", *module.split("/")[:-1]))


def upward(module: str, rooms: list[tuple[str, int]]) -> list[str]:
    """Imports of a higher floor, in words."""
    own = LEVEL[room_of(module)]
    return [f"bns/{module}:{line} imports {room}" for room, line in rooms if LEVEL[room] > own]


DIAGNOSE_FLOORS = (
    {"settings", "parallel"},
    {"data"},
    {"predict"},
    {"estimate"},
    {"select", "residuals"},
    {"values"},
    {"standing"},
    {"beside_terms"},
    {"outcome"},
    {"effect_caveats"},
    {"caveats"},
    {"adding", "comparison", "diagnosis"},
    {"diagnosing"},
    {"design"},
    {"report"},
)
"""Rooms and files of ``diagnose/``, the ground first: a log's way to its verdict enters no room twice."""


def test_the_rooms_of_the_diagnosis_stand_on_floors_too():
    level = {room: number for number, rooms in enumerate(DIAGNOSE_FLOORS) for room in rooms}
    inside = [path.relative_to(PACKAGE / "diagnose") for path in (PACKAGE / "diagnose").rglob("*.py")]
    found = []
    for path in inside:
        own = path.parts[0].removesuffix(".py")
        for node in ast.walk(ast.parse((PACKAGE / "diagnose" / path).read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("bns.diagnose"):
                rest = node.module.split(".")[2:]
                rooms = rest[:1] or [alias.name for alias in node.names]
                found += [
                    f"{path}:{node.lineno} imports {room}"
                    for room in rooms
                    if own not in {"__init__", room} and level[room] >= level[own]
                ]
    assert found == []


def test_every_room_has_a_floor():
    rooms = {room_of(module) for module in modules()}
    assert rooms == set(LEVEL), "say in FLOORS where a new room stands"


@pytest.mark.parametrize("module", [module for module in modules() if module != FRONT])
def test_nothing_is_imported_from_a_higher_floor(module):
    assert upward(module, of_module(module)) == []


def test_the_front_reaches_upward_only_when_asked():
    command = "import sys, bns; print(*sorted(name for name in sys.modules if name.startswith('bns')))"
    done = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["bns"]


def test_the_schema_of_the_files_depends_on_the_ground_only():
    assert {room for room, _ in of_module("store/schema.py")} <= {"errors", "spec"}


def test_no_module_of_a_robot_is_known_to_the_engine_or_the_loop():
    """A robot is added by adding a file: what stands above finds it by its name."""
    for module in modules():
        if room_of(module) in {"engine", "tasks", "bootstrap", "store", "sweep", "cli"}:
            assert "robots.khepera" not in (PACKAGE / module).read_text(), module


def test_no_text_holds_both_sides_of_a_merge():
    marked = re.compile(r"^(<{7} |>{7} |={7}$)", re.M)
    texts = [f for folder in ("bns", "analysis", "sweeps", "tests", "docs") for f in (PACKAGE.parent / folder).rglob("*.*")]
    texts = [f for f in texts if f.suffix in {".py", ".md", ".yaml", ".css", ".js", ".ino"}]
    assert len(texts) > 500
    assert [str(f) for f in texts if marked.search(f.read_text(errors="replace"))] == []


def test_the_package_does_not_import_its_tests():
    for module in modules():
        text = (PACKAGE / module).read_text()
        if not re.search(r"from\s+(tests|analysis)\b", text):  # to parse them all takes seconds
            continue
        assert not any(
            isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in {"tests", "analysis"}
            for node in ast.walk(ast.parse(text))
        ), module


@pytest.mark.parametrize(
    ("source", "rooms"),
    [
        ("import bns.store.read.reader", ["store"]),
        ("def f():\n    from bns.sweep import runner", ["sweep"]),
        ("from bns import bootstrap, errors", ["bootstrap", "errors"]),
        ("from ..store.reader import load", ["store"]),
        ("from . import philox", ["engine"]),
        ("from bns import __version__", ["__init__"]),
        ("import numpy.random\nfrom bnsx import store", []),
    ],
)
def test_imports_of_every_form_are_seen(source, rooms):
    assert [room for room, _ in imported(source, ("bns", "engine"))] == rooms


def test_an_upward_import_is_reported_with_its_line():
    found = upward("engine/snn.py", imported("import os\nfrom bns.bootstrap.loop import run", ("bns", "engine")))
    assert found == ["bns/engine/snn.py:2 imports bootstrap"]


def test_what_follows_a_widget_on_the_page_goes_to_the_browser_under_one_lock():
    watching = [path for path in (PACKAGE / "app").rglob("*.py") if ".param.watch(" in path.read_text()]
    assert [path.name for path in watching] == ["parts.py"]  # `on_change`, which says why
