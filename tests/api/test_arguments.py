"""Arguments of another type than is meant are answered in a sentence, before anything is computed."""

from pathlib import Path

import pandas as pd
import pytest

import bns
from bns.api.common.arguments import several
from tests.diagnose.worlds import NOMINAL, measured


@pytest.fixture(scope="module")
def table():
    return measured(NOMINAL, trials=3)


@pytest.mark.parametrize(
    ("call", "error", "said"),
    [
        (lambda t: bns.compare(t, None), bns.ModelError, "The model is given as NoneType"),
        (lambda t: bns.compare("khepera", t), bns.ModelError, "given as DataFrame.*Measurements come first"),
        (lambda _: bns.Model(3), bns.ModelError, "given as int"),
        (lambda t: bns.add(t, 3, "khepera"), bns.ModelError, "effects has 3"),
        (lambda t: bns.add(t, ["motor-lag", 3], "khepera"), bns.ModelError, "effects has 3"),
        (lambda t: bns.diagnose(t, "khepera", also=3), bns.ModelError, "also has 3"),
        (lambda t: bns.diagnose(t, "khepera", without_effects=3), bns.ModelError, "without_effects has 3"),
        (lambda t: bns.propose(t, "khepera", minutes="3"), bns.DataError, "minutes is '3'"),
        (lambda t: bns.report(t, "khepera", None), bns.DataError, "given as NoneType; give its path"),
        *(
            (lambda t, name=name: getattr(bns, name)(t, "khepera", progress=3), bns.DataError, "progress is 3; give a function")
            for name in ("compare", "diagnose", "propose")
        ),
        (lambda t: bns.add(t, "motor-lag", "khepera", progress=3), bns.DataError, "progress is 3"),
        (lambda t: bns.Measurements(t).without(99), bns.DataError, "There is no trial 99; there are 0, 1, 2"),
    ],
)
def test_another_type_is_an_error_of_the_package(table, call, error, said):
    with pytest.raises(error, match=said):
        call(table)


def test_an_experiment_does_not_replace_the_log_it_comes_from(table, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table.to_csv("log.csv", index=False)
    assert bns.Measurements("log.csv").files == (Path("log.csv"), Path("log.csv.import.yaml"))
    assert bns.Measurements(bns.Measurements(table)).files == ()
    read = bns.Measurements("log.csv", mapping={"columns": {name: {"from": name} for name in table}})
    assert read.files == (Path("log.csv"),)


def test_one_name_is_as_good_as_several(table):
    assert several("also", "a.py") == several("also", ["a.py"]) == ("a.py",)
    kept = bns.Measurements(table).without("1")
    assert len(kept) == len(bns.Measurements(table).without(1)) == 2
    assert isinstance(kept.frame, pd.DataFrame)
