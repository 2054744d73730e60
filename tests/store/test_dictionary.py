"""The dictionary of columns in results/README.md holds every column of the schema, once, and no other."""

import re
from pathlib import Path

import pytest

from bns.store.schema import SCHEMAS, read_columns

PAGE = Path(__file__).parents[2] / "results" / "README.md"
SECTION = re.compile(r"^### (?P<tables>`[^\n]*`)\n(?P<body>.*?)(?=^#|\Z)", re.MULTILINE | re.DOTALL)
ROW = re.compile(r"^\| `(?P<column>\w+)` \|(?P<unit>[^|]*)\|(?P<meaning>[^|]*)\|$", re.MULTILINE)


def sections():
    return [
        (re.findall(r"`(\w+)`", found["tables"]), list(ROW.finditer(found["body"])))
        for found in SECTION.finditer(PAGE.read_text())
    ]


@pytest.mark.parametrize("table", SCHEMAS)
def test_every_column_of_the_schema_is_described_once_and_no_other(table):
    described = [row["column"] for tables, rows in sections() if table in tables for row in rows]
    assert sorted(described) == sorted(read_columns(table))


def test_every_row_of_the_page_is_read_and_says_something():
    page = PAGE.read_text().split("## Columns")[1]
    rows = [row for _, found in sections() for row in found]
    assert len(rows) == len(re.findall(r"^\| `", page, re.MULTILINE))
    assert all(row["meaning"].strip() for row in rows)
    assert {table for tables, _ in sections() for table in tables} == set(SCHEMAS)


@pytest.mark.parametrize("column", ["generations", "bound_hits", "arithmetic_failures"])
def test_running_totals_are_marked(column):
    meanings = [
        row["meaning"] for tables, rows in sections() if tables == ["evals"] for row in rows if row[1] == column
    ]
    assert [meaning.strip().startswith("so far") for meaning in meanings] == [True]
