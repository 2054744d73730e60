"""Sweeps that are stopped, killed and resumed. Each is a process of its own."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
import sweep_jobs
from sweep_jobs import make_sweep

from bns.store.read.reader import load
from bns.sweep.interrupt import Interrupts
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.runner import run_sweep

SCRIPT = Path(__file__).with_name("sweep_process.py")


@pytest.fixture
def start(tmp_path):
    """Starts a sweep in a session of its own; whatever is left of it at the end is killed."""
    started = []

    def begin(*arguments: object) -> subprocess.Popen:
        (tmp_path / "marks").mkdir(exist_ok=True)
        environment = os.environ | {sweep_jobs.MARKS: str(tmp_path / "marks")}
        command = [sys.executable, "-W", "error", SCRIPT, *map(str, arguments)]
        started.append(
            subprocess.Popen(
                command,
                env=environment,
                text=True,
                start_new_session=True,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
            )
        )
        return started[-1]

    yield begin
    for process in started:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def wait_for(condition: Callable[[], object], what: str) -> None:
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end, f"waited in vain for {what}"
        time.sleep(0.02)


def begun(tmp_path) -> list[str]:
    return [mark.name for mark in (tmp_path / "marks").glob("begun-*")]


def summary_of(process: subprocess.Popen) -> dict:
    out, err = process.communicate(timeout=600)
    assert (process.returncode, err) == (0, "")
    return json.loads(out.splitlines()[-1])


def expected(folder) -> pd.DataFrame:
    sweep = make_sweep(combos=4, seeds=4)
    run_sweep(sweep, folder, job=sweep_jobs.ok, executor=SerialExecutor(sweep_jobs.ok))
    return load(folder)


@pytest.mark.parametrize(("number", "name"), [(signal.SIGINT, "interrupt"), (signal.SIGTERM, "terminated")])
@pytest.mark.slow
def test_first_signal_finishes_what_is_in_flight_and_the_rest_can_be_resumed(tmp_path, start, number, name):
    process = start(tmp_path / "a", 2, "slow")
    wait_for(lambda: len(begun(tmp_path)) >= 2, "two runs to begin")
    os.killpg(process.pid, number)  # as a terminal or a batch system does: the workers get it too
    summary = summary_of(process)
    assert summary["stopped_by"] == name
    assert 2 <= summary["new"] == len(begun(tmp_path)) < 16
    assert summary["done"] == summary["new"] == len(load(tmp_path / "a", "runs"))
    resumed = summary_of(start(tmp_path / "a", 2, "ok"))
    assert (resumed["done"], resumed["new"], resumed["stopped_by"]) == (16, 16 - summary["new"], None)
    pd.testing.assert_frame_equal(load(tmp_path / "a"), expected(tmp_path / "b"))


@pytest.mark.parametrize("grace_s", [0.3, 60])
def test_runs_that_do_not_finish_are_given_up(tmp_path, start, grace_s):
    process = start(tmp_path / "a", 2, "endless", "demo", grace_s)
    wait_for(lambda: len(begun(tmp_path)) == 2, "two runs to begin")
    process.send_signal(signal.SIGINT)
    if grace_s == 60:
        time.sleep(0.3)
        process.send_signal(signal.SIGTERM)  # the second signal ends it at once
    summary = summary_of(process)
    assert (summary["new"], summary["stopped_by"]) == (0, "interrupt")
    assert not any(alive(worker) for worker in workers(tmp_path))


def test_signal_before_anything_is_in_flight_ends_it(tmp_path, monkeypatch):
    sweep, job = make_sweep(), sweep_jobs.ok

    def warm_up() -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(5)
        pytest.fail("the signal did not end the preparation")

    summary = run_sweep(sweep, tmp_path, executor=SerialExecutor(job), job=job, warm_up=warm_up)
    assert (summary.new, summary.stopped_by) == (0, "terminated")
    assert run_sweep(sweep, tmp_path, executor=SerialExecutor(job), job=job).done == 8


def test_run_in_this_process_is_left_at_the_second_signal(tmp_path):
    def job(spec):
        for _ in range(2):
            os.kill(os.getpid(), signal.SIGINT)
        time.sleep(5)
        return sweep_jobs.ok(spec)

    summary = run_sweep(make_sweep(), tmp_path, executor=SerialExecutor(job), job=job)
    assert (summary.new, summary.stopped_by) == (0, "interrupt")


def test_handlers_are_put_back():
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with Interrupts():
        assert signal.getsignal(signal.SIGTERM) != before[1]
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


@pytest.mark.parametrize("jobs", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_killed_at_any_moment_and_resumed_it_gives_the_same_evals(tmp_path, start, jobs):
    moments, kills = random.Random(jobs), 0
    for _ in range(2):
        process = start(tmp_path / "a", jobs, "short")
        assert process.stdout.readline() == "importing done\n"
        time.sleep(moments.uniform(0.3, 1.5) / jobs)
        process.kill()
        kills += process.wait() == -signal.SIGKILL
    assert kills  # otherwise this proves nothing
    summary = summary_of(start(tmp_path / "a", jobs, "short"))
    assert summary["done"] == 16
    pd.testing.assert_frame_equal(load(tmp_path / "a"), expected(tmp_path / "b"))


def test_workers_end_with_their_parent(tmp_path, start):
    process = start(tmp_path / "a", 2, "endless")
    wait_for(lambda: len(begun(tmp_path)) == 2, "two runs to begin")
    assert all(alive(worker) for worker in workers(tmp_path))
    process.kill()
    wait_for(lambda: not any(alive(worker) for worker in workers(tmp_path)), "the workers to end")


@pytest.mark.slow
def test_two_sweeps_fill_one_store_at_once(tmp_path, start):
    both = [start(tmp_path / "a", 1, "short", name) for name in ("one", "two")]
    assert [summary_of(process)["done"] for process in both] == [16, 16]
    runs = load(tmp_path / "a", "runs")
    assert runs.groupby("sweep").size().to_dict() == {"one": 16, "two": 16}


def workers(tmp_path) -> list[int]:
    return [int(name.rsplit("-", 1)[1]) for name in begun(tmp_path)]


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except (ProcessLookupError, FileNotFoundError):
        return False
    return state != "Z"  # a zombie only waits for somebody to read its exit status
