"""A few bad trials do not turn a verdict, and are named."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report.text import diagnosis_text
from bns.diagnose.residuals.worst_trials import apart, most_left_out, standing_out
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, hidden, measured


def with_bad(good, bad, trials=36, of_them=2):
    """Trials of one robot, and of another named 100, 101, ..."""
    odd = measured(bad, trials=of_them, seed=3)
    return pd.concat([measured(good, trials=trials, seed=2), odd.assign(trial=odd.trial + 100)], ignore_index=True)


def wild_of(table):
    predictor = WheelPredictor(tracks_of(table))
    problem = problem_for(predictor, NOMINAL)
    return [predictor.tracks.names[i] for i in standing_out(problem, problem.fit(NOMINAL))]


@pytest.mark.slow
def test_two_bad_trials_of_38_hide_nothing_and_are_named():
    good, bad = hidden(wheelbase={"factor": 1.04}), hidden(wheelbase={"factor": 0.6})
    predictor = WheelPredictor(tracks_of(with_bad(good, bad)))
    found = diagnose(predictor, NOMINAL, barred=all_but_rivals_of("wheelbase"))
    assert (found.verdict, found.effects) == ("effects", ("wheelbase",))
    answer = found.as_json()
    number = answer["parameters"]["wheelbase"]["factor"]
    assert number["low"] < 1.04 < number["high"]
    assert set(answer["without_worst"]["trials"]) == {"100", "101"}
    assert answer["without_worst"]["with_them"] != answer["without_worst"]["without"]
    assert any("Unlike all others" in note and "with them the verdict would be" in note for note in found.notes)
    assert answer["error"]["trial"]["windows"] == 38


@pytest.mark.parametrize("seed", range(4))
def test_honest_trials_are_alike(seed):
    assert wild_of(measured(NOMINAL, trials=40, seed=seed, jitter=0.01)) == []


def test_more_than_the_worst_few_are_a_phenomenon():
    assert most_left_out(36) == 2
    assert most_left_out(120) == 4
    bad = hidden(wheelbase={"factor": 0.6})
    assert wild_of(with_bad(NOMINAL, bad, trials=30, of_them=1)) == ["100"]
    assert wild_of(with_bad(NOMINAL, bad, trials=30, of_them=4)) == []


def apart_in(table, trial):
    predictor = WheelPredictor(tracks_of(table))
    problem = problem_for(predictor, NOMINAL)
    return next(iter(apart(problem, problem.fit(NOMINAL), [predictor.tracks.names.index(trial)])))


def test_a_trial_that_a_push_makes_unlike_the_rest_is_told_from_one_that_differs_throughout():
    table = measured(NOMINAL, trials=20, seed=2)
    pushed = table.index[table.trial == 7]
    at = len(pushed) // 2
    shift = np.clip((np.arange(len(pushed)) - at) / 4.0, 0.0, 1.0)  # 60 mm within four frames
    table.loc[pushed, "x_m"] += 0.06 * shift
    one = apart_in(table, "7")
    assert one.once
    assert one.share > 0.9
    assert one.times > 1.5
    assert abs(one.moment.t_s - table.loc[pushed[at], "t_s"]) < 0.5
    assert f"of the excess from one moment: at {one.moment.t_s:.2f} s, near (" in one.in_words
    other = apart_in(with_bad(NOMINAL, hidden(wheelbase={"factor": 0.6}), trials=20, of_them=1), "100")
    assert not other.once
    assert other.in_words.endswith("times the loss per pose of the median trial, spread over the trial")


def test_a_trial_that_is_too_short_for_a_moment_has_none():
    table = measured(NOMINAL, trials=12, seed=2)
    few = table.index[table.trial == 3]
    one = apart_in(table.drop(few[8:]), "3")
    assert (one.once, one.moment) == (False, None)


def held_from(table, shares):
    """The robot is held from a share of each of these trials to its end: number -> share."""
    out, rng = table.copy(), np.random.default_rng(4)
    for trial, share in shares.items():
        rows = out.index[out.trial == trial]
        still = rows[int(share * len(rows)) :]
        for name in ("x_m", "y_m", "heading_rad"):
            out.loc[still, name] = out.loc[still[0], name] + rng.normal(0.0, 0.002, len(still))
    return out


@pytest.mark.slow
def test_the_worst_trials_hide_the_next_ones_and_together_they_count():
    """Two are held for nearly a whole trial, two for its last part: next to the first, the others look like the rest."""
    table = held_from(measured(NOMINAL, trials=40, seed=2), {3: 0.05, 17: 0.05, 22: 0.9, 31: 0.9})
    predictor = WheelPredictor(tracks_of(table))
    found = diagnose(predictor, NOMINAL, barred=all_but_rivals_of("wheelbase"))
    assert found.verdict == "unlisted"
    assert found.without_worst is None
    note = next(note for note in found.notes if "Unlike all others" in note)
    assert "more than 3% of all trials" in note
    assert {"3", "17", "22", "31"} == set(note.split("trials ")[1].split(".")[0].split(", "))
    assert {o.trial for o in found.rest.outliers} == {"3", "17", "22", "31"}
    worst = found.rest.outliers[0]
    assert worst.moved_m < 0.01 < worst.predicted_m
    assert found.behaviour[0].startswith("in 4 of 40 trials the error is large for a moment")
    assert worst.in_words in found.behaviour[0]
    assert found.behaviour[1] == "in 3 of these 4 moments the robot stood still, whatever it was told"
    for said in found.behaviour:
        assert f"  - {said}." in diagnosis_text(found)


def test_what_does_not_count_bends_no_number_and_is_judged():
    predictor = WheelPredictor(tracks_of(with_bad(NOMINAL, hidden(wheelbase={"factor": 0.6}), trials=12)))
    apart = predictor.not_counting([12, 13])
    model = NOMINAL.with_effect("wheelbase", factor=1.0)
    problem = problem_for(apart, model)
    fit = problem.fit(model)
    assert fit.values[0] == pytest.approx(1.0, abs=0.004)
    assert (fit.losses[12:] == 0).all()
    assert predictor.counted is None
    assert (apart.windows("trial")[0] == predictor.windows("trial")[0]).all()
