"""Poses that jump away together and come back are lost; nothing that comes after them is."""

import numpy as np
import pandas as pd
import pytest

from bns.cli.main import main
from bns.diagnose.data.tracker_faults import excursions, jumps, lasting, without_faults
from bns.diagnose.data.tracks import tracks_of
from bns.measurements import write_measurements
from tests.diagnose.worlds import NOMINAL, measured


@pytest.fixture(scope="module")
def table():
    return measured(NOMINAL, trials=12, seed=4)


def away(table, begin, end, aside_m=0.3, turned_rad=0.0, trial=1):
    """Poses of a trial from ``begin`` to before ``end`` are those of something else."""
    out = table.copy()
    rows = out.index[(out.trial == trial) & out.x_m.notna()][begin:end]
    out.loc[rows, "x_m"] += aside_m
    out.loc[rows, "heading_rad"] = (out.loc[rows, "heading_rad"] + turned_rad + np.pi) % (2 * np.pi) - np.pi
    return out


def twice(table):
    """Trials 1 and 2 are the same."""
    return pd.concat([table[table.trial < 2], table[table.trial == 1].assign(trial=2)], ignore_index=True)


def found_in(table):
    tracks = tracks_of(table)
    first = int(tracks.first[1])
    return [(begin - first, end - first) for begin, end in excursions(tracks, jumps(tracks))]


@pytest.mark.parametrize(("frames", "turned_rad"), [(2, 0.0), (3, 0.0), (12, 0.0), (12, np.pi), (49, 0.0)])
def test_what_jumps_away_and_comes_back_is_lost(table, frames, turned_rad):
    wrong = away(table, 20, 20 + frames, turned_rad=turned_rad)
    assert found_in(wrong) == [(20, 20 + frames)]
    whole, left = tracks_of(table), without_faults(tracks_of(wrong))
    assert left.jumped is None
    assert len(left.t_s) == len(whole.t_s) - frames
    kept = np.isin(whole.t_s[whole.trial == 1], left.t_s[left.trial == 1])
    np.testing.assert_array_equal(left.pose[left.trial == 1], whole.pose[whole.trial == 1][kept])


@pytest.mark.parametrize(
    "wrong",
    [
        lambda table: away(table, 20, None),  # stays there
        lambda table: away(table, 20, 72),  # for longer than a robot can be foreseen
        lambda table: away(away(table, 20, 30, aside_m=0.6), 30, None, aside_m=0.3),  # comes back 30 cm off
        lambda table: away(away(table, 20, 30, turned_rad=np.pi), 30, None, 0.0, np.pi / 2 + 0.3),  # ... turned
        lambda table: away(away(twice(table), 30, None), 0, 32, trial=2),  # in another trial, at the same place
    ],
)
def test_what_does_not_come_back_lasts(table, wrong):
    tracks = tracks_of(wrong(table))
    found = jumps(tracks)
    assert found.any()
    assert excursions(tracks, found) == []
    assert lasting(found, []).tolist() == found.tolist()


def test_what_comes_back_may_jump_again(table):
    wrong = away(away(table, 20, 25), 40, None)
    assert found_in(wrong) == [(20, 25)]
    tracks = tracks_of(wrong)
    assert np.flatnonzero(lasting(jumps(tracks), excursions(tracks, jumps(tracks)))).tolist() == [tracks.first[1] + 40]
    assert (without_faults(tracks).trial == 1).sum() == 35
    assert found_in(away(away(table, 20, 25), 30, 35)) == [(20, 25), (30, 35)]


def test_it_is_told_from_when_to_when(table, tmp_path, capsys):
    """Rows of other trials are none the less of what is used."""
    data = tmp_path / "log.csv"
    write_measurements(away(away(table, 20, 25), 30, 32, trial=2), data)
    assert main(["compare", str(data), "--model", "khepera", "--findings"]) == 0
    said = capsys.readouterr().err
    assert "mm at 0.80 s and comes back at 1.00 s; the 5 poses in between count as lost" in said
    assert "at 1.20 s and comes back at 1.28 s; the 2 poses in between count as lost" in said
    assert "not used" not in said
