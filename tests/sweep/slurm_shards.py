"""A shard whose runs only wait. In a module of its own, so that the job's process can import it."""

import os
from pathlib import Path

import sweep_jobs

from bns.sweep import slurm_job
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.runner import Summary, run_sweep


class WaitingShard(slurm_job.ShardJob):
    """Tells which process it is in, and replaces the worker processes there."""

    def __call__(self) -> Summary:
        Path(self.results).mkdir(exist_ok=True)
        (Path(self.results) / f"process-{os.getpid()}").touch()
        slurm_job.run_sweep = _waiting
        return super().__call__()


def _waiting(*arguments, jobs: int, **options) -> Summary:
    job = sweep_jobs.half_second
    return run_sweep(*arguments, job=job, executor=SerialExecutor(job), **options)
