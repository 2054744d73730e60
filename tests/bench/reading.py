"""Reading a whole study for a figure: 7.5 million evaluations, made up, in files as a finished sweep leaves them."""

from __future__ import annotations

import tempfile
from pathlib import Path

import duckdb

from bns.store import query
from tests.bench.clock import alternating
from tests.bench.line import Line, at_most
from tests.store.synthetic import make_store

FIGURE = "SELECT evaluation, mutation_rate, avg(success_7cm::INT) AS success FROM {} GROUP BY ALL ORDER BY ALL"


def measure(quick: bool) -> list[Line]:
    """Seconds from nothing opened to the numbers of the figure."""
    runs, evaluations = (7_500 if quick else 75_000), 100
    with tempfile.TemporaryDirectory() as folder:
        make_store(Path(folder), runs, evaluations)
        files = f"read_parquet('{folder}/evals/**/*.parquet', hive_partitioning=true)"
        taken = alternating(
            {
                "ours": lambda: query(folder, FIGURE.format("evals")),
                "bare": lambda: duckdb.connect().sql(FIGURE.format(files)).fetchall(),
            },
            5,
        )
    name = f"reading {runs * evaluations / 1e6:g} million evaluations for a figure"
    return [at_most(name, taken["ours"], 1, "s", taken["bare"], "floor: the same query on the bare files")]
