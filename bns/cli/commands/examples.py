"""The commands for a beginning: effects (what a model can lack), example (files to try everything with)."""

from __future__ import annotations

import argparse
from pathlib import Path

from bns.cli.commands.diagnose import Adder
from bns.cli.options.option_types import as_json


def add_commands(command: Adder) -> None:
    """The parsers of these commands."""
    listed = command("effects", effects, "list the physical effects that a model can lack")
    listed.add_argument("--json", action="store_true", help="a list of JSON objects on stdout, one an effect")
    begun = command("example", example, "copy a sample log, a sweep and a script to begin with into a new folder")
    begun.add_argument("folder", type=Path, metavar="DIR", help="a folder that is new or empty")


def effects(options: argparse.Namespace) -> int:
    """The catalogue."""
    from bns.api.effects import effects as catalogue

    table = catalogue()
    if options.json:
        print(as_json(table.reset_index().to_dict("records")))
        return 0
    wide = max(map(len, table.index))
    for row in table.itertuples():
        print(f"{row.Index:{wide}}  {row.meaning} [{row.stage}]\n{'':{wide}}  {row.parameters}; {row.bounds}")
    return 0


def example(options: argparse.Namespace) -> int:
    """The files, and what to type first."""
    from bns.examples import copy_example

    files = copy_example(options.folder)
    print("\n".join(str(file) for file in files))
    print(f"begin with {files[0]}: cd {options.folder}; bns diagnose khepera-log.csv --model khepera")
    return 0
