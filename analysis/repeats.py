"""Drives of a trial's final controller beside each other, from the trial's folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

FOLDERS = {"trials": "", "trials-emulated": "-emulated"}
"""Sweep of a trial -> end of its folder's name; a replay drives nothing."""


def repeats_of(results: Path, sweep: str, run_id: str, evaluation: int) -> pd.DataFrame:
    """Rows (`repeat`, `success`, `step`, poses) of all drives of the controller of this evaluation; none if there was one."""
    if sweep in FOLDERS:
        for file in (results / "trials").glob(f"*-{run_id}{FOLDERS[sweep]}/repeats.csv"):
            table = pd.read_csv(file)
            return table[table["evaluation"] == evaluation]
    return pd.DataFrame(columns=["repeat", "success", "step"])


def paths_of(repeats: pd.DataFrame, columns: list[str]) -> list[np.ndarray]:
    """Path (steps + 1, columns) of each drive."""
    return [rows[columns].to_numpy() for _, rows in repeats.groupby("repeat")]


def mean_path(paths: list[np.ndarray]) -> np.ndarray:
    """Mean of some paths (n, columns), as far as all of them go."""
    shortest = min(len(path) for path in paths)
    mean: np.ndarray = np.mean([path[:shortest] for path in paths], axis=0)
    return mean
