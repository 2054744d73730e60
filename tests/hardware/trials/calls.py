"""A trial as it is called from the command line, and what it leaves behind."""

import yaml

import bns
from bns.cli.main import main

from .. import soak

TRIAL = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", *soak.QUICK]


def journal_of(results):
    [journal] = (results / "trials").glob("*/journal.jsonl")
    return journal


def faults(tmp_path, *plan):
    file = tmp_path / "faults.yaml"
    file.write_text(yaml.safe_dump({"seed": 1, "faults": list(plan)}))
    return ["--faults", file]


def call(*arguments):
    return main([str(a) for a in arguments])


def evaluated(results, sweep):
    rows = bns.load(results)
    return rows[rows["sweep"] == sweep].reset_index(drop=True)
