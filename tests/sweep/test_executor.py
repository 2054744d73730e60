"""Executors: what a dying worker costs, and what it does not."""

import os
import signal
import time
from functools import partial

import pytest
import sweep_jobs
from sweep_jobs import make_sweep

from bns.store.record import RunRecord
from bns.sweep.expand.order import ordered_specs
from bns.sweep.jobs.executor import ATTEMPTS, Executor, SerialExecutor
from bns.sweep.jobs.job import describe, run_job
from bns.sweep.jobs.workers import LokyExecutor


@pytest.fixture
def marks(tmp_path, monkeypatch):
    folder = tmp_path / "marks"
    folder.mkdir()
    monkeypatch.setenv(sweep_jobs.MARKS, str(folder))
    return folder


def carry_out(executor: Executor, sweep=None) -> list[RunRecord]:
    waiting, records = ordered_specs(sweep or make_sweep()), []
    with executor:
        while waiting or executor.in_flight:
            while waiting and executor.free:
                executor.submit(waiting.pop(0))
            record = executor.next(5.0)
            records += [record] if record else []
    return records


@pytest.mark.parametrize(
    "make",
    [SerialExecutor, partial(LokyExecutor, 1), partial(LokyExecutor, 2)],
    ids=["serial", "one worker", "two workers"],
)
def test_every_run_comes_back_once(make):
    records = carry_out(make(sweep_jobs.ok))
    assert {r.spec for r in records} == set(ordered_specs(make_sweep()))
    assert len(records) == 8
    assert {(r.run["status"], r.run["attempts"]) for r in records} == {("ok", 1)}


def test_workers_stay_alive_have_one_thread_and_ignore_ctrl_c():
    notes = {r.run["world_digest"] for r in carry_out(LokyExecutor(1, sweep_jobs.environment))}
    assert len(notes) == 1
    assert notes.pop().startswith("1 <Handlers.SIG_IGN")


def test_run_that_kills_its_worker_is_quarantined_and_the_others_are_undisturbed(marks):
    records = carry_out(LokyExecutor(2, sweep_jobs.killed), make_sweep(combos=9, seeds=1))
    lost = [r for r in records if r.run["status"] != "ok"]
    assert len(records) == 9
    assert {(r.spec.population_size, r.run["status"]) for r in lost} == {(10, "quarantined")}
    assert {r.run["attempts"] for r in lost} == {ATTEMPTS}
    assert not lost[0].tables
    assert "the worker process died in each of 3 attempts: SIGKILL" in lost[0].run["error"]
    begun = [mark.name.split("-")[:2] for mark in marks.iterdir()]
    assert len(begun) == 8 + ATTEMPTS  # the others once each
    assert begun.count(["10", "0"]) == ATTEMPTS


def test_run_that_survives_the_second_attempt_is_ok(marks):
    records = carry_out(LokyExecutor(2, sweep_jobs.killed_once))
    assert {r.run["status"] for r in records} == {"ok"}
    assert sorted(r.run["attempts"] for r in records) == [1] * 7 + [2]


def test_worker_killed_while_idle_costs_nothing():
    specs = ordered_specs(make_sweep())
    with LokyExecutor(1, sweep_jobs.ok) as executor:
        executor.submit(specs[0])
        assert executor.next(30.0).run["status"] == "ok"
        worker = next(iter(executor._slots[0].pool._processes))
        os.kill(worker, signal.SIGKILL)
        time.sleep(0.3)
        executor.submit(specs[1])
        record = executor.next(30.0)
        record = record or executor.next(30.0)
        assert record.run["status"] == "ok"


def test_system_exit_in_a_job_is_a_failed_row():
    records = carry_out(LokyExecutor(1, sweep_jobs.faulty), make_sweep(combos=1, seeds=2))
    assert [r.run["status"] for r in records] == ["failed", "failed"]
    assert records[0].run["error"].startswith("SystemExit: 3")


def test_cancel_gives_up_what_is_in_flight(marks):
    begin = time.monotonic()
    with LokyExecutor(2, sweep_jobs.endless) as executor:
        for spec in ordered_specs(make_sweep())[:2]:
            executor.submit(spec)
        assert executor.next(0.1) is None
        assert (executor.free, executor.in_flight) == (0, 2)
        executor.cancel()
        assert (executor.free, executor.in_flight, executor.next(5.0)) == (0, 0, None)
    assert time.monotonic() - begin < 60


def test_no_jobs_are_refused():
    with pytest.raises(ValueError, match="jobs is 0; it must be at least 1"):
        LokyExecutor(0)


def test_a_fault_in_a_run_becomes_a_row(monkeypatch):
    spec = ordered_specs(make_sweep())[0]
    for fault, text in (MemoryError(), "MemoryError\n"), (ValueError("two\nlines"), "ValueError: two lines"):

        def explode(_spec, fault=fault):
            raise fault

        monkeypatch.setattr("bns.bootstrap.loop.run", explode)
        record = run_job(spec)
        assert record.run["status"] == "failed"
        assert record.run["error"].startswith(text)
        assert "in explode: raise fault" in record.run["error"]
        assert not record.tables
        assert record.run["wall_s"] >= 0
        assert record.run["started_at"].tzinfo is not None


def test_describe_names_the_innermost_places_first():
    try:
        int("x")
    except ValueError as fault:
        lines = describe(fault).splitlines()
    assert lines[0] == "ValueError: invalid literal for int() with base 10: 'x'"
    assert "test_executor.py" in lines[1]
