"""Damages of every kind to every kind of result file: python -m tests.store.damages N [SEED].

Each damage is done to a copy of a small store that was read before. It must be named or change nothing; no row that is read
may differ from what was written, nothing may end in a traceback, and a sweep must bring the store back to what it was.
"""

from __future__ import annotations

import contextlib
import shutil
import sys
import tempfile
import warnings
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import numpy as np
import pandas as pd

from bns.errors import BnsError
from bns.store import SCHEMAS, Writer, compact, connect, finished
from bns.store.disk.parts import find_parts
from bns.store.read.views import DAMAGED
from bns.store.record import RunRecord
from bns.store.schema import RECORDED, SORT_KEYS, read_columns
from tests.store.synthetic import failed, record, specs

KINDS = ("bit", "cut", "zeros", "swap", "overwrite", "double", "lose")
SWEEPS = {"t": ("circle",), "s": ("circle", "square")}
TEXTS = {sweep: f"name: {sweep}\n" for sweep in SWEEPS}
_CHANGES_BY_DAY = {"written_at"}


class StopError(Exception):
    """Leaves a journal behind, as a crash does."""


@dataclass(frozen=True)
class Outcome:
    """One damage. ``verdict``: named, harmless (nothing read differs), again (cut off like a crash: done again), silent,
    traceback, not-whole; only the first three are well."""

    kind: str
    file: str
    verdict: str
    detail: str = ""


def runs_of(sweep: str) -> list[RunRecord]:
    """What was stored in ``sweep``: full records of each task, one failure."""
    made = [
        record(spec, RECORDED)
        for number, task in enumerate(SWEEPS[sweep])
        for spec in specs(4, 2, task=task, record="full", root_seed=number + 10 * (sweep == "t"))
    ]
    return [*made, failed(next(specs(1, 3, seed=9)))]


def make(results: Path) -> None:
    """A store with folds of all tables, a compacted sweep, spec files and a journal that was left."""
    for sweep in SWEEPS:
        runs = runs_of(sweep)
        for chunk in (runs[:4], runs[4:-2]):
            with Writer(results, sweep, sweep_text=TEXTS[sweep], fold_at=3) as writer:
                for run in chunk:
                    writer.append(run)
        if sweep == "t":
            compact(results)
        with contextlib.suppress(StopError), Writer(results, sweep, sweep_text=TEXTS[sweep]) as writer:
            for run in runs[-2:]:
                writer.append(run)
            raise StopError


def tables(results: Path) -> dict[str, pd.DataFrame]:
    """All that is read from a store, in an order of its own."""
    with connect(results) as connection:
        found = {}
        for table in SCHEMAS:
            order = ", ".join(["sweep", *SORT_KEYS[table]])
            columns = ", ".join(name for name in read_columns(table) if name not in _CHANGES_BY_DAY)
            found[table] = (
                connection.sql(f"SELECT {columns} FROM {table} ORDER BY {order}").to_arrow_table().to_pandas()
            )
        return found


def files(results: Path) -> list[Path]:
    """Every file that holds results."""
    return sorted([*results.rglob("*.parquet"), *results.rglob("*.journal")])


def do(kind: str, path: Path, others: list[Path], random: np.random.Generator) -> None:
    """Damage ``path`` (and for a swap one of ``others``, mostly of its own table)."""
    data = bytearray(path.read_bytes())
    at = int(random.integers(len(data)))
    alike = [one for one in others if one != path and one.suffix == path.suffix]
    near = [one for one in alike if one.parts[-4:-3] == path.parts[-4:-3]]
    pool = near if near and random.random() < 0.8 else alike or [path]
    other = pool[int(random.integers(len(pool)))]
    if kind == "bit":
        data[at] ^= 1 << int(random.integers(8))
    elif kind == "cut":
        del data[at:]
    elif kind == "zeros":
        size = int(random.choice([1, 16, 512, 4096]))
        data[at : at + size] = bytes(len(data[at : at + size]))
    elif kind == "swap":
        theirs = other.read_bytes()
        other.write_bytes(data)
        data = bytearray(theirs)
    elif kind == "overwrite":
        data = bytearray(other.read_bytes())
    elif kind == "double":
        copy = path.with_name(
            path.name.replace("-0.parquet", "-1.parquet").replace("--j", "--j0").replace("spec-", "spec-0")
        )
        copy.with_name(copy.name[: len(path.name)] if path.suffix == ".journal" else copy.name).write_bytes(data)
    if kind == "lose":
        path.unlink()
    else:
        path.write_bytes(data)


def check(whole: Path, reference: dict[str, pd.DataFrame], work: Path, random: np.random.Generator) -> Outcome:
    """One damage at random to a copy of ``whole`` below ``work``, and what came of it."""
    shutil.copytree(whole, work)
    for table in SCHEMAS:
        find_parts(work, table)  # whatever is remembered of the sound files must not hide the damage
    listed = files(work)
    kind, path = str(random.choice(KINDS)), listed[int(random.integers(len(listed)))]
    before = path.read_bytes()
    do(kind, path, listed, random)
    name = str(path.relative_to(work))
    try:
        return Outcome(kind, name, *_judged(work, reference, path, before, random))
    except BnsError as error:
        return Outcome(kind, name, "named" if path.name in str(error) else "traceback", str(error))
    except Exception as error:
        return Outcome(kind, name, "traceback", f"{type(error).__name__}: {error}")


def _judged(
    work: Path, reference: dict[str, pd.DataFrame], path: Path, before: bytes, random: np.random.Generator
) -> tuple[str, str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        seen = tables(work)
    said = "\n".join(str(one.message) for one in caught)
    if said:  # a run whose rows are not all there says so; whatever else is in its row must be what was stored
        seen["runs"] = seen["runs"].replace({"status": {DAMAGED: "ok"}})
    strange = [table for table in SCHEMAS if not _is_part_of(seen[table], reference[table])]
    short = [table for table in SCHEMAS if len(seen[table]) < len(reference[table])]
    after = path.read_bytes() if path.exists() else b""
    # A journal that ends early is what a killed writer leaves; a spec file and a journal vouch for nothing else.
    is_like_a_crash = before.startswith(after) or path.suffix == ".journal" or "specs" in path.parts
    if strange:
        return "silent", f"{strange} hold other rows; said: {said}"
    if short and not said and not is_like_a_crash:
        return "silent", f"{short} lack rows"
    fault = _redone(work, reference, bool(random.random() < 0.3))
    if fault:
        return "not-whole", fault
    return ("named" if said else "again" if short else "harmless"), said


def _redone(work: Path, reference: dict[str, pd.DataFrame], also_compact: bool) -> str:
    """What is not as it was after a sweep has done what is missing; "" if all is."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if also_compact:
            compact(work)
        for sweep in SWEEPS:
            with Writer(work, sweep, sweep_text=TEXTS[sweep]) as writer:
                there = finished(work, sweep)
                for run in (run for run in runs_of(sweep) if run.spec.run_id not in there):
                    writer.append(run)
        if also_compact:
            compact(work)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        now = tables(work)
    changed = [table for table in SCHEMAS if not now[table].equals(reference[table])]
    if caught:
        return f"still said: {caught[0].message}"
    return f"{changed} differ after the sweep" if changed else ""


def _is_part_of(some: pd.DataFrame, everything: pd.DataFrame) -> bool:
    """Whether each row of ``some`` is one of ``everything``, and none is there twice."""
    rows, all_rows = (
        list(frame.astype(object).where(frame.notna(), None).itertuples(index=False, name=None))
        for frame in (some, everything)
    )
    return len(set(rows)) == len(rows) and set(rows) <= set(all_rows)


def survey(count: int, seed: int) -> list[Outcome]:
    """``count`` damages."""
    random = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder, mock.patch("os.fsync"):  # what it is for is tested in test_order.py
        whole = Path(folder) / "whole"
        make(whole)
        reference = tables(whole)
        outcomes = []
        for number in range(count):
            work = Path(folder) / str(number)
            outcomes.append(check(whole, reference, work, random))
            shutil.rmtree(work)
        return outcomes


def main() -> int:
    """Print how many damages of each kind ended how; 1 if any went wrong."""
    outcomes = survey(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0)
    wrong = [one for one in outcomes if one.verdict in {"silent", "traceback", "not-whole"}]
    for (kind, verdict), count in sorted(Counter((one.kind, one.verdict) for one in outcomes).items()):
        print(f"{kind:10} {verdict:10} {count}")
    for one in wrong:
        print(f"{one.verdict}: {one.kind} of {one.file}: {one.detail}")
    print(
        f"{len(outcomes)} damages, {sum(one.verdict == 'silent' for one in outcomes)} silent, {len(wrong)} wrong in all"
    )
    return bool(wrong)


if __name__ == "__main__":
    raise SystemExit(main())
