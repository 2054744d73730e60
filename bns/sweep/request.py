"""How a sweep is to be carried out, as the command line says it, and where that would be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from bns.sweep.budget import Budget
from bns.sweep.expand.shard import Shard
from bns.sweep.runner import Summary, silent


@dataclass(frozen=True)
class Request:
    """``jobs`` is the number of worker processes a machine; None uses every core that this process may use.

    ``scheduler`` is the address of a Dask scheduler (None: one of this machine's own). The rest is for SLURM:
    ``shards`` jobs of an array with ``time_limit_s`` each, further ``options`` of ``sbatch`` by name; ``cluster`` is
    "slurm", or "local" to try the same on this machine. With ``wait`` the command stays until all are done.
    """

    results: Path
    jobs: int | None = None
    budget: Budget = field(default_factory=Budget)
    retry_failed: bool = False
    shard: Shard | None = None
    on_progress: Callable[[Summary], None] = silent
    scheduler: str | None = None
    shards: int | None = None
    time_limit_s: float = 4 * 3600.0
    options: tuple[tuple[str, str], ...] = ()
    cluster: str = "slurm"
    wait: bool = False


@dataclass(frozen=True)
class Placement:
    """``workers`` runs at once, and in words where they would be."""

    workers: int
    where: str
