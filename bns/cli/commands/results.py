"""The commands that look at what there is: status, query, compact, archive, figures, watch."""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

from bns.cli.options.option_types import as_json, interval
from bns.cli.parser import Adder, add_results


def add_commands(command: Adder) -> None:
    """The parsers of these commands."""
    far = command("status", status, "show the progress of the sweeps in a results folder")
    ask = command("query", query, "answer an SQL query over evals, runs, specs, paths, generations, probes (DuckDB)")
    ask.add_argument("sql", metavar="SELECT ...")
    ask.add_argument("--csv", action="store_true", help="print comma-separated values with a header")
    ask.add_argument("--no-header", action="store_true", help="with --csv: no header")
    for one in (far, ask):
        one.add_argument("--json", action="store_true", help="print a list of JSON objects, one per row")
    small = command("compact", compact, "merge small result files, recover journals, upgrade older files")
    keep = command("archive", archive, "write the data that figures and findings need into one small file")
    add_results(keep)
    keep.add_argument("folder", type=Path, nargs="?", metavar="DIR", help="the same, without --results")
    keep.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.parquet", help="file to write")
    keep.add_argument("--sweep", action="append", metavar="NAME", help="keep this sweep (may be repeated; default: all)")
    drawn = command("figures", figures, "draw all figures that the results allow, on one page: DIR/figures/index.html")
    drawn.add_argument(
        "--from",
        dest="archive",
        metavar="FILE",
        help="draw from a file that bns archive wrote; published: DIR/published/study.parquet",
    )
    drawn.add_argument("--only", metavar="NAME", help="draw only this figure, for example success-by-mutation")
    look = command("watch", watch, "redraw the page of figures whenever runs finish, until Ctrl-C")
    look.add_argument("--every", type=interval, default=10.0, metavar="TIME", help="time between two checks (default: 10s)")
    for one in (far, ask, small):
        add_results(one)
    for one in (drawn, look):
        add_results(one, once_positional=True)


def status(options: argparse.Namespace) -> int:
    """A table of the sweeps."""
    from bns.sweep.report import status_table
    from bns.sweep.status import sweep_status

    rows = sweep_status(options.results)
    if options.json:
        print(as_json([asdict(row) | {"remaining": row.remaining} for row in rows]))
    else:
        print(status_table(rows))
    return 0


def query(options: argparse.Namespace) -> int:
    """Rows of a query, as a table, as CSV or as JSON."""
    from bns.errors import SpecError
    from bns.store import query as answer

    if options.json and (options.csv or options.no_header):
        raise SpecError(f"--json and {'--csv' if options.csv else '--no-header'} exclude each other. Give one of them.")
    if options.no_header and not options.csv:
        raise SpecError("--no-header: only with --csv. Give that too, or leave --no-header out.")
    rows = answer(options.results, options.sql)
    if options.json:
        print(as_json([dict(zip(rows.columns, row, strict=True)) for row in rows.itertuples(index=False, name=None)]))
    elif options.csv:
        sys.stdout.write(rows.to_csv(index=False, header=not options.no_header))
    else:
        print(rows.to_string(index=False, max_rows=100) if len(rows) else "no rows")
    sys.stdout.flush()
    return 0


def compact(options: argparse.Namespace) -> int:
    """Merge small files."""
    from bns.store import compact as merge

    print(merge(options.results))
    return 0


def archive(options: argparse.Namespace) -> int:
    """One file of what figures need."""
    from bns.store.archive.write import archive as write

    print(write(options.folder or options.results, options.output, options.sweep))
    return 0


def figures(options: argparse.Namespace) -> int:
    """The page of figures, drawn once; the code is that of the figures' scripts."""
    from bns.plotting.scripts import carry_out

    only = ["--only", options.only] if options.only else []
    return carry_out(options.results, *(["--from", options.archive] if options.archive else []), *only)


def watch(options: argparse.Namespace) -> int:
    """The page of figures, kept up to date."""
    from bns.cli.commands.watch import watch as keep_drawing

    def say(text: str) -> None:
        print(f"bns: {text.removeprefix('bns: ')}", file=sys.stderr, flush=True)  # a script that failed says bns itself

    keep_drawing(options.results, options.every, say=say)
    return 0
