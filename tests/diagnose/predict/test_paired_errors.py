"""The one error: the same number for the same thing in every command, on windows chosen without a model."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from bns.cli.main import main
from bns.diagnose.data.checks import checked
from bns.diagnose.data.tracker_faults import jumps, without_faults
from bns.diagnose.data.tracking_noise import TrackingNoise, _about, noise_at_rest, tracking_noise
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.predict.paired_errors import (
    FEWEST_TRIALS,
    Change,
    HorizonErrors,
    ModelError,
    PairedErrors,
    _Draws,
    paired_errors,
)
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report.text import error_lines
from bns.measurements import write_measurements
from bns.physics.model import Model
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, hidden, measured


@pytest.fixture(scope="module")
def table():
    return measured(hidden(turn_slip={"slip_s": 0.12}), trials=12, seed=4)


def tracks(table):
    return tracks_of(checked(table)[0])


def moved(table, trials, by_m=0.14, turn_rad=0.2):
    """The table with a jump that lasts in the middle of these trials."""
    out = table.copy()
    for trial in trials:
        rows = out.index[out["trial"] == trial]
        late = rows[len(rows) // 2 :]
        out.loc[late, "x_m"] += by_m
        out.loc[late, "heading_rad"] += turn_rad
    return out


def test_every_command_shows_the_same_error(table, tmp_path, capsys):
    data = tmp_path / "log.parquet"
    write_measurements(table, data)
    ask = [str(data), "--model", "khepera", "--json"]
    assert main(["compare", *ask]) == 0
    compared = json.loads(capsys.readouterr().out)["error"]
    assert main(["diagnose", *ask]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["effects"] == ["turn-slip"]
    new = tmp_path / "new.yaml"
    assert main(["add", "turn-slip", "--model", "khepera", "--data", str(data), "-o", str(new)]) == 0
    told = capsys.readouterr().out
    written = yaml.safe_load(new.read_text())
    by_name = written["provenance"]["held_out_position_error_m"]
    number = found["parameters"]["turn-slip"]["slip_s"]
    assert written["effects"][0]["values"]["slip_s"] == pytest.approx(number["value"], rel=1e-9)
    for horizon, error in found["error"].items():
        assert error["before"] == pytest.approx(compared[horizon]["position_m"], rel=1e-12)
        assert error["noise_floor"] == compared[horizon]["noise_floor_m"]
        assert by_name["as given"][horizon] == pytest.approx(error["before"], abs=1e-6)
        assert by_name["turn-slip"][horizon] == pytest.approx(error["after"], abs=1e-6)
        assert f"{1e3 * error['after']:.2f}" in told


def test_the_floor_is_the_same_under_every_model(table):
    predictor = WheelPredictor(tracks(table))
    floors = {
        factor: paired_errors(predictor, [("m", predictor.steps(NOMINAL.with_effect("wheelbase", factor=factor)))])
        for factor in (1.0, 1.6)
    }
    assert floors[1.0].horizons["1s"].noise_floor_m == floors[1.6].horizons["1s"].noise_floor_m
    assert floors[1.0].noise.position_m == pytest.approx(0.0015, rel=0.15)
    assert floors[1.0].noise.heading_rad == pytest.approx(0.005, rel=0.15)


def test_noise_at_rest_includes_what_wanders_slowly():
    """Correlated from frame to frame (0.9), of 2 mm: a parabola follows it, a robot at rest shows all of it."""
    table = measured(NOMINAL, trials=8, seed=1, noise=(0.0, 0.0))
    rng, rho = np.random.default_rng(0), 0.9
    walk = np.zeros((len(table), 2))
    for i in range(1, len(table)):
        walk[i] = rho * walk[i - 1] + np.sqrt(1 - rho**2) * rng.normal(size=2)
    table[["x_m", "y_m"]] += 0.002 * walk
    quick = tracking_noise(tracks(table))
    assert quick.basis == "high frequency"
    assert quick.position_m < 0.0015
    still = table.copy()
    still[["left_m_s", "right_m_s"]] = 0.0
    still["x_m"], still["y_m"] = 0.002 * walk[:, 0], 0.002 * walk[:, 1]
    still["heading_rad"] = 0.0
    still["trial"] = still["trial"] + 100
    rest = tracking_noise(tracks(pd.concat([table, still], ignore_index=True)))
    assert rest.basis == "at rest"
    assert rest.position_m == pytest.approx(0.002, rel=0.3)


def test_noise_at_rest_is_not_the_robot_that_creeps():
    """A proportional controller lets wheels creep down a slope: 10 mm/s here, under noise of 1.5 mm."""
    driven = measured(NOMINAL, trials=8, seed=1)
    still = driven.assign(left_m_s=0.0, right_m_s=0.0, trial=driven["trial"] + 100)
    rng = np.random.default_rng(3)
    still[["x_m", "y_m", "heading_rad"]] = rng.normal(size=(len(still), 3)) * [0.0015, 0.0015, 0.005]
    creeps = still.assign(x_m=still["x_m"] + 0.01 * still["t_s"])
    both = [tracks(pd.concat([driven, one], ignore_index=True)) for one in (still, creeps)]
    (standing, _), (creeping, _) = map(noise_at_rest, both)
    assert standing.position_m == pytest.approx(0.0015, rel=0.1)
    assert creeping.position_m == pytest.approx(0.0015, rel=0.15)


def test_a_window_is_left_out_for_a_jump_and_never_for_a_bad_model(table):
    wrong, seen = Model(wheelbase_m=0.3), tracks(moved(table, [3, 7]))
    jumpy = replace(seen, jumped=jumps(seen))
    predictor = WheelPredictor(jumpy)
    errors = paired_errors(predictor, [("right", predictor.steps(NOMINAL)), ("wrong", predictor.steps(wrong))])
    trial = errors.horizons["trial"]
    assert (trial.windows, trial.left_out) == (10, 2)
    assert trial.models[0].rms_m < trial.models[1].rms_m
    assert trial.total.rose
    assert not errors.falls
    clean = WheelPredictor(tracks(table))
    assert paired_errors(clean, [("wrong", clean.steps(wrong))]).horizons["trial"].left_out == 0


def test_jumps_are_found_and_honest_gaps_are_not(table):
    assert not jumps(tracks(table)).any()
    gap = table.drop(index=table.index[10:18]).reset_index(drop=True)
    assert not jumps(tracks(gap)).any()
    found = tracks(moved(table, [2, 5, 9]))
    found = replace(found, jumped=jumps(found))
    assert sorted({found.names[found.trial[k]] for k in np.flatnonzero(found.jumped)}) == ["2", "5", "9"]
    assert found.thinned(3).jumped.sum() == 3


def test_what_follows_a_jump_is_left_out_unless_jumps_are_the_rule(table):
    few, many = tracks(moved(table, [2, 5])), tracks(moved(table, range(12)))
    cut = without_faults(few)
    assert cut.jumped is None
    half = int((few.trial == 2).sum()) // 2
    assert (cut.trial == 2).sum() == half
    assert (cut.trial == 3).sum() == (few.trial == 3).sum()
    marked = without_faults(many)
    assert len(marked.t_s) == len(many.t_s)
    assert marked.jumped.sum() == 12


def test_a_jump_is_listed_with_its_trial_and_time(table, tmp_path, capsys):
    data = tmp_path / "jumpy.csv"
    write_measurements(moved(table, [3]), data)
    assert main(["compare", str(data), "--model", "khepera", "--findings"]) == 0
    said = capsys.readouterr().err
    assert "trial 3" in said
    assert "jumps by" in said
    assert "stays there" in said


@pytest.mark.slow
def test_jumps_do_not_bend_the_numbers(table, tmp_path, capsys):
    numbers = {}
    for name, rows in {"clean": table, "jumpy": moved(table, [3, 8])}.items():
        data = tmp_path / f"{name}.parquet"
        write_measurements(rows, data)
        barred = [word for name in all_but_rivals_of("turn-slip") for word in ("--without-effect", name)]
        assert main(["diagnose", str(data), "--model", "khepera", "--json", *barred]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert answer["effects"] == ["turn-slip"]
        numbers[name] = answer["parameters"]["turn-slip"]["slip_s"]
    assert numbers["jumpy"]["value"] == pytest.approx(numbers["clean"]["value"], abs=2 * numbers["clean"]["se"])


def test_what_lowers_nothing_is_said_so(table, tmp_path, capsys):
    data = tmp_path / "log.parquet"
    write_measurements(measured(NOMINAL, trials=12, seed=9), data)
    assert main(["add", "wheelbase", "--model", "khepera", "--data", str(data), "-o", str(tmp_path / "n.yaml")]) == 0
    assert "warning: " in capsys.readouterr().out


def test_a_change_without_an_interval_is_taken_by_its_sign():
    nan = float("nan")
    assert [(c.fell, c.rose) for c in (Change(-1.0, nan, nan), Change(1.0, nan, nan))] == [(True, False), (False, True)]
    unsure = Change(-1.0, -2.0, 0.5), Change(1.0, -0.5, 2.0), Change(nan, nan, nan)
    assert not any(c.fell or c.rose for c in unsure)


@pytest.mark.parametrize(("trials", "known"), [(FEWEST_TRIALS - 1, False), (FEWEST_TRIALS, True)])
def test_intervals_begin_with_the_fewest_trials(trials, known):
    predictor = WheelPredictor(tracks(measured(NOMINAL, trials=trials, seed=3)))
    models = [(name, predictor.steps(model)) for name, model in (("right", NOMINAL), ("wrong", Model(wheelbase_m=0.12)))]
    error = paired_errors(predictor, models).horizons["trial"]
    assert error.windows == trials
    ends = [error.models[0].low_m, error.models[0].high_m, error.total.low_m, error.total.high_m]
    assert (np.isfinite(ends) == known).all()


def test_a_perfect_model_is_off_by_the_noise_of_both_ends_and_of_the_first_heading():
    noise = TrackingNoise(0.001, 0.01, "at rest")
    assert noise.error_m(np.zeros(3)) == pytest.approx(0.002)  # two coordinates, at two ends
    assert noise.error_m(np.array([0.0, 0.2])) == pytest.approx(np.sqrt(4e-6 + 0.5 * 0.002**2))
    assert np.isnan(noise.error_m(np.zeros(0)))


@pytest.mark.parametrize("order", [0, 1])
def test_deviations_from_a_rest_are_as_large_as_the_noise_however_few_poses_it_has(order):
    rng, t_s = np.random.default_rng(0), np.arange(6.0)
    off = [_about(t_s, rng.normal(0.0, 0.002, (6, 3)) + 0.3 * order * t_s[:, None], order) for _ in range(2000)]
    assert np.std(np.concatenate(off)) == pytest.approx(0.002, rel=0.03)


def test_a_model_that_lowers_rare_large_errors_and_raises_all_others_does_not_lower_the_error():
    """The model as given is right but for the third command of a trial; the other one is better there, and 3 % low elsewhere."""
    table = measured(NOMINAL, trials=16, seed=4, commands=12, noise=(2e-4, 1e-3))
    predictor = WheelPredictor(tracks(table))
    changed = table.groupby("trial")["left_m_s"].diff().fillna(0.0) != 0
    rare = (changed.groupby(table["trial"]).cumsum() == 3).to_numpy()[:, None]
    right = predictor.steps(NOMINAL)
    given, other = (replace(right, body=right.body * np.where(rare, *factors)) for factors in ((1.5, 1.0), (1.4, 0.97)))
    judged = paired_errors(predictor, [("given", given), ("other", other)])
    change = judged.horizons["command"].changes[0]
    assert change.change_m < 0
    assert change.median_rose
    assert not judged.falls
    assert "command" in judged.rose_in_the_end
    better = paired_errors(predictor, [("given", given), ("right", right)])
    assert better.falls
    assert not any(at.changes[0].median_rose for at in better.horizons.values())


def test_medians_of_samples_are_those_of_all_their_windows():
    rng = np.random.default_rng(0)
    of_trial = np.repeat(np.arange(12), rng.integers(3, 9, 12))
    values = rng.exponential(size=len(of_trial))
    draws = _Draws.over(np.bincount(of_trial))
    expected = [np.quantile(np.repeat(values, n[of_trial].astype(int)), 0.5, method="inverted_cdf") for n in draws.drawn[:50]]
    assert draws.medians(values, of_trial)[:50] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("before_m", "median_m", "change", "shown"),
    [
        (0.237754, 0.17009, (-0.21777, -0.25369, -0.18314), ("  237.75 (170.09)  ", "  -217.77 (-253.69 to -183.14)")),
        (1.5002, 0.71873, (-1.4541, -1.95682, -0.89832), ("    1500 (  719)  ", "  -1454 (-1957 to -898)")),
        (99.9999, 99.9999, (-99.9999, -99.9999, -99.9999), ("  100000 (100000)  ", "  -100000 (-100000 to -100000)")),
    ],
)
def test_large_errors_keep_the_columns_of_the_table_apart(before_m, median_m, change, shown):
    models = (
        ModelError("as given", before_m, before_m, before_m, median_m, 0.1),
        ModelError("with the effects", 0.0461, 0.0461, 0.0461, 0.0204, 0.1),
    )
    at = HorizonErrors("trial", 30, 0, models, (Change(*change),), None, 0.038)
    _, first, second, *_ = error_lines(PairedErrors({"trial": at}, None, 30))
    assert shown[0] in first
    assert shown[1] in second
    assert "46.10 (20.40)" in second


def test_the_change_between_models_that_do_not_follow_each_other_is_no_silent_unknown(table):
    """It once counted as an error that does not fall."""
    predictor = WheelPredictor(tracks(table))
    steps = predictor.steps(NOMINAL)
    errors = paired_errors(predictor, [("one", steps), ("two", steps), ("three", steps)])
    assert not errors.between("two", "three")
    with pytest.raises(ValueError, match="'three' does not follow 'one'"):
        errors.between("one", "three")
