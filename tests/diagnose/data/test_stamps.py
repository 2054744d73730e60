"""Poses that are stamped on arrival: the scatter is measured and said; poses taken at uneven times, or lost, are none."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.checks import checked
from bns.diagnose.data.load import measured_table
from bns.diagnose.data.stamps import stamp_scatter
from bns.diagnose.data.tracker_faults import jumps
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.effect_caveats import _on_stamps

STEP_S, LONG_S, NOISE_M = 0.001, 20.0, 0.001


def even(period_s=0.04):
    return lambda rng, path: np.arange(rng.uniform(0, period_s), LONG_S - 0.01, period_s)


def losing(share):
    def taken(rng, path):
        times = even()(rng, path)
        return times[rng.random(len(times)) > share]

    return taken


lossy = losing(0.3)


def by_chance(rng, path):
    return np.cumsum(0.01 + rng.exponential(0.04, int(LONG_S / 0.06)))


def interleaved(rng, path):
    return np.sort(np.concatenate([even(1 / 30)(rng, path), even(1 / 20)(rng, path)]))


def every_centimetre(rng, path):
    """At 200 Hz, when a noisy position is a centimetre from the last one that was logged."""
    taken, last = [0], path[0, :2]
    for k in range(0, len(path), 5):
        seen = path[k, :2] + rng.normal(0, NOISE_M, 2)
        if np.hypot(*(seen - last)) > 0.01:
            taken.append(k)
            last = seen
    return STEP_S * np.array(taken)


def on_arrival(delay_s, least_s=0.01):
    """Stamps of poses that arrive one after the other over a network."""
    return lambda rng, times: np.maximum.accumulate(times + least_s + rng.exponential(delay_s, len(times)))


def log(taken, stamped=lambda rng, times: times, trials=8, seed=0, smoothed=1.0, noise_m=NOISE_M):
    """A robot that drives at one of five speeds and one of many turn rates for two seconds each; made without the package."""
    rng, parts = np.random.default_rng(seed), []
    for trial in range(trials):
        each = int(2 / STEP_S)
        speed = np.repeat(rng.choice([0.0, 0.1, 0.2, 0.3, 0.4], int(LONG_S / 2)), each)
        turn = np.repeat(rng.normal(0, 0.5, int(LONG_S / 2)), each)
        heading = np.cumsum(turn * STEP_S)
        along, aside = (np.cumsum(speed * of(heading)) * STEP_S for of in (np.cos, np.sin))
        path = np.column_stack([along, aside, heading])
        times = taken(rng, path)
        at = (times / STEP_S).astype(int).clip(0, len(path) - 1)
        pose = path[at] + rng.normal(size=(len(at), 3)) * [noise_m, noise_m, 0.004]
        for k in range(1, len(pose)):
            pose[k] = smoothed * pose[k] + (1 - smoothed) * pose[k - 1]
        told = {"left_m_s": speed - 0.05 * turn, "right_m_s": speed + 0.05 * turn}
        rows = {"trial": trial, "t_s": stamped(rng, times), **{name: of[at] for name, of in told.items()}}
        table = pd.DataFrame({**rows, "x_m": pose[:, 0], "y_m": pose[:, 1], "heading_rad": pose[:, 2]})
        parts.append(table[np.append(True, np.diff(table["t_s"]) > 1e-7)])
    return pd.concat(parts, ignore_index=True)


def scatter(table):
    return stamp_scatter(tracks_of(checked(table)[0]))


@pytest.mark.parametrize(("delay_s", "within"), [(0.005, 0.05), (0.008, 0.05), (0.015, 0.2)])
def test_the_scatter_is_that_of_the_delays(delay_s, within):
    """Poses that arrive at once are one row: long delays look shorter."""
    found = scatter(log(even(), on_arrival(delay_s)))
    assert found.sd_s == pytest.approx(delay_s, rel=within)
    assert found.period_s == pytest.approx(0.04, rel=1e-3)
    assert found.noise_m == pytest.approx(NOISE_M, rel=0.1)
    assert found.follows < 0.1
    assert found.off_s[0] < found.off_s[1] < found.period_s / 2
    assert f"{1e3 * found.sd_s:.2g} ms (standard deviation" in found.in_words


def test_what_is_real_of_the_intervals_is_no_scatter():
    """Poses that are lost make intervals longer in truth."""
    found = scatter(log(losing(0.03), on_arrival(0.008)))
    assert found.sd_s == pytest.approx(0.008, rel=0.06)
    assert 0.2 < found.follows < 0.5


def test_a_small_jitter_beside_lost_poses_is_not_said():
    """It costs more than the noise, which the tracker smooths; but nearly all of what intervals do is real."""
    table = log(even(), lambda rng, times: times + rng.normal(0, 0.0012, len(times)), smoothed=0.2)
    lost = table[np.random.default_rng(0).random(len(table)) > 0.02]
    assert scatter(lost) is None


def test_poses_that_are_written_twice_are_one():
    table = log(even(), on_arrival(0.01))
    again = table.assign(t_s=table["t_s"] + 0.002)
    both = pd.concat([table, again]).sort_values(["trial", "t_s"], kind="stable", ignore_index=True)
    both = both[both.groupby("trial")["t_s"].diff().fillna(1.0) > 1e-7]
    assert scatter(both).period_s == pytest.approx(0.04, rel=1e-3)


def test_it_is_said_where_it_is_certain(monkeypatch):
    found = scatter(log(even(), on_arrival(0.01)))
    for z, said in ((0.5, True), (1.5, False)):
        monkeypatch.setattr("bns.diagnose.data.stamps.CERTAIN_Z", z * found.sd_s / (2 * found.se_s))
        assert (scatter(log(even(), on_arrival(0.01))) is not None) == said


def test_a_gap_is_no_interval():
    """Poses lost for a second at a time, while the robot goes on: they are not compared."""
    table = log(even(), on_arrival(0.01))
    lost = table[(table["t_s"] % 4) > 1]
    assert scatter(lost).sd_s == pytest.approx(0.01, rel=0.1)


def test_its_standard_error_is_right():
    found = [scatter(log(even(), on_arrival(0.005), trials=3, seed=seed)) for seed in range(12)]
    spread = np.std([one.sd_s for one in found], ddof=1)
    assert np.mean([one.se_s for one in found]) == pytest.approx(spread, rel=0.6)


@pytest.mark.parametrize(
    ("taken", "stamped"),
    [
        pytest.param(even(), lambda rng, times: times, id="even"),
        pytest.param(even(), lambda rng, times: times + rng.normal(0, 0.001, len(times)), id="a millisecond"),
        pytest.param(
            even(),
            lambda rng, times: times + rng.normal(0, 0.001, len(times)) + 0.008 * np.sin(times * np.pi / 5),
            id="a millisecond, and a clock that wanders slowly",
        ),
        pytest.param(lossy, lambda rng, times: times, id="lost"),
        pytest.param(by_chance, lambda rng, times: times, id="events"),
        pytest.param(interleaved, lambda rng, times: times, id="two rates"),
        pytest.param(every_centimetre, lambda rng, times: times, id="by distance"),
        pytest.param(even(1 / 30), lambda rng, times: np.round(times, 3), id="to a millisecond"),
        pytest.param(even(1 / 30), lambda rng, times: np.round(times, 2), id="to a hundredth"),
        pytest.param(even(1 / 30), lambda rng, times: np.ceil(times * 50) / 50, id="by a logger at 50 Hz"),
        pytest.param(
            even(1 / 30),
            lambda rng, times: np.ceil(times * 100) / 100 + rng.normal(0, 0.001, len(times)),
            id="by a logger at 100 Hz",
        ),
    ],
)
def test_no_scatter_is_seen_where_there_is_none(taken, stamped):
    assert scatter(log(taken, stamped)) is None


@pytest.mark.parametrize("taken", [lossy, by_chance])
def test_a_tracker_that_smooths_is_no_scatter(taken):
    """Its poses do not follow uneven intervals at once, but uneven poses have no clock, and lost ones lie on its grid."""
    assert scatter(log(taken, smoothed=0.35)) is None


def test_poses_that_a_faster_logger_repeats_are_no_scatter():
    table = log(even(1 / 30))
    logged = []
    for _, rows in table.groupby("trial"):
        at = np.arange(rows["t_s"].iloc[0] + 0.02, LONG_S - 0.1, 0.02)
        seen = rows.iloc[np.searchsorted(rows["t_s"], at) - 1]
        logged.append(seen.assign(t_s=at))
    assert scatter(pd.concat(logged, ignore_index=True)) is None


def test_few_poses_and_robots_that_stand_say_nothing():
    table = log(even(), on_arrival(0.01))
    assert scatter(table[(table.trial == 0) & (table.t_s < 4)]) is None
    still = table.assign(x_m=1.0, y_m=2.0)
    assert scatter(still) is None


def test_it_is_an_irregularity_of_the_log_and_a_note_on_delays(tmp_path):
    table = log(even(), on_arrival(0.01))
    found = measured_table(table, tmp_path / "log.csv")
    assert found.findings[0].text.startswith("the poses' time stamps scatter")
    right = measured_table(log(even()), tmp_path / "log.csv")
    assert not [one for one in right.findings if "stamps scatter" in one.text]
    (note,) = _on_stamps(found.tracks, {"clock-offset", "motor-lag"})
    assert "clock-offset may be the mean of these delays" in note
    assert not list(_on_stamps(found.tracks, {"motor-lag"}))
    assert not list(_on_stamps(right.tracks, {"clock-offset"}))
    assert not list(_on_stamps(SimpleNamespace(timed=False), {"clock-offset"}))


def test_late_poses_are_no_jumps():
    """Delays of up to several periods, so that poses arrive in heaps; a marker that is mistaken is seen among them."""
    table = log(even(), on_arrival(0.04))
    tracks = tracks_of(checked(table)[0])
    assert not jumps(tracks).any()
    rows = table.index[table["trial"] == 3]
    table.loc[rows[len(rows) // 2 :], "x_m"] += 0.5
    tracks = tracks_of(checked(table)[0])
    assert [tracks.names[k] for k in tracks.trial[jumps(tracks)]] == ["3"]
