"""A model is judged on the measurements that it was fitted to: every answer says so, and none does on new ones."""

import pytest

import bns
from bns.diagnose.adding import fitted_to
from tests.diagnose.worlds import NOMINAL, hidden, measured

SAID = "was fitted to these very measurements"


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """The log that the model is fitted to, and another one of the same robot."""
    folder = tmp_path_factory.mktemp("logs")
    robot = hidden(motor_lag={"tau_s": 0.12})
    for number, name in enumerate(("known", "new")):
        measured(robot, trials=12, commands=4, seed=number).to_csv(folder / f"{name}.csv", index=False)
    return folder / "known.csv", folder / "new.csv"


@pytest.fixture(scope="module")
def model(logs, tmp_path_factory):
    """The model from its file, as another day reads it."""
    path = tmp_path_factory.mktemp("models") / "extended.yaml"
    return bns.add(logs[0], "motor-lag", bns.Model(NOMINAL)).model.save(path)


def test_every_answer_says_that_the_model_knows_the_trials(logs, model):
    known, new = logs
    seen = bns.compare(known, model)
    assert SAID in seen.notes[0]
    assert "known.csv" in seen.notes[0]
    assert SAID in seen.summary()
    assert SAID in seen.to_json()["notes"][0]
    again = bns.add(known, "wheel-mismatch", model)
    assert SAID in again.warnings[0]
    assert fitted_to(again.extended.model, seen.log.measured.digest)
    assert not bns.compare(new, model).notes
    assert not any(SAID in warning for warning in bns.add(new, "wheel-mismatch", model).warnings)


@pytest.mark.slow
def test_a_diagnosis_says_it_first(logs, model):
    assert SAID in bns.diagnose(logs[0], model).notes[0]
    assert not any(SAID in note for note in bns.diagnose(logs[1], model).notes)


def test_a_model_whose_numbers_were_all_fitted_again_no_longer_knows_the_first_log(logs, model):
    later = bns.add(logs[1], "wheel-mismatch", model).model
    digest = bns.compare(logs[0], NOMINAL).log.measured.digest
    assert not fitted_to(later, digest)


def test_a_model_of_a_drawing_was_fitted_to_nothing(logs):
    assert not bns.compare(logs[0], NOMINAL).notes
