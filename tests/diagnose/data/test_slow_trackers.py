"""Logs whose tracker is slower than their rows, whose trials begin in motion, or which have more poses than a search needs."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.checks import checked
from bns.diagnose.data.mapping import load_mapping
from bns.diagnose.data.tracks import MOST_FRAMES, RUN_UP_S, slimmed, tracks_of
from bns.diagnose.predict.wheels import WheelPredictor
from bns.errors import DataError
from bns.measurements import POSE
from tests.diagnose.worlds import NOMINAL, hidden, measured


def held(table, every=5):
    """The table as a tracker that is slower would have it: poses stay until the next comes."""
    out = table.copy()
    rows = (np.arange(len(out)) // every) * every
    out[list(POSE)] = table[list(POSE)].to_numpy()[rows]
    return out


def test_held_poses_are_said_and_taken_out_only_when_asked(tmp_path):
    table = held(measured(NOMINAL, trials=2))
    _, findings = checked(table)
    assert "of all poses repeat the one before" in findings[0].text
    assert not any("repeat" in f.text for f in checked(measured(NOMINAL, trials=2))[1])
    (tmp_path / "m.yaml").write_text("columns: {}\nrepeated_poses: lost\n")
    out = applied(table, load_mapping(tmp_path / "m.yaml"))
    assert len(out) == len(table)
    kept = out["x_m"].notna()
    assert kept.mean() == pytest.approx(0.2, abs=0.05)
    assert table.loc[kept, "x_m"].equals(out.loc[kept, "x_m"])
    assert applied(table, {"columns": {}})["x_m"].notna().all()


def test_a_robot_told_to_stand_is_not_held():
    speeds, pose = {"left_m_s": 0.0, "right_m_s": 0.0}, {"x_m": 0.1, "y_m": 0.2, "heading_rad": 0.3}
    still = pd.DataFrame({"trial": 0, "t_s": [0.0, 0.1, 0.2], **speeds, **pose})
    assert applied(still, {"columns": {}, "repeated_poses": "lost"})["x_m"].notna().all()


def test_unknown_words_are_refused(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text("columns: {}\nrepeated_poses: droped\n")
    with pytest.raises(DataError, match="unknown word for repeated_poses 'droped'"):
        load_mapping(path)


def test_a_trial_that_began_in_motion_has_no_lag_at_its_start():
    table = measured(NOMINAL, trials=1, commands=1)
    speeds = table[["left_m_s", "right_m_s"]].iloc[0]
    moving = table.assign(before_left_m_s=speeds.iloc[0], before_right_m_s=speeds.iloc[1])
    lagging = hidden(motor_lag={"tau_s": 0.3})
    tracks = tracks_of(moving)
    assert tracks.t_s[0] == RUN_UP_S
    np.testing.assert_allclose(
        WheelPredictor(tracks).steps(lagging).body[:-2], WheelPredictor(tracks_of(table)).steps(NOMINAL).body[:-2], atol=1e-6
    )


def test_tracks_are_thinned_evenly_and_keep_their_ends():
    tracks = tracks_of(measured(NOMINAL, trials=3))
    thin = tracks.thinned(4)
    for i in range(3):
        whole, few = (t.t_s[t.first[i] : t.first[i + 1]] for t in (tracks, thin))
        assert few[0] == whole[0]
        assert few[-1] == whole[-1]
        assert len(few) == pytest.approx(len(whole) / 4, abs=2)
    assert thin.left_m_s is tracks.left_m_s
    assert slimmed(tracks) is tracks
    assert len(tracks.t_s) < MOST_FRAMES
