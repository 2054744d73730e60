"""Journals that are torn or damaged give every whole run they hold."""

import os
import shutil
import warnings
from dataclasses import replace

import pandas.testing as pdt
import pytest

from bns.errors import StoreError
from bns.store import StoreWarning, Writer, compact, finished, load
from bns.store.disk import journal as journal_module
from bns.store.disk.journal import MAGIC, journals
from bns.store.write import fold

from .synthetic import failed, record, records, specs


class StopError(Exception):
    """Leaves a journal behind, as a crash does."""


@pytest.fixture
def left(tmp_path):
    """Results with a journal of three runs that was not folded, and the three frames' offsets."""
    runs = records(3)
    with pytest.raises(StopError), Writer(tmp_path, "s") as writer:  # noqa: PT012
        for run in runs:
            writer.append(run)
        raise StopError
    path = journals(tmp_path)[0].path
    data = path.read_bytes()
    starts = [at for at in range(len(data)) if data.startswith(MAGIC, at)]
    assert len(starts) == 3
    return tmp_path, path, runs, starts


def ids(runs):
    return sorted(run.spec.run_id for run in runs)


def test_readers_see_the_journal_and_the_fold_changes_nothing(left):
    results, path, runs, _ = left
    before, status = load(results), finished(results, "s")
    assert list(status) == ids(runs)
    with Writer(results, "s"):
        assert not path.exists()
    pdt.assert_frame_equal(load(results), before)


@pytest.mark.parametrize("cut", [1, 10, 23, 24, 30, 200])
def test_torn_last_frame_is_cut_without_a_word(left, cut):
    results, path, runs, starts = left
    data = path.read_bytes()
    path.write_bytes(data[: starts[2] + cut])
    assert list(finished(results, "s")) == ids(runs[:2])
    with Writer(results, "s") as writer:
        assert writer.recovered == 2
        writer.append(runs[2])
    assert list(finished(results, "s")) == ids(runs)
    assert not (results / "set-aside").exists()


def test_zeros_at_the_end_are_a_torn_frame(left):
    results, path, runs, _ = left
    path.write_bytes(path.read_bytes() + bytes(4096))
    assert list(finished(results, "s")) == ids(runs)


@pytest.mark.parametrize("where", ["magic", "length", "payload"])
@pytest.mark.parametrize("frame", [0, 1, 2])
def test_damaged_frame_is_reported_and_the_others_kept(left, where, frame):
    results, path, runs, starts = left
    data = bytearray(path.read_bytes())
    data[starts[frame] + {"magic": 2, "length": 9, "payload": 500}[where]] ^= 0x40
    path.write_bytes(data)
    good = [run for number, run in enumerate(runs) if number != frame]
    with pytest.warns(StoreWarning, match=f"{path.name} is damaged .* 2 whole runs"):
        assert list(finished(results, "s")) == ids(good)
    with (
        pytest.warns(StoreWarning, match=r"2 whole runs of it are kept, a\s+copy is in .*set-aside"),
        Writer(results, "s"),
    ):
        pass
    assert list(finished(results, "s")) == ids(good)
    assert (results / "set-aside" / "journal" / path.name).read_bytes() == data


def test_rows_of_a_fold_that_is_under_way_are_not_called_lost(left, monkeypatch):
    results, path, _, _ = left
    before, published = load(results), fold.publish

    def stopped(data, staged, place):
        if "runs" in place.relative_to(results).parts:
            raise StopError
        published(data, staged, place)

    monkeypatch.setattr(fold, "publish", stopped)
    with pytest.raises(StopError):
        fold.fold_journal(results, journals(results)[0])
    assert path.exists()
    assert list((results / "evals").rglob("*.parquet"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pdt.assert_frame_equal(load(results), before)
    path.rename(results / "elsewhere")
    with pytest.warns(StoreWarning, match="there is no readable runs/"):
        assert finished(results, "s") == {}


def test_run_in_a_journal_and_in_a_file_is_taken_once(left, tmp_path_factory):
    results, path, runs, _ = left
    kept = tmp_path_factory.mktemp("kept") / path.name
    shutil.copy(path, kept)
    with Writer(results, "s"):
        pass
    folded = load(results)
    shutil.copy(kept, path)
    pdt.assert_frame_equal(load(results), folded)
    other = path.with_name("s--j" + "0" * 32 + ".journal")
    shutil.move(path, other)
    pdt.assert_frame_equal(load(results), folded)
    assert compact(results).recovered_runs == 3
    pdt.assert_frame_equal(load(results), folded)
    assert len(load(results, "runs")) == len(runs)


def test_retry_that_goes_well_hides_the_failure(tmp_path):
    spec = next(specs(1, 3))
    for order in ([failed(spec), record(spec)], [record(spec), failed(spec)]):
        sweep = f"s{len(list(tmp_path.iterdir()))}"
        with Writer(tmp_path, sweep) as writer:
            writer.append(order[0])
            assert list(finished(tmp_path, sweep).values()) == [order[0].run["status"]]
            writer.append(order[1])
            assert finished(tmp_path, sweep) == {spec.run_id: "ok"}
        assert len(load(tmp_path, "runs", where={"sweep": sweep})) == 1
        assert len(load(tmp_path, where={"sweep": sweep})) == 3


def test_of_two_results_of_a_run_that_both_went_well_the_first_counts(tmp_path):
    spec = next(specs(1, 3))
    with Writer(tmp_path, "s") as writer:
        for wall_s in (1.0, 2.0):
            writer.append(record(spec, wall_s=wall_s))
        assert load(tmp_path, "runs")["wall_s"].tolist() == [1.0]
    assert not journals(tmp_path)
    assert load(tmp_path, "runs")["wall_s"].tolist() == [1.0]


def test_journal_of_another_sweep_is_left_alone(left):
    results, path, runs, _ = left
    with Writer(results, "s--j"), Writer(results, "t"):
        assert path.exists()
    assert list(finished(results, "s")) == ids(runs)


def test_journal_of_a_newer_version_is_refused(left, monkeypatch):
    results, _, _, _ = left
    monkeypatch.setattr(journal_module, "SCHEMA_VERSION", 0)
    with pytest.raises(StoreError, match=r"schema version 2; this bns knows 0.*pip install -U bns"):
        finished(results, "s")


def test_journal_of_an_older_version_is_read_and_folded_as_of_this_one(left, monkeypatch):
    """Version 1 knew neither approaches nor robot time: half a minute beside what was driven."""
    results, path, _, _ = left
    before = load(results)
    driven_s = before.groupby("run_id").driven_ms.cumsum() / 1000 + 30 * before.evaluation
    old = []
    for frame in journal_module.read_journal(journals(results)[0]).frames:
        tables = {name: table.drop_columns([n for n in ("approach", "robot_s") if n in table.column_names])
                  for name, table in frame.tables.items()}  # fmt: skip
        old.append(replace(frame, tables=tables))
    with monkeypatch.context() as earlier:
        earlier.setattr(journal_module, "SCHEMA_VERSION", 1)
        path.write_bytes(b"".join(journal_module.encoded(frame, "s") for frame in old))
    pdt.assert_frame_equal(load(results), before.assign(robot_s=driven_s))
    with Writer(results, "s") as writer:
        assert writer.recovered == 3
    pdt.assert_frame_equal(load(results), before.assign(robot_s=driven_s))


def test_empty_journal_is_removed(tmp_path):
    path = tmp_path / "journal" / f"s--j{'1' * 32}.journal"
    path.parent.mkdir(parents=True)
    path.touch()
    with warnings.catch_warnings(action="error"), Writer(tmp_path, "s") as writer:
        assert writer.recovered == 0
    assert not path.exists()


def test_emptied_journal_is_reported(left):
    results, path, *_ = left
    path.write_bytes(b"")
    with warnings.catch_warnings(action="error"):
        assert not finished(results, "s")  # it may be under way
    os.utime(path, (1, 1))
    with pytest.warns(StoreWarning, match=r"journal is empty: .*was emptied; its 0 whole runs are read"):
        assert not finished(results, "s")
    with pytest.warns(StoreWarning, match=r"emptied; 0 whole runs of it are kept\. Run the sweep again"), Writer(results, "s"):
        assert not path.exists()


def test_damage_is_counted_to_the_byte(left):
    _, path, _, starts = left
    file, data = journals(path.parents[1])[0], path.read_bytes()
    whole = journal_module.scan(data, file)
    assert (len(whole.frames), whole.damaged, whole.torn) == (3, 0, 0)
    middle = bytearray(data)
    middle[starts[1] + 60] ^= 1
    found = journal_module.scan(bytes(middle), file)
    assert (len(found.frames), found.damaged, found.torn) == (2, starts[2] - starts[1], 0)
    other = replace(file, sweep="another")
    assert (journal_module.scan(data, other).damaged, journal_module.scan(data, other).frames) == (len(data), [])


def test_damage_and_a_torn_frame_at_the_end_are_counted_to_the_byte(left):
    _, path, _, starts = left
    file, data = journals(path.parents[1])[0], path.read_bytes()
    for start in starts:
        for cut in range(1, 100):
            found = journal_module.scan(data[: start + cut], file)
            assert (len(found.frames), found.damaged, found.torn) == (starts.index(start), 0, cut)
    last = bytearray(data)
    last[starts[2] + 60] ^= 1
    for more in range(4):
        found = journal_module.scan(bytes(last) + b"x" * more, file)
        assert (len(found.frames), found.damaged, found.torn) == (2, len(data) + more - starts[2], 0)
