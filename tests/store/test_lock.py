"""One writer a sweep, names that can stand in folders, nothing made before it is needed."""

import json
import os
import platform
import subprocess
import sys
from unittest.mock import Mock

import pytest

from bns.errors import StoreError
from bns.spec import RunSpec
from bns.store import Writer, compact, finished
from bns.store.disk.lock import ShardLock, SweepLock, SweepLockedError

from .synthetic import record, records


def test_second_writer_is_refused_at_once_and_told_who_holds_the_sweep(tmp_path):
    with Writer(tmp_path, "s") as first:
        holder = f"'s' is being written by process {os.getpid()} on {platform.node()} since"
        with pytest.raises(StoreError, match=holder), Writer(tmp_path, "s"):
            pass
        with Writer(tmp_path, "t") as other:
            other.append(records(1)[0])
        first.append(records(1)[0])
    with Writer(tmp_path, "s"):
        pass
    assert len(finished(tmp_path, "s")) == len(finished(tmp_path, "t")) == 1


def test_a_shard_that_was_refused_keeps_nobody_out(tmp_path):
    one = ShardLock(tmp_path, "s", "a")
    one.acquire()
    with pytest.raises(SweepLockedError):
        ShardLock(tmp_path, "s", "a").acquire()
    one.release()
    with SweepLock(tmp_path, "s"):
        pass


def test_shards_of_one_sweep_are_written_side_by_side_and_the_whole_is_not(tmp_path):
    one, other = (ShardLock(tmp_path, "s", shard) for shard in "ab")
    one.acquire()
    other.acquire()
    with pytest.raises(SweepLockedError):
        SweepLock(tmp_path, "s").acquire()
    with pytest.raises(SweepLockedError):
        ShardLock(tmp_path, "s", "a").acquire()
    ShardLock(tmp_path, "t", "a").acquire()


def test_writer_in_another_process_is_named(tmp_path):
    code = (
        "import sys; from bns.store import Writer\n"
        "with Writer(sys.argv[1], 's'): print('in', flush=True); sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout.readline() == "in\n"
        with pytest.raises(StoreError, match=f"process {holder.pid} on"), Writer(tmp_path, "s"):
            pass
        holder.kill()
        holder.wait()
        with Writer(tmp_path, "s"):  # the lock of a dead process is free
            assert json.loads((tmp_path / "journal" / "s.lock.json").read_text())["pid"] == os.getpid()


def test_holder_that_cannot_be_read_does_not_hide_the_lock(tmp_path):
    with Writer(tmp_path, "s"):
        (tmp_path / "journal" / "s.lock.json").write_text("{")
        with pytest.raises(StoreError, match="has not said yet which it is"), Writer(tmp_path, "s"):
            pass


def test_compaction_leaves_a_sweep_that_is_being_written(tmp_path):
    with Writer(tmp_path, "s", fold_at=1) as writer:
        for run in records(3):
            writer.append(run)
        summary = compact(tmp_path)
        assert summary.skipped_sweeps == ("s",)
        assert "skipped, being written: sweep s" in str(summary)
        assert len(list((tmp_path / "evals").rglob("*.parquet"))) == 3
    assert compact(tmp_path).skipped_sweeps == ()
    assert len(list((tmp_path / "evals").rglob("*.parquet"))) == 1


@pytest.mark.parametrize("name", ["", "1s", "-s", "a b", "a/b", "../a", "ä", "a.b", "a=b", "a\n"])
def test_names_that_cannot_be_folders_are_refused(tmp_path, name):
    with pytest.raises(StoreError, match="must begin with a letter and hold only letters, digits, - and _"):
        Writer(tmp_path, name)
    with Writer(tmp_path, "s") as writer, pytest.raises(StoreError, match=r"task .* cannot be a folder name"):
        writer.append(record(RunSpec(task=name, evaluations=1)))


def test_writer_makes_nothing_before_it_is_entered(tmp_path):
    writer = Writer(tmp_path / "results", "a-B_3")
    assert not (tmp_path / "results").exists()
    with pytest.raises(StoreError, match="is not open; use it in a with statement"):
        writer.append(records(1)[0])
    with writer:
        pass
    with pytest.raises(StoreError, match="is not open;"):
        writer.append(records(1)[0])
    writer.close()


def test_fold_at_must_be_positive(tmp_path):
    with pytest.raises(StoreError, match="fold_at is 0; it must be 1"):
        Writer(tmp_path, "s", fold_at=0)


def test_lock_is_given_back_when_entering_fails(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr("bns.store.write.writer.clear_staging", Mock(side_effect=StoreError("that is it")))
        with pytest.raises(StoreError, match="that is it"), Writer(tmp_path, "s"):
            pass
    with Writer(tmp_path, "s"):
        pass
