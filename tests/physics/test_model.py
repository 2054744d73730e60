"""Model files, and models changed one effect at a time."""

import pickle
from dataclasses import replace
from importlib import resources

import pytest

from bns.errors import ModelError
from bns.physics.effects import effect_named
from bns.physics.model import Model, load_model, model_names

TEXT = """
base: differential-drive
wheelbase_m: 0.1
noise: {position_m: 0.001, heading_rad: 0.01, basis: guess, reason: a test}
effects:
  - {name: motor-lag, values: {tau_s: 0.1}, basis: guess, reason: a test}
"""


def loaded(tmp_path, text):
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    return load_model(path)


def test_file_becomes_model(tmp_path):
    model = loaded(tmp_path, TEXT)
    assert (model.name, model.base, model.wheelbase_m) == ("robot", "differential-drive", 0.1)
    assert (model.jitter_relative, model.noise_position_m, model.noise_heading_rad) == (0.0, 0.001, 0.01)
    assert model.values_of("motor-lag") == {"tau_s": 0.1}
    assert model.effects[0].reason == "a test"
    assert model.values_of("speed-gain") == {"gain": 1.0}


@pytest.mark.parametrize("name", model_names())
def test_shipped_models_are_plausible_and_say_why(name):
    model = load_model(name)
    assert bool(model.effects) == name.endswith("-world"), "drawings have no effects, worlds have"
    for active in model.effects:
        assert active.reason
        for parameter, value in zip(active.effect.parameters, active.values, strict=True):
            assert parameter.plausible[0] <= value <= parameter.plausible[1]
            assert value != parameter.neutral


def test_khepera_is_shipped_inside_the_package():
    assert {"khepera", "khepera-world"} <= set(model_names())
    assert (resources.files("bns.physics") / "khepera.yaml").is_file()
    assert load_model("khepera").wheelbase_m == load_model("khepera-world").wheelbase_m == 0.0884


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("wheelbase_m", "wheelbas_m", r"unknown key 'wheelbas_m'\. Did you mean 'wheelbase_m'\?"),
        ("motor-lag", "motorlag", r"unknown effect 'motorlag'\. Did you mean 'motor-lag'\?"),
        ("tau_s", "tau", r"unknown key 'tau'\. Did you mean 'tau_s'\?"),
        ("tau_s: 0.1", "tau_s: -0.1", r"motor-lag: tau_s is -0.1; it must be a number from 0 to 5"),
        ("tau_s: 0.1", "tau_s: '1e-1'", r"tau_s is '1e-1'.*exponent with a point"),
        ("{tau_s: 0.1}", "{}", r"motor-lag lacks tau_s"),
        ("wheelbase_m: 0.1", "wheelbase_m: 0", r"wheelbase_m is 0; it must be a number from 0.001 to 10"),
        ("differential-drive", "snake", r"unknown base 'snake'"),
        ("{tau_s: 0.1}, basis: guess", "{tau_s: 0.1}, basis: hope", r"unknown basis 'hope'.*guess"),
        ("0.1}, basis: guess, reason: a test", "0.1}, basis: guess, reason: ''", r"reason is ''; write down why"),
        ("0.1}, basis: guess, reason: a test", "0.1}, basis: guess", r"lacks reason"),
        ("position_m: 0.001, ", "", r"noise of model robot lacks position_m"),
        ("effects:\n  - {name", "effects:\n    {name", r"effects is \{.*must be a list"),
        ("base: differential-drive\n", "base: [\n", r"model robot, line .*: no valid YAML"),
    ],
)
def test_faults_in_a_file_are_named(tmp_path, old, new, message):
    assert old in TEXT
    with pytest.raises(ModelError, match=message):
        loaded(tmp_path, TEXT.replace(old, new))


def test_the_same_effect_twice_is_refused(tmp_path):
    with pytest.raises(ModelError, match="has the effect 'motor-lag' twice"):
        loaded(tmp_path, TEXT + TEXT.splitlines()[-1] + "\n")


def test_no_such_model(tmp_path):
    with pytest.raises(ModelError, match=r"robot model 'kepera'\. Did you mean 'khepera'\?.*path of a YAML"):
        load_model("kepera")
    with pytest.raises(ModelError, match=r"no model file .*gone\.yaml.*khepera"):
        load_model(tmp_path / "gone.yaml")
    with pytest.raises(ModelError, match=r"'snak'\. Did you mean 'snake'\?.*differential-drive.*--wheelbase METRES"):
        load_model("snak")


def test_a_log_in_the_place_of_a_model_is_called_one(tmp_path):
    (tmp_path / "log.csv").write_text("trial,t_s\n")
    with pytest.raises(ModelError, match=r"log\.csv is no model: .*bns diagnose LOG --model MODEL"):
        load_model(tmp_path / "log.csv")


def test_a_name_that_does_not_exist_is_said_before_the_keys_that_are_missing(tmp_path):
    entry = "effects:\n  - {name: motor-lagg, values: {tau_s: 0.1}}\n"
    with pytest.raises(ModelError, match=r"'motor-lagg'\. Did you mean 'motor-lag'"):
        loaded(tmp_path, "base: differential-drive\nwheelbase_m: 0.1\n" + entry)
    with pytest.raises(ModelError, match="lacks basis, reason"):
        loaded(tmp_path, "base: differential-drive\nwheelbase_m: 0.1\n" + entry.replace("lagg", "lag"))


def test_effects_switch_on_and_off_in_place():
    model = Model(wheelbase_m=0.1).with_effect("motor-lag", tau_s=0.1).with_effect("speed-gain", gain=1.1)
    changed = model.with_effect("motor-lag", tau_s=0.2)
    assert [a.effect.name for a in changed.effects] == ["motor-lag", "speed-gain"]
    assert changed.values_of("motor-lag") == {"tau_s": 0.2}
    assert [a.effect.name for a in changed.without("motor-lag").effects] == ["speed-gain"]
    with pytest.raises(ModelError, match="Did you mean 'motor-lag'"):
        model.without("motor-lagg")


def test_digest_follows_the_revision_of_an_effect():
    """Where the same values give other numbers than before, results of both must not pass for the same."""
    model = Model(wheelbase_m=0.1).with_effect("motor-lag", tau_s=0.1)
    assert "revisions" not in model.canonical_json()
    (lag,) = model.effects
    revised = replace(model, effects=(replace(lag, effect=replace(lag.effect, revision=2)),))
    assert revised.digest != model.digest


def test_digest_follows_numbers_and_not_words(tmp_path):
    model = loaded(tmp_path, TEXT)
    assert model.digest == loaded(tmp_path, TEXT.replace("a test", "another reason")).digest
    assert model.digest != loaded(tmp_path, TEXT.replace("tau_s: 0.1", "tau_s: 0.11")).digest
    assert model.digest != loaded(tmp_path, TEXT.replace("heading_rad: 0.01", "heading_rad: 0.02")).digest
    assert pickle.loads(pickle.dumps(model)) == model
    assert " at 0x" not in repr(model)


@pytest.mark.parametrize(("old", "new"), [("k * v * abs(w)", "k * v * w"), ("on: v", "on: w")])
def test_digest_follows_the_text_of_a_formula_and_what_it_acts_on(tmp_path, old, new):
    entry = "  - {name: rub, term: k * v * abs(w), on: v, values: {k: 0.1}, basis: guess, reason: a test}\n"
    rub = loaded(tmp_path, TEXT + entry)
    other = loaded(tmp_path, TEXT + entry.replace(old, new))
    assert rub.values_of("rub") == other.values_of("rub")
    assert rub.digest != other.digest


@pytest.mark.parametrize("value", [-0.1, 6.0, float("nan"), 1])
def test_no_way_to_other_values_leads_out_of_bounds(value):
    model = Model(0.1).with_effect("motor-lag", tau_s=0.1)
    for other in (
        lambda: model.with_values({"motor-lag": {"tau_s": value}}),
        lambda: model.with_active(effect_named("motor-lag"), (value,)),
    ):
        if value == 1:
            assert other().values_of("motor-lag") == {"tau_s": 1.0}
        else:
            with pytest.raises(ModelError, match=r"motor-lag: tau_s is .*; it must be a number from 0 to 5"):
                other()


def test_a_model_at_its_own_values_keeps_its_effects():
    model = Model(0.1).with_effect("motor-lag", tau_s=0.1)
    same = model.with_values({"motor-lag": {"tau_s": 0.1}})
    assert same == model
    assert same.effects[0] is model.effects[0]
    moved = model.with_values({"motor-lag": {"tau_s": 0.2}})
    assert moved.values_of("motor-lag") == {"tau_s": 0.2}
    assert model.values_of("motor-lag") == {"tau_s": 0.1}


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("yaw-bias", {"rate_rad_s": 0.1}),
        ("floor-slope", {"x_m_s": 0.01, "y_m_s": 0.0}),
        ("tether-pull", {"pull_per_s": 0.1, "anchor_x_m": 0.0, "anchor_y_m": 0.0}),
    ],
)
def test_what_acts_while_the_robot_moves_had_other_numbers_beside_late_wheels_once(name, values):
    """So runs in worlds with it are not taken for those of today."""
    assert f'"revisions":{{"{name}":2}}' in Model(0.1).with_effect(name, **values).canonical_json()
