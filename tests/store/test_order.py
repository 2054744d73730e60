"""The order of the steps that docs/architecture.md relies on: what is synced before what is published before what is removed.

The calls of os.fsync, os.replace and Path.unlink are written down with the files they are about.
"""

import contextlib
import os
from pathlib import Path

import pytest

from bns.store import StoreWarning, Writer, compact, finished, load

from .synthetic import record, records, specs

TABLES = ("evals", "paths", "generations", "probes")


@pytest.fixture
def steps(monkeypatch):
    """(what, path) of each durable step, in order."""
    taken, sync, replace, unlink = [], os.fsync, os.replace, Path.unlink

    def synced(descriptor):
        taken.append(("sync", Path(f"/proc/self/fd/{descriptor}").readlink()))
        sync(descriptor)

    def replaced(source, target):
        taken.append(("publish", Path(target)))
        assert ("sync", Path(source)) in taken, f"{source} was published before it was synced"
        replace(source, target)

    def unlinked(path, missing_ok=False):
        if path.suffix in {".parquet", ".journal"}:
            taken.append(("remove", path))
        unlink(path, missing_ok=missing_ok)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", replaced)
    monkeypatch.setattr(Path, "unlink", unlinked)
    return taken


def table_of(path):
    return path.parts[-4]


def done(steps, what, suffix=".parquet"):
    return [path for one, path in steps if one == what and path.suffix == suffix]


def check_folders_are_synced(steps):
    """After each publication and removal, and before the next one, its folder is synced."""
    for at, (what, path) in enumerate(steps):
        if what != "sync":
            assert steps[at + 1] == ("sync", path.parent), f"{what} of {path} is followed by {steps[at + 1]}"


def store(results, runs):
    with Writer(results, "s") as writer:
        for run in runs:
            writer.append(run)


def full(count, first=0):
    return [record(spec, TABLES) for spec in list(specs(first + count, 2, record="full"))[first:]]


def test_fold(tmp_path, steps):
    store(tmp_path, full(3))
    published = done(steps, "publish")
    assert [table_of(path) for path in published] == [*TABLES, "runs"]
    assert steps.index(("remove", done(steps, "remove", ".journal")[0])) > steps.index(("publish", published[-1]))
    check_folders_are_synced(steps)


def test_new_folders_are_synced_into_those_above(tmp_path, steps):
    store(tmp_path, records(1))
    at = steps.index(("publish", done(steps, "publish")[0]))
    for folder in (tmp_path, tmp_path / "evals", tmp_path / "evals" / "sweep=s"):
        assert ("sync", folder) in steps[:at]


def test_journal_is_synced_with_its_folder(tmp_path, steps):
    with Writer(tmp_path, "s") as writer:
        writer.append(records(1)[0])
        journal = next((tmp_path / "journal").glob("*.journal"))
        assert ("sync", journal) in steps
        assert ("sync", journal.parent) in steps[: steps.index(("sync", journal))]


def test_compaction(tmp_path, steps):
    for first in (0, 2):
        store(tmp_path, full(2, first))
    steps.clear()
    compact(tmp_path)
    tables = [table_of(path) for path in done(steps, "publish")]
    gone = [table_of(path) for path in done(steps, "remove")]
    assert tables == [*TABLES, "runs"]
    assert gone == [table for table in ("runs", *TABLES) for _ in range(2)]
    published = [at for at, (what, _) in enumerate(steps) if what == "publish"]
    removed = [at for at, (what, path) in enumerate(steps) if what == "remove" and path.suffix == ".parquet"]
    assert max(published) < min(removed)
    check_folders_are_synced(steps)


def test_both_folders_of_what_is_set_aside_are_synced_before_anything_else_is_done(tmp_path, steps):
    store(tmp_path, records(2))
    path = next((tmp_path / "evals").rglob("*.parquet"))
    with path.open("rb+") as file:
        file.truncate(path.stat().st_size - 1)
        os.fsync(file.fileno())
    (moved,) = compact(tmp_path).set_aside
    at = steps.index(("publish", moved))
    assert {*steps[at + 1 : at + 3]} == {("sync", path.parent), ("sync", moved.parent)}


class KilledError(Exception):
    """Stands for a power cut at this very step."""


@pytest.mark.parametrize("step", [0, 2, 4, 5, 6, 8, 14])
@pytest.mark.slow
def test_a_cut_at_any_step_of_a_compaction_loses_nothing(tmp_path, monkeypatch, step):
    for first in (0, 2):
        store(tmp_path, full(2, first))
    before = {table: load(tmp_path, table) for table in (*TABLES, "runs")}
    with monkeypatch.context() as patch:
        left = [step]

        def cut(function):
            def call(*arguments, **options):
                left[0] -= 1
                if left[0] < 0:
                    raise KilledError
                return function(*arguments, **options)

            return call

        patch.setattr(os, "replace", cut(os.replace))
        patch.setattr(Path, "unlink", cut(Path.unlink))
        with contextlib.suppress(KilledError):
            compact(tmp_path)
    for table, frame in before.items():
        assert load(tmp_path, table).equals(frame), table
    assert len(finished(tmp_path, "s")) == 4
    compact(tmp_path)
    assert all(load(tmp_path, table).equals(frame) for table, frame in before.items())


@pytest.mark.parametrize("below", ["", "sweep=s", "sweep=s/task=circle"])
def test_table_folder_that_is_a_link_to_another_disk(tmp_path, monkeypatch, below):
    results, disk, replace = tmp_path / "results", tmp_path / "disk", os.replace
    disk.mkdir()
    link = results / "evals" / below
    link.parent.mkdir(parents=True)
    link.symlink_to(disk, target_is_directory=True)

    def across(source, target):
        """As between file systems: whatever comes from or goes to the other disk must be on it at both ends."""
        if (disk in Path(source).resolve().parents) != (disk in Path(target).resolve().parents):
            raise OSError(18, "Invalid cross-device link")
        replace(source, target)

    monkeypatch.setattr(os, "replace", across)
    for chunk in (records(2), records(4)[2:]):
        store(results, chunk)
    assert len(load(results)) == 12
    compact(results)
    assert len(finished(results, "s")) == 4
    assert len(list(disk.rglob("*.parquet"))) == 1
    path = next(disk.rglob("*.parquet"))
    path.write_bytes(path.read_bytes()[:-1])
    assert len(compact(results).set_aside) == 1
    with pytest.warns(StoreWarning, match="gone"):
        assert load(results).empty


def test_copy_that_was_cut_off_on_the_other_disk_is_cleared(tmp_path):
    store(tmp_path, records(2))
    folder = next((tmp_path / "evals").rglob("*.parquet")).parent
    half = folder / ".part-jx-0.parquet.copy"
    half.write_bytes(b"PAR1")
    assert len(load(tmp_path)) == 6
    store(tmp_path, [])
    assert not half.exists()
