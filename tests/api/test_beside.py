"""Two models on one log that neither was fitted to: does the extended one predict it better, and how sure is that?"""

import json

import numpy as np
import pandas as pd
import pytest

import bns
from bns.cli.main import main
from bns.errors import ModelError
from tests.diagnose.worlds import NOMINAL, hidden, measured

ROBOT = hidden(motor_lag={"tau_s": 0.12})


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "new.csv"
    measured(ROBOT, trials=12, commands=4, seed=5).to_csv(path, index=False)
    return path


@pytest.fixture(scope="module")
def extended():
    return bns.Model(NOMINAL).with_effect("motor-lag", tau_s=0.12)


def test_the_errors_of_both_are_those_that_each_has_alone(log, extended):
    given = bns.Model(NOMINAL)
    both = bns.compare(log, given, beside=extended)
    alone, other = bns.compare(log, given), bns.compare(log, extended)
    assert both.errors.equals(alone.errors)
    rows = both.changes.xs(both.changes.index[0][0])
    np.testing.assert_array_equal(rows.position_m, other.errors.loc[rows.index, "position_m"])
    np.testing.assert_allclose(rows.change_m, rows.position_m - alone.errors.loc[rows.index, "position_m"], atol=1e-12)
    assert both.residual_dependence.equals(alone.residual_dependence)  # what else is said is of the first model
    assert alone.changes.empty


def test_the_change_is_certain_where_the_effect_is_there_and_turns_its_sign(log, extended):
    forth = bns.compare(log, NOMINAL, beside=extended).changes
    back = bns.compare(log, extended, beside=NOMINAL).changes
    near = forth.xs(forth.index[0][0]).loc[["command", "1s"]]  # twelve trials are few for the longer ones
    assert (near.high_m < 0).all()
    np.testing.assert_allclose(back[["change_m", "low_m", "high_m"]], -forth[["change_m", "high_m", "low_m"]], atol=1e-12)


def test_the_interval_is_that_of_a_bootstrap_over_trials(log, extended):
    """Worked out again from the errors of every trial: each of one window of the whole trial."""
    squares = []
    for model in (NOMINAL, extended):
        worst = [bns.compare(one, model).errors.loc["trial", "position_m"] for one in _one_by_one(log)]
        squares.append(np.square(worst))
    rng = np.random.default_rng(1)
    drawn = rng.integers(12, size=(4000, 12))
    before, after = (np.sqrt(s[drawn].mean(axis=1)) for s in squares)
    found = bns.compare(log, NOMINAL, beside=extended).changes.xs("trial", level="horizon").iloc[0]
    np.testing.assert_allclose([found.low_m, found.high_m], np.quantile(after - before, [0.025, 0.975]), atol=5e-4)
    assert found.high_m - found.low_m > 5e-3  # ten times what is tolerated


def _one_by_one(log):
    table = pd.read_csv(log)
    return [table[table.trial == name] for name in table.trial.unique()]


def test_several_have_a_row_each_and_names_of_their_own(log, extended):
    found = bns.compare(log, extended, beside=[NOMINAL, extended])
    names = list(dict.fromkeys(found.changes.index.get_level_values("model")))
    assert names == ["khepera (2)", "khepera (3)"]  # all three are called alike
    assert (found.changes.loc[names[1], ["change_m", "low_m", "high_m"]] == 0).all(axis=None)
    text = found.summary()
    assert text.count("both as they are, on the same windows") == 2
    assert names[1] in text
    kept = json.loads(json.dumps(found.to_json()))["beside"]
    assert [m["name"] for m in kept[1]["trial"]["models"]] == [extended.name, names[1]]


def test_one_that_was_fitted_to_this_log_is_told(log, tmp_path):
    fitted = bns.add(log, "motor-lag", bns.Model(NOMINAL)).model.save(tmp_path / "fitted.yaml")
    assert "The model fitted was fitted to these very measurements" in bns.compare(log, NOMINAL, beside=fitted).notes[0]


@pytest.mark.parametrize(
    ("model", "other", "said"),
    [
        ("khepera", "snake", "wheel speeds and poses"),
        ("khepera", "gone.yaml", "gone.yaml"),
        ("khepera", 3, "given as int"),
        ("khepera", ["snake-networks"], "only models with effects"),
    ],
)
def test_what_cannot_be_compared_is_refused(log, model, other, said):
    with pytest.raises(bns.BnsError, match=said):
        bns.compare(log, model, beside=other)


def test_the_command_says_the_same(log, extended, tmp_path, capsys):
    file = str(extended.save(tmp_path / "extended.yaml"))
    found = bns.compare(log, bns.Model(wheelbase_m=NOMINAL.wheelbase_m), beside=file)
    asked = ["compare", str(log), "--model", "differential-drive", "--wheelbase", str(NOMINAL.wheelbase_m)]
    assert main([*asked, "--beside", file, "--beside", "differential-drive", "--json"]) == 0
    first, second = json.loads(capsys.readouterr().out)["beside"]
    told = {horizon: [e["models"][1]["position_rms_m"], e["changes"][0]["change_m"]] for horizon, e in first.items()}
    assert told == {horizon: [row.position_m, row.change_m] for (_, horizon), row in found.changes.iterrows()}
    assert second["1s"]["changes"][0]["change_m"] == 0  # the wheelbase is that of both


@pytest.mark.parametrize("alike", [True, False])
def test_another_body_is_simulated_as_itself(tmp_path, monkeypatch, alike):
    """On the stretches that the first one counts, where the two differ in those that can be foreseen, too."""
    from bns.diagnose.predict import jointed  # MuJoCo is slow to load
    from tests.jointed.arm import log as moved_arm
    from tests.jointed.arm import xml

    for name, stiffness in (("arm", 6.0), ("soft", 3.0)):
        (tmp_path / f"{name}.xml").write_text(xml(stiffness))
    arm, soft, data = bns.Model(tmp_path / "arm.xml"), bns.Model(tmp_path / "soft.xml"), moved_arm(3)
    alone, other = bns.compare(data, arm, fresh=True), bns.compare(data, soft, fresh=True)
    if not alike:
        far = jointed._far_m
        counts = iter([1, 5])  # stretches at the end that are wild: of the first body, of the other one

        def some_wild(simulations, bare):
            found = far(simulations, bare)
            wild = next(counts, 0)
            return np.where(np.arange(len(found)) < len(found) - wild, found, 9.0)

        monkeypatch.setattr(jointed, "_far_m", some_wild)
    both = bns.compare(data, arm, beside=soft, fresh=True)
    there = int(alone.errors.loc["stretch", "windows"])
    assert both.errors.loc["stretch", "windows"] == (there if alike else there - 1)
    row = both.changes.iloc[0]
    if alike:
        assert row.position_m == pytest.approx(other.errors.loc["stretch", "position_m"], rel=1e-12)
    assert row.position_m > 1.2 * both.errors.loc["stretch", "position_m"]


def test_another_body_is_seen_at_the_same_sites(tmp_path):
    from tests.jointed.arm import log as moved_arm
    from tests.jointed.arm import xml

    (tmp_path / "arm.xml").write_text(xml())
    (tmp_path / "half.xml").write_text(xml().replace('<site name="elbow" pos="0 0 0"/>', ""))
    with pytest.raises(ModelError, match=r"half is seen at the sites hand, .* at elbow, hand\. Give both models the same sites"):
        bns.compare(moved_arm(3), bns.Model(tmp_path / "arm.xml"), beside=bns.Model(tmp_path / "half.xml"))
