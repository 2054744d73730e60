"""Dask: real scheduler and worker processes on this machine, some of which die."""

import os
import signal
import sys
import time
import types
import warnings
from pathlib import Path

import pandas as pd
import pytest
import sweep_jobs
from sweep_jobs import make_sweep

pytest.importorskip("distributed")

from dask_cluster import Cluster
from distributed import Client

from bns.errors import ClusterError, SweepWarning
from bns.store import load
from bns.sweep.expand.order import ordered_specs
from bns.sweep.jobs import dask_link
from bns.sweep.jobs.dask_job import LeavesSignals
from bns.sweep.jobs.dask_workers import DaskExecutor, DaskWarning, _advise
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.jobs.workers import LEFT_TO_PARENT
from bns.sweep.runner import run_sweep


@pytest.fixture(scope="module")
def marks(tmp_path_factory):
    folder = tmp_path_factory.mktemp("marks")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(sweep_jobs.MARKS, str(folder))
        yield folder


@pytest.fixture(scope="module")
def cluster(marks):
    with Cluster(2) as started:
        yield started


def carry_out(cluster, folder, job, sweep=None, **options):
    executor = DaskExecutor(cluster.address, job=job, patience_s=60)
    return run_sweep(sweep or make_sweep(), folder, job=job, executor=executor, **options)


def test_same_evals_as_of_one_process(cluster, tmp_path):
    summary = carry_out(cluster, tmp_path / "dask", sweep_jobs.ok)
    run_sweep(make_sweep(), tmp_path / "one", job=sweep_jobs.ok, executor=SerialExecutor(sweep_jobs.ok))
    assert (summary.done, summary.stopped_by) == (8, None)
    pd.testing.assert_frame_equal(load(tmp_path / "dask"), load(tmp_path / "one"))
    assert set(load(tmp_path / "dask", "runs")["attempts"]) == {1}


def test_warnings_of_the_workers_come_back_with_the_runs(cluster, tmp_path):
    with pytest.warns(SweepWarning) as caught:
        carry_out(cluster, tmp_path, sweep_jobs.warning)
    said = [str(one.message).rpartition(" (")[0] for one in caught if issubclass(one.category, SweepWarning)]
    assert sum("the floor is not level" in text for text in said) == 2
    counts = ["in 2 runs: RuntimeWarning: a small population", "in 8 runs: UserWarning: the floor is not level"]
    assert sorted(said[-2:]) == counts


def test_a_fault_in_a_run_is_a_failed_row_and_its_worker_lives(cluster, tmp_path):
    summary = carry_out(cluster, tmp_path, sweep_jobs.faulty)
    assert summary.failed == 8
    assert load(tmp_path, "runs")["error"].str.startswith("SystemExit: 3").all()


def test_a_run_that_survives_the_second_attempt_is_ok(cluster, tmp_path):
    summary = carry_out(cluster, tmp_path, sweep_jobs.killed_once)
    assert summary.done == 8
    runs = load(tmp_path, "runs")
    killed = (runs["population_size"] == 10) & (runs["seed"] == runs["seed"].min())
    assert runs["attempts"][killed].tolist() == [2]
    assert sorted(runs["attempts"][~killed]) in ([1] * 7, [1] * 6 + [2])  # its worker may have had another result


@pytest.mark.slow
def test_a_run_whose_result_dies_with_its_worker_was_attempted_twice(marks):
    with Cluster(1) as alone, DaskExecutor(alone.address, job=sweep_jobs.ok, patience_s=60) as executor:
        executor.submit(ordered_specs(make_sweep())[0])
        [flight] = executor._flights.values()
        give_up_at = time.monotonic() + 180
        while flight.future.status != "finished" and time.monotonic() < give_up_at:
            time.sleep(0.05)  # the worker has the result then, and nobody has fetched it
        with Client(alone.address, set_as_default=False) as client:
            [pid] = client.run(os.getpid).values()
        os.kill(pid, signal.SIGKILL)
        records = [None]
        while records[-1] is None and time.monotonic() < give_up_at:
            records.append(executor.next(1.0))
    assert records[-1].run["attempts"] == 2


def test_budget_and_limit_hold(cluster, tmp_path):
    assert carry_out(cluster, tmp_path, sweep_jobs.ok, limit=3).stopped_by == "limit"
    assert len(load(tmp_path, "runs")) == 3


def test_workers_of_another_engine_stop_the_sweep(cluster, tmp_path, monkeypatch):
    monkeypatch.setattr("bns.spec.ENGINE_VERSION", 999)
    with pytest.raises(ClusterError, match="The same bns, with the same engine version"):
        carry_out(cluster, tmp_path, sweep_jobs.ok)


def test_workers_that_lack_the_code_stop_the_sweep(cluster, tmp_path, monkeypatch):
    here = types.ModuleType("only_here")
    exec("def job(spec): raise AssertionError", here.__dict__)
    monkeypatch.setitem(sys.modules, "only_here", here)
    with pytest.raises(ClusterError, match="could not carry out a run"):
        carry_out(cluster, tmp_path, here.job)


def test_runs_in_flight_are_given_up_at_once(cluster, tmp_path):
    spec = ordered_specs(make_sweep())[0]
    with DaskExecutor(cluster.address, job=sweep_jobs.short) as executor:
        executor.submit(spec)
        executor.cancel()
        assert (executor.free, executor.in_flight, executor.next(0.01)) == (0, 0, None)


def test_no_scheduler_is_explained():
    with pytest.raises(ClusterError, match=r"no Dask scheduler answers at tcp://127.0.0.1:9"):
        DaskExecutor("tcp://127.0.0.1:9", patience_s=2).__enter__()
    with pytest.raises(ClusterError, match=r"'nonsense:x:y' is no address of a Dask scheduler"):
        DaskExecutor("nonsense:x:y").__enter__()


def test_a_client_whose_thread_starts_too_late_is_tried_again(cluster, monkeypatch):
    tried, client = [], dask_link.Client

    def slow(*arguments, **options):
        tried.append(arguments)
        if len(tried) == 1:
            raise AssertionError
        return client(*arguments, **options)

    monkeypatch.setattr(dask_link, "Client", slow)
    with DaskExecutor(cluster.address) as executor:
        assert executor.free
    assert len(tried) == 2


@pytest.mark.slow
def test_scheduler_without_workers_is_explained():
    with Cluster(0) as empty, pytest.raises(ClusterError, match=r"no worker has joined.*dask worker tcp://"):
        DaskExecutor(empty.address, patience_s=10).__enter__()


@pytest.mark.slow
def test_killed_scheduler_is_waited_for_and_the_sweep_goes_on(tmp_path, marks):
    stored = []

    def restart(summary):
        stored.append(summary.new)
        if summary.new == 3 and stored.count(3) == 1:
            cluster.stop()
            cluster.start()

    with Cluster(1, threads=2) as cluster, pytest.warns(DaskWarning, match="more than one thread .* --nthreads 1"):
        summary = carry_out(cluster, tmp_path, sweep_jobs.short, on_progress=restart)
    assert (summary.done, summary.new) == (8, 8)
    assert load(tmp_path, "runs")["run_id"].is_unique
    assert len(load(tmp_path)) == 8 * 3


@pytest.mark.slow
def test_own_cluster_quarantines_the_run_that_kills_its_workers(tmp_path, marks, monkeypatch):
    path = [str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path))
    sweep = make_sweep(combos=3, seeds=1)
    began = time.monotonic()
    summary = run_sweep(
        sweep, tmp_path, job=sweep_jobs.killed, executor=DaskExecutor(workers=1, job=sweep_jobs.killed)
    )
    assert (summary.done, summary.quarantined) == (2, 1)
    lost = load(tmp_path, "runs", where={"status": "quarantined"})
    assert lost["attempts"].tolist() == [3]
    assert "died in each of 3 attempts" in lost["error"][0]
    assert time.monotonic() - began < 200


def test_workers_of_its_own_leave_ctrl_c_to_the_process_that_sweeps():
    former = {number: signal.getsignal(number) for number in LEFT_TO_PARENT}
    try:
        LeavesSignals().setup(None)
        for number in LEFT_TO_PARENT:
            os.kill(os.getpid(), number)  # would end this process
        time.sleep(0.05)
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)


def test_every_thread_of_a_worker_takes_a_run_and_one_run_waits_for_the_first_worker(monkeypatch):
    link = dask_link.DaskLink("tcp://127.0.0.1:8786", 1, 1.0)
    assert link.slots == 1
    for threads, slots in (({"a": 2, "b": 3}, 5), ({"a": 1}, 1), ({}, 1)):
        client = types.SimpleNamespace(status="running", nthreads=lambda threads=threads: threads)
        monkeypatch.setattr(link, "_client", client)
        link._looked_at = float("-inf")
        assert link.slots == slots


def test_workers_with_two_threads_are_advised_against_and_those_with_one_are_not():
    with pytest.warns(DaskWarning, match=r"1 Dask workers have more than one thread \(b has 2\).*--nthreads 1"):
        _advise({"a": 1, "b": 2})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _advise({"a": 1, "b": 1})
