"""Disks that are full or read-only: a message that says what to do, and nothing that was finished is lost."""

import errno
import os
import resource
import subprocess
import sys
from pathlib import Path

import pandas.testing as pdt
import pytest

from bns.errors import StoreError
from bns.store import Writer, compact, finished, load
from bns.store.disk.files import publish
from bns.store.disk.journal import journals
from bns.store.read.snapshot import full_snapshot

from .synthetic import records

FULL = "limit is full. Nothing that was finished is lost: free some space"
READ_ONLY = r"read-only for this user. .*give another place \(--results DIR for results, -o FILE for a file\)"


class Disk:
    """Stands in for os.write and friends: fails with ``code`` once ``room`` bytes were written."""

    def __init__(self, monkeypatch, code, room=0):
        self.code, self.room, self.write, self.open = code, room, os.write, os.open
        self.monkeypatch = monkeypatch

    def fill(self):
        self.monkeypatch.setattr(os, "write", self._write)

    def protect(self):
        self.monkeypatch.setattr(os, "open", self._open)
        self.monkeypatch.setattr(os, "mkdir", self._fail)

    def _write(self, descriptor, data):
        if self.room <= 0:
            self._fail()
        self.room -= 1000
        return self.write(descriptor, bytes(data)[:1000])

    def _open(self, path, flags, *arguments, **options):
        if flags & (os.O_WRONLY | os.O_RDWR):
            self._fail()
        return self.open(path, flags, *arguments, **options)

    def _fail(self, *arguments, **options):
        raise OSError(self.code, os.strerror(self.code))


def store(results, runs):
    with Writer(results, "s") as writer:
        for run in runs:
            writer.append(run)


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
@pytest.mark.parametrize("room", [0, 5000])
def test_full_disk_leaves_the_journal_at_its_last_whole_run(tmp_path, monkeypatch, code, room):
    runs = records(3)
    with Writer(tmp_path, "s") as writer:
        writer.append(runs[0])
        size = journals(tmp_path)[0].path.stat().st_size
        with monkeypatch.context() as patch:
            Disk(patch, code, room).fill()
            with pytest.raises(StoreError, match=FULL):
                writer.append(runs[1])
        assert journals(tmp_path)[0].path.stat().st_size == size
        assert list(finished(tmp_path, "s")) == [runs[0].spec.run_id]
        writer.append(runs[2])  # somebody made room
    assert sorted(finished(tmp_path, "s")) == sorted(run.spec.run_id for run in (runs[0], runs[2]))
    assert not (tmp_path / "set-aside").exists()


def test_full_disk_at_a_fold_keeps_the_runs_in_the_journal(tmp_path, monkeypatch):
    runs = records(4)
    store(tmp_path / "whole", runs)
    results = tmp_path / "cut"
    disk = Disk(monkeypatch, errno.ENOSPC, 2000)
    with pytest.raises(StoreError, match=FULL), Writer(results, "s") as writer:  # noqa: PT012
        for run in runs:
            writer.append(run)
        with monkeypatch.context() as patch:
            disk.monkeypatch = patch
            disk.fill()
            writer.fold()
    assert not list((results / "staging").rglob("*.parquet"))
    pdt.assert_frame_equal(load(results), load(tmp_path / "whole"))
    with Writer(results, "s") as writer:
        assert writer.recovered == 4
    pdt.assert_frame_equal(load(results), load(tmp_path / "whole"))


def test_full_disk_at_a_compaction_keeps_the_old_files(tmp_path, monkeypatch):
    store(tmp_path, records(2))
    store(tmp_path, records(4)[2:])
    before = load(tmp_path)
    with monkeypatch.context() as patch:
        Disk(patch, errno.ENOSPC, 2000).fill()
        with pytest.raises(StoreError, match=FULL):
            compact(tmp_path)
    pdt.assert_frame_equal(load(tmp_path), before)
    compact(tmp_path)
    pdt.assert_frame_equal(load(tmp_path), before)


@pytest.mark.parametrize("code", [errno.EROFS, errno.EACCES])
def test_read_only_results_say_so_and_can_still_be_read(tmp_path, monkeypatch, code):
    store(tmp_path, records(2))
    before = load(tmp_path)
    with monkeypatch.context() as patch:
        Disk(patch, code).protect()
        for write in (lambda r: store(r, []), lambda r: store(r / "new", []), compact):
            with pytest.raises(StoreError, match=READ_ONLY):
                write(tmp_path)
        pdt.assert_frame_equal(load(tmp_path), before)
    store(tmp_path, records(3)[2:])
    assert len(finished(tmp_path, "s")) == 3


@pytest.mark.skipif(os.geteuid() == 0, reason="permissions do not bind root; simulated in the test above")
def test_folder_without_write_permission(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(StoreError, match=READ_ONLY):
        store(tmp_path, records(1))
    tmp_path.chmod(0o700)


def test_file_size_limit_of_the_system(tmp_path):
    code = f"""
import resource, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from synthetic import records
from bns.errors import StoreError
from bns.store import Writer
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, resource.RLIM_INFINITY))
with Writer(sys.argv[1], "s") as writer:
    for number, run in enumerate(records(20)):
        try:
            writer.append(run)
        except StoreError as error:
            print(number, error)
            break
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
"""
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    stored, message = done.stdout.split(" ", 1)
    assert "free some space" in message
    assert len(finished(tmp_path, "s")) == int(stored) > 0
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY


def test_a_file_that_cannot_be_made_is_named_and_so_is_its_folder(tmp_path, monkeypatch):
    place = tmp_path / "report.html"
    disk = Disk(monkeypatch, errno.ENOENT)
    monkeypatch.setattr(os, "open", disk._open)
    with pytest.raises(StoreError, match=rf"write {place}: .* Nothing can be made in the folder {tmp_path}\. .*another folder"):
        publish(b"page", place.with_name(f".{place.name}.part"), place)


def test_a_folder_with_nothing_to_read_is_not_called_empty(tmp_path):
    (tmp_path / "evals").mkdir()
    with pytest.raises(StoreError, match="nothing in the folder can be read as results"):
        full_snapshot(tmp_path)
    (tmp_path / "evals").rmdir()
    with pytest.raises(StoreError, match="the folder is empty"):
        full_snapshot(tmp_path)
