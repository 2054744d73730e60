"""Is anything slower than it was? Ratios of a measured table against those that are committed beside this file.

Only ratios are compared: against a peer that is measured in the same run, or against the floor that the machine allows. Times
alone say more of the machine than of a change. ``python -m tests.bench.ratios`` compares; ``--write`` keeps the new ones.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

KEPT = Path(__file__).with_name("ratios.csv")
MOST_WORSE = 0.15
"""Evosax's generation alone varies by that much from hour to hour on a machine that others use as well."""


def ratios(lines: Sequence[Mapping[str, Any]]) -> dict[str, tuple[float, bool]]:
    """Name -> ratio, and whether more of it is better, of every line that has one."""
    found = {}
    for line in lines:
        name = line["name"].strip()
        if line["unit"] == "x" and line["measured"] is not None:
            found[name] = (float(line["measured"]), not line["at_most"])
        elif line["distance"] is not None:
            found[f"{name}, over its floor"] = (float(line["distance"]), not line["at_most"])
    return found


def worse(now: Mapping[str, tuple[float, bool]], kept: Mapping[str, float]) -> dict[str, float]:
    """Name -> by which fraction a ratio is worse than the kept one, of those that are by more than `MOST_WORSE`."""
    by = {n: (kept[n] / value if more else value / kept[n]) - 1.0 for n, (value, more) in now.items() if n in kept}
    return {name: share for name, share in by.items() if share > MOST_WORSE}


def read(path: Path = KEPT) -> dict[str, float]:
    """The kept ratios."""
    with path.open() as file:
        return {row["name"]: float(row["ratio"]) for row in csv.DictReader(file)}


def write(now: Mapping[str, tuple[float, bool]], path: Path = KEPT) -> None:
    """Keep these ratios; those that were not measured this time stay as they were."""
    kept = (read(path) if path.exists() else {}) | {name: value for name, (value, _) in now.items()}
    with path.open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["name", "ratio"])
        table.writerows((name, f"{value:.3g}") for name, value in kept.items())


def main(arguments: list[str] | None = None) -> int:
    """Command line: 1 where a ratio is worse, 2 where there is nothing to compare."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.ratios", description=__doc__)
    parser.add_argument("measured", nargs="?", type=Path, default=Path("results/bench.json"), help="what make bench wrote")
    parser.add_argument("--write", action="store_true", help="keep these ratios as those to compare with")
    options = parser.parse_args(arguments)
    if not options.measured.is_file():
        print(f"{options.measured} is not there; run `make bench` first.", file=sys.stderr)
        return 2
    measured = json.loads(options.measured.read_text())
    now = ratios(measured["lines"])
    if measured["quick"]:
        print("That was a quick look, no result: run `make bench`.", file=sys.stderr)
        return 2
    if options.write:
        write(now)
        return 0
    kept, slower = read(), worse(now, read())
    for name, (value, more) in now.items():
        before = f"{kept[name]:8.3g}" if name in kept else "       -"
        verdict = f"WORSE by {slower[name]:.0%}" if name in slower else ""
        print(f"{name:62s} {before} {value:8.3g}  {'more' if more else 'less'} is better  {verdict}".rstrip())
    print(f"{len(now)} ratios, {len(slower)} worse by more than {MOST_WORSE:.0%} than the committed ones")
    return 1 if slower else 0


if __name__ == "__main__":
    sys.exit(main())
