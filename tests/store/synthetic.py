"""Made-up results: single runs for the tests, and whole stores for tests and benchmarks."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from bns.spec import RunSpec
from bns.store.provenance import provenance
from bns.store.record import RunRecord
from bns.store.schema import PARAMETERS, SCHEMAS
from bns.store.write.fold import publish_fold

START = datetime(2026, 1, 1, tzinfo=UTC)
MUTATION_RATES = (0.02, 0.05, 0.1, 0.2, 0.4)
POPULATIONS = (100, 200, 400)
PARAMETER_KEYS = ("run_id", "robot", *PARAMETERS)


def specs(count: int, evaluations: int = 100, **fixed: Any) -> Iterator[RunSpec]:
    """``count`` different specs: every mutation rate and population with seed 0, then with seed 1 ..."""
    # Not product(count(), ...): product collects its arguments before it begins.
    cells = list(itertools.product(MUTATION_RATES, POPULATIONS))
    grid = ((seed, *cell) for seed in itertools.count() for cell in cells)
    for seed, rate, population in itertools.islice(grid, count):
        values = {"seed": seed, "mutation_rate": rate, "population_size": population}
        yield RunSpec(**{**values, "evaluations": evaluations, **fixed})


def columns(table: str, rows: int, random: np.random.Generator) -> dict[str, np.ndarray]:
    """Random values for the columns that a run itself fills, of the types of the schema."""
    made: dict[str, np.ndarray] = {}
    for field in SCHEMAS[table]:
        if field.name in PARAMETER_KEYS:
            continue
        if field.name == "robot_s":  # adds up from evaluation to evaluation
            made[field.name] = np.arange(1.0, rows + 1)
        elif pa.types.is_boolean(field.type):
            made[field.name] = random.random(rows) < 0.3
        elif pa.types.is_floating(field.type):
            made[field.name] = random.random(rows)
        elif pa.types.is_string(field.type):
            made[field.name] = np.where(np.arange(rows) % 2 == 0, "evaluated", "fittest").astype(object)
        else:
            made[field.name] = random.integers(0, 1000, rows)
    return made


def _rows_each(table: str) -> int:
    """Rows an evaluation: one, or one for each controller that is told apart."""
    return 2 if "who" in SCHEMAS[table].names else 1


def run_row(status: str = "ok", **values: Any) -> dict[str, Any]:
    """The runs columns that the caller of the store provides."""
    return {"status": status, "started_at": START, "wall_s": 1.5, "cpu_s": 1.25, "attempts": 1, **values}


def record(spec: RunSpec, tables: tuple[str, ...] = ("evals",), **values: Any) -> RunRecord:
    """A run that went well; its numbers depend on its spec alone."""
    random = np.random.default_rng(int(spec.run_id[1:9], 16))
    made = {name: columns(name, spec.evaluations * _rows_each(name), random) for name in tables}
    for name, one in made.items():
        one["evaluation"] = np.repeat(np.arange(1, spec.evaluations + 1), _rows_each(name))
    return RunRecord(spec, run_row(world_digest="w0", peak_memory_mib=80.0, **values), made)


def records(count: int, evaluations: int = 3, **fixed: Any) -> list[RunRecord]:
    """``count`` runs that went well."""
    return [record(spec) for spec in specs(count, evaluations, **fixed)]


def failed(spec: RunSpec, status: str = "failed") -> RunRecord:
    """A run that broke."""
    return RunRecord(spec, run_row(status, error="ValueError: no"))


def make_store(
    path: Path, runs: int, evaluations: int = 100, *, sweep: str = "synthetic", runs_per_file: int = 200, seed: int = 0
) -> list[RunSpec]:
    """A store of ``runs`` runs in folded files, as a finished study leaves it (75,000 runs take a minute)."""
    random, made = np.random.default_rng(seed), list(specs(runs, evaluations))
    for number, start in enumerate(range(0, runs, runs_per_file)):
        publish_chunk(path, sweep, f"part-j{number:032x}-0", made[start : start + runs_per_file], random)
    return made


def publish_chunk(
    path: Path, sweep: str, part: str, chunk: list[RunSpec], random: np.random.Generator, **own: np.ndarray
) -> None:
    """One file a table with the runs of ``chunk``, all of one task; ``own`` are columns of evals that are not random."""
    evaluations = chunk[0].evaluations
    evals = columns("evals", evaluations * len(chunk), random) | own
    evals["evaluation"] = np.tile(np.arange(1, evaluations + 1), len(chunk))
    rows = {
        "error": None,
        "world_digest": "w0",
        "peak_memory_mib": 80.0,
        "evaluations": evaluations,
        **run_row(),
        **provenance().columns(),
    }
    filled = {name: [value] * len(chunk) for name, value in rows.items()}
    filled["started_at"] = [START + timedelta(seconds=number) for number in range(len(chunk))]
    filled["spec"] = [spec.canonical_json() for spec in chunk]
    runs = _table("runs", chunk, 1, filled)
    tables = {"evals": _table("evals", chunk, evaluations, evals), "runs": runs}
    publish_fold(path, sweep, chunk[0].task, part, tables, ["s0"])


def _table(name: str, chunk: list[RunSpec], rows_each: int, own: dict[str, Any]) -> pa.Table:
    described = [{**dataclasses.asdict(spec), "run_id": spec.run_id} for spec in chunk]
    arrays = []
    for field in SCHEMAS[name]:
        if field.name in PARAMETER_KEYS:
            values = pa.array([one[field.name] for one in described], field.type)
            arrays.append(values.take(pa.array(np.repeat(np.arange(len(chunk)), rows_each))))
        else:
            arrays.append(pa.array(own[field.name], field.type))
    return pa.table(arrays, schema=SCHEMAS[name])
