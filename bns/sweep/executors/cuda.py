"""The GPU of this machine: thousands of runs side by side, in one process."""

from __future__ import annotations

from functools import partial

from bns.cuda.batch import warm
from bns.cuda.device import device_name
from bns.cuda.support import check_supported
from bns.errors import SpecError
from bns.spec import RunSpec
from bns.sweep.expand.grid import Sweep
from bns.sweep.jobs.batches import BatchExecutor
from bns.sweep.request import Placement, Request
from bns.sweep.runner import Summary, run_sweep


def placement(request: Request) -> Placement:
    """Nothing can be foretold: SpecError."""
    raise SpecError("--dry-run knows the speed of cores, not of a GPU; leave --device out to count runs and disk space.")


def carry_out(sweep: Sweep, request: Request) -> Summary:
    """The sweep, or one shard of it, on the GPU; a kill loses the batch in flight.

    Raises:
        SpecError: there are runs in it that only the CPU can do.
        DeviceError: no GPU, or it failed.
    """
    check_supported(RunSpec(robot=sweep.robot, **combo) for combo in sweep.combos)
    device_name()
    return run_sweep(
        sweep,
        request.results,
        budget=request.budget,
        retry_failed=request.retry_failed,
        on_progress=request.on_progress,
        shard=request.shard,
        executor=BatchExecutor(lambda: request.budget.left_s),
        warm_up=partial(warm, sweep.robot),
    )
