"""The command that turns a log into a table of measurements: import."""

from __future__ import annotations

import argparse
from pathlib import Path

from bns.cli.parser import Adder


def add_commands(command: Adder) -> None:
    """The parser of this command; ``command`` makes one of a name, a function and a text."""
    read = command("import", import_, "turn a log with other columns or units into a table of measurements")
    read.add_argument(
        "data",
        type=Path,
        nargs="+",
        metavar="LOG",
        help="a .csv, .tsv, .dat, .txt, .parquet or .tuple file, or a ROS recording (.bag, .mcap, .db3 or its folder); further "
        "files are joined with the first by time",
    )
    read.add_argument(
        "--map", type=Path, metavar="FILE", help="mapping (YAML); default: LOG.import.yaml next to the log"
    )
    read.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="table to write (.csv or .parquet); with --propose the mapping (.yaml)",
    )
    read.add_argument(
        "--propose",
        action="store_true",
        help="print a proposed mapping (YAML), or write it to -o FILE: bns import LOG --propose -o LOG.import.yaml",
    )


def import_(options: argparse.Namespace) -> int:
    """A log as a table of measurements; the mapping is kept beside it."""
    import yaml

    from bns.diagnose.data.import_log import check_new_mapping, import_log, proposal
    from bns.diagnose.data.mapping import files_behind, load_mapping, refuse_to_replace
    from bns.diagnose.report.text import findings_text
    from bns.errors import DataError
    from bns.measurements import check_table_name, write_measurements

    if options.propose:
        if options.output is not None:
            check_new_mapping(options.output)
        proposed = proposal(options.data)
        if options.output is None:
            print(proposed, end="")
        else:
            options.output.write_text(proposed, encoding="utf-8")
            print(f"Wrote {options.output}, a proposed mapping: check it line by line.")
        return 0
    if options.output is None:
        raise DataError("Give -o FILE, the table to write (.csv or .parquet), or --propose, which prints a mapping.")
    check_table_name(options.output)
    first = options.data[0]
    given = load_mapping(options.map) if options.map else None
    sources = [*files_behind(options.data, given), *([options.map] if options.map else ())]
    refuse_to_replace(options.output, sources, "imported")
    found = import_log(options.data, given)
    write_measurements(found.table, options.output)
    if options.map:
        beside = first.with_name(first.name + ".import.yaml")
        if not beside.exists():
            beside.write_text(yaml.safe_dump(dict(found.mapping or {}), sort_keys=False), encoding="utf-8")
    print(found.summary(str(options.output)))
    print(findings_text(found.findings))
    return 0
