"""Measure and print the table. Exit code 0 whether or not the targets are met: it says so."""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import time
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path

from tests.bench.clock import ONE_THREAD
from tests.bench.line import Line

PARTS = {
    "training": "Rprop against torch",
    "rollout": "rollout, and a generation against evosax",
    "whole_run": "a whole run against the core's peak",
    "snake": "the snake: physics, training, a whole run",
    "two_jobs": "two workers against one, and the sweep's overhead",
    "forecast": "what a sweep should take",
    "reading": "reading a study for a figure",
    "figures": "drawing a whole study",
    "page": "bns explore in a browser",
    "commands": "start, diagnosis, comparison and import from the command line",
}


def main(arguments: list[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer rounds and a tenth of the data: a look, no result")
    parser.add_argument("--only", choices=PARTS, metavar="NAME", help=", ".join(f"{n} ({t})" for n, t in PARTS.items()))
    parser.add_argument("--json", type=Path, metavar="PATH", help="write the lines to this file as well")
    options = parser.parse_args(arguments)
    os.environ.update(ONE_THREAD)
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, load {_load()} before the start")
    lines = [line for part in ([options.only] if options.only else PARTS) for line in _measured(part, options.quick)]
    met = [line.met for line in lines if line.target is not None]
    print(f"{met.count(True)} met, {met.count(False)} NOT met, {met.count(None)} not measured")
    if options.json:
        write(options.json, lines, options.quick)
    return 0


def _measured(part: str, quick: bool) -> list[Line]:
    began = time.perf_counter()
    lines: list[Line] = import_module(f"tests.bench.{part}").measure(quick)
    for line in lines:
        print(line.in_words(), flush=True)
    print(f"  ({time.perf_counter() - began:.0f} s)", file=sys.stderr, flush=True)
    return lines


def _load() -> str:
    return f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"


def write(path: Path, lines: list[Line], quick: bool) -> None:
    """The lines and the machine as JSON."""
    about = {
        "at": datetime.now(UTC).isoformat(timespec="seconds"),
        "quick": quick,
        "machine": platform.platform(),
        "cores": os.cpu_count(),
        "load": _load(),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(about | {"lines": [line.as_dict() for line in lines]}, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
