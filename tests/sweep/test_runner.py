"""A sweep in the store: resume, failures, budget, limit, worlds, locks."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import sweep_jobs
from sweep_jobs import make_sweep

from bns.errors import ModelError, StoreError, SweepWarning
from bns.spec import RunSpec
from bns.store.read.reader import load
from bns.store.record import RunRecord
from bns.store.write.writer import Writer
from bns.sweep import runner
from bns.sweep.budget import Budget
from bns.sweep.expand.grid import Sweep
from bns.sweep.expand.order import ordered_specs
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.jobs.job import prepare
from bns.sweep.jobs.workers import LokyExecutor
from bns.sweep.runner import Summary, run_sweep


def serial(sweep, results, job=sweep_jobs.ok, **options) -> Summary:
    return run_sweep(sweep, results, job=job, executor=SerialExecutor(job), **options)


def fails(world, _robot):
    raise ModelError(world)


def fails_for_seed_0(spec) -> RunRecord:
    if spec.seed == 0:
        return RunRecord(spec, {**sweep_jobs.ok(spec).run, "status": "failed", "error": "ValueError: seed"})
    return sweep_jobs.ok(spec)


def test_all_runs_are_stored_with_their_numbers(tmp_path):
    sweep = make_sweep()
    assert run_sweep(sweep, tmp_path, jobs=2, job=sweep_jobs.ok) == Summary("demo", 8, done=8, new=8)
    evals = load(tmp_path)
    assert set(evals["run_id"]) == {spec.run_id for spec in ordered_specs(sweep)}
    for spec in ordered_specs(sweep):
        mine = evals[evals["run_id"] == spec.run_id]
        np.testing.assert_array_equal(mine["diversity"], sweep_jobs.evals_of(spec)["diversity"])
    assert load(tmp_path, "specs")["runs"].tolist() == []  # a sweep without text has no row


def test_workers_and_this_process_store_the_same(tmp_path):
    run_sweep(make_sweep(), tmp_path / "a", jobs=2, job=sweep_jobs.ok)
    serial(make_sweep(), tmp_path / "b")
    pd.testing.assert_frame_equal(load(tmp_path / "a"), load(tmp_path / "b"))


def test_limit_then_resume_does_only_the_rest_in_order(tmp_path):
    sweep, begun = make_sweep(text="name: demo\n"), []

    def job(spec):
        begun.append(spec)
        return sweep_jobs.ok(spec)

    first = serial(sweep, tmp_path, job, limit=3)
    assert (first.new, first.done, first.remaining, first.stopped_by) == (3, 3, 5, "limit")
    second = serial(sweep, tmp_path, job)
    assert (second.new, second.done, second.remaining, second.stopped_by) == (5, 8, 0, None)
    assert begun == ordered_specs(sweep)
    assert serial(sweep, tmp_path, job).new == 0
    assert len(begun) == 8
    assert load(tmp_path, "specs")["runs"].tolist() == [8]


def test_more_seeds_later_run_only_the_new_ones(tmp_path):
    serial(make_sweep(seeds=1), tmp_path)
    assert serial(make_sweep(seeds=3), tmp_path).new == 8


def test_failed_runs_are_rows_and_redone_only_on_request(tmp_path):
    sweep = make_sweep()
    first = serial(sweep, tmp_path, fails_for_seed_0)
    assert (first.done, first.failed, first.remaining, first.stopped_by) == (4, 4, 0, None)
    assert first.new_failed == 4
    runs = load(tmp_path, "runs", where={"status": "failed"})
    assert set(runs["error"]) == {"ValueError: seed"}
    idle = serial(sweep, tmp_path)
    assert (idle.new, idle.failed, idle.new_failed) == (0, 4, 0)
    again = serial(sweep, tmp_path, retry_failed=True)
    assert (again.new, again.done, again.failed, again.new_failed) == (4, 8, 0, 0)
    assert load(tmp_path)["run_id"].nunique() == 8


def test_results_of_another_sweep_of_that_name_are_warned_of_once(tmp_path):
    serial(make_sweep(combos=4), tmp_path, fails_for_seed_0)
    message = r"already holds 6 finished runs .* 'demo' that x\.yaml does not .* leave them out .* give the sweep another name"
    with pytest.warns(SweepWarning, match=message) as caught:
        summary = serial(make_sweep(combos=1), tmp_path)
    assert (len(caught), caught[0].filename) == (1, __file__)
    assert (summary.total, summary.done, summary.failed) == (2, 1, 1)
    assert serial(make_sweep(combos=5), tmp_path).new == 2  # it describes all that is there: no warning


def test_progress_is_told_after_each_run_that_it_is_stored(tmp_path):
    seen = []

    def look(summary: Summary) -> None:
        stored = load(tmp_path, "runs") if summary.new else []
        seen.append((summary.new, len(stored)))

    serial(make_sweep(), tmp_path, on_progress=look)
    assert seen == [(n, n) for n in range(9)]


class Clock:
    """Time that passes only when a run takes it."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now

    def job(self, spec):
        self.now += 2.0
        return sweep_jobs.ok(spec, wall_s=2.0)


def test_budget_begins_no_run_that_would_end_after_it(tmp_path):
    clock = Clock()
    summary = serial(make_sweep(), tmp_path, clock.job, budget=Budget(7.0, clock))
    assert (summary.new, summary.remaining, summary.stopped_by) == (3, 5, "budget")


def test_a_run_that_would_end_with_the_last_of_the_budget_is_not_begun(tmp_path):
    clock = Clock()
    nothing = serial(make_sweep(), tmp_path, clock.job, budget=Budget(0.0, clock))
    assert (nothing.new, nothing.stopped_by) == (0, "budget")
    summary = serial(make_sweep(), tmp_path, clock.job, budget=Budget(4.0, clock))
    assert (summary.new, summary.stopped_by) == (1, "budget")


def test_failures_that_took_no_time_do_not_make_runs_seem_shorter(tmp_path):
    clock, begun = Clock(), []

    def job(spec):
        begun.append(spec)
        if len(begun) <= 3:
            return RunRecord(spec, {**sweep_jobs.ok(spec, wall_s=0.0).run, "status": "failed", "error": "ValueError: no"})
        clock.now += 10.0
        return sweep_jobs.ok(spec, wall_s=10.0)

    summary = serial(make_sweep(), tmp_path, job, budget=Budget(15.0, clock))
    assert (summary.failed, summary.done, summary.stopped_by) == (3, 1, "budget")


def test_budget_is_shared_by_sweeps(tmp_path):
    clock = Clock()
    budget = Budget(21.0, clock)
    assert serial(make_sweep("one"), tmp_path, clock.job, budget=budget).stopped_by is None
    two = serial(make_sweep("two"), tmp_path, clock.job, budget=budget)
    assert (two.new, two.stopped_by) == (2, "budget")


def test_no_budget_at_all_begins_nothing(tmp_path):
    assert serial(make_sweep(), tmp_path, budget=Budget(0.0)).stopped_by == "budget"


def test_another_world_is_refused_before_anything_is_mixed(tmp_path):
    serial(make_sweep(), tmp_path, limit=3)
    message = r"made with world w1 \(task circle, world substitute\), but .* world w2: .*another folder"
    with pytest.raises(StoreError, match=message):
        serial(make_sweep(), tmp_path, sweep_jobs.other_world)
    assert set(load(tmp_path, "runs")["world_digest"]) == {"w1"}
    assert serial(make_sweep("other"), tmp_path, sweep_jobs.other_world).done == 8


def test_second_process_on_the_same_sweep_is_refused_and_another_sweep_is_not(tmp_path):
    with Writer(tmp_path, "demo"):
        with pytest.raises(StoreError, match="demo"):
            serial(make_sweep("demo"), tmp_path)
        assert serial(make_sweep("other"), tmp_path).done == 8


def test_full_disk_ends_the_sweep_and_keeps_what_was_finished(tmp_path, monkeypatch):
    append, calls = Writer.append, []

    def fill_up(self, record):
        calls.append(record)
        if len(calls) == 4:
            raise StoreError("cannot write: No space left on device.")
        append(self, record)

    monkeypatch.setattr(Writer, "append", fill_up)
    executor = LokyExecutor(2, sweep_jobs.short)
    with pytest.raises(StoreError, match="No space left"):
        run_sweep(make_sweep(), tmp_path, executor=executor)
    assert executor.in_flight == 0
    monkeypatch.undo()
    assert len(load(tmp_path, "runs")) == 3
    assert serial(make_sweep(), tmp_path).new == 5


def test_kernels_are_warmed_once_and_only_if_there_is_work(tmp_path):
    calls = []
    serial(make_sweep(), tmp_path, warm_up=lambda: calls.append(1))
    serial(make_sweep(), tmp_path, warm_up=lambda: calls.append(1))
    assert calls == [1]


def test_kernels_on_the_disk_are_not_compiled_again_but_a_missing_world_is_found(monkeypatch):
    calls = []
    monkeypatch.setattr("bns.sweep.jobs.job.warm", lambda *what: calls.append(what))
    monkeypatch.setattr("bns.engine.jit.compiled", lambda _robot, world: world == "substitute")
    prepare([RunSpec(), RunSpec(world="physics"), RunSpec(seed=1, world="physics")])
    assert calls == [("khepera", "physics")]
    monkeypatch.setattr("bns.worlds.build_world", fails)
    with pytest.raises(ModelError, match="substitute"):
        prepare([RunSpec()])


def test_real_runs_are_the_same_for_any_number_of_workers(tmp_path):
    small = {
        "population_size": 10,
        "evaluations": 4,
        "generations_per_evaluation": 2,
        "training_iterations_per_evaluation": 20,
    }
    sweep = Sweep("real", "khepera", 4, (small,), "", Path("x.yaml"))
    tables = []
    for jobs in 1, 2:
        assert run_sweep(sweep, tmp_path / str(jobs), jobs=jobs).done == 4
        evals = load(tmp_path / str(jobs))
        tables.append(evals[[name for name in evals if not name.endswith("_s")]])
    pd.testing.assert_frame_equal(*tables)
    assert len(tables[0]) == 16
    assert tables[0].groupby("seed")["fitness_world"].sum().nunique() == 4
    runs = load(tmp_path / "1", "runs")
    assert runs["peak_memory_mib"].between(20, 20_000).all()


@pytest.mark.parametrize("retry", [True, False])
def test_quarantined_runs_are_redone_like_failed_ones_and_only_on_request(tmp_path, monkeypatch, retry):
    sweep = make_sweep(seeds=3)
    first, second, third = (spec.run_id for spec in ordered_specs(sweep)[:3])
    monkeypatch.setattr("bns.sweep.runner.recorded", lambda *_: {first: "quarantined", second: "failed"})
    todo = [spec.run_id for spec in runner._SweepRun(sweep, tmp_path, Budget(), lambda _: None, None).plan(retry, None)]
    assert ([first in todo, second in todo, third in todo]) == [retry, retry, True]
