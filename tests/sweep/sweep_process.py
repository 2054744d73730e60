"""A sweep as a process of its own, for tests that kill it: RESULTS JOBS JOB [NAME] [GRACE_S]."""

import json
import sys
from dataclasses import asdict
from pathlib import Path

import sweep_jobs

from bns.sweep.runner import run_sweep


def main(results: str, jobs: str, job: str, name: str = "demo", grace_s: str = "20") -> None:
    print("importing done", flush=True)
    summary = run_sweep(
        sweep_jobs.make_sweep(name, combos=4, seeds=4),
        Path(results),
        jobs=int(jobs),
        job=getattr(sweep_jobs, job),
        grace_s=float(grace_s),
    )
    print(json.dumps(asdict(summary)), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
