"""Worker processes of this machine, all of its cores by default."""

from __future__ import annotations

import platform

from bns.sweep.expand.grid import Sweep
from bns.sweep.jobs.cores import cores
from bns.sweep.request import Placement, Request
from bns.sweep.runner import Summary, run_sweep


def placement(request: Request) -> Placement:
    """The worker processes of this machine."""
    jobs = cores(request.jobs)
    return Placement(jobs, f"{jobs} worker processes on {platform.node()} ({cores()} cores)")


def carry_out(sweep: Sweep, request: Request) -> Summary:
    """The sweep, or one shard of it, in worker processes of this machine."""
    return run_sweep(
        sweep,
        request.results,
        jobs=cores(request.jobs),
        budget=request.budget,
        retry_failed=request.retry_failed,
        on_progress=request.on_progress,
        shard=request.shard,
    )
