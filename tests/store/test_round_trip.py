"""What is written comes back: values, types, order, every run once."""

import pickle
from dataclasses import replace
from datetime import UTC, datetime
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pandas.testing as pdt
import pytest

from bns.errors import StoreError
from bns.spec import RunSpec
from bns.store import RunRecord, Writer, bytes_per_run, connect, finished, load, query, spec_hash
from bns.store.schema import IDENTITY, PARAMETERS, SCHEMAS, read_columns

from .synthetic import columns, failed, make_store, record, records, run_row, specs

FULL = ("evals", "paths", "generations", "probes")


def write(results, runs, **options):
    with Writer(results, "s", **options) as writer:
        for run in runs:
            writer.append(run)


def test_every_recorded_value_comes_back(tmp_path):
    run = record(RunSpec(evaluations=4, record="full"), FULL)
    write(tmp_path, [run])
    for table in FULL:
        back = load(tmp_path, table)
        assert list(back.columns[:4]) == list(IDENTITY)
        for name, values in run.tables[table].items():
            assert sorted(back[name].tolist()) == sorted(np.asarray(values).tolist()), (table, name)
        assert set(back["run_id"]) == {run.spec.run_id}


def test_identity_and_parameters_stand_beside_every_evaluation(tmp_path):
    run = records(1, seed=7, mutation_rate=0.25)[0]
    write(tmp_path, [run])
    row = load(tmp_path).iloc[0]
    assert (row["sweep"], row["task"], row["robot"]) == ("s", run.spec.task, run.spec.robot)
    for name in PARAMETERS:
        assert row[name] == getattr(run.spec, name), name


def test_runs_row_holds_outcome_spec_and_provenance(tmp_path):
    good, bad = records(2)[0], failed(RunSpec(seed=99))
    write(tmp_path, [good, bad])
    runs = load(tmp_path, "runs").set_index("run_id")
    assert runs.loc[good.spec.run_id, "spec"] == good.spec.canonical_json()
    assert runs.loc[good.spec.run_id, "evaluations"] == 3
    assert runs.loc[good.spec.run_id, "started_at"] == datetime(2026, 1, 1, tzinfo=UTC)
    assert pd.isna(runs.loc[good.spec.run_id, "error"])
    broken = runs.loc[bad.spec.run_id, ["status", "error", "evaluations"]]
    assert broken.tolist() == ["failed", "ValueError: no", 0]
    assert runs["versions"].str.contains('"numpy"').all()
    assert len(load(tmp_path)) == 3


def test_order_of_arrival_does_not_show(tmp_path):
    runs = records(7)
    write(tmp_path / "a", runs, fold_at=3)
    write(tmp_path / "b", runs[::-1], fold_at=5)
    pdt.assert_frame_equal(load(tmp_path / "a"), load(tmp_path / "b"))
    order = load(tmp_path / "a")[["run_id", "evaluation"]]
    pdt.assert_frame_equal(order, order.sort_values(["run_id", "evaluation"]))


def test_unknown_truth_values_stay_unknown_and_average(tmp_path):
    run = records(1)[0]
    run.tables["evals"]["success_7cm"] = np.array([True, None, False], dtype=object)
    run.tables["evals"]["success_10cm"] = np.ma.masked_array([True, True, False], [False, True, True])
    write(tmp_path, [run])
    back = load(tmp_path)
    assert back["success_7cm"].tolist() == [True, pd.NA, False]
    assert back["success_7cm"].mean() == 0.5
    assert back["success_10cm"].isna().tolist() == [False, True, True]
    assert back["success"].dtype == bool


def test_columns_and_conditions(tmp_path):
    write(tmp_path, records(15))
    condition = "mutation_rate > 0.1 AND evaluation = 1"
    some = load(tmp_path, columns=["mutation_rate", "evaluation"], where=condition)
    assert list(some.columns) == ["mutation_rate", "evaluation"]
    assert (some["mutation_rate"] > 0.1).all()
    assert len(some) == 6
    named = load(tmp_path, where={"mutation_rate": [0.2, 0.4], "sweep": "s", "evaluation": 1})
    assert named["run_id"].tolist() == load(tmp_path, columns=["run_id"], where=condition)["run_id"].tolist()
    assert load(tmp_path, where={"evaluation": []}).empty
    nowhere = records(1, root_seed=7)[0]
    write(tmp_path, [replace(nowhere, run=nowhere.run | {"world_digest": ""})])
    assert len(load(tmp_path, "runs", where={"world_digest": ""})) == 1
    assert load(tmp_path, "runs", where={"world_digest": []}).empty
    assert load(tmp_path, where={"task": "it's"}).empty


def test_views_are_there_and_empty_before_anything_is_recorded_in_them(tmp_path):
    write(tmp_path, records(1))
    with connect(tmp_path) as connection:
        for table in SCHEMAS:
            names = [row[0] for row in connection.execute(f"DESCRIBE {table}").fetchall()]
            assert names == read_columns(table)
    assert load(tmp_path, "paths").empty
    assert list(load(tmp_path, "paths", columns=["left_units", "right_units"]).columns) == ["left_units", "right_units"]


def test_names_that_look_like_numbers_stay_text(tmp_path):
    write(tmp_path, [record(RunSpec(task="e1", evaluations=1))])
    types = query(tmp_path, "SELECT typeof(sweep) s, typeof(task) t FROM evals")
    assert types.values.tolist() == [["VARCHAR", "VARCHAR"]]


def test_sweep_file_is_kept_once(tmp_path):
    for _ in range(2):
        write(tmp_path, records(2), sweep_text="grid: 1\n", sweep_runs=2)
    kept = load(tmp_path, "specs", columns=["sweep", "spec_hash", "text", "runs"])
    assert kept.values.tolist() == [["s", spec_hash("grid: 1\n"), "grid: 1\n", 2]]
    write(tmp_path, [], sweep_text="grid: 2\n")
    assert len(load(tmp_path, "specs")) == 2


def test_of_two_sweep_files_of_the_same_second_the_later_is_known_as_such(tmp_path, monkeypatch):
    for microsecond, text in ((7, "a: 1\n"), (8, "a: 2\n")):
        now = datetime(2026, 1, 1, 12, 0, 0, microsecond, tzinfo=UTC)
        monkeypatch.setattr("bns.store.write.writer.datetime", SimpleNamespace(now=lambda _, now=now: now))
        with Writer(tmp_path, "s", sweep_text=text):
            pass
    kept = load(tmp_path, "specs", columns=["written_at", "text"]).sort_values("written_at")
    assert kept["text"].tolist() == ["a: 1\n", "a: 2\n"]
    assert kept["written_at"].dt.microsecond.tolist() == [7, 8]


def test_finished_names_every_run_of_one_sweep(tmp_path):
    assert finished(tmp_path / "nothing", "s") == {}
    runs = [*records(2), failed(RunSpec(seed=99), "quarantined")]
    write(tmp_path, runs)
    assert finished(tmp_path, "s") == {run.spec.run_id: run.run["status"] for run in runs}
    assert finished(tmp_path, "other") == {}


def test_record_pickles_small():
    run = records(1, evaluations=100)[0]
    again = pickle.loads(pickle.dumps(run))
    assert again.spec == run.spec
    assert len(pickle.dumps(run)) < 40_000


def test_synthetic_store_reads_like_a_written_one(tmp_path):
    made = make_store(tmp_path, 50, 10, runs_per_file=20)
    assert finished(tmp_path, "synthetic") == {spec.run_id: "ok" for spec in made}
    assert len(load(tmp_path)) == 500
    files = [path for path in tmp_path.rglob("*.parquet") if "synthetic" in str(path)]
    assert bytes_per_run(tmp_path, "synthetic") == sum(path.stat().st_size for path in files) / 50
    assert np.isnan(bytes_per_run(tmp_path, "other"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t["evals"].pop("diversity"), "evals of run r.* has no column diversity; it needs evaluation"),
        (lambda t: t["evals"].update(diversty=np.zeros(3)), "column 'diversty'. Did you mean 'diversity'"),
        (lambda t: t["evals"].update(diversity=np.zeros(2)), "'diversity' has 2 values and '.*' has 3"),
        (lambda t: t["evals"].update(commands=np.full(3, 1.5)), "column 'commands' must be int32"),
        (lambda t: t["evals"].update(success=np.zeros(3)), "column 'success' is float64; it must be bool"),
        (lambda t: t["evals"].update(success=np.array([True, None, True])), "'success' has an empty value"),
        (lambda t: t.update(eval=t["evals"]), "unknown table 'eval'. Did you mean 'evals'"),
    ],
)
def test_columns_that_do_not_fit_are_refused_and_nothing_is_stored(tmp_path, change, message):
    good, bad = (record(spec) for spec in specs(2, 3))
    change(bad.tables)
    with Writer(tmp_path, "s") as writer:
        writer.append(good)
        with pytest.raises(StoreError, match=message):
            writer.append(bad)
    assert list(finished(tmp_path, "s")) == [good.spec.run_id]


@pytest.mark.parametrize(
    ("row", "tables", "message"),
    [
        ({"status": "ok"}, False, "has no 'started_at'"),
        (run_row("okay"), True, "unknown status 'okay'. Did you mean 'ok'"),
        (run_row("ok"), False, "status 'ok' and the tables: none"),
        (run_row("failed"), True, "status 'failed' and the tables: evals"),
        (run_row("ok", wall=1), True, "unknown column 'wall'. Did you mean 'wall_s'"),
    ],
)
def test_outcomes_that_make_no_sense_are_refused(tmp_path, row, tables, message):
    made = {"evals": columns("evals", 1, np.random.default_rng(0))} if tables else {}
    with Writer(tmp_path, "s") as writer, pytest.raises(StoreError, match=message):
        writer.append(RunRecord(RunSpec(), row, made))
