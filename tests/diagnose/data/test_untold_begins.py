"""A recording that begins in the middle of a drive, before the first command that it holds."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.checks import checked


def log(speed_m_s=0.1, turn_rad_s=0.0, noise_m=0.0, without=60):
    """Two trials at 100 Hz; the second has no command in its first rows."""
    parts = []
    for name in ("a", "b"):
        rng, t = np.random.default_rng(3), 0.01 * np.arange(300)
        x = np.cumsum(np.full(300, speed_m_s)) * 0.01 + noise_m * rng.standard_normal(300)
        table = pd.DataFrame({"trial": name, "t_s": t, "left_m_s": 0.1, "right_m_s": 0.1, "x_m": x})
        table = table.assign(y_m=noise_m * rng.standard_normal(300), heading_rad=turn_rad_s * t)
        if name == "b":
            table.loc[: without - 1, ["left_m_s", "right_m_s"]] = np.nan
            table.loc[without:, ["x_m", "heading_rad"]] += 0.1 * (t[without:, None] - t[without])
        parts.append(table)
    return pd.concat(parts, ignore_index=True)


@pytest.mark.parametrize(
    "way",
    [{}, {"speed_m_s": -0.02}, {"speed_m_s": 0.0, "turn_rad_s": 0.4, "noise_m": 1e-4}, {"noise_m": 0.003}],
    ids=["ahead", "slowly back", "turning", "noise of 3 mm"],
)
def test_poses_before_the_first_command_are_left_out_where_the_robot_moves(way):
    usable, findings = checked(log(**way))
    told = [one for one in findings if "before the first command" in one.text]
    assert [(one.trial, one.row) for one in told] == [("b", 300)]
    assert "moves in the 0.60 s (60 rows) before" in told[0].text
    assert list(usable.index) == [*range(300), *range(360, 600)]


@pytest.mark.parametrize(
    "way",
    [{"speed_m_s": 0.0}, {"speed_m_s": 0.0, "noise_m": 0.02}, {"speed_m_s": 0.004}, {"without": 0}],
    ids=["it stands", "noise of 2 cm", "hardly", "commands from the beginning"],
)
def test_poses_at_rest_are_kept(way):
    usable, findings = checked(log(**way))
    assert len(usable) == 600
    assert not [one for one in findings if "before the first command" in one.text]
