"""Diagnose the logs of real robots: ``python -m analysis.real_robots --data DIR [--only NAME] [--out results/real-robots]``."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from analysis.real_robots.cases import cases, diagnosed, table_of
from analysis.real_robots.figure import error_figure
from bns.errors import BnsError, DataError, unknown_name


def main(arguments: list[str] | None = None) -> int:
    """Every case, or those whose names begin so; 2 where the data are not there."""
    parser = argparse.ArgumentParser(prog="python -m analysis.real_robots", description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder that holds the logs")
    parser.add_argument("--only", default="", metavar="NAME", help="cases whose names begin so")
    parser.add_argument("--out", type=Path, default=Path("results/real-robots"), help="folder for numbers and figures")
    options = parser.parse_args(arguments)
    try:
        return _run(options)
    except BnsError as fault:
        print(f"real-robots: {fault}", file=sys.stderr)
        return fault.exit_code


def _run(options: argparse.Namespace) -> int:
    everything = cases()
    chosen = {name: case for name, case in everything.items() if name.startswith(options.only)}
    if not chosen:
        raise DataError(unknown_name("case", options.only, everything))
    tables = {name: table_of(case, options.data) for name, case in chosen.items()}
    for name, case in chosen.items():
        answer = diagnosed(case, tables[name], options.out)
        known = {h: e for h, e in answer["error"].items() if e["after"] is not None}
        errors = ", ".join(f"{h} {1e3 * e['before']:.3g} -> {1e3 * e['after']:.3g} mm" for h, e in known.items())
        print(f"{name}: {answer['verdict']}: {', '.join(answer['effects']) or 'nothing listed'}; {errors}", flush=True)
    answers = {n: json.loads(p.read_text()) for n in everything if (p := options.out / f"{n}.json").is_file()}
    print(error_figure(answers, {n: c.title for n, c in everything.items()}, options.out / "real-error"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
