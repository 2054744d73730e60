"""Any column of a log is a signal for formulas and Python effects; a name that nobody knows is an error."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import bns
from bns.cli.main import main
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report.text import diagnosis_text
from bns.diagnose.residuals.symbolic import Formula
from bns.errors import ModelError
from bns.measurements import write_measurements
from bns.physics.effects import effect_in_file
from bns.physics.formula import ON, PAST, VARIABLES, formula_effect
from bns.physics.formula_value import FUNCTIONS
from bns.physics.model import parse_model
from tests.diagnose.worlds import NOMINAL, measured

LOSS = 0.3
PYTHON = '''
from bns.physics.effect import Effect, Parameter

def apply(body, share):
    return body.with_added("forward_m_s", -share * body.logged["load"] * body.forward_m_s)

EFFECT = Effect(name="load-loss", stage="body", parameters=(Parameter("share", "1", -5.0, 5.0, (-1.0, 1.0), 0.0, "x"),),
    equation="v' = v·(1 - share·load)", residuals="slower under load", lookalikes=(), apply=apply)
'''


@pytest.fixture(scope="module")
def table():
    """Trials whose forward speed falls with a logged load, which a text column and an odd name stand beside."""
    loads = np.random.default_rng(2).uniform(0, 1, 14)
    trials = []
    for number, load in enumerate(loads):
        slower = NOMINAL.with_active(formula_effect("f", "k * v", "v"), (-LOSS * load,))
        trials.append(measured(slower, trials=1, seed=number).assign(trial=number, load=load, note="a", **{"odd name": 1.0}))
    return pd.concat(trials, ignore_index=True)


def test_a_formula_finds_the_loss_under_a_logged_load(table):
    found = bns.add(table, "loss", bns.Model("khepera"), term="k * load * v")
    assert [number.parameter.name for number in found.extended.fit.free] == ["k"]
    assert found.extended.fit.values[0] == pytest.approx(-LOSS, abs=0.03)


def test_an_effect_in_python_finds_it_too(table, tmp_path):
    (tmp_path / "e.py").write_text(PYTHON)
    found = bns.add(table, effect_in_file(tmp_path / "e.py"), bns.Model("khepera"))
    assert found.extended.fit.values[0] == pytest.approx(LOSS, abs=0.03)


@pytest.mark.parametrize(
    ("term", "message"),
    [
        ("k * laod * v", r"unknown name 'laod'. Did you mean 'load'\? Valid: d, heading, l, load,"),
        ("k * current_a * v", "unknown name 'current_a'"),
        ("drag * v", "a number to fit is a letter"),
    ],
)
def test_an_unknown_name_is_an_error_that_lists_the_names(table, term, message):
    with pytest.raises(ModelError, match=f"(?i){message}"):
        bns.add(table, "loss", bns.Model("khepera"), term=term)


def test_the_command_line_says_it_too(table, tmp_path, capsys):
    table.to_csv(tmp_path / "d.csv", index=False)
    log, new = str(tmp_path / "d.csv"), str(tmp_path / "n.yaml")
    assert main(["add", log, "loss", "--term", "k*lode*v", "--model", "khepera", "-o", new]) == 2
    assert "unknown name 'lode'" in capsys.readouterr().err
    assert not (tmp_path / "n.yaml").exists()


def test_a_model_file_with_a_logged_column_is_read_and_asks_for_it(table, tmp_path):
    new = bns.add(table, "loss", bns.Model("khepera"), term="k * load * v").model
    new.save(tmp_path / "n.yaml")
    again = bns.Model(tmp_path / "n.yaml")
    with_it = bns.compare(table, again).errors.loc["1s", "position_m"]
    assert with_it < 0.8 * bns.compare(table, bns.Model("khepera")).errors.loc["1s", "position_m"]
    with pytest.raises(ModelError, match="column of the log 'load'"):
        bns.compare(table.rename(columns={"load": "burden"}), again)
    with pytest.raises(ModelError, match="driven without a log"):
        measured(again, trials=1)


def test_numbers_of_a_model_file_keep_whatever_name_they_have():
    effect = "{name: f, term: drag * v, on: v, values: {drag: 0.2}, basis: guess, reason: r}"
    text = f"base: differential-drive\nwheelbase_m: 0.1\neffects:\n- {effect}\n"
    assert parse_model(text, "m").effects[0].by_name == {"drag": 0.2}


def test_columns_of_rows_without_poses_are_read_between_them(table):
    own = table[["trial", "t_s", "left_m_s", "right_m_s"]].assign(t_s=table["t_s"] + 0.013, hot=table["t_s"] + 0.013)
    both = pd.concat([table, own.iloc[::3]]).sort_values(["trial", "t_s"], kind="stable").reset_index(drop=True)
    tracks = tracks_of(both)
    inner = (tracks.t_s > 0.2) & (tracks.t_s < 1.0)
    np.testing.assert_allclose(tracks.extra["hot"][inner], tracks.t_s[inner], atol=1e-9)
    grid = WheelPredictor(tracks).conditions.logged["hot"]
    assert np.isfinite(grid).all()


@pytest.mark.slow
def test_what_an_unlisted_verdict_says_of_a_column_holds_its_name_and_its_command_works(table, tmp_path):
    data = tmp_path / "my log.csv"
    write_measurements(table, data)
    found = bns.diagnose(data, "khepera")
    assert found.verdict == "unlisted"
    assert re.search(r"Left unexplained by listed effects, [^:]*: [^;]*forward velocity along load \([0-9.]+%\)", found.summary())
    problem, term = problem_for(found.ready.predictor, found.ready.model), "k * load * v"
    before = problem.fit(found.ready.model)
    after = problem.fit(before.model.with_active(formula_effect("loss", term, "v", ("load",)), (0.0,)))
    hint = Formula("v", term, after, problem.paired_comparison(before, after), "loss", "")
    alone = replace(found.diagnosis.selection, accepted=())  # the hint was fitted without effects
    text = diagnosis_text(replace(found.diagnosis, selection=alone, formula=hint, terms=()), command=found.command)
    lines = text.split("\n")
    (typed,) = (line.partition("to try it: ")[2] for line in lines if "to try it" in line)
    assert typed == f"bns add '{data}' loss --term 'k * load * v' --on v --model khepera -o NEW.yaml"
    assert main([*shlex.split(typed)[1:-1], str(tmp_path / "NEW.yaml")]) == 0
    assert bns.Model(tmp_path / "NEW.yaml").values_of("loss")["k"] == pytest.approx(-LOSS, abs=0.03)


def test_a_term_that_was_fitted_beside_effects_is_tried_in_the_extended_model():
    seen = WheelPredictor(tracks_of(measured(NOMINAL, trials=12)))
    problem = problem_for(seen, NOMINAL)
    found = diagnose(seen, NOMINAL)
    beside = problem.fit(NOMINAL.with_effect("speed-gain", gain=1.05))
    after = problem.fit(beside.model.with_active(formula_effect("loss", "k * v", "v"), (0.0,)))
    hint = Formula("v", "k * v", after, problem.paired_comparison(beside, after), "loss", "")
    selection = replace(found.selection, accepted=("speed-gain",), fit=beside)
    words = {"data": "log.csv", "model": "--model khepera --more b.csv", "shared": "--more b.csv"}
    for accepted, ending in (((), words["model"]), (selection.accepted, "--model EXTENDED.yaml --more b.csv")):
        one = replace(found, formula=hint, terms=(), selection=replace(selection, accepted=accepted))
        (line,) = (line for line in diagnosis_text(one, command=words).split("\n") if "bns add log.csv loss" in line)
        assert line.endswith(f"bns add log.csv loss --term 'k * v' --on v {ending} -o NEW.yaml")
        assert ("(written with -o EXTENDED.yaml)" in line) is bool(accepted)


def test_a_column_whose_name_could_be_a_numbers_is_a_column_in_the_file_too():
    added = formula_effect("twist", "k * (heading - h0)", "w", ("h0",))
    assert [p.name for p in added.parameters] == ["k"]
    entry = "{name: twist, term: k * (heading - h0), on: w, values: {k: -0.1}, basis: guess, reason: a test}"
    (read,) = parse_model(f"base: differential-drive\nwheelbase_m: 0.1\neffects: [{entry}]", "robot").effects
    assert read.by_name == {"k": -0.1}
    assert read.effect.parameters == added.parameters


def test_a_formula_has_a_name_of_its_own(table, tmp_path):
    data = tmp_path / "log.csv"
    write_measurements(table, data)
    with pytest.raises(ModelError, match="motor-lag is the name of a listed effect; give the formula another one"):
        bns.add(data, "motor-lag", "khepera", term="k * v", on="v")


def test_the_names_are_documented():
    page = (Path(__file__).parents[3] / "docs" / "formulas.md").read_text()
    for name in (*VARIABLES, *FUNCTIONS, *ON):
        assert f"`{name}`" in page
    for name in PAST:
        assert f"`{name}(" in page
    for text in VARIABLES.values():
        assert text in page
