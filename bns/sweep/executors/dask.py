"""The workers of a Dask scheduler, or a scheduler and workers of this machine's own."""

from __future__ import annotations

from collections import Counter
from urllib.parse import urlsplit

from bns.sweep.executors import joblib
from bns.sweep.expand.grid import Sweep
from bns.sweep.jobs.cores import cores
from bns.sweep.jobs.dask_link import DaskLink
from bns.sweep.jobs.dask_workers import DaskExecutor
from bns.sweep.request import Placement, Request
from bns.sweep.runner import Summary, run_sweep

_LOOK_S = 10.0


def placement(request: Request) -> Placement:
    """The workers that are with the scheduler now; ClusterError if there is none."""
    if request.scheduler is None:
        own = joblib.placement(request)
        return Placement(own.workers, f"a Dask scheduler of its own with {own.where}")
    link = DaskLink(request.scheduler, 0, _LOOK_S)
    try:
        threads = link.open().threads_by_worker()
    finally:
        link.close([])
    hosts = Counter(urlsplit(worker).hostname for worker in threads)
    listed = ", ".join(f"{count} on {host}" for host, count in sorted(hosts.items(), key=str))
    return Placement(sum(threads.values()), f"Dask workers of {request.scheduler}: {listed}")


def carry_out(sweep: Sweep, request: Request) -> Summary:
    """The sweep, or one shard of it, by Dask workers; this process stores what they send."""
    return run_sweep(
        sweep,
        request.results,
        budget=request.budget,
        retry_failed=request.retry_failed,
        on_progress=request.on_progress,
        shard=request.shard,
        executor=DaskExecutor(request.scheduler, cores(request.jobs)),
        warm_up=lambda: None,  # this process computes nothing
    )
