"""Which robots and floors there are, and the diagnosis of one of them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from bns.diagnose.data.load import Measured, load_measured
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.predict.paired_errors import paired_errors
from bns.diagnose.predict.wheels import predictor_for_search
from bns.diagnose.report.text import diagnosis_text
from bns.errors import DataError
from bns.physics.model import Model

_KEYS = ("title", "file", "drawn_m", "wheelbase_m", "mapping")


@dataclass(frozen=True)
class Case:
    """A robot on a floor: where its rows are, how they are read, and the model that is held against them."""

    name: str
    title: str
    file: str
    drawn_m: float
    wheelbase_m: float
    mapping: Mapping[str, Any]
    rows: Mapping[str, str]
    every: int = 1


def cases() -> dict[str, Case]:
    """Name -> case, in the order of robots.yaml."""
    tree = yaml.safe_load((resources.files("analysis.real_robots") / "robots.yaml").read_text(encoding="utf-8"))
    return {
        name: Case(name, *(entry[k] for k in _KEYS), rows=entry.get("rows", {}), every=entry.get("every", 1))
        for name, entry in tree.items()
    }


def table_of(case: Case, data: Path) -> pd.DataFrame:
    """The rows of a case as they were logged; DataError if its file is not there."""
    path = data / case.file
    if not path.is_file():
        raise DataError(f"There is no file {path}. Give the folder that holds {case.file}: make real-robots DATA=dir.")
    table = pd.read_parquet(path)
    for column, value in case.rows.items():
        table = table[table[column] == value]
    chosen = table["trial"].unique()[:: case.every]
    return with_start(table[table["trial"].isin(chosen)].reset_index(drop=True))


def with_start(table: pd.DataFrame) -> pd.DataFrame:
    """Wheel speeds before each window, for logs cut into windows of one command each (column ``transient``).

    In the first window after a change the encoders say how fast the wheels still were; in others the same command was in force.
    """
    if "transient" not in table.columns:
        return table
    first = table.groupby("trial", sort=False).transform("first")
    changed = first["transient"] == 1
    speeds = {side: first[f"{side}_m_s"].where(changed, first[f"{side}_cmd_m_s"]) for side in ("left", "right")}
    return table.assign(**{f"start_{side}_m_s": values for side, values in speeds.items()})


def measured(case: Case, table: pd.DataFrame, folder: Path) -> Measured:
    """The table written beside its mapping, read as `bns` reads any log."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{case.name}.parquet"
    table.to_parquet(path, index=False)
    (folder / f"{case.name}.parquet.import.yaml").write_text(yaml.safe_dump(dict(case.mapping)), encoding="utf-8")
    return load_measured(path)


def diagnosed(case: Case, table: pd.DataFrame, folder: Path) -> dict[str, Any]:
    """The diagnosis as JSON, with the error (m, at every horizon) of the model as drawn; kept in ``folder``, in words too."""
    log = measured(case, table, folder)
    predictor = predictor_for_search(log.tracks)
    found = diagnose(predictor, Model(wheelbase_m=case.wheelbase_m, name="differential-drive"))
    drawn = paired_errors(predictor, [("drawn", predictor.steps(Model(wheelbase_m=case.drawn_m)))])
    answer = {
        **found.as_json(),
        "drawn": {h: e.models[0].rms_m for h, e in drawn.horizons.items() if e.windows},
        "trials": len(log.tracks),
        "findings": len(log.findings),
        "intervals": intervals(found) if found.errors else {},
    }
    per_trial_effect = found.model.per_trial_effect if found.model else None
    answer["clocks_s"] = list(per_trial_effect.trial_values) if per_trial_effect else []
    (folder / f"{case.name}.json").write_text(json.dumps(answer, indent=1), encoding="utf-8")
    (folder / f"{case.name}.txt").write_text(diagnosis_text(found) + "\n", encoding="utf-8")
    return answer


def intervals(found: Diagnosis) -> dict[str, dict[str, list[float]]]:
    """95 % intervals of the errors (m), before and after, at every horizon that the log has; the trial is the unit."""
    assert found.errors is not None
    ends = {h: [[m.low_m, m.high_m] for m in e.models] for h, e in found.errors.horizons.items() if e.windows}
    return {h: {"before": models[0], "after": models[-1]} for h, models in ends.items()}
