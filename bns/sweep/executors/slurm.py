"""Job arrays of a SLURM cluster: every job sweeps one shard with the worker processes of its node.

The folder of results, which all nodes must see, is all that they share; scripts and logs are in ``slurm/`` there.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from bns.errors import ClusterError
from bns.extras import extra
from bns.store.archive.read import recorded
from bns.sweep.expand.grid import Sweep
from bns.sweep.expand.order import ordered_specs
from bns.sweep.expand.shard import Shard
from bns.sweep.request import Placement, Request
from bns.sweep.runner import Summary
from bns.sweep.slurm_job import SIGNAL_S, ShardJob

with extra("cluster"):
    import submitit

SHARDS = 16
LARGEST_ARRAY = 1000
"""SLURM's own limit of an array's jobs where `scontrol` does not tell another one."""

_TURNS = 10_000
_LOOK_S, _ASK_S = 5.0, 30.0


def placement(request: Request) -> Placement:
    """The jobs that would be queued."""
    shards = request.shards or SHARDS
    processes = f"{request.jobs} worker processes" if request.jobs else "a node each, all of its cores (taken for 1)"
    arrays = len(list(_pieces(range(shards), _largest_array(request))))
    where = f"{shards} jobs of {processes}, {arrays} array(s), {request.time_limit_s / 3600:.1f} h a turn"
    return Placement(shards * (request.jobs or 1), where)


def carry_out(sweep: Sweep, request: Request) -> Summary:
    """Queue the shards; with ``wait`` stay until they are done.

    Raises:
        ClusterError: there is no SLURM here, it does not take the jobs, or the request asks for what it cannot do.
    """
    _check(request)
    summary = _stand(sweep, request, "submitted")
    if summary.remaining or request.retry_failed:
        jobs = _submit(sweep, request)
        if request.wait:
            return _wait(sweep, request, jobs)
        return summary
    return _stand(sweep, request, None)


def _check(request: Request) -> None:
    if request.shard is not None:
        raise ClusterError("--shard is what each job of --executor slurm does by itself; give --shards N for their number.")
    if request.budget.left_s != float("inf"):
        raise ClusterError("--budget is for one process; give --time-limit, the time that each job of the array has.")
    if request.cluster == "slurm" and shutil.which("sbatch") is None:
        raise ClusterError(
            "there is no sbatch here, the command of SLURM. Run this on a login node of the cluster, or try the same on "
            "this machine with --try-locally; for another batch system give each of its jobs --shard K/N."
        )


def _submit(sweep: Sweep, request: Request) -> list[submitit.Job[Any]]:
    count = request.shards or SHARDS
    results = request.results.resolve()
    shards = [
        ShardJob(sweep, results, Shard(number, count), request.jobs, request.retry_failed)
        for number in range(1, count + 1)
    ]
    executor = _executor(sweep, request, results / "slurm" / sweep.name)
    jobs: list[submitit.Job[Any]] = []
    try:
        for piece in _pieces(shards, _largest_array(request)):
            with executor.batch():
                jobs += [executor.submit(shard) for shard in piece]
    except (OSError, subprocess.SubprocessError, submitit.core.utils.FailedJobError) as error:
        raise ClusterError(
            f"SLURM did not take the jobs: {' '.join(str(error).split())}. {len(jobs)} of {count} shards are queued. "
            "Fix what it names (--slurm NAME=VALUE gives an option of sbatch) and repeat the command."
        ) from error
    return jobs


def _executor(sweep: Sweep, request: Request, folder: Path) -> submitit.AutoExecutor:
    executor = submitit.AutoExecutor(folder=folder, cluster=request.cluster, slurm_max_num_timeout=_TURNS)
    executor.update_parameters(
        name=f"bns-{sweep.name}",
        timeout_min=max(1, round(request.time_limit_s / 60)),
        cpus_per_task=request.jobs or 1,
        slurm_signal_delay_s=SIGNAL_S,
        slurm_array_parallelism=LARGEST_ARRAY,
        # Without it a node's cores are the job's, and the shard's process is bound to one of them.
        slurm_srun_args=["--cpu-bind=none"],
        slurm_additional_parameters=dict(request.options),
        **({} if request.jobs else {"slurm_exclusive": True}),
    )
    return executor


def _largest_array(request: Request) -> int:
    """Jobs that one array may have."""
    if request.cluster != "slurm":
        return LARGEST_ARRAY
    try:
        told = subprocess.run(
            ["scontrol", "show", "config"], capture_output=True, text=True, timeout=_ASK_S, check=True
        ).stdout
    except (OSError, subprocess.SubprocessError):
        return LARGEST_ARRAY
    found = re.search(r"^MaxArraySize\s*=\s*(\d+)", told, re.MULTILINE)
    return max(1, int(found[1])) if found else LARGEST_ARRAY


def _pieces(items: Sequence[Any], size: int) -> Iterator[Sequence[Any]]:
    return (items[start : start + size] for start in range(0, len(items), size))


def _wait(sweep: Sweep, request: Request, jobs: Sequence[submitit.Job[Any]]) -> Summary:
    began = _stand(sweep, request, None)
    while not all(job.done() for job in jobs):
        request.on_progress(_stand(sweep, request, None, began))
        time.sleep(_LOOK_S)
    return _stand(sweep, request, None, began)


def _stand(sweep: Sweep, request: Request, stopped_by: str | None, began: Summary | None = None) -> Summary:
    """What the store says of the sweep; with what is new since ``began``."""
    known = recorded(request.results, sweep.name)
    counts = [known.get(spec.run_id) for spec in ordered_specs(sweep)] if known else []
    done, failed, quarantined = (counts.count(status) for status in ("ok", "failed", "quarantined"))
    new = 0 if began is None else done + failed + quarantined - (sweep.total - began.remaining)
    new_failed = 0 if began is None else failed + quarantined - began.failed - began.quarantined
    return Summary(sweep.name, sweep.total, done, failed, quarantined, new, new_failed, stopped_by)
