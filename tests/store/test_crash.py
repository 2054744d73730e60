"""A writer or compaction that is killed at any moment loses nothing and doubles nothing."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pandas.testing as pdt
import pytest

from bns.store import Writer, compact, finished, load
from bns.store.disk.journal import journals

from .synthetic import records
from .victim import sample

VICTIM = Path(__file__).with_name("victim.py")


def kill(results, action, moment, number):
    done = subprocess.run(
        [sys.executable, str(VICTIM), str(results), action, moment, str(number)],
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    results = tmp_path_factory.mktemp("reference")
    with Writer(results, "s") as writer:
        for run in sample():
            writer.append(run)
    return load(results), finished(results, "s")


def check(results, reference):
    evals, statuses = reference
    pdt.assert_frame_equal(load(results), evals)
    assert finished(results, "s") == statuses


@pytest.mark.parametrize(
    ("action", "moment", "number"),
    [
        ("append", "never", 0),  # every run in the journal, nothing folded
        ("fold", "before", 1),  # evals staged, not published
        ("fold", "after", 1),  # evals published, runs not
        ("fold", "after", 2),  # all published, journal still there
    ],
)
@pytest.mark.slow
def test_killed_writer(tmp_path, reference, action, moment, number):
    assert "appended" in kill(tmp_path, action, moment, number)
    check(tmp_path, reference)
    with Writer(tmp_path, "s") as writer:
        assert writer.recovered == 12
        check(tmp_path, reference)
    check(tmp_path, reference)
    assert not journals(tmp_path)
    assert not list((tmp_path / "staging").rglob("*.parquet"))
    assert len(list((tmp_path / "evals").rglob("*.parquet"))) == 1


@pytest.mark.parametrize(
    ("moment", "number"),
    [
        ("before", 1),  # merged evals staged
        ("after", 1),  # merged evals published, their runs not
        ("after", 2),  # both published, the old files still there
        ("unlink", 2),  # one of the old runs files removed
        ("unlink", 4),  # one of the old evals files removed
    ],
)
@pytest.mark.slow
def test_killed_compaction(tmp_path, reference, moment, number):
    runs = sample()
    for chunk in (runs[:5], runs[5:10], runs[10:]):
        with Writer(tmp_path, "s") as writer:
            for run in chunk:
                writer.append(run)
    kill(tmp_path, "compact", moment, number)
    check(tmp_path, reference)
    summary = compact(tmp_path)
    check(tmp_path, reference)
    assert summary.set_aside == ()
    assert len(list((tmp_path / "evals").rglob("*.parquet"))) == 1
    assert len(list((tmp_path / "runs").rglob("*.parquet"))) == 1


def test_run_is_on_the_disk_when_append_returns(tmp_path, monkeypatch):
    synced = []
    sync = os.fsync
    monkeypatch.setattr(os, "fsync", lambda fd: (sync(fd), synced.append(os.fstat(fd).st_size)))
    with Writer(tmp_path, "s") as writer:
        for run in records(2):
            writer.append(run)
            assert synced[-1] == journals(tmp_path)[0].path.stat().st_size
