"""The commands for a beginning: effects (what a model can lack), example (files to try everything with)."""

from __future__ import annotations

import argparse

from bns.cli.options.option_types import as_json
from bns.cli.parser import Adder


def add_commands(command: Adder) -> None:
    """The parsers of these commands."""
    listed = command("effects", effects, "list the physical effects that a model can lack")
    listed.add_argument("name", nargs="?", metavar="EFFECT", help="show this effect alone, with all that is known of it")
    listed.add_argument("--json", action="store_true", help="print a list of JSON objects, one per effect")
    what = "copy sample files into a new folder: a log, a sweep, notebooks and a script; with robot: a package for your own robot"
    begun = command("example", example, what)
    begun.add_argument(
        "words", nargs="+", metavar="[robot] DIR", help="a new or empty folder; robot DIR writes a package for your own robot"
    )


def effects(options: argparse.Namespace) -> int:
    """The catalogue, or one effect."""
    from bns.api.effects import described, joint_names, rows

    if options.name is not None:
        known = described(options.name)
        texts = ("\n".join(f"{key.replace('_', ' ')}: {text}" for key, text in one.items() if text) for one in known)
        print(as_json(known) if options.json else "\n\n".join(texts))
        return 0
    listed = rows()
    if options.json:
        print(as_json(listed))
        return 0
    wide = max(len(row["effect"]) for row in listed)
    for row in listed:
        print(f"{row['effect']:{wide}}  {row['meaning']} [{row['stage']}]\n{'':{wide}}  {row['parameters']}; {row['bounds']}")
    print(f"\nof bodies on joints: {', '.join(joint_names())}\nbns effects EFFECT shows one with all that is known of it")
    return 0


def example(options: argparse.Namespace) -> int:
    """The files, and what to type first."""
    from bns.errors import SpecError
    from bns.examples import copy_example, copy_robot

    *kind, folder = options.words
    if kind not in ([], ["robot"]):
        raise SpecError(f"bns example {' '.join(options.words)}: write bns example DIR, or bns example robot DIR.")
    files = copy_robot(folder) if kind else copy_example(folder)
    print("\n".join(str(file) for file in files))
    then = "pip install -e .; bns trial --robot my-robot --emulated" if kind else "bns diagnose khepera-log.csv --model khepera"
    print(f"begin with {files[0]}: cd {folder}; {then}")
    return 0
