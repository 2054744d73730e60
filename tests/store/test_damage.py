"""Files that are truncated, foreign, missing, doubled or of another version."""

import json
import os
import shutil
import time
import warnings
from pathlib import Path

import pandas.testing as pdt
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bns.errors import StoreError
from bns.store import StoreWarning, Writer, compact, connect, finished, load, query
from bns.store.schema import SCHEMA_VERSION

from .synthetic import failed, record, records

OLD_KEYS = ("schema_version", "table", "sweep", "spec_hash", "git_sha", "git_clean", "bns_version")


@pytest.fixture
def store(tmp_path):
    """Two folds of three runs each."""
    runs = records(6)
    with Writer(tmp_path, "s", fold_at=3) as writer:
        for run in runs:
            writer.append(run)
    assert len(files(tmp_path, "evals")) == len(files(tmp_path, "runs")) == 2
    return tmp_path


def files(results, table):
    return sorted((results / table).rglob("*.parquet"))


def ids_in(path):
    return set(pq.read_table(path, columns=["run_id"], partitioning=None)["run_id"].to_pylist())


@pytest.mark.parametrize(
    "content",
    [
        lambda data: data[: len(data) // 2],
        lambda data: b"",
        lambda data: b"PAR1" + bytes(50) + b"PAR1",
        lambda data: data[:-100] + bytes(100),
    ],
)
def test_truncated_file_is_skipped_with_one_warning_and_set_aside(store, content):
    first, second = files(store, "evals")
    lost, data = ids_in(first), content(first.read_bytes())
    first.write_bytes(data)
    with pytest.warns(StoreWarning, match=first.name) as caught:
        assert set(load(store)["run_id"]) == ids_in(second)
    assert len(caught) == 1
    with pytest.warns(StoreWarning, match="is skipped: it is (truncated|damaged)"):
        assert set(finished(store, "s")) == ids_in(second)
    summary = compact(store)
    assert [path.read_bytes() for path in summary.set_aside] == [data]
    assert str(summary.set_aside[0]).startswith(str(store / "set-aside" / "evals"))
    with pytest.warns(StoreWarning, match=f"{first.name}: gone, .* 3 runs do not count as finished: sweep s does them"):
        assert set(finished(store, "s")).isdisjoint(lost)
    with pytest.warns(StoreWarning, match="gone"):
        assert set(load(store)["run_id"]) == ids_in(second)


def garbled(path):
    path.write_bytes(path.read_bytes()[:-100] + bytes(100))


def one_bit_off(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 1
    path.write_bytes(bytes(data))


@pytest.mark.filterwarnings("ignore::bns.store.StoreWarning")
@pytest.mark.parametrize("harm", [garbled, one_bit_off, Path.unlink])
def test_runs_whose_evaluations_are_damaged_say_so_until_they_are_repeated(store, harm):
    with Writer(store, "s") as writer:
        writer.append(failed(records(7)[6].spec))
    first, second = files(store, "evals")
    lost, kept = ids_in(first), ids_in(second)
    harm(first)
    runs = load(store, "runs").set_index("run_id")["status"]
    assert set(runs[list(lost)]) == {"damaged"}
    assert set(runs[list(kept)]) == {"ok"}
    assert runs.drop([*lost, *kept]).tolist() == ["failed"]
    counted = query(store, "SELECT status, count(*) AS n FROM runs GROUP BY status ORDER BY status")
    assert counted.values.tolist() == [["damaged", 3], ["failed", 1], ["ok", 3]]
    assert not lost & set(finished(store, "s"))
    compact(store)
    assert set(load(store, "runs", where={"status": "damaged"})["run_id"]) == lost
    with Writer(store, "s") as writer:
        for run in (run for run in records(6) if run.spec.run_id in lost):
            writer.append(run)
    assert set(load(store, "runs", where="run_id IN (SELECT run_id FROM evals)")["status"]) == {"ok"}


def test_foreign_files_are_skipped_and_set_aside(store):
    before = load(store)
    folder = files(store, "evals")[0].parent
    pq.write_table(pa.table({"x": [1]}), folder / "a.parquet")
    pq.write_table(pa.table({"x": [1]}), store / "evals" / "stray.parquet")
    shutil.copy(files(store, "runs")[0], folder / "part-jwrong-0.parquet")
    (store / "evals" / "notes.txt").write_text("not ours, not parquet, left alone")
    with pytest.warns(StoreWarning) as caught:
        pdt.assert_frame_equal(load(store), before)
    assert sorted(str(one.message).split(" is skipped")[0].split("/")[-1] for one in caught) == [
        "a.parquet",
        "part-jwrong-0.parquet",
        "stray.parquet",
    ]
    assert len(compact(store).set_aside) == 3
    pdt.assert_frame_equal(load(store), before)


def test_run_without_its_evaluations_does_not_count_and_can_be_repeated(store):
    lost = files(store, "evals")[0]
    gone = ids_in(lost)
    lost.unlink()
    with pytest.warns(StoreWarning, match=f"{lost.name}: gone"):
        assert set(finished(store, "s")).isdisjoint(gone)
    with Writer(store, "s") as writer:
        for run in (run for run in records(6) if run.spec.run_id in gone):
            writer.append(run)
    assert len(finished(store, "s")) == 6
    compact(store)
    assert len(finished(store, "s")) == len(load(store, "runs")) == 6


def test_evaluations_without_their_runs_are_reported_and_kept(store):
    lost = files(store, "runs")[0]
    gone = ids_in(lost)
    lost.unlink()
    with pytest.warns(StoreWarning, match=f"{lost.name} is skipped: there is no readable runs/.* belongs to"):
        assert gone.isdisjoint(load(store)["run_id"])
    assert [path.name for path in compact(store).set_aside] == [lost.name]


def test_run_in_two_files_is_taken_once(store):
    before = {table: load(store, table) for table in ("evals", "runs")}
    for table in ("evals", "runs"):
        path = files(store, table)[0]
        shutil.copy(path, path.with_name("part-jcopy-0.parquet"))
    for table, frame in before.items():
        pdt.assert_frame_equal(load(store, table), frame)
    assert compact(store).dropped_copies == 3
    for table, frame in before.items():
        pdt.assert_frame_equal(load(store, table), frame)


def test_copy_of_the_runs_alone_hides_nothing(store):
    before = load(store)
    for path in files(store, "runs"):
        shutil.copy(path, path.with_name(f"part-a{path.name}"))
    pdt.assert_frame_equal(load(store), before)
    assert len(finished(store, "s")) == 6


def test_same_run_in_two_sweeps_belongs_to_both(store):
    with Writer(store, "t") as writer:
        writer.append(records(1)[0])
    assert len(load(store, "runs")) == 7
    assert len(finished(store, "t")) == 1


def test_later_success_hides_a_folded_failure(tmp_path):
    run = records(1)[0]
    for one in (failed(run.spec), record(run.spec), failed(run.spec, "quarantined")):
        with Writer(tmp_path, "s") as writer:
            writer.append(one)
    assert finished(tmp_path, "s") == {run.spec.run_id: "ok"}
    assert load(tmp_path, "runs")["status"].tolist() == ["ok"]
    assert len(load(tmp_path)) == 3


def with_version(path, version):
    table = pq.read_table(path, partitioning=None)
    known = json.loads(table.schema.metadata[b"bns"])
    text = json.dumps({name: known[name] for name in OLD_KEYS} | {"schema_version": version}).encode()
    if version < 2:
        table = table.drop_columns([name for name in ("approach", "robot_s") if name in table.column_names])
    if version == 0 and "arithmetic_failures" in table.column_names:
        table = table.drop_columns(["arithmetic_failures"])
    pq.write_table(table.replace_schema_metadata({b"bns": text}), path)


@pytest.mark.parametrize("version", [0, 1])
def test_older_files_name_the_command_that_rewrites_them(store, version):
    stored = load(store)
    driven_s = stored.groupby("run_id").driven_ms.cumsum() / 1000 + 30 * stored.evaluation
    old = stored.run_id.isin(ids_in(files(store, "evals")[0]))
    before = stored.assign(robot_s=stored.robot_s.where(~old, driven_s))
    if version == 0:
        before.loc[old, "arithmetic_failures"] = 0
    for table in ("evals", "runs"):
        with_version(files(store, table)[0], version)
    for read in (load, connect, lambda results: finished(results, "s")):
        with pytest.raises(StoreError, match=rf"version {version}, older than 2.* bns compact --results {store}"):
            read(store)
    assert compact(store).upgraded_files == 2
    assert old.sum() == 9
    pdt.assert_frame_equal(load(store), before, check_dtype=False)


def test_newer_files_name_the_update(store):
    with_version(files(store, "evals")[1], 3)
    for read in (load, compact):
        with pytest.raises(StoreError, match=r"schema version 3, newer than 2.* pip install -U bns"):
            read(store)


@pytest.mark.parametrize(("sweep", "task"), [("s", "square"), ("t", "circle")])
def test_a_file_in_the_folder_of_another_sweep_or_task_is_named_and_not_read(store, sweep, task):
    before, first = load(store), files(store, "evals")[0]
    place = store / "evals" / f"sweep={sweep}" / f"task={task}" / first.name
    place.parent.mkdir(parents=True)
    shutil.copy(first, place)
    with pytest.warns(StoreWarning, match=f"{first.name} is skipped: it was written for sweep 's', task 'circle'"):
        pdt.assert_frame_equal(load(store), before)


def test_empty_and_missing_results_name_the_commands_to_begin_with(tmp_path):
    for results in (tmp_path, tmp_path / "none"):
        with pytest.raises(StoreError, match=r"no results in .* bns sweep khepera-small, or"):
            load(results)
    assert not (tmp_path / "none").exists()
    trial = tmp_path / "results" / "trials" / "khepera-circle-0"
    trial.mkdir(parents=True)
    (trial / "journal.jsonl").write_text("")
    for results in (tmp_path / "results", trial):
        with pytest.raises(StoreError, match=r"holds trials alone, and a trial is stored when it is complete: .* --resume"):
            query(results, "SELECT 1")
    with pytest.raises(StoreError, match="the folder does not exist"):
        compact(tmp_path / "none")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r: load(r, "eval"), "unknown table 'eval'. Did you mean 'evals'"),
        (lambda r: load(r, columns=["succes_7cm"]), "column of evals 'succes_7cm'. Did you mean 'success_7cm'"),
        (lambda r: load(r, columns="seed"), r"columns is 'seed'; it must be a list of names: \['seed'\]"),
        (lambda r: load(r, where={"mutation": 1}), "unknown column of evals 'mutation'"),
        (lambda r: load(r, where="mutation > 1"), "DuckDB cannot answer .*mutation"),
        (lambda r: load(r, where={"seed": object()}), "a condition cannot compare with"),
        (lambda r: query(r, "SELECT nonsense FROM evals"), "DuckDB cannot answer .*nonsense"),
        (lambda r: query(r, "SELEC 1"), "DuckDB cannot answer .*SELEC"),
    ],
)
def test_questions_that_cannot_be_answered(store, call, message):
    with pytest.raises(StoreError, match=message):
        call(store)


def test_clock_that_goes_back_and_odd_file_times_change_nothing(store, monkeypatch):
    before = load(store)
    for path in (*files(store, "evals"), *files(store, "runs")):
        os.utime(path, (0, 0))
    monkeypatch.setattr(time, "time", lambda: 1.0)
    with Writer(store, "s") as writer:
        for run in records(8)[6:]:
            writer.append(run)
    assert len(finished(store, "s")) == 8
    known = load(store)
    pdt.assert_frame_equal(known[known["run_id"].isin(before["run_id"])].reset_index(drop=True), before)


def test_results_in_a_folder_with_odd_letters(tmp_path):
    odd = tmp_path / "it's [a] *str?nge* folder"
    with warnings.catch_warnings(), Writer(odd, "s") as writer:
        for run in records(2):
            writer.append(run)
    assert len(load(odd)) == 6


def test_unreadable_runs_are_warned_of_once(store):
    path = files(store, "runs")[0]
    gone = ids_in(path)
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.warns(StoreWarning, match="is (truncated|damaged)") as caught:
        assert gone.isdisjoint(finished(store, "s"))
    assert len(caught) == 1
    assert [moved.name for moved in compact(store).set_aside] == [path.name, path.name]
    assert len(finished(store, "s")) == 3


def test_run_with_a_part_of_its_evaluations_does_not_count(store):
    """In files from before digests, where nothing but the number of rows tells."""
    evals = files(store, "evals")[0]
    [runs] = [path for path in files(store, "runs") if path.name == evals.name]
    for path in (evals, runs):
        with_version(path, SCHEMA_VERSION)
    assert len(finished(store, "s")) == 6
    table = pq.read_table(evals, partitioning=None)
    pq.write_table(table.slice(1), evals)  # the first evaluation of one run
    with pytest.warns(StoreWarning, match=f"{evals.name} .* has lost rows .*: 1 of its runs"):
        there = set(finished(store, "s"))
    assert there == {run.spec.run_id for run in records(6)} - {table["run_id"][0].as_py()}
