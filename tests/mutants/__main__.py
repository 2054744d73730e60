"""Small faults planted one at a time: do the nearest tests fail? `python -m tests.mutants --minutes 20`.

cosmic-ray plants them (a comparison, an operator, a number, a truth value exchanged) in a copy of the repository. A sample,
the same every time for a seed, is drawn group by group in turn until the time is up. Faults that change nothing that is carried
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

from tests.mutants.groups import GROUPS
from tests.mutants.report import written

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


def mutants(group: str, rng: random.Random) -> list[Mutant]:
    """All of a group, in an order that the seed decides."""
    found = []
    for pattern in GROUPS[group][0].split():
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
    """Whether a group's tests pass in the copy; no after `limit_s`."""
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


def limit(copy: Path, group: str, size: int) -> float:
    """How long a group's tests may take, from how long they take without a fault; they must pass then."""
    began = time.monotonic()
    if not passes(copy, GROUPS[group][1], 1200.0):
        sys.exit(f"the tests of {group} fail as they are: {GROUPS[group][1]}")
    took_s = time.monotonic() - began
    print(f"{group}: {size} places, tests take {took_s:.0f} s", flush=True)
    return max(LEAST_S, PATIENCE * took_s)


def main() -> None:
    """Plant until the time is up; the page of results."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--group", action="append", choices=GROUPS, help="only this one (may be given several times)")
    parser.add_argument("--out", type=Path, default=HERE / "docs" / "mutants.md")
    options = parser.parse_args()
    groups = options.group or list(GROUPS)
    left = {group: mutants(group, random.Random(f"{options.seed} {group}")) for group in groups}
    sizes, killed = {group: len(left[group]) for group in groups}, dict.fromkeys(groups, 0)
    survivors: dict[str, list[str]] = {group: [] for group in groups}
    with tempfile.TemporaryDirectory(prefix="bns-mutants-") as folder:
        copy = Path(folder) / "bns"
        hidden = shutil.ignore_patterns(".git", ".venv", "results", ".mypy_cache", ".ruff_cache", ".hypothesis", "__pycache__")
        shutil.copytree(HERE, copy, ignore=hidden)
        limits = {group: limit(copy, group, sizes[group]) for group in groups}
        end = time.monotonic() + 60.0 * options.minutes
        while time.monotonic() < end and any(left.values()):
            for group in [group for group in groups if left[group]]:
                mutant = left[group].pop()
                try:
                    lines = survives(copy, mutant, GROUPS[group][1], limits[group])
                except LookupError:
                    continue
                if lines is None:
                    killed[group] += 1
                else:
                    survivors[group].append(f"{mutant.path}:{lines}")
                options.out.write_text(written(sizes, killed, survivors, options))
                print("killed  " if lines is None else "SURVIVED", group, mutant.path, lines or "", flush=True)
    options.out.write_text(written(sizes, killed, survivors, options))


if __name__ == "__main__":
    main()
