"""Lines on the floor at which wheels lose way are found wherever they are; what depends on commands is none."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.caveats import _on_rest
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.floor_lines import FloorLines, _commanded, _runs, _spacing, floor_lines
from bns.diagnose.residuals.unexplained import NOTHING, Unexplained, unexplained
from tests.diagnose.worlds import BASE_M, FRAME_S, NOMINAL

LASTS = 10
STEP_S = FRAME_S / LASTS
FRAMES = 200


def driven(lines, loss_m, trials=40, seed=0, dragged=None):
    """By this test's own integrator, all trials at once: a wheel that crosses one of the lines slips by that much of its way.

    ``lines``: (direction across, spacing, offset) each. ``dragged`` (pose, told) -> factor of the speeds, (trials,).
    """
    rng = np.random.default_rng(seed)
    pose = np.column_stack([rng.uniform(-0.3, 0.3, (trials, 2)), rng.uniform(-3, 3, trials)])
    left = np.array([1.0, -1.0])
    cell, due, rows = None, np.zeros((trials, 2)), []
    told = np.zeros((trials, 2))
    for k in range(FRAMES * LASTS):
        if k % (25 * LASTS) == 0:
            home = np.arctan2(-pose[:, 1], -pose[:, 0]) - pose[:, 2]  # stays on a small floor
            any_way = rng.uniform(-0.06, 0.06, trials)
            bend = np.where(np.hypot(pose[:, 0], pose[:, 1]) > 0.4, np.sign(np.sin(home)) * 0.06, any_way)
            told = rng.uniform(0.08, 0.16, trials)[:, None] + bend[:, None] * np.array([-1, 1])
            told *= np.where(rng.uniform(size=trials) < 0.3, -1.0, 1.0)[:, None]
        if k % LASTS == 0:
            seen = pose + rng.standard_normal(pose.shape) * [5e-4, 5e-4, 2e-3]
            rows.append(np.column_stack([np.arange(trials), np.full(trials, k * STEP_S), told, seen]))
        speed = told * (dragged(pose, told)[:, None] if dragged else 1.0)
        ahead, turn = speed.mean(axis=1), (speed[:, 1] - speed[:, 0]) / BASE_M
        wheels = pose[:, None, :2] + (BASE_M / 2) * left[:, None] * np.stack(
            [-np.sin(pose[:, 2]), np.cos(pose[:, 2])], axis=1
        )[:, None, :]
        now = [np.floor((wheels @ [np.cos(a), np.sin(a)] - at) / every) for a, every, at in lines]
        due += sum((a != b) * loss_m for a, b in zip(now, cell, strict=True)) if cell is not None else 0.0
        cell = now
        lost = np.minimum(due, 0.5 * np.abs(speed) * STEP_S)
        due = due - lost
        way = speed * STEP_S - np.sign(speed) * lost
        ahead, turn = way.mean(axis=1), (way[:, 1] - way[:, 0]) / BASE_M
        middle = pose[:, 2] + turn / 2
        pose = pose + np.column_stack([ahead * np.cos(middle), ahead * np.sin(middle), turn])
    table = pd.DataFrame(np.concatenate(rows), columns=["trial", "t_s", "left_m_s", "right_m_s", "x_m", "y_m", "heading_rad"])
    return table.sort_values(["trial", "t_s"], ignore_index=True).astype({"trial": int})


def found_in(table):
    problem = problem_for(WheelPredictor(tracks_of(table)), NOMINAL)
    return floor_lines(problem, problem.fit(NOMINAL))


@pytest.fixture(scope="module")
def tiles():
    """Joints of tiles of 20 cm, turned by 20°."""
    return driven([(math.radians(20), 0.2, 0.05), (math.radians(110), 0.2, 0.12)], 0.004)


def test_joints_of_tiles_are_found_in_both_directions(tiles):
    found = sorted(found_in(tiles), key=lambda lines: lines.across_rad)
    assert [math.degrees(lines.across_rad) for lines in found] == pytest.approx([-70, 20], abs=1.0)
    assert [lines.spacing_m for lines in found] == pytest.approx([0.2, 0.2], rel=0.03)
    for lines, offset in zip(found, (-0.12, 0.05), strict=True):
        off = (np.array(lines.at_m) - offset + 0.1) % 0.2 - 0.1
        assert np.abs(off).max() < 0.012
        assert 0.0025 < lines.loss_m < 0.0045
        assert "in the direction of" in lines.in_words
        assert f"{lines.spacing_m:.3g} m apart" in lines.in_words


def test_a_single_line_that_gains_way_is_one():
    """A wheel that rolls down a step."""
    (found,) = found_in(driven([(0.0, 10.0, 0.1)], -0.006))
    assert found.at_m == pytest.approx([0.1], abs=0.01)
    assert (found.spacing_m, abs(math.degrees(found.across_rad)) < 1.5) == (None, True)
    assert -0.009 < found.loss_m < -0.004
    assert "gains about" in found.in_words
    assert found.in_words.endswith(f"at x = {found.at_m[0]:.2f} m")


def test_nothing_is_nothing():
    assert found_in(driven([], 0.0)) == ()


def test_a_place_that_is_wide_is_no_line():
    assert found_in(driven([], 0.0, dragged=lambda pose, _: np.where(np.abs(pose[:, 0]) < 0.4, 0.95, 1.0))) == ()


def test_what_depends_on_commands_is_no_line():
    """All robots turn to the left on a strip, and there only; a robot that is slow in left turns is slow there."""
    table = driven([], 0.0)
    rng = np.random.default_rng(3)
    rows = []
    for trial in range(40):
        x, y, heading, t_s = rng.uniform(-0.35, -0.3), rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), 0.0
        for _ in range(FRAMES):
            bends = 0.05 < x < 0.1
            told = np.array([0.08, 0.12]) if bends else np.array([0.1, 0.1])
            rows.append([trial, t_s, *told, *(np.array([x, y, heading]) + rng.standard_normal(3) * [5e-4, 5e-4, 2e-3])])
            left, right = told * (0.8 if bends else 1.0)
            heading += (right - left) / BASE_M * FRAME_S / 2
            x, y = x + (left + right) / 2 * np.cos(heading) * FRAME_S, y + (left + right) / 2 * np.sin(heading) * FRAME_S
            heading += (right - left) / BASE_M * FRAME_S / 2
            t_s += FRAME_S
    assert found_in(pd.DataFrame(rows, columns=table.columns).astype({"trial": int})) == ()


def test_turns_on_the_spot_at_the_ends_of_lanes_are_no_lines():
    """To the left at one wall, to the right at the other, each 10 % short; and lanes are driven backwards as well."""
    rng, rows = np.random.default_rng(4), []
    for trial in range(40):
        x, y, heading, t_s, way = -0.4, rng.uniform(-0.3, 0.3), rng.uniform(-0.05, 0.05), 0.0, 1.0
        spin = 0
        for _ in range(FRAMES):
            if spin == 0 and way * x > 0.4:
                spin, way = 40, -way
            side = 1.0 if (way < 0) != (trial % 2 == 0) else -1.0
            turning = spin > 0
            told = np.array([-0.05, 0.05]) * (side if spin > 20 else -side) if turning else np.array([0.12, 0.12]) * way
            spin = max(spin - 1, 0)
            rows.append([trial, t_s, *told, *(np.array([x, y, heading]) + rng.standard_normal(3) * [5e-4, 5e-4, 2e-3])])
            left, right = told * (0.9 if turning else 1.0)
            heading += (right - left) / BASE_M * FRAME_S
            x, y = x + (left + right) / 2 * np.cos(heading) * FRAME_S, y + (left + right) / 2 * np.sin(heading) * FRAME_S
            t_s += FRAME_S
    table = pd.DataFrame(rows, columns=["trial", "t_s", "left_m_s", "right_m_s", "x_m", "y_m", "heading_rad"])
    assert found_in(table.astype({"trial": int})) == ()


def test_few_frames_and_relative_tracks_are_not_asked(tiles):
    assert found_in(tiles[tiles["trial"] < 2]) == ()
    assert len(found_in(tiles[tiles["trial"] < 20])) >= 1
    predictor = WheelPredictor(tracks_of(tiles))
    problem = problem_for(predictor, NOMINAL)
    fit = problem.fit(NOMINAL)
    assert unexplained(problem, fit, ()).lines == ()  # not where errors are near tracking noise
    assert len(unexplained(problem, fit, (), far=True).lines) == 2
    tracks = SimpleNamespace(relative=True)
    assert floor_lines(SimpleNamespace(predictor=SimpleNamespace(tracks=tracks)), fit) == ()


def test_commands_are_those_of_the_frames_where_a_trial_has_a_run_up(tiles):
    """Times for people begin after it, the commands with it."""
    tracks = tracks_of(tiles)
    after = replace(tracks, lead_s=np.full(len(tracks), 2.0))
    assert after.own_s[0] != tracks.own_s[0]
    for given, same in zip(_commanded(after), _commanded(tracks), strict=True):
        np.testing.assert_array_equal(given, same)


LINES = FloorLines(0.0, (0.1, 0.4, 0.7, 1.0, 1.3, 1.6, 1.9), 0.3, 0.004, 12.0)


def test_lines_are_something_that_is_left():
    rest = Unexplained((), None, (), lines=(LINES,))
    assert rest.any
    assert not NOTHING.any
    (note,) = _on_rest(rest, range(40))
    assert "12 standard errors" in note
    assert "joints of tiles" in note
    assert LINES.in_words.endswith("x = 0.10, 0.40, 0.70, 1.00, 1.30, 1.60 m and 1 more, 0.3 m apart")
    found = Diagnosis("unlisted", None, rest=rest)
    assert found.behaviour == (LINES.in_words,)
    (told,) = found.as_json()["floor_lines"]
    assert (told["spacing_m"], told["in_words"]) == (0.3, LINES.in_words)


@pytest.mark.parametrize(
    ("at", "spacing"),
    [
        ([0.0, 0.3, 0.6], 0.3),
        ([0.0, 0.3, 0.9, 1.2], 0.3),  # one was not seen
        ([0.0, 0.31, 0.6, 0.91], 0.303),
        ([0.0, 0.3], None),
        ([0.0, 0.3, 0.45], 0.15),
        ([0.0, 0.3, 0.42, 0.9], None),
    ],
)
def test_even_spacing(at, spacing):
    assert _spacing(at) == (pytest.approx(spacing, abs=0.002) if spacing else None)


def test_runs_close_gaps_of_one():
    assert list(_runs(np.array([1, 0, 1, 0, 0, 1], dtype=bool))) == [(0, 3), (5, 6)]


@pytest.mark.slow
def test_a_diagnosis_says_where_they_are_and_names_them_where_they_are_evenly_spaced():
    """Three seams with two gaps of which neither is a multiple of the other; then planks."""
    uneven = driven([(0.0, 10.0, -0.17), (0.0, 10.0, 0.2), (0.0, 10.0, 0.36)], 0.005)
    found = diagnose(WheelPredictor(tracks_of(uneven)), NOMINAL)
    assert found.verdict == "unlisted"
    assert set(found.effects) <= {"speed-gain"}  # what the lines take on the whole
    (words,) = (words for words in found.behaviour if "line on the floor" in words)
    assert "where it crosses a line on the floor, at x = " in words
    assert not words.endswith("m apart")
    found = diagnose(WheelPredictor(tracks_of(driven([(0.0, 0.25, 0.1)], 0.005))), NOMINAL)
    assert found.effects == ("floor-joints",)  # and moments: this integrator holds a wheel for longer where it comes slowly
    assert not found.rest.lines
    values = found.selection.fit.model.values_of("floor-joints")
    assert values["spacing_m"] == pytest.approx(0.25, abs=0.001)
    assert values["loss_m"] == pytest.approx(0.005, abs=0.0004)
    assert (values["at_m"] - 0.1 + 0.125) % 0.25 - 0.125 == pytest.approx(0.0, abs=0.002)


def test_lines_of_three_directions_are_all_found():
    """Three cables on the floor, each of its own direction."""
    cables = [(math.radians(12), 0.21), (math.radians(97), -0.13), (math.radians(151), 0.05)]
    found = found_in(driven([(angle, 10.0, at) for angle, at in cables], 0.006, trials=60))
    assert len(found) == 3
    for angle, at in cables:
        (one,) = (lines for lines in found if abs(math.remainder(lines.across_rad - angle, math.pi)) < math.radians(2.0))
        turned = math.cos(one.across_rad - angle)  # the same line, counted from the other side
        assert [turned * place for place in one.at_m] == pytest.approx([at], abs=0.015)
