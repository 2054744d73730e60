"""Figures on disk: NAME.png, NAME.svg, NAME.csv and, last, the caption NAME.json that says they belong together."""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from analysis.figure_result import FigureResult
from analysis.results import Results, among
from bns.plotting.style import put
from bns.store.disk.files import publish, remove

DIGITS = "%.12g"
"""Of numbers in tables: what follows depends on the order in which a database adds up."""
KINDS = ("png", "svg", "csv", "json")


def publish_figure(
    drawn: FigureResult, pictures: tuple[bytes, bytes] | None, paper: str, store: Results, out: Path
) -> Path:
    """Write a figure, its numbers and its caption; the path of the PNG, or of the CSV of a table without a picture.

    ``pictures``: the figure `rendered`, None where there is none.

    Raises:
        StoreError: the disk does not take a file.
    """
    files: list[Path] = [*put(pictures, out / drawn.name)] if pictures is not None else []
    if drawn.data is not None:
        files.append(_put(out / f"{drawn.name}.csv", drawn.data.to_csv(index=False, float_format=DIGITS)))
    caption = {
        "name": drawn.name,
        "title": drawn.title,
        "paper": paper,
        "shows": drawn.shows,
        "see": drawn.see,
        "n": drawn.n,
        "missing": list(drawn.missing),
        "sweeps": list(drawn.sweeps),
        "files": [file.name for file in files],
        "table": _rows(drawn.table),
        **_origins(store, drawn.sweeps),
    }
    _put(out / f"{drawn.name}.json", json.dumps(caption, indent=2, ensure_ascii=False) + "\n")
    return files[0]


def publish_skipped(name: str, paper: str, reason: str, out: Path) -> None:
    """Note why a figure was not drawn; what was drawn under its name before is removed."""
    _forget(out, name)
    _put(out / f"{name}.json", json.dumps({"name": name, "paper": paper, "skipped": reason}, indent=2) + "\n")


def forget_skipped(name: str, out: Path) -> None:
    """Take back that the script ``name`` was skipped: its figures may bear longer names."""
    if any(caption["name"] == name and "skipped" in caption for caption in captions(out)):
        _forget(out, name)


def captions(out: Path) -> list[dict[str, Any]]:
    """The captions in a folder; files that are none of ours are passed over."""
    found = [_caption(path) for path in sorted(out.glob("*.json"))]
    return [caption for caption in found if caption is not None]


def forget_all_but(names: Collection[str], out: Path) -> None:
    """Remove figures of earlier calls that the results no longer give; whatever has no caption of ours stays."""
    for caption in captions(out):
        if caption["name"] not in names:
            _forget(out, caption["name"])


def _forget(out: Path, name: str) -> None:
    for kind in KINDS:
        if (out / f"{name}.{kind}").exists():
            remove(out / f"{name}.{kind}")


def _caption(path: Path) -> dict[str, Any] | None:
    try:
        caption = json.loads(path.read_text())
    except (OSError, ValueError):
        return None
    ours = isinstance(caption, dict) and caption.get("name") == path.stem and "paper" in caption
    return caption if ours else None


def _put(place: Path, text: str) -> Path:
    publish(text.encode(), place.with_name(f".{place.name}.part"), place)
    return place


def _rows(table: pd.DataFrame | None) -> dict[str, list[Any]] | None:
    if table is None:
        return None
    return {"columns": list(table.columns), "rows": table.astype(str).to_numpy().tolist()}


def _origins(store: Results, sweeps: Sequence[str]) -> dict[str, Any]:
    """Spec hashes, commits and versions that the results of ``sweeps`` come from."""
    hashes = store.query(f"SELECT DISTINCT spec_hash FROM specs WHERE {among('sweep', sweeps)} ORDER BY 1")
    made = store.query(
        f"SELECT DISTINCT git_sha, git_clean, bns_version FROM runs WHERE {among('sweep', sweeps)} ORDER BY ALL"
    )
    return {
        "spec_hashes": hashes.spec_hash.tolist(),
        "bns_versions": sorted(set(made.bns_version)),
        "git": [
            {"sha": one.git_sha, "clean": None if pd.isna(one.git_clean) else bool(one.git_clean)}
            for one in made.itertuples()
        ],
    }
