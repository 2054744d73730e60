"""SLURM job arrays, by submitit's local executor; with SLURM itself where there is one."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pandas as pd
import pytest
from slurm_shards import WaitingShard
from sweep_jobs import make_sweep, ok

pytest.importorskip("submitit")

import submitit

from bns.errors import ClusterError
from bns.registry import EXECUTORS
from bns.store import RunRecord, finished, load
from bns.sweep.budget import Budget
from bns.sweep.executors import executor_names, load_executor, slurm
from bns.sweep.expand.grid import parse_sweep
from bns.sweep.expand.shard import Shard
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.request import Request
from bns.sweep.runner import run_sweep
from bns.sweep.slurm_job import ShardJob

TEXT = """
name: small
robot: khepera
seeds: 2
fixed: {evaluations: 3, training_iterations_per_evaluation: 10, generations_per_evaluation: 1}
grid: {population_size: [8, 12]}
"""


def small(seeds: int = 2):
    return parse_sweep(TEXT.replace("seeds: 2", f"seeds: {seeds}"), Path("small.yaml"))


@pytest.fixture
def slurm_commands(tmp_path, monkeypatch):
    """Commands of that name which note what they are called with; scontrol knows of arrays of three."""
    folder = tmp_path / "commands"
    folder.mkdir()
    scripts = {
        "sbatch": 'for last; do :; done; cp "$last" "$0.$(ls "$0".* 2>/dev/null | wc -l)"; echo Submitted batch job $$',
        "scontrol": 'echo "MaxArraySize = 3"; echo "JobState=$JOB_STATE Reason=None"',
        "sacct": "true",
        "srun": "true",
    }
    for name, script in scripts.items():
        (folder / name).write_text(f"#!/bin/sh\n{script}\n")
        (folder / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    return folder


@pytest.mark.slow
def test_shards_of_the_local_executor_give_what_one_process_gives(tmp_path):
    request = Request(tmp_path / "a", jobs=1, shards=2, cluster="local", wait=True)
    summary = slurm.carry_out(small(), request)
    assert (summary.new, summary.done, summary.remaining, summary.stopped_by) == (4, 4, 0, None)
    run_sweep(small(), tmp_path / "b", executor=SerialExecutor())
    columns = [name for name in load(tmp_path / "a") if not name.endswith("_s")]
    pd.testing.assert_frame_equal(load(tmp_path / "a", columns=columns), load(tmp_path / "b", columns=columns))
    again = slurm.carry_out(small(), request)
    assert (again.new, again.done) == (0, 4)
    assert len(list((tmp_path / "a" / "slurm" / "small").glob("*_submitted.pkl"))) == 2  # none a second time


@pytest.mark.slow
def test_a_job_whose_time_is_up_stores_what_it_has_and_takes_another_turn(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))
    executor = submitit.LocalExecutor(tmp_path / "slurm", max_num_timeout=10)
    executor.update_parameters(timeout_min=5, signal_delay_s=1)
    job = executor.submit(WaitingShard(make_sweep(seeds=3), tmp_path / "a", Shard(1, 1), 1, grace_s=10))
    process = _process_that_has_stored(tmp_path / "a", job)
    os.kill(process, signal.SIGUSR2)
    assert job.result().done == 12
    log = job.stdout() + job.stderr()
    assert log.count("Starting with JobEnvironment") == 2
    assert "Requeued job" in log
    assert "stopped_by='terminated'" in log
    runs = load(tmp_path / "a", "runs")
    assert len(runs) == 12
    assert runs["run_id"].is_unique


def _process_that_has_stored(results: Path, job: submitit.LocalJob) -> int:
    end = time.monotonic() + 60
    while not any(path.stat().st_size for path in (results / "journal").glob("*.journal")):
        assert time.monotonic() < end, f"nothing was stored: {job.stderr()}"
        assert not job.done(), job.stderr()
        time.sleep(0.1)
    (mark,) = results.glob("process-*")
    return int(mark.name.split("-")[1])


@pytest.mark.parametrize(("state", "returns"), [("RUNNING", False), ("CANCELLED", True), ("COMPLETING", True)])
def test_only_a_job_that_was_not_cancelled_asks_for_another_turn(slurm_commands, monkeypatch, tmp_path, state, returns):
    monkeypatch.setenv("SLURM_JOB_ID", "7")
    monkeypatch.setenv("JOB_STATE", state)
    asked = []
    monkeypatch.setattr("bns.sweep.slurm_job.run_sweep", lambda *_, **__: _terminated())
    former = signal.signal(signal.SIGUSR2, lambda *_: asked.append(True))
    try:
        summary = ShardJob(small(), tmp_path, Shard(1, 1), 1)()
        assert signal.getsignal(signal.SIGUSR2) not in {former, signal.SIG_DFL}  # put back
    finally:
        signal.signal(signal.SIGUSR2, former)
    assert summary.stopped_by == "terminated"
    assert asked == ([] if returns else [True])


def test_a_job_comes_back_only_if_somebody_says_that_it_is_running_and_it_is_not_done(slurm_commands, monkeypatch, tmp_path):
    asked, ended = [], [_terminated(), _done()]
    monkeypatch.setenv("SLURM_JOB_ID", "7")
    monkeypatch.setenv("JOB_STATE", "RUNNING")
    monkeypatch.setattr("bns.sweep.slurm_job.run_sweep", lambda *_, **__: ended.pop())
    former = signal.signal(signal.SIGUSR2, lambda *_: asked.append(True))
    try:
        assert ShardJob(small(), tmp_path, Shard(1, 1), 1)().stopped_by is None
        (slurm_commands / "scontrol").write_text("#!/bin/sh\nexit 1\n")
        assert ShardJob(small(), tmp_path, Shard(1, 1), 1)().stopped_by == "terminated"
    finally:
        signal.signal(signal.SIGUSR2, former)
    assert asked == []


def _done():
    from bns.sweep.runner import Summary

    return Summary("small", 4, done=4)


def _terminated():
    from bns.sweep.runner import Summary

    return Summary("small", 4, done=1, stopped_by="terminated")


def test_scripts_ask_for_what_was_given_in_arrays_that_the_cluster_takes(slurm_commands, tmp_path):
    options = (("partition", "long"), ("account", "lab"))
    request = Request(tmp_path, jobs=4, shards=7, time_limit_s=7200.0, options=options)
    assert slurm.placement(request).workers == 28
    assert "3 array(s), 2.0 h a turn" in slurm.placement(request).where
    summary = slurm.carry_out(small(), request)
    assert (summary.stopped_by, summary.new) == ("submitted", 0)
    scripts = [path.read_text() for path in sorted(slurm_commands.glob("sbatch.*"))]
    assert [s.split("--array=")[1].split("%")[0] for s in scripts if "--array=" in s] == ["0-2", "0-2"]
    assert len(scripts) == 3
    wanted = "--partition=long", "--account=lab", "--time=120", "--cpus-per-task=4", "--signal=USR2@120", "--cpu-bind=none"
    assert all(option in script for option in wanted for script in scripts)


def test_a_node_is_used_whole_where_no_number_is_given(slurm_commands, tmp_path):
    slurm.carry_out(small(), Request(tmp_path, shards=2))
    (script,) = [path.read_text() for path in slurm_commands.glob("sbatch.*")]
    assert "#SBATCH --exclusive" in script


def test_a_limit_below_a_minute_is_one_because_none_is_no_limit_to_slurm(slurm_commands, tmp_path):
    slurm.carry_out(small(), Request(tmp_path, shards=2, time_limit_s=20.0))
    (script,) = [path.read_text() for path in slurm_commands.glob("sbatch.*")]
    assert "#SBATCH --time=1\n" in script


def test_shards_of_which_every_run_has_failed_are_queued_only_on_request(slurm_commands, tmp_path):
    def never(spec):
        return RunRecord(spec, {**ok(spec).run, "status": "failed", "error": "ValueError: no"})

    run_sweep(small(), tmp_path, job=never, executor=SerialExecutor(never))
    assert slurm.carry_out(small(), Request(tmp_path, shards=2)).stopped_by is None
    assert not list(slurm_commands.glob("sbatch.*"))
    assert slurm.carry_out(small(), Request(tmp_path, shards=2, retry_failed=True)).stopped_by == "submitted"
    assert len(list(slurm_commands.glob("sbatch.*"))) == 1


def test_runs_that_went_wrong_before_are_not_counted_as_new(slurm_commands, monkeypatch, tmp_path):
    def never(spec):
        return RunRecord(spec, {**ok(spec).run, "status": ("failed", "quarantined")[spec.seed], "error": "ValueError: no"})

    run_sweep(small(), tmp_path, job=never, executor=SerialExecutor(never))
    monkeypatch.setattr(slurm, "_submit", lambda *_: [])
    waited = slurm.carry_out(small(), Request(tmp_path, shards=2, retry_failed=True, wait=True))
    assert (waited.failed, waited.quarantined, waited.new, waited.new_failed) == (2, 2, 0, 0)


def test_what_slurm_refuses_is_told(slurm_commands, tmp_path):
    (slurm_commands / "sbatch").write_text("#!/bin/sh\necho 'sbatch: error: invalid partition' >&2; exit 1\n")
    with pytest.raises(ClusterError, match=r"SLURM did not take the jobs: .*invalid partition.*--slurm NAME=VALUE"):
        slurm.carry_out(small(), Request(tmp_path, shards=2))


def test_what_makes_no_sense_is_refused(tmp_path, monkeypatch):
    with pytest.raises(ClusterError, match="give --shards N"):
        slurm.carry_out(small(), Request(tmp_path, shard=Shard(1, 2)))
    with pytest.raises(ClusterError, match="give --time-limit"):
        slurm.carry_out(small(), Request(tmp_path, budget=Budget(60.0)))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ClusterError, match=r"no sbatch here.*--try-locally.*--shard K/N"):
        slurm.carry_out(small(), Request(tmp_path))
    assert not list(tmp_path.iterdir())


def test_executors_are_found_by_name():
    assert executor_names() == ("cuda", "dask", "joblib", "slurm")
    with pytest.raises(ClusterError, match=r"unknown executor 'slrm'\. Did you mean 'slurm'\?"):
        load_executor("slrm")


def test_a_missing_library_is_named(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "submitit", None)
    monkeypatch.delitem(__import__("sys").modules, "bns.sweep.executors.slurm")
    monkeypatch.setattr(EXECUTORS, "_loaded", {})
    with pytest.raises(ClusterError, match=r"--executor slurm: .*submitit.*bns\[cluster\]"):
        load_executor("slurm")


def _slurm_is_at_work() -> bool:
    try:
        return subprocess.run(["sinfo"], capture_output=True, check=False, timeout=5).returncode == 0
    except (OSError, subprocess.SubprocessError):
        return False


@pytest.mark.skipif(not _slurm_is_at_work(), reason="there is no SLURM at work here")
def test_slurm_itself_carries_out_two_shards(tmp_path):
    results = tmp_path / "a"
    slurm.carry_out(small(), Request(results, jobs=1, shards=2))
    end = time.monotonic() + 240
    while len(finished(results, "small")) < 4:
        assert time.monotonic() < end, "the jobs did not end"
        time.sleep(1.0)
    assert load(results, "runs")["status"].eq("ok").all()
