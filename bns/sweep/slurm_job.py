"""What one job of a SLURM array does: one shard, and another turn in the queue when its time is up."""

from __future__ import annotations

import os
import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from bns.extras import extra
from bns.sweep.expand.grid import Sweep
from bns.sweep.expand.shard import Shard
from bns.sweep.jobs.cores import cores
from bns.sweep.runner import Summary, run_sweep

with extra("cluster"):
    from submitit.helpers import DelayedSubmission

SIGNAL_S, GRACE_S = 120, 60.0
"""How long before the end of its time a job is told, and how long runs in flight may then take to finish."""

_TOLD = getattr(signal, "SIGUSR2", signal.SIGTERM)  # Windows, which has no SLURM, lacks the first
_ASK_S = 30.0


@dataclass(frozen=True)
class ShardJob:
    """A shard of ``sweep`` on the node that it is called on, with ``jobs`` worker processes or one a core.

    SIGUSR2 (the time is nearly up) and SIGTERM (preempted, or cancelled) end it as Ctrl-C does a sweep: runs in
    flight may finish, everything is stored. Unless it was cancelled it then asks for another turn.
    """

    sweep: Sweep
    results: Path
    shard: Shard
    jobs: int | None = None
    retry_failed: bool = False
    grace_s: float = GRACE_S

    def __call__(self) -> Summary:
        """Carry the shard out, or as much of it as there is time for."""
        requeue = signal.signal(_TOLD, _as_terminated)
        try:
            summary = run_sweep(
                self.sweep,
                self.results,
                jobs=cores(self.jobs),
                retry_failed=self.retry_failed,
                shard=self.shard,
                grace_s=self.grace_s,
            )
        finally:
            signal.signal(_TOLD, requeue)
        print(summary, flush=True)
        if summary.stopped_by is not None and not _was_cancelled():
            signal.raise_signal(_TOLD)  # submitit's own handler: it saves `checkpoint`, requeues, and exits
        return summary

    def checkpoint(self) -> DelayedSubmission:
        """The same again: the store knows what is done."""
        return DelayedSubmission(self)


def _as_terminated(_number: int, _frame: FrameType | None) -> None:
    signal.raise_signal(signal.SIGTERM)


def _was_cancelled() -> bool:
    """Whether the batch system has ended the job for good: a cancelled job must not come back."""
    job = os.environ.get("SLURM_JOB_ID")
    if job is None:
        return False
    try:
        asked = ["scontrol", "show", "job", "--oneliner", job]
        told = subprocess.run(asked, capture_output=True, text=True, timeout=_ASK_S, check=True).stdout
    except (OSError, subprocess.SubprocessError):
        return True  # nobody to ask: better one shard too few, which the same command makes up for
    return "JobState=RUNNING" not in told
