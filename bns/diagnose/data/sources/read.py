"""Any file of measurements as the table that it is."""

from __future__ import annotations

import csv
import re
import zlib
from pathlib import Path

import pandas as pd
import yaml
from pyarrow import ArrowException

from bns.diagnose.data.relative_motions import read_json_lines
from bns.diagnose.data.sources.bags import ENDINGS as BAGS
from bns.diagnose.data.sources.bags import is_bag, read_bag
from bns.diagnose.data.sources.text_tables import ENDINGS as TEXTS
from bns.diagnose.data.sources.text_tables import read_text_table
from bns.errors import DataError

KINDS = "a .csv, .tsv, .dat, .txt, .parquet or .tuple file, or a recording of ROS (.bag, .mcap, .db3 or its folder)"


def read_table(path: Path) -> pd.DataFrame:
    """A file as it is, or a folder of ROS 2; DataError if there is none, it is of no such kind, or it does not read."""
    if not path.exists():
        raise DataError(f"There is no file {path}. Give {KINDS}.")
    if path.is_dir() and not is_bag(path):
        raise DataError(f"{path} is a folder without metadata.yaml, .mcap or .db3. Give {KINDS}.")
    if is_bag(path):
        return read_bag(path)
    if not path.stat().st_size:
        raise DataError(f"{path} is empty.")
    try:
        if path.name.endswith(TEXTS):
            return read_text_table(path)
        if path.suffix == ".tuple":
            return read_json_lines(path)
        if path.suffix == ".parquet":
            return pd.read_parquet(path)
    except (
        ValueError,
        csv.Error,
        OSError,
        EOFError,
        zlib.error,
        OverflowError,
        KeyError,
        ArrowException,
        yaml.YAMLError,
    ) as fault:
        raise DataError(f"{path} does not read as {path.suffix[1:]}: {_in_words(fault)}.") from fault
    known = ", ".join((*TEXTS, ".parquet", ".tuple", *BAGS))
    raise DataError(f"{path} is no file of measurements by its name; these are read: {known}.")


def _in_words(fault: Exception) -> str:
    if isinstance(fault, UnicodeDecodeError):
        return "it is no text in UTF-8. Save it as UTF-8, or give it the ending of what it is (.parquet)"
    found = re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", str(fault))
    if found:
        expected, line, saw = found.groups()
        return f"line {line} has {saw} columns, and the first line {expected}; put texts with separators into quotes"
    return str(fault).strip().rstrip(".")
