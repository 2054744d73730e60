"""The snake's table of measurements: which cycles were driven, and where a camera saw the markers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bns.robots.snake import cycles
from bns.robots.snake.path import STABLE

if TYPE_CHECKING:  # half a second to load, and a run needs no table
    import pandas as pd

GAIT = cycles.COLUMNS[:4]
"""What is in force from a row's time on; empty where no cycle is."""
MARKERS = ("yellow_x_m", "yellow_y_m", "green_x_m", "green_y_m")
COLUMNS = ("trial", "t_s", "cycle", *GAIT, *MARKERS, "stable")
"""cycle: number of the cycle in its trial; stable: 1 or 0, in the row at the cycle's end."""


def cycle_table(
    trial: int, driven: np.ndarray, observations: np.ndarray, lasted_s: np.ndarray, pause_s: float
) -> pd.DataFrame:
    """Rows of one trial with the columns `COLUMNS`: two a cycle, at its begin and at its end.

    ``driven`` (n, >= 4) cycles; ``observations`` (n, 9) as in `path.walk`; ``lasted_s`` (n,) the time of each cycle;
    ``pause_s`` what is counted for the way from one cycle to the next, which no world reports.
    """
    n = len(driven)
    begin_s = np.concatenate([[0.0], np.cumsum(lasted_s + pause_s)[:-1]]) if n else np.empty(0)
    rows = np.full((n, 2, len(COLUMNS) - 1), np.nan)
    rows[:, 0, 0], rows[:, 1, 0] = begin_s, begin_s + lasted_s
    rows[:, :, 1] = np.arange(1, n + 1)[:, None]
    rows[:, 0, 2:6] = driven[:, :4]
    rows[:, :, 6:10] = observations[:, :8].reshape(n, 2, 4)
    rows[:, 1, 10] = observations[:, STABLE]
    import pandas as pd  # noqa: PLC0415  # as above

    table = pd.DataFrame(rows.reshape(2 * n, -1), columns=list(COLUMNS[1:]))
    table.insert(0, "trial", trial)
    return table
