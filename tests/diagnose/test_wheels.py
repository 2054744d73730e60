"""What is in force when: after the last row, its command goes on; where that row has none, the robot stands."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.tracks import tracks_of
from bns.diagnose.wheels import WheelPredictor


def trial(name, left_m_s, step_s=0.5):
    """One row a command, the robot anywhere."""
    t = step_s * np.arange(len(left_m_s))
    rows = {"trial": name, "t_s": t, "left_m_s": left_m_s, "right_m_s": left_m_s}
    return pd.DataFrame(rows | {"x_m": 0.1 * t, "y_m": 0.0, "heading_rad": 0.0})


@pytest.mark.parametrize(
    ("left_m_s", "after_m_s"), [([0.1, 0.05, np.nan], 0.0), ([0.1, 0.05, 0.05], 0.05), ([0.1, 0.05, -0.08], -0.08)]
)
def test_what_the_last_row_says_is_in_force_after_it(left_m_s, after_m_s):
    longer = trial("longer", [0.02] * 6)  # its commands must not run into the shorter trial's
    grid = WheelPredictor(tracks_of(pd.concat([trial("short", left_m_s), longer], ignore_index=True))).grid
    middle = (grid.node_s[0, 1:] + grid.node_s[0, :-1]) / 2
    lasting = grid.step_s[0] > 0
    assert set(grid.left_m_s[0][lasting & (middle < 0.5)]) == {0.1}
    assert set(grid.left_m_s[0][lasting & (middle > 0.5) & (middle < 1.0)]) == {0.05}
    assert set(grid.left_m_s[0][lasting & (middle > 1.0)]) == {after_m_s}
    assert (grid.left_m_s[1][grid.step_s[1] > 0] == 0.02).all()
