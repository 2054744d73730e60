"""The scatter of a drive as the cause of an error: compared with a walk at random that is drawn here, frame by frame."""

import re
from itertools import islice
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose import diagnosing
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report import text
from bns.diagnose.report.plain_language import ABOVE_NOISE, headline, nothing_above_noise
from bns.diagnose.residuals.drive_scatter import scatter_in_words, still_left_in_words, wandering_m
from tests.diagnose.worlds import NOMINAL, measured

NOISE = np.array([0.0005, 0.002, 0.008, 0.004, 0.05])
"""Of a pose (m, rad); of the drive for a metre: ahead, aside (m), heading (rad)."""


def robot(path, windows):
    """A predictor of one path, (frames, 2)."""
    way_m = np.append(0.0, np.hypot(*np.diff(path, axis=0).T))
    starts, ends = np.transpose(windows)
    return SimpleNamespace(tracks=SimpleNamespace(pose=path), way_m=way_m, windows=lambda _: (starts, ends))


def curved(frames=200):
    angle = np.linspace(0, 2.5, frames)
    return np.column_stack([np.sin(angle), 1 - np.cos(angle)]) * 0.8


def drawn_mm(path, start, end, rng, times=4000):
    """Root mean square distance between the end of the path and where it leads if each step scatters as NOISE says."""
    steps = np.diff(path[start : end + 1], axis=0)
    way = np.hypot(*steps.T)
    turned = np.cumsum(rng.normal(size=(times, len(way))) * NOISE[4] * np.sqrt(way), axis=1)
    cos, sin = np.cos(turned), np.sin(turned)
    scatter = rng.normal(size=(2, times, len(way))) * NOISE[2:4, None, None] * np.sqrt(way)
    heading = np.arctan2(*steps.T[::-1]) + turned
    x = (cos * steps[:, 0] - sin * steps[:, 1] + scatter[0] * np.cos(heading) - scatter[1] * np.sin(heading)).sum(axis=1)
    y = (sin * steps[:, 0] + cos * steps[:, 1] + scatter[0] * np.sin(heading) + scatter[1] * np.cos(heading)).sum(axis=1)
    return 1e3 * np.sqrt(((x - steps[:, 0].sum()) ** 2 + (y - steps[:, 1].sum()) ** 2).mean())


@pytest.mark.parametrize(("start", "end"), [(0, 199), (20, 90)])
def test_the_error_is_that_of_a_walk_at_random(start, end):
    path = curved()
    expected = drawn_mm(path, start, end, np.random.default_rng(0))
    assert 1e3 * wandering_m(robot(path, [(start, end)]), NOISE, "trial") == pytest.approx(expected, rel=0.04)


def test_windows_count_by_their_mean_squares():
    path = curved()
    both, first, second = (wandering_m(robot(path, w), NOISE, "trial") for w in ([(0, 90), (90, 199)], [(0, 90)], [(90, 199)]))
    assert both**2 == pytest.approx((first**2 + second**2) / 2)
    assert np.isnan(wandering_m(robot(path, np.zeros((0, 2), dtype=int)), NOISE, "trial"))


def test_what_was_driven_before_a_window_adds_nothing():
    path = curved()
    from_afar = np.concatenate([path[:20] - [3.0, 0.0], path[20:]])
    both = [wandering_m(robot(one, [(20, 90)]), NOISE, "trial") for one in (path, from_afar)]
    assert both[0] == pytest.approx(both[1], rel=1e-12)


def errors(rms_m, floor_m=0.002, windows=5, shorter_m=0.0):
    def judged(last_m):
        models = (SimpleNamespace(rms_m=1.0), SimpleNamespace(rms_m=last_m))
        return SimpleNamespace(models=models, noise_floor_m=floor_m, windows=windows)

    empty = SimpleNamespace(models=(SimpleNamespace(rms_m=np.nan),), noise_floor_m=np.nan, windows=0)
    return SimpleNamespace(horizons={"1s": judged(shorter_m), "5s": judged(rms_m), "trial": empty})


def test_it_is_said_where_it_makes_the_error_and_the_error_is_above_noise():
    predictor = robot(curved(), [(0, 199)])
    by_drive = wandering_m(predictor, NOISE, "5s")
    (said,) = scatter_in_words(predictor, NOISE, errors(1.2 * by_drive))
    assert f"over 5 seconds ({1.2e3 * by_drive:.3g} mm)" in said
    assert f"which makes {1e3 * by_drive:.3g} mm" in said
    assert "8 mm ahead, 4 mm to the side and 2.86°" in said
    assert "It may be chance" in said
    (said,) = scatter_in_words(predictor, NOISE, errors(1.7 * by_drive))  # something else makes most of it
    assert f"({1.7e3 * by_drive:.3g} mm) is far above tracking noise (2 mm)" in said
    assert f"makes only {1e3 * by_drive:.3g} mm. In the rest no listed effect" in said
    (said,) = scatter_in_words(predictor, NOISE, errors(0.6 * by_drive))  # from pose to pose more, and it goes back
    assert f"({0.6e3 * by_drive:.3g} mm) is far above tracking noise (2 mm)" in said
    assert f"would be {1e3 * by_drive:.3g} mm off. So its jumps take one another back, or are rare" in said
    assert scatter_in_words(predictor, NOISE, errors(0.6 * by_drive, floor_m=0.5 * by_drive)) == []
    assert scatter_in_words(predictor, NOISE, errors(by_drive, floor_m=0.6 * by_drive)) == []  # near noise: no question
    assert scatter_in_words(predictor, NOISE, errors(by_drive, floor_m=np.nan)) == []
    assert scatter_in_words(predictor, NOISE, SimpleNamespace(horizons={})) == []


def test_what_is_left_beside_terms_is_said_where_neither_noise_nor_scatter_makes_it():
    predictor = robot(curved(), [(0, 199)])
    by_drive = wandering_m(predictor, NOISE, "5s")
    (said,) = still_left_in_words(predictor, NOISE, errors(1.7 * by_drive))
    assert f"over 5 seconds is still {1.7e3 * by_drive:.3g} mm (as given 1000 mm, by tracking noise 2 mm)" in said
    assert "a load that has shifted" in said
    assert still_left_in_words(predictor, NOISE, errors(1.2 * by_drive)) == []  # the drive's own scatter
    assert still_left_in_words(predictor, NOISE, errors(1.7 * by_drive, floor_m=by_drive)) == []
    assert still_left_in_words(predictor, NOISE, SimpleNamespace(horizons={})) == []


def test_a_verdict_that_finds_nothing_says_that_the_error_is_above_noise():
    for error_m, floor_m, verdict, says in (
        (0.03, 0.01, "none", True),
        (0.019, 0.01, "none", False),
        (0.03, np.nan, "none", False),
        (0.03, 0.01, "effects", False),
    ):
        found = SimpleNamespace(verdict=verdict, errors=errors(error_m, floor_m=floor_m))
        assert nothing_above_noise(found) == says
    found = SimpleNamespace(verdict="none", errors=errors(0.03, floor_m=0.01), effects=(), numbers={}, selection=None)
    assert headline(found) == "Nothing is missing from the model that these measurements could show. " + ABOVE_NOISE
    verdict, said = islice(text._diagnosis(found, (), {}), 2)
    assert verdict == "verdict: none"
    assert said == "Nothing is missing that these measurements could show. " + ABOVE_NOISE


def two_horizons():
    """One second is a third of the path, five are all of it."""
    predictor = robot(curved(), [(0, 199)])
    windows = {"1s": ([0], [66]), "5s": ([0], [199])}
    predictor.windows = lambda horizon: windows[horizon]
    return predictor, *(wandering_m(predictor, NOISE, horizon) for horizon in windows)


def test_wheels_that_vary_over_parts_of_a_second_scatter_more_over_seconds_than_from_pose_to_pose():
    predictor, short, whole = two_horizons()
    (said,) = scatter_in_words(predictor, NOISE, errors(2.2 * whole, shorter_m=np.hypot(2.0 * short, 0.002)))
    assert "as if the drive itself scattered: grown as a walk at random grows, the error over 1 second makes" in said
    assert f"makes {2e3 * whole:.3g} mm. From pose to pose it scatters less ({1e3 * whole:.3g} mm)" in said
    for shorter_m in (1.2 * short, 0.001, 5.0 * short):  # too little, below the noise, and more than all
        (said,) = scatter_in_words(predictor, NOISE, errors(2.2 * whole, shorter_m=shorter_m))
        assert "trials may differ from one another" in said


def test_what_differs_from_trial_to_trial_grows_faster_than_a_walk_at_random():
    """Headings that turn away at a rate of their own in each trial: over six times the way, 36 times as far, not 15 times."""
    way = np.column_stack([np.linspace(0, 6.0, 601), np.zeros(601)])
    predictor = robot(way, [(0, 600)])
    windows = {"1s": (np.arange(0, 600, 100), np.arange(100, 601, 100)), "5s": ([0], [600])}
    predictor.windows = lambda horizon: windows[horizon]
    bent = {horizon: 0.3 * length**2 / 2 for horizon, length in (("1s", 1.0), ("5s", 6.0))}
    (said,) = scatter_in_words(predictor, NOISE, errors(bent["5s"], shorter_m=bent["1s"]))
    assert "trials may differ from one another" in said


def scattered(table, rng):
    """The same drives with steps that scatter as NOISE says, frame by frame, and its noise of poses."""
    table = table.copy()
    for _, rows in table.groupby("trial").groups.items():
        pose = table.loc[rows, ["x_m", "y_m", "heading_rad"]].to_numpy()
        steps, heading = np.diff(pose, axis=0), pose[:-1, 2]
        root = np.sqrt(np.hypot(*steps[:, :2].T))
        cos, sin = np.cos(heading), np.sin(heading)
        ahead, left = cos * steps[:, 0] + sin * steps[:, 1], cos * steps[:, 1] - sin * steps[:, 0]
        off = rng.normal(size=(3, len(steps))) * NOISE[2:, None] * root
        turned = heading + np.append(0.0, np.cumsum(off[2])[:-1])
        x = np.cos(turned) * (ahead + off[0]) - np.sin(turned) * (left + off[1])
        y = np.sin(turned) * (ahead + off[0]) + np.cos(turned) * (left + off[1])
        walked = pose[0] + np.vstack([np.zeros(3), np.cumsum(np.column_stack([x, y, steps[:, 2] + off[2]]), axis=0)])
        walked += rng.normal(size=walked.shape) * NOISE[[0, 0, 1]]
        table.loc[rows, ["x_m", "y_m", "heading_rad"]] = walked
    return table


@pytest.mark.slow
@pytest.mark.parametrize("verdict", ["", "insufficient-data"])
def test_a_diagnosis_that_finds_nothing_says_so_and_one_that_cannot_tell_does_not(verdict, monkeypatch):
    if verdict:
        monkeypatch.setattr(diagnosing, "_verdict", lambda *_: verdict)
    driven = measured(NOMINAL, trials=24, seed=5, noise=(0.0, 0.0), jitter=0.0, commands=12)
    found = diagnosing.diagnose(WheelPredictor(tracks_of(scattered(driven, np.random.default_rng(1)))), NOMINAL)
    assert found.verdict == (verdict or "none")
    said = [note for note in found.notes if "as if the drive itself scattered" in note]
    assert len(said) == (not verdict)
    if said:
        numbers = [float(one) for one in re.findall(r"by ([\d.]+) mm ahead, ([\d.]+) mm to the side and ([\d.]+)°", said[0])[0]]
        assert numbers == pytest.approx([1e3 * NOISE[2], 1e3 * NOISE[3], np.degrees(NOISE[4])], rel=0.3)
