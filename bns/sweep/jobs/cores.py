"""How many runs this machine can do at once."""

from __future__ import annotations

from joblib import cpu_count


def cores(jobs: int | None = None) -> int:
    """``jobs``, or every core that this process may use: affinity, container quota and batch system are heeded."""
    return jobs or int(cpu_count())
