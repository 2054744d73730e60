"""A column of the log that scales a velocity, or adds to it, is found as a term by itself, and said in words."""

import numpy as np
import pandas as pd
import pytest

import bns
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.grammar import LOGGED, LOGGED_OFFSET, Family, families, formula_columns
from bns.diagnose.residuals.ranked_families import ranked, significant, simpler_first
from bns.diagnose.residuals.symbolic import fitted
from bns.diagnose.residuals.words import in_words
from bns.physics.formula import formula_effect
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, measured

TRIALS = 14
NAMES = ("load", "k1", "odd name", "v", "tanh", "lambda", "session_s", "battery_v", "still")


def table_of(term, on, size):
    """Trials in each of which a term has its own load; further columns that no formula can have for its own."""
    loads = np.random.default_rng(2).uniform(0.2, 1.2, TRIALS)
    trials = []
    for number, load in enumerate(loads):
        robot = NOMINAL.with_active(formula_effect("f", f"k * {term}", on), (size * load,))
        others = dict.fromkeys(NAMES[1:-1], load + number) | {"still": 1.0}
        trials.append(measured(robot, trials=1, seed=number).assign(trial=number, load=load, **others))
    return pd.concat(trials, ignore_index=True)


def found_in(table):
    """The best family of the columns, added to the ideal drive."""
    predictor = WheelPredictor(tracks_of(table))
    problem = problem_for(predictor, NOMINAL)
    fit = problem.fit(NOMINAL)
    tried = [family for family in families(predictor, NOMINAL.wheelbase_m) if family.signal.startswith(LOGGED)]
    best = simpler_first(significant(ranked(problem, fit, tried)), float(fit.losses.mean()))[0].family
    return best, fitted(problem, fit, best.on, best.term, signal=best.signal), predictor


@pytest.mark.parametrize(
    ("term", "on", "size", "family", "words"),
    [
        ("v", "v", -0.1, Family(LOGGED + "load", "v", ("v * load",)), "the robot's forward motion follows load: slower by"),
        ("w", "w", 0.1, Family(LOGGED + "load", "w", ("w * load",)), "the robot's turning follows load: faster by"),
        ("1", "share", -0.1, Family(LOGGED + "load", "share", ("load",)), "the robot's motion follows load: slower by"),
        ("u", "left", -0.1, Family(LOGGED + "load", "left", ("u * load",)), "the robot's left wheel follows load: slower by"),
        (
            "moving",
            "w",
            0.05,
            Family(LOGGED + "load" + LOGGED_OFFSET, "w", ("moving * load",)),
            "turning velocity changes with load while the robot moves: +",
        ),
    ],
)
def test_what_follows_a_column_is_found_with_its_number(term, on, size, family, words):
    best, formula, predictor = found_in(table_of(term, on, size))
    assert best == family
    assert formula.values["k0"] == pytest.approx(size, rel=0.1)
    assert formula.certain
    said = in_words(formula, predictor)
    assert said.startswith(words)
    low, high = np.quantile(predictor.tracks.extra["load"], [0.05, 0.95])
    assert f"at {low:.3g}" in said
    assert said.endswith(f"at {high:.3g}")
    if formula.signal.endswith(LOGGED_OFFSET):
        assert f", {np.degrees(formula.values['k0'] * high):+.2g} °/s at" in said


def test_a_bend_along_a_column_is_a_curve():
    table = table_of("v", "v", 0.0)
    loads = table.groupby("trial")["load"].first()
    bent = [
        measured(NOMINAL.with_active(formula_effect("f", "k * v", "v"), (-0.4 * abs(load - 0.7),)), trials=1, seed=number)
        for number, load in loads.items()
    ]
    table = pd.concat([one.assign(trial=n, load=loads[n]) for n, one in enumerate(bent)], ignore_index=True)
    best, formula, predictor = found_in(table)
    assert (best.signal, best.on, len(best.functions)) == (LOGGED + "load", "v", 3)
    assert in_words(formula, predictor).startswith("the robot's forward motion follows load: ")


def test_only_columns_that_vary_and_that_a_formula_can_name_are_tried():
    predictor = WheelPredictor(tracks_of(table_of("v", "v", -0.1)))
    assert set(NAMES) <= {*predictor.tracks.extra, "session_s"}
    assert formula_columns(predictor) == ["load"]


@pytest.mark.slow
def test_a_diagnosis_offers_it_and_its_command_works(tmp_path):
    table = table_of("v", "v", -0.1)[["trial", "t_s", "left_m_s", "right_m_s", "x_m", "y_m", "heading_rad", "load"]]
    found = bns.diagnose(table, bns.Model(NOMINAL), without_effects=all_but_rivals_of("speed-gain"))
    assert found.verdict == "unlisted"
    assert not found.effects
    assert found.diagnosis.behaviour[0].startswith("the robot's forward motion follows load: slower by")
    (term,) = found.diagnosis.terms
    extended = found.model_with_terms.save(tmp_path / "extended.yaml")
    before, after = (bns.compare(table, model).errors.loc["5s", "position_m"] for model in (bns.Model(NOMINAL), extended))
    assert after < before / 3
    assert term.values["k0"] == pytest.approx(-0.1, abs=0.01)
