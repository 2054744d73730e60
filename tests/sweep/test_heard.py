"""What runs in worker processes warn of: shown once by the process that sweeps, and how often it came."""

import threading
import warnings

import pytest
import sweep_jobs
from sweep_jobs import make_sweep

from bns.errors import SweepWarning
from bns.spec import RunSpec
from bns.store import load
from bns.sweep.jobs import heard
from bns.sweep.jobs.executor import ATTEMPTS
from bns.sweep.jobs.workers import LokyExecutor
from bns.sweep.runner import run_sweep


@pytest.fixture(autouse=True)
def as_before(monkeypatch):
    """This process is no worker: what a test lets it be ends with the test."""
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)


def said_in(results, executor, job, sweep):
    """Texts of the warnings of this process, without the places where they came, and the summary."""
    with pytest.warns(SweepWarning) as caught:
        summary = run_sweep(sweep, results, job=job, executor=executor)
    return [str(one.message).rpartition(" (")[0] for one in caught if issubclass(one.category, SweepWarning)], summary


def check(said, first):
    """Of 8 runs, 2 of each of 4 populations."""
    counts = sorted(text for text in said if text.startswith(("in 8 runs", "in 2 runs")))
    assert counts == ["in 2 runs: RuntimeWarning: a small population", "in 8 runs: UserWarning: the floor is not level"]
    at_once = [text.partition(": ")[2] for text in said if text not in counts]
    each = [f"UserWarning: seed {seed} of {10 + population}" for seed in range(2) for population in range(4)]
    assert sorted(at_once) == sorted(["RuntimeWarning: a small population", "UserWarning: the floor is not level", *each])
    assert said.index(counts[0]) > len(at_once) - 1  # the counts come last
    assert first in said[0]


def test_each_warning_of_the_workers_is_shown_once_and_counted(tmp_path, capfd):
    sweep = make_sweep()
    said, summary = said_in(tmp_path, LokyExecutor(2, sweep_jobs.warning), sweep_jobs.warning, sweep)
    assert summary.done == 8
    check(said, "UserWarning: the floor is not level")
    assert "floor" not in capfd.readouterr().err  # the workers themselves are silent
    assert set(load(tmp_path, "runs").status) == {"ok"}


def test_what_came_before_a_fault_or_a_death_is_printed_by_the_worker(tmp_path, capfd):
    one = make_sweep(combos=1, seeds=1)
    fault = LokyExecutor(1, sweep_jobs.warning_and_faulty)
    assert run_sweep(one, tmp_path / "fault", job=sweep_jobs.warning_and_faulty, executor=fault).failed == 1
    assert capfd.readouterr().err.count("UserWarning: about to fail") == 1
    death = LokyExecutor(1, sweep_jobs.warning_and_killed)
    assert run_sweep(one, tmp_path / "death", job=sweep_jobs.warning_and_killed, executor=death).quarantined == 1
    assert capfd.readouterr().err.count("UserWarning: about to die") == ATTEMPTS - 1


def test_threads_hear_their_own_runs_and_what_belongs_to_none_is_shown():
    shown, begun, go_on = [], threading.Event(), threading.Event()
    warnings.showwarning = lambda message, *_: shown.append(str(message))

    def job(spec):
        begun.set()
        go_on.wait(5)
        warnings.warn(f"seed {spec.seed}", stacklevel=1)
        return sweep_jobs.ok(spec)

    records = []
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        threads = [
            threading.Thread(target=lambda seed=seed: records.append(heard.listening(job, RunSpec(seed=seed, evaluations=2))))
            for seed in range(3)
        ]
        for thread in threads:
            thread.start()
        begun.wait(5)
        warnings.warn("of no run", stacklevel=1)
        go_on.set()
        for thread in threads:
            thread.join()
    assert shown == ["of no run"]
    assert sorted(record.heard[0].partition(" (")[0] for record in records) == [f"UserWarning: seed {seed}" for seed in range(3)]
    assert {len(record.heard) for record in records} == {1}


def test_a_run_without_warnings_says_nothing(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run_sweep(make_sweep(), tmp_path, job=sweep_jobs.ok, executor=LokyExecutor(1, sweep_jobs.ok)).done == 8
