"""What several tests of figures do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from store.synthetic import record

from bns.spec import RunSpec
from bns.store import RunRecord, Writer


def written(results: Path, sweep: str, records: list[RunRecord], **more) -> None:
    with Writer(results, sweep, **more) as writer:
        for one in records:
            writer.append(one)


def curves(figure, number: int = 0) -> dict[str, tuple]:
    """Label -> (x, y) of the labelled lines of one of the axes."""
    lines = figure.axes[number].get_lines()
    return {line.get_label(): line.get_data() for line in lines if not line.get_label().startswith("_")}


def with_evals(spec: RunSpec, **columns) -> RunRecord:
    """A run that went well, with these values in its evals: an array, or one value for all rows."""
    made = record(spec)
    for name, value in columns.items():
        empty = value is None
        made.tables["evals"][name] = np.full(spec.evaluations, value, object if empty else None) if np.ndim(value) == 0 else value
    return made
