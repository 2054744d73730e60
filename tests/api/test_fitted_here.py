"""A model is judged on the measurements that it was fitted to: every answer says so, and none does on new ones."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
import yaml

import bns
from bns.diagnose.adding import fitted_to
from bns.diagnose.report.page import _origin
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, hidden, measured

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
    known, new = (bns.diagnose(log, model, without_effects=all_but_rivals_of("motor-lag")) for log in logs)
    assert SAID in known.notes[0]
    assert not any(SAID in note for note in new.notes)


def test_a_model_whose_numbers_were_all_fitted_again_no_longer_knows_the_first_log(logs, model):
    later = bns.add(logs[1], "wheel-mismatch", model).model
    digest = bns.compare(logs[0], NOMINAL).log.measured.digest
    assert not fitted_to(later, digest)


def test_a_model_of_a_drawing_was_fitted_to_nothing(logs):
    assert not bns.compare(logs[0], NOMINAL).notes


def test_of_several_logs_each_one_alone_is_known(logs, model, tmp_path):
    both = bns.add(logs, "motor-lag", bns.Model(NOMINAL))
    path = both.model.save(tmp_path / "both.yaml")
    made_of = yaml.safe_load(path.read_text())
    assert "24 trials of known.csv, new.csv" in made_of["effects"][0]["reason"]
    told = made_of["provenance"]
    digests = [bns.Measurements(log).measured.digest for log in logs]
    assert told["logs"] == [{"data": log.name, "data_sha256": d} for log, d in zip(logs, digests, strict=True)]
    assert told["data"] == "known.csv, new.csv"
    for log in logs:
        assert f"{SAID} ({log.name})" in bns.compare(log, path).notes[0]
        assert f"{SAID} ({log.name})" in bns.compare(log, NOMINAL, beside=path).notes[0]
    assert f"{SAID} (known.csv, new.csv)" in bns.compare(logs, path).notes[0]
    assert f"{SAID} (known.csv, new.csv)" in bns.compare(bns.Measurements(list(logs)).checked_again(), path).notes[0]
    assert "was fitted to some of these very measurements (known.csv)" in bns.compare(logs, model).notes[0]


def test_of_rows_of_several_logs_the_names_stay(logs):
    fewer = bns.Measurements(list(logs)).without("0")
    assert fewer.measured.files == (("known.csv", ""), ("new.csv", ""))
    assert "23 trials of known.csv, new.csv" in bns.add(fewer, "motor-lag", NOMINAL).model.effects[0].reason


def test_the_report_names_all_logs(logs):
    both = bns.Measurements(list(logs)).measured
    (known, first), (new, second) = both.files
    told = _origin(SimpleNamespace(measured=both, model=NOMINAL))
    assert f"Data {known}, SHA-256 {first}…; {new}, SHA-256 {second}…; together SHA-256 {both.digest}…; model" in told
    alone = bns.Measurements(logs[0]).measured
    assert f"Data known.csv, SHA-256 {first}…; model" in _origin(SimpleNamespace(measured=alone, model=NOMINAL))


def test_files_of_old_models_and_odd_ones_are_read(logs, model):
    told = yaml.safe_load(model.read_text())["provenance"]
    assert "logs" not in told  # of one file, as it always was
    for odd in ("known.csv", [1, {"data": "known.csv"}], None):
        assert not fitted_to(replace(NOMINAL, provenance={"logs": odd}), told["data_sha256"])
    assert not fitted_to(NOMINAL, "")
