"""Digests of what the product answers: written before code is moved, checked after. Numbers must not change.

``python -m tests.digests --write FILE [--quick]`` keeps, ``--check FILE [--quick]`` compares; exit code 0 equal, 1 not.
Of every item (a table, a figure's CSV, a diagnosis, a journal; see `tests.digests_kept`) FILE holds one SHA-256, and
the values if they are few, so that the first one that differs is shown. Columns that are new are left alone.

Processors differ in last bits, and what is trained amplifies them. On a processor or with libraries other than those
that FILE names, only the first evaluation of each run (as in test_golden.py) and names in verdicts are compared.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import platform
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import partial
from importlib.metadata import version
from itertools import zip_longest
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_info

from tests.digests_kept import FULL, QUICK, Columns, Items, kept, skipped

LIBRARIES = ("numpy", "numba", "scipy", "torch", "pandas", "duckdb")
FEW = 20_000
"""Values of an item that are kept themselves."""
NAMES = ("verdict", "effects", "explanations")
FIRST = (
    *("diversity", "fitness_simulation", "fitness_world", "evaluated_fitness_world", "validation_error"),
    *("training_patterns", "commands", "mean_commands", "driven_ms"),
)
"""Of the first evaluation, what every processor finds, nearly."""
ROUNDED = 1e-9
"""Numbers of a diagnosis may differ by so much, relatively: on one machine, one process in about six had others in the thirteenth
digit. Runs and figures are equal to the last one."""
RELATIVE = 2e-3


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line."""
    options = _parser().parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        if not options.quick:
            os.environ["NUMBA_CACHE_DIR"] = (
                f"{folder}/kernels"  # compiled afresh: what lies on disk may be of older code
            )
        found = kept(QUICK if options.quick else FULL, Path(folder))
    if options.write:
        written = written_of(found)
        options.write.write_text(text_of(written))
        print(f"{len(found)} items written to {options.write}")
        return 0
    return check(json.loads(options.check.read_text()), found)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.digests", description=__doc__)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--write", type=Path, metavar="FILE", help="keep the digests there")
    what.add_argument("--check", type=Path, metavar="FILE", help="compare with the digests there")
    parser.add_argument("--quick", action="store_true", help="four small runs, two worlds and the figures")
    return parser


def machine() -> dict[str, str]:
    """What last bits depend on: the processor, the libraries that compute, and the kernels that linear algebra takes.

    The last may be chosen by a variable (OPENBLAS_CORETYPE): on one machine, Haswell's and the processor's own gave numbers of an
    effect that a log hardly determines which differed by 2e-9.
    """
    cpu = Path("/proc/cpuinfo")
    lines = cpu.read_text().splitlines() if cpu.is_file() else []
    told = sorted({line for line in lines if line.startswith(("model", "cpu family", "flags", "Features"))})
    kind = hashlib.sha256("\n".join(told).encode()).hexdigest()[:16]
    processor = f"{platform.system()} {platform.machine()} {platform.processor()} {kind}"
    kernels = ", ".join(sorted({one.get("architecture", "") for one in threadpool_info() if one["user_api"] == "blas"}))
    libraries = {"linear algebra": kernels} | {name: version(name) for name in LIBRARIES}
    return {"processor": processor, "python": platform.python_version()} | libraries


def digest(item: Columns) -> str:
    """Of all values with the names of their columns, in the order of these names."""
    return hashlib.sha256(json.dumps(item, sort_keys=True).encode()).hexdigest()


def entry_of(item: Columns) -> dict[str, Any]:
    """An item as FILE holds it."""
    few = sum(map(len, item.values())) <= FEW
    return {"sha256": digest(item), "columns": sorted(item), **({"values": item} if few else {})}


def written_of(found: Items) -> dict[str, Any]:
    """All that FILE holds."""
    return {"machine": machine(), "items": {name: entry_of(item) for name, item in found.items()}}


def text_of(written: Mapping[str, Any]) -> str:
    """JSON with a line for every item."""
    items = ",\n".join(f"{json.dumps(name)}: {json.dumps(entry)}" for name, entry in written["items"].items())
    return f'{{"machine": {json.dumps(written["machine"])},\n"items": {{\n{items}\n}}}}\n'


def check(written: Mapping[str, Any], found: Items) -> int:
    """Compare and say; 0 where all is equal."""
    other = differences_of(written["machine"], machine())
    if other:
        print(f"another kind of machine ({', '.join(other)}): first evaluations and verdicts are compared")
    told = []
    for name, entry in written["items"].items():
        was, now = entry, found.get(name)
        if now is None and skipped(name):
            print(f"not compared: {name}")
        elif now is None:
            told.append(f"{name}: is there no more")
        elif line := (nearly(was, now) if other else exactly(was, now)):
            told.append(f"{name}: {line}")
    for name in found.keys() - written["items"].keys():
        print(f"new, and not compared: {name}")
    print("\n".join(told) or f"{len(written['items'])} items are equal")
    return int(bool(told))


def differences_of(was: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """Names of what differs."""
    return [name for name in was if was[name] != now.get(name)]


def exactly(entry: Mapping[str, Any], now: Columns) -> str:
    """The first difference of the columns that were kept; nothing where every digit is the same."""
    same = {name: now[name] for name in entry["columns"] if name in now}
    if digest(same) == entry["sha256"]:
        return ""
    lacking = [name for name in entry["columns"] if name not in now]
    if lacking:
        return f"lacks {', '.join(lacking)}"
    if "values" not in entry:
        return "differs; its values were too many to be kept"
    if set(NAMES) <= set(entry["columns"]):
        return first(entry["values"], same, partial(close, within=ROUNDED))
    return first(entry["values"], same, lambda a, b: a == b)


def nearly(entry: Mapping[str, Any], now: Columns) -> str:
    """The first difference that no other processor explains."""
    return first(portable(entry.get("values", {})), portable(now), close) if "values" in entry else ""


def portable(item: Columns) -> Columns:
    """Names in verdicts, or what first evaluations found."""
    if set(NAMES) <= set(item):
        return {name: item[name] for name in NAMES}
    if "evaluation" not in item or not set(FIRST) <= set(item):
        return {}
    begun = [row for row, number in enumerate(item["evaluation"]) if number == "1"]
    return {name: [item[name][row] for row in begun] for name in FIRST}


def close(was: str | None, now: str | None, within: float = RELATIVE) -> bool:
    """The same text, or numbers as near as that; by default as test_golden.py asks."""
    try:
        return was == now or math.isclose(float(was or "nan"), float(now or "nan"), rel_tol=within)
    except ValueError:
        return False


def first(was: Columns, now: Columns, same: Any) -> str:
    """Which value differs first, what it was and what it is."""
    for name in was:
        for row, (a, b) in enumerate(zip_longest(was[name], now.get(name, []))):
            if not same(a, b):
                return f"{name}[{row}] was {a}, is {b}"
    return ""


if __name__ == "__main__":
    sys.exit(main())
