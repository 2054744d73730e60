"""Make the worlds, ask about each, and judge the answers. Exit code 0 whether or not the targets are met: it says so."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import track

from tests.hidden_effects.acceptable import acceptable
from tests.hidden_effects.answer import read
from tests.hidden_effects.asking import Record, answers, shares
from tests.hidden_effects.figure import confusion
from tests.hidden_effects.heldout import ratios
from tests.hidden_effects.judge import WRONG, coverage, judge, said
from tests.hidden_effects.plan import QUICK, select, worlds
from tests.hidden_effects.summary import Result, mistakes, table
from tests.hidden_effects.world import World, write


def main(arguments: list[str] | None = None) -> int:
    """Command line."""
    options = _parser().parse_args(arguments)
    chosen = select(worlds(options.seed), options.only, options.quick)
    if not chosen:
        print(f"no world's family or name holds {options.only!r}; families: {', '.join(QUICK)}", file=sys.stderr)
        return 2
    if options.write:
        for world in _shown(chosen, len(chosen)):
            write(world, options.write, acceptable(world))
        return 0
    os.environ.update(shares(options.jobs))
    found = answers(chosen, options.results / "answers", options.jobs, options.fresh)
    results = [result_of(world, record) for world, record in _shown(found, len(chosen))]
    _report(results, options.results)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.hidden_effects", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a slice of every family: a look, no result")
    parser.add_argument("--only", metavar="WORD", default="", help=f"one family ({', '.join(QUICK)}) or part of a name")
    parser.add_argument("--seed", type=int, default=0, help="of all worlds; another seed, other trials (0)")
    parser.add_argument("--write", type=Path, metavar="DIR", help="write tables and truth there, and ask nothing")
    parser.add_argument("--fresh", action="store_true", help="ask again what was answered before")
    parser.add_argument("--jobs", type=int, default=2, help="worlds asked at a time (2)")
    parser.add_argument("--results", type=Path, default=Path("results/hidden-effects"), help="folder of the answers")
    return parser


def _shown(items: Iterator[tuple[World, Record]] | Sequence[World], total: int):  # type: ignore[no-untyped-def]
    console = Console(stderr=True)
    return track(items, "worlds", total=total, console=console, disable=not sys.stderr.isatty())


def result_of(world: World, record: Record) -> Result:
    """The record judged."""
    if record["answer"] is None:
        return Result(world, WRONG, "no answer", record["seconds_s"])
    answer = read(record["answer"])
    outcome, covered = judge(world, answer), tuple(coverage(world, answer))
    told = said(world, answer)
    return Result(world, outcome, told, record["seconds_s"], covered, ratios(world, answer), record.get("cpu_s", 0.0))


def _report(results: Sequence[Result], folder: Path) -> None:
    said = f"{table(results)}\n{mistakes(results)}".rstrip()
    print(said)
    (folder / "table.txt").write_text(said + "\n")
    summary = [
        {
            "world": one.world.name,
            "family": one.world.family,
            "outcome": one.outcome,
            "said": one.said,
            "seconds_s": one.seconds_s,
            "cpu_s": one.cpu_s,
            "ratios": one.ratios,
            "covered": [vars(interval) | {"inside": interval.inside} for interval in one.covered],
        }
        for one in results
    ]
    (folder / "summary.json").write_text(json.dumps(summary, indent=1) + "\n")
    for path in confusion(results, folder / "confusion"):
        print(path)


if __name__ == "__main__":
    sys.exit(main())
