"""Take controllers of stored runs to another world: ``python -m analysis.transfer SWEEP ... --to WORLD``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from analysis.results import Results
from analysis.transfer.drives import described, summary, transferred
from analysis.transfer.figure import transfer_figure
from bns.errors import BnsError
from bns.robots import load_robot
from bns.store.disk.files import publish
from bns.worlds import build_world


def main(arguments: Sequence[str] | None = None) -> int:
    """Table on stdout; transfer.csv, transfer-summary.csv and transfer.png in a folder. 0, or 2 with one line on stderr."""
    wanted = _parser().parse_args(arguments)
    compared = _labels(wanted.sweeps)
    labels = compared | _labels(wanted.reference)
    try:
        robot = load_robot(wanted.robot)
        drives = transferred(Results(wanted.results), list(labels), build_world(wanted.to, robot), robot)
        table = summary(drives)
        for name, frame in (("transfer.csv", drives), ("transfer-summary.csv", table)):
            publish(frame.to_csv(index=False).encode(), wanted.out / f".{name}.part", wanted.out / name)
        picture = transfer_figure(drives, compared, _labels(wanted.reference), wanted.out / "transfer", robot.name)
    except BnsError as fault:
        print(f"analysis.transfer: {fault}", file=sys.stderr)
        return fault.exit_code
    print(f"{described(table, labels)}\nfigure: {picture}")
    return 0


def _labels(sweeps: Sequence[str]) -> dict[str, str]:
    """What to call each sweep: what stands behind its ``=``, or its name."""
    parts = [one.partition("=") for one in sweeps]
    return {sweep: label or sweep for sweep, _, label in parts}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m analysis.transfer", description="Drive stored controllers in another world.")
    parser.add_argument("sweeps", nargs="+", metavar="SWEEP[=LABEL]", help="sweeps with record: paths, and what to call them")
    parser.add_argument(
        "--reference", action="append", default=[], metavar="SWEEP[=LABEL]", help="drawn thin, without its interval (repeatable)"
    )
    parser.add_argument("--to", required=True, metavar="WORLD", help="substitute, physics or a model file (.yaml)")
    parser.add_argument("--robot", default="khepera", help="(default: khepera)")
    parser.add_argument("--results", type=Path, default=Path("results"), metavar="DIR", help="folder of the results (results)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of tables and figure")
    return parser


if __name__ == "__main__":
    sys.exit(main())
