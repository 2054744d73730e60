"""What sweeps would cost on a laptop, a server and a cluster, from what runs take on this machine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from bns.sweep.forecast.plan import Plan, wall_s


@dataclass(frozen=True)
class Machine:
    """``nodes`` computers of ``cores`` each, every core as fast as one of this machine's."""

    name: str
    nodes: int
    cores: int

    @property
    def workers(self) -> int:
        """Runs at once."""
        return self.nodes * self.cores


MACHINES = (Machine("laptop", 1, 8), Machine("server", 1, 64), Machine("cluster", 20, 64))
"""Typical ones; a machine's own time is core-hours divided by its cores as long as there are more runs than cores."""


@dataclass(frozen=True)
class Cost:
    """Runs to do, core-hours and bytes of one sweep or several; ``mean_s`` is the time of a mean run."""

    sweep: str
    runs: int
    core_hours: float
    disk_bytes: float
    mean_s: float

    @classmethod
    def of(cls, plan: Plan) -> Cost:
        """From a plan for one worker."""
        seconds = plan.seconds_estimate
        return cls(plan.sweep, plan.remaining, seconds / 3600, plan.bytes_estimate, seconds / max(1, plan.remaining))

    def seconds_on(self, machine: Machine) -> float:
        """Wall time on ``machine``: rounds of runs, as many at once as it has cores."""
        return wall_s(self.runs * self.mean_s, self.runs, machine.workers)


def total(costs: Sequence[Cost]) -> Cost:
    """All of them together."""
    runs, hours = sum(cost.runs for cost in costs), math.fsum(cost.core_hours for cost in costs)
    disk = math.fsum(cost.disk_bytes for cost in costs)
    return Cost("all", runs, hours, disk, 3600 * hours / max(1, runs))


def cost_table(costs: Sequence[Cost], machines: Sequence[Machine] = MACHINES) -> str:
    """One line a sweep, one more for all of several; times as h:mm."""
    lines = [("sweep", "runs", "core-hours", "disk MiB", *(_heading(machine) for machine in machines))]
    for cost in [*costs, total(costs)] if len(costs) > 1 else costs:
        times = [_clock(cost.seconds_on(machine)) for machine in machines]
        lines.append((cost.sweep, str(cost.runs), _hours(cost.core_hours), f"{cost.disk_bytes / 2**20:.0f}", *times))
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(line, widths, strict=True))
        )
        for line in lines
    )


def _heading(machine: Machine) -> str:
    return f"{machine.name} ({f'{machine.nodes} × ' if machine.nodes > 1 else ''}{machine.cores} cores) h:mm"


def _hours(hours: float) -> str:
    return "unknown" if math.isnan(hours) else f"{hours:.2f}" if hours < 10 else f"{hours:.0f}"


def _clock(seconds: float) -> str:
    if math.isnan(seconds):
        return "unknown"
    minutes = math.ceil(seconds / 60)
    return f"{minutes // 60}:{minutes % 60:02d}"
