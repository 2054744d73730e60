"""Executors: what a dying worker costs, and what it does not."""

import math
import os
import re
import signal
import time
from concurrent.futures import BrokenExecutor, Future
from datetime import UTC, datetime
from functools import partial
from types import SimpleNamespace

import pytest
import sweep_jobs
from sweep_jobs import make_sweep

from bns.store.record import RunRecord
from bns.sweep.expand.order import ordered_specs
from bns.sweep.jobs.executor import ATTEMPTS, Executor, SerialExecutor, without_result
from bns.sweep.jobs.job import describe, names_a_file, run_job
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


def test_workers_leave_to_their_parent_whatever_a_terminal_or_a_batch_system_sends():
    (record,) = carry_out(LokyExecutor(1, sweep_jobs.left_alone), make_sweep(combos=1, seeds=1))
    assert {"SIGINT", "SIGTERM", "SIGUSR1", "SIGUSR2"} <= set(record.run["world_digest"].split())


class Pool:
    """Stands in for a pool of one worker that takes ten seconds for a run and dies of it, or had died while it was idle."""

    def __init__(self, clock, fault, idle):
        self.clock, self.fault, self.idle = clock, fault, idle

    def submit(self, job, spec):
        if self.idle:
            raise BrokenExecutor
        self.clock.append(10.0)
        future = Future()
        future.set_result(job(spec)) if self.fault is None else future.set_exception(BrokenExecutor(self.fault))
        return future


def with_pools(monkeypatch, *pools):
    """An executor whose worker lives in one of these after the other; (fault, idle) each."""
    clock = []
    monkeypatch.setattr("bns.sweep.jobs.workers.time", SimpleNamespace(perf_counter=lambda: sum(clock)))
    waiting = [Pool(clock, *pool) for pool in pools]

    def pool(_, slot):
        slot.pool = slot.pool or waiting.pop(0)
        return slot.pool

    monkeypatch.setattr(LokyExecutor, "_pool", pool)
    return LokyExecutor(1, sweep_jobs.ok)


@pytest.mark.parametrize(("signal_name", "hinted"), [("SIGKILL(-9)", True), ("SIGSEGV(-11)", False)])
def test_a_quarantined_run_took_as_long_as_all_its_attempts_and_names_what_killed_it(monkeypatch, signal_name, hinted):
    said = f"A worker process was terminated. The exit codes of the workers are {{{signal_name}}}"
    executor = with_pools(monkeypatch, *[(said, False)] * ATTEMPTS)
    executor.submit(ordered_specs(make_sweep())[0])
    *earlier, record = [executor.next(0.0) for _ in range(ATTEMPTS)]
    assert earlier == [None] * (ATTEMPTS - 1)
    assert (record.run["status"], record.run["wall_s"]) == ("quarantined", 10.0 * ATTEMPTS)
    assert f"died in each of {ATTEMPTS} attempts: {signal_name}." in record.run["error"]
    assert ("Killed from outside, most often for want of memory: use fewer jobs." in record.run["error"]) is hinted


def test_a_worker_that_died_while_it_was_idle_costs_its_next_run_no_attempt(monkeypatch):
    executor = with_pools(monkeypatch, (None, False), (None, False))
    specs = ordered_specs(make_sweep())
    executor.submit(specs[0])
    assert executor.next(0.0).run["attempts"] == 1
    executor._slots[0].pool.idle = True
    executor.submit(specs[1])
    assert executor.next(0.0).run["attempts"] == 1


@pytest.mark.parametrize(
    ("world", "names"),
    [
        ("physics", False),
        ("physics>substitute@3", False),
        ("worn.yaml", True),
        ("worn.yml", True),
        ("physics>worn.yaml@3", True),
        ("worn.yaml>physics@3", True),
    ],
)
def test_a_world_is_a_file_where_it_is_one_before_or_after_a_change(world, names):
    assert names_a_file(world) is names


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


def test_the_processor_time_of_a_worker_that_gave_no_answer_is_unknown():
    began = datetime(2026, 1, 1, tzinfo=UTC)
    record = without_result(ordered_specs(make_sweep())[0], "quarantined", "it died", began, 2.5)
    assert math.isnan(record.run["cpu_s"])
    assert (record.run["wall_s"], record.run["started_at"], record.tables) == (2.5, began, {})


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


@pytest.mark.parametrize("fault", [None, ValueError("no")])
def test_a_run_is_charged_with_its_own_time_and_not_with_that_of_compiling(monkeypatch, fault):
    """Clocks that stand in: compiling takes a hundred seconds, the run five, of which the processor works three."""
    now = {"wall": 0.0, "cpu": 0.0}

    def takes(wall_s, cpu_s):
        now["wall"] += wall_s
        now["cpu"] += cpu_s

    def carried_out(_spec):
        takes(5.0, 3.0)
        if fault:
            raise fault
        return SimpleNamespace(tables={}, world_digest="")

    monkeypatch.setattr("bns.sweep.jobs.job.warm", lambda *_: takes(100.0, 90.0))
    monkeypatch.setattr("bns.bootstrap.loop.run", carried_out)
    clocks = SimpleNamespace(perf_counter=lambda: now["wall"], process_time=lambda: now["cpu"])
    monkeypatch.setattr("bns.sweep.jobs.job.time", clocks)
    row = run_job(ordered_specs(make_sweep())[0]).run
    assert (row["status"], row["wall_s"], row["cpu_s"]) == ("failed" if fault else "ok", 5.0, 3.0)


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


def test_of_many_places_the_three_innermost_are_told():
    def down(steps):
        if not steps:
            raise ValueError("deep")
        down(steps - 1)

    for steps, names in ((0, ["down", "test_of_many_places_the_three_innermost_are_told"]), (5, ["down"] * 3)):
        with pytest.raises(ValueError, match="deep") as caught:
            down(steps)
        first, *places = describe(caught.value).splitlines()
        assert first == "ValueError: deep"
        assert [re.search(r" in (\w+): ", place)[1] for place in places] == names
        assert places[0].endswith(' in down: raise ValueError("deep")')
