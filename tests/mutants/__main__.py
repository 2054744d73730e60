"""Small faults planted one at a time: do the nearest tests fail? `python -m tests.mutants --minutes 20`.

cosmic-ray plants them (a comparison, an operator, a number, a truth value exchanged) in a copy of the repository. A sample,
the same every time for a seed, is drawn room by room in turn until the time is up. Faults that change nothing that is carried
out (in annotations) are passed over.
"""

import argparse
import ast
import functools
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numba  # noqa: F401  # what all tests need, loaded once: each mutant runs in a fork
import pandas  # noqa: F401
import pyarrow.parquet  # noqa: F401
import pytest
import scipy.optimize
import scipy.stats  # noqa: F401
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

from tests.mutants.report import written
from tests.mutants.rooms import ROOMS

HERE = Path(__file__).resolve().parents[2]
KINDS = (
    *("BinaryOperator", "ComparisonOperator", "UnaryOperator", "NumberReplacer", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue"),
    *("ReplaceAndWithOr", "ReplaceOrWithAnd", "AddNot", "ReplaceBreakWithContinue", "ZeroIterationForLoop"),
)
PATIENCE, LEAST_S = 4.0, 60.0
"""A mutant whose tests take so many times as long as without it hangs, which counts as noticed."""


@dataclass(frozen=True)
class Mutant:
    """The `number`-th place of one kind of fault in a file."""

    path: str
    kind: str
    number: int


def operators() -> list[str]:
    """Names of the kinds of faults that are planted."""
    return sorted(name for name in operator_names() if any(kind in name for kind in KINDS))


def mutants(room: str, rng: random.Random) -> list[Mutant]:
    """All of a room, in an order that the seed decides."""
    found = []
    for pattern in ROOMS[room][0].split():
        for path in sorted(HERE.glob(pattern)):
            nodes = list(ast_nodes(get_ast(path.read_text())))
            for kind in operators():
                positions = sum(len(list(get_operator(kind)().mutation_positions(node))) for node in nodes)
                found += [Mutant(str(path.relative_to(HERE)), kind, number) for number in range(positions)]
    rng.shuffle(found)
    return found


@functools.cache
def meaning(text: str) -> str:
    """The code without annotations and texts that stand alone: what is the same here does the same."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.arg | ast.AnnAssign):
            node.annotation = ast.Constant(None)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            node.returns = None
    return ast.dump(tree)


def passes(copy: Path, tests: str, limit_s: float) -> bool:
    """Whether a room's tests pass in the copy; no after `limit_s`."""
    child = os.fork()
    if child == 0:
        os.setsid()
        os.chdir(copy)
        sys.path[:] = [str(copy), *(place for place in sys.path if Path(place or ".").resolve() != HERE)]
        for name in [name for name in sys.modules if name.split(".")[0] in {"bns", "tests", "analysis"}]:
            del sys.modules[name]
        os.environ["PYTHONPATH"] = str(copy)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        os._exit(int(pytest.main(["-x", "-q", "-n", "0", "-p", "no:cacheprovider", *tests.split()])))
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status) == 0
        time.sleep(0.05)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return False


def survives(copy: Path, mutant: Mutant, tests: str, limit_s: float) -> str | None:
    """The changed lines if the tests pass with it, nothing if they notice; LookupError if it changes nothing."""
    place = copy / mutant.path
    original = (HERE / mutant.path).read_text()
    changed = mutate_code(original, get_operator(mutant.kind)(), mutant.number) or original
    try:
        same = meaning(changed) == meaning(original)
    except SyntaxError as fault:  # cosmic-ray replaces the * of an unpacking, too
        raise LookupError(mutant) from fault
    if same:
        raise LookupError(mutant)
    place.write_text(changed)
    try:
        return difference(original, changed) if passes(copy, tests, limit_s) else None
    finally:
        shutil.copy2(HERE / mutant.path, place)


def difference(original: str, changed: str) -> str:
    """`line: before -> after` of the first line that differs."""
    pairs = enumerate(zip(original.splitlines(), changed.splitlines(), strict=False), 1)
    number, (before, after) = next((n, pair) for n, pair in pairs if pair[0] != pair[1])
    return f"{number}: `{before.strip()}` → `{after.strip()}`"


def limit(copy: Path, room: str, size: int) -> float:
    """How long a room's tests may take, from how long they take without a fault; they must pass then."""
    began = time.monotonic()
    if not passes(copy, ROOMS[room][1], 1200.0):
        sys.exit(f"the tests of {room} fail as they are: {ROOMS[room][1]}")
    took_s = time.monotonic() - began
    print(f"{room}: {size} places, tests take {took_s:.0f} s", flush=True)
    return max(LEAST_S, PATIENCE * took_s)


def main() -> None:
    """Plant until the time is up; the page of results."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--room", action="append", choices=ROOMS, help="only this one (may be given several times)")
    parser.add_argument("--out", type=Path, default=HERE / "docs" / "mutants.md")
    options = parser.parse_args()
    rooms = options.room or list(ROOMS)
    left = {room: mutants(room, random.Random(f"{options.seed} {room}")) for room in rooms}
    sizes, killed, survivors = {room: len(left[room]) for room in rooms}, dict.fromkeys(rooms, 0), {room: [] for room in rooms}
    with tempfile.TemporaryDirectory(prefix="bns-mutants-") as folder:
        copy = Path(folder) / "bns"
        hidden = shutil.ignore_patterns(".git", ".venv", "results", ".mypy_cache", ".ruff_cache", ".hypothesis", "__pycache__")
        shutil.copytree(HERE, copy, ignore=hidden)
        limits = {room: limit(copy, room, sizes[room]) for room in rooms}
        end = time.monotonic() + 60.0 * options.minutes
        while time.monotonic() < end and any(left.values()):
            for room in [room for room in rooms if left[room]]:
                mutant = left[room].pop()
                try:
                    lines = survives(copy, mutant, ROOMS[room][1], limits[room])
                except LookupError:
                    continue
                if lines is None:
                    killed[room] += 1
                else:
                    survivors[room].append(f"{mutant.path}:{lines}")
                options.out.write_text(written(sizes, killed, survivors, options))
                print("killed  " if lines is None else "SURVIVED", room, mutant.path, lines or "", flush=True)
    options.out.write_text(written(sizes, killed, survivors, options))


if __name__ == "__main__":
    main()
