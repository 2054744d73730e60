"""The commands as a user types them: models that come back, figures, refusals with exit code 2."""

import json
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import bns
from bns.cli.commands.diagnose import _why_not
from bns.cli.main import main
from bns.measurements import write_measurements
from bns.physics.formula import formula_effect
from bns.physics.model import load_model
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, hidden, measured

ONLY_RIVALS = [word for name in all_but_rivals_of("turn-slip") for word in ("--without-effect", name)]
"""For what is asked of a diagnosis besides its verdict."""
WARMING = NOMINAL.with_active(formula_effect("rough", "k * exp(-tau / 2)", "share"), (-0.15,))


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    path = tmp_path_factory.mktemp("measured") / "m.parquet"
    write_measurements(measured(hidden(turn_slip={"slip_s": 0.12}), trials=12, seed=2), path)
    return path


def test_compare_says_how_far_and_where(data, tmp_path, capsys):
    assert main(["compare", str(data), "--model", "khepera", "--json", "--figures", str(tmp_path)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["trials"] == 12
    assert answer["error"]["command"]["position_m"] > answer["error"]["command"]["noise_floor_m"]
    assert len(answer["worst"]) == 5
    assert (tmp_path / "comparison.png").stat().st_size > 10_000


def test_a_trial_takes_no_part(data, capsys):
    left_out = ["--without", "3", "--without", "5"]
    assert main(["compare", str(data), "--model", "khepera", "--json", *left_out]) == 0
    fewer = bns.compare(bns.Measurements(data).without(["3", "5"]), "khepera").to_json()
    assert json.loads(capsys.readouterr().out)["error"] == json.loads(json.dumps(fewer["error"]))
    assert main(["compare", str(data), "--model", "khepera", "--without", "nobody"]) == 2
    assert "There is no trial nobody; there are 0, 1," in capsys.readouterr().err


def test_added_effects_lower_the_error_and_the_model_comes_back(data, tmp_path, capsys):
    new = tmp_path / "new.yaml"
    assert main(["add", "turn-slip", "--model", "khepera", "--data", str(data), "-o", str(new)]) == 0
    out = capsys.readouterr().out
    assert "as given" in out
    assert "+ turn-slip" in out
    model = load_model(new)
    low, high = model.effects[0].intervals["slip_s"]
    assert low < 0.12 < high
    errors = model.provenance["held_out_position_error_m"]
    assert errors["turn-slip"]["command"] < errors["as given"]["command"]
    assert model.effects[0].basis == "fitted"
    assert main(["add", "turn-slip", "--model", str(new), "--data", str(data), "-o", str(tmp_path / "x.yaml")]) == 2
    assert "already has turn-slip" in capsys.readouterr().err


@pytest.mark.slow
def test_a_diagnosis_writes_the_model_that_it_found_and_says_how(data, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("BNS_CACHE", str(tmp_path / "cache"))  # as a user's: what is asked twice is computed once
    new, added = tmp_path / "found.yaml", tmp_path / "added.yaml"
    words = ["diagnose", str(data), "--model", "khepera", *ONLY_RIVALS]
    assert main(words) == 0
    assert capsys.readouterr().out.endswith(f"bns diagnose {data} --model khepera {' '.join(ONLY_RIVALS)} -o extended.yaml\n")
    assert main([*words, "-o", str(new)]) == 0
    assert f"written to {new}; the old model is unchanged (khepera)" in capsys.readouterr().out
    assert main(["add", str(data), "turn-slip", "--model", "khepera", "-o", str(added)]) == 0
    assert bns.Model(new) == bns.Model(added) != bns.Model("khepera")
    assert hash(bns.Model(new)) == hash(bns.Model(added))
    model = load_model(new)
    assert model.effects[0].intervals["slip_s"][0] < 0.12 < model.effects[0].intervals["slip_s"][1]
    errors = model.provenance["held_out_position_error_m"]
    assert errors["with the effects"]["command"] < errors["as given"]["command"]
    capsys.readouterr()
    assert main(["diagnose", str(data), "--model", str(new), "-o", str(tmp_path / "more.yaml"), *ONLY_RIVALS]) == 0
    assert "Nothing was found to add, so" in capsys.readouterr().out
    assert not (tmp_path / "more.yaml").exists()
    refitted = bns.diagnose(data, new, without_effects=ONLY_RIVALS[1::2])
    assert refitted.model.values_of("turn-slip")["slip_s"] == refitted.parameters.set_index("parameter").value["slip_s"]
    own = tmp_path / "own.yaml"
    bns.Model("khepera").save(own)
    assert main(["diagnose", str(data), "--model", str(own), "-o", str(own), *ONLY_RIVALS]) == 0
    assert f"written to {own}; in the place of the model as given" in capsys.readouterr().out
    assert main([*words, "-o", str(tmp_path / "model.txt")]) == 2
    assert "must end in .yaml" in capsys.readouterr().err


@pytest.mark.slow
def test_a_diagnosis_writes_terms_that_lower_the_error_where_no_effect_is_listed(tmp_path, capsys):
    log, new = tmp_path / "warming.parquet", tmp_path / "found.yaml"
    write_measurements(measured(WARMING, trials=24, seed=3), log)
    words = ["diagnose", str(log), "--model", "khepera", "--without-effect", "warm-up", *ONLY_RIVALS, "-o", str(new)]
    assert main(words) == 0
    assert "added to share: " in capsys.readouterr().out
    before, after = (bns.compare(log, model).errors.position_m["trial"] for model in ("khepera", new))
    assert after < 0.6 * before


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"left_m_s": 0.0, "right_m_s": 0.0}, "are 0, but the robot moves"),
        ({"left_m_s": np.nan}, "left_m_s is empty in all rows"),
        ({"left_m_s": np.nan, "right_m_s": np.nan}, "left_m_s and right_m_s are empty in all rows"),
    ],
)
@pytest.mark.parametrize("command", ["compare", "diagnose"])
def test_commands_that_are_never_in_force_are_refused(data, tmp_path, told, message, command, capsys):
    write_measurements(pd.read_parquet(data).assign(**told), tmp_path / "none.parquet")
    assert main([command, str(tmp_path / "none.parquet"), "--model", "khepera"]) == 2
    assert message in capsys.readouterr().err


def test_a_formula_is_added_and_comes_back(data, tmp_path):
    new = tmp_path / "formula.yaml"
    arguments = ["add", "mine", "--term", "k * v * abs(w)", "--on", "v", "--model", "khepera"]
    assert main([*arguments, "--data", str(data), "-o", str(new)]) == 0
    model = load_model(new)
    assert model.effects[0].written == {"term": "k * v * abs(w)", "on": "v"}
    assert model.values_of("mine")["k"] == pytest.approx(-0.12, abs=0.03)


def test_listed_effects_and_a_formula_are_added_together(data, tmp_path, capsys):
    new, told = tmp_path / "both.yaml", ["--term", "k * v * abs(w)", "--model", "khepera", "--data", str(data)]
    assert main(["add", "speed-gain", "mine", *told, "-o", str(new)]) == 0
    written = {active.effect.name: active.written for active in load_model(new).effects}
    assert written == {"speed-gain": {}, "mine": {"term": "k * v * abs(w)", "on": "v"}}
    capsys.readouterr()
    for names in (["speed-gain", "motor-lag"], ["mine", "yours"]):
        assert main(["add", *names, *told, "-o", str(new)]) == 2
        assert f"one name of its own, beside any names of listed effects; given are {', '.join(names)}" in capsys.readouterr().err


@pytest.mark.slow
def test_an_effect_of_ones_own_is_a_file(data, tmp_path, capsys):
    mine = tmp_path / "drag.py"
    mine.write_text(
        "from dataclasses import replace\nfrom bns.physics.effect import Effect, Parameter\n"
        "def apply(body, k):\n    return replace(body, forward_m_s=body.forward_m_s * (1 - k * abs(body.yaw_rad_s)))\n"
        "EFFECT = Effect('my-drag', 'body', (Parameter('k', 's', -1.0, 1.0, (-0.5, 0.5), 0.0, 'drag'),), 'v(1-k|w|)', "
        "'arcs too short', (), apply)\n"
    )
    new = tmp_path / "own.yaml"
    assert main(["add", str(mine), "--model", "khepera", "--data", str(data), "-o", str(new)]) == 0
    assert load_model(new).values_of("my-drag")["k"] == pytest.approx(0.12, abs=0.03)
    capsys.readouterr()
    assert main(["diagnose", str(data), "--model", "khepera", "--json", "--also", str(mine)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {"my-drag", "turn-slip"} <= {entry["name"] for entry in answer["ranking"]}
    assert answer["ties"] == [["my-drag", "turn-slip"]]
    alone = ["diagnose", str(data), "--model", "khepera", "--also", str(mine), "--without-effect", "turn-slip"]
    assert main([*alone, "-o", str(tmp_path / "found.yaml")]) == 0
    assert load_model(tmp_path / "found.yaml").values_of("my-drag")["k"] == pytest.approx(0.12, abs=0.03)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--model", "kepera"], "Did you mean 'khepera'"),
        (["--model", "differential-drive"], "needs its wheelbase: --wheelbase METRES"),
        (["--model", "differential-drive", "--wheelbase", "0.3"], r"A wheelbase of about 0.0\d+ m would fit"),
        (["--model", "gone.yaml"], "no model file gone.yaml"),
    ],
)
def test_models_that_do_not_fit_are_refused(data, arguments, message, capsys):
    import re

    assert main(["diagnose", str(data), *arguments]) == 2
    assert re.search(message, capsys.readouterr().err)


@pytest.mark.parametrize(
    ("term", "message"),
    [
        ("k * v *", "is no formula"),
        ("k * exec(v)", "unknown function 'exec'"),
        ("k * v.real", "is not allowed"),
        ("v * w", "has no number to fit"),
        ("k / w", "a pole"),
        ("k * log(v - 1)", "a pole, a root or logarithm"),
    ],
)
def test_formulas_that_cannot_be_are_refused(data, tmp_path, term, message, capsys):
    new = tmp_path / "new.yaml"
    assert main(["add", "mine", "--term", term, "--model", "khepera", "--data", str(data), "-o", str(new)]) == 2
    assert message in capsys.readouterr().err
    assert not new.exists()


def test_data_that_cannot_be_read_are_refused(tmp_path, capsys):
    assert main(["compare", str(tmp_path / "gone.csv"), "--model", "khepera"]) == 2
    (tmp_path / "bad.parquet").write_text("no parquet")
    assert main(["compare", str(tmp_path / "bad.parquet"), "--model", "khepera"]) == 2
    table = measured(NOMINAL, trials=2).assign(robot=lambda t: t.trial.map({0: "ada", 1: "bob"}))
    write_measurements(table, tmp_path / "two.csv")
    assert main(["compare", str(tmp_path / "two.csv"), "--model", "khepera"]) == 2
    err = capsys.readouterr().err
    assert "There is no file" in err
    assert "does not read as parquet" in err
    assert "of 2 robots: ada, bob. Choose one with --robot ada" in err
    assert pd.read_csv(tmp_path / "two.csv")["robot"].nunique() == 2


def test_a_run_leaves_measurements_that_its_own_networks_are_held_against(tmp_path, capsys):
    """From a run in the physics world to a comparison of its networks and of the drawing with it."""
    table, nets = tmp_path / "run.parquet", tmp_path / "nets.safetensors"
    small = ["--population-size", "20", "--evaluations", "12", "--generations-per-evaluation", "2"]
    run = ["run", "--world", "physics", *small, "--results", str(tmp_path / "r")]
    assert main([*run, "--measurements", str(table), "--save-snn", str(nets)]) == 0
    assert pd.read_parquet(table)["trial"].nunique() == 12
    capsys.readouterr()
    assert main(["compare", str(table), "--model", str(nets), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["trials"] == 12
    ends = len(pd.read_parquet(table)) - 12
    # a command that repeats the one before cannot be told from a longer one
    assert 0.7 * ends <= answer["error"]["command"]["windows"] <= ends
    assert main(["diagnose", str(table), "--model", str(nets)]) == 2
    assert "can be compared, not diagnosed" in capsys.readouterr().err


def test_a_table_that_could_not_be_written_is_refused_before_the_run(tmp_path, capsys):
    assert main(["run", "--measurements", str(tmp_path / "gone" / "m.csv"), "--results", str(tmp_path / "r")]) == 2
    assert f"there is no folder {tmp_path / 'gone'}" in capsys.readouterr().err
    assert not (tmp_path / "r").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.groupby("trial").head(1), "m.csv: no trial has two tracked poses"),
        (lambda t: t.assign(x_m=0.1, y_m=0.1, heading_rad=0.0), "hardly moves although it is commanded to"),
        (lambda t: t.assign(robot="snake"), "are of the robot snake, but the model khepera is of khepera"),
    ],
)
def test_comparisons_that_make_no_sense_are_refused(tmp_path, change, message, capsys):
    write_measurements(change(measured(NOMINAL, trials=10)), tmp_path / "m.csv")
    assert main(["compare", str(tmp_path / "m.csv"), "--model", "khepera"]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("command", ["compare", "diagnose", "add", "propose", "report", "explore"])
def test_a_log_of_one_pose_is_refused_by_every_command(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    if command == "explore":
        pytest.importorskip("panel", reason="the extra app (Panel) is not installed")
    write_measurements(measured(NOMINAL, trials=1).head(1), tmp_path / "one.csv")
    more = {"add": ["motor-lag", "-o", "new.yaml"], "explore": ["--no-browser"]}.get(command, [])
    assert main([command, "one.csv", *more, "--model", "khepera"]) == 2
    said = capsys.readouterr().err
    assert "one.csv: no trial has two tracked poses, and a displacement needs two" in said
    assert "the log holds 1 trial with 1 tracked pose. Log the pose before and after commands" in said
    assert not (tmp_path / "new.yaml").exists()


@pytest.mark.parametrize(
    ("verdict", "fell", "said"),
    [
        ("unlisted", ("trial",), "What was found lowers some errors and raises others (see the notes)"),
        ("unlisted", (), "Nothing that was found lowers the error"),
        ("unlisted", None, "Nothing that was found lowers the error"),
        ("none", ("trial",), "Nothing was found to add"),
    ],
)
def test_why_no_model_is_written_is_said(verdict, fell, said):
    with_terms = None if fell is None else SimpleNamespace(fell_in_the_end=fell)
    found = SimpleNamespace(verdict=verdict, diagnosis=SimpleNamespace(errors_with_terms=with_terms))
    assert _why_not(found) == said
